"""Dropped files: a hammer or a curve, or one sentence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.hammers import CRUDE

from printhammer.errors import InputError
from printhammer.studio.bounds import MOST_SAMPLES
from printhammer.studio.frames import unframe
from printhammer.studio.states.drops import dropped, read_curve


def test_a_hammer_file_is_told_by_its_name() -> None:
    text = CRUDE.read_text("utf-8")
    heading, _ = unframe(dropped(3, "mine.toml", text))
    assert (heading["what"], heading["text"]) == ("hammer", text)


def test_a_curve_is_converted_to_si() -> None:
    heading, found = unframe(dropped(3, "a.csv", "# by hand\ntime [us],displacement [mil]\n0,2\n10,4\n"))
    assert heading["what"] == "displacement"
    np.testing.assert_allclose(found["t"], [0.0, 1e-5], rtol=1e-7)
    np.testing.assert_allclose(found["values"], [50.8e-6, 101.6e-6], rtol=1e-7)


def test_a_long_curve_is_thinned_and_keeps_its_ends() -> None:
    rows = "\n".join(f"{k},{k % 7}" for k in range(10 * MOST_SAMPLES))
    _, times, values = read_curve(f"time [us],current [A]\n{rows}", "a.csv")
    assert len(times) == len(values) == MOST_SAMPLES
    assert (times[0], times[-1]) == (0.0, pytest.approx((10 * MOST_SAMPLES - 1) * 1e-6))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "the file is empty"),
        ("time,current\n0,1\n1,2", "carry a unit"),
        ("time [us],colour [m]\n0,1\n1,2", "columns 'time', 'colour'"),
        ("time [us],current [A]\n0,1\n0,2", "increasing times"),
        ("time [us],current [A]\n0,1\n1,x", "row 3 is expected to hold 2 finite numbers"),
        ("time [us],current [A]\n0,1\n1,nan", "row 3"),
        ("time [us],current [s]\n0,1\n1,2", "unit 's' is a time"),
        ('time [us],current [A]\n0,"1\n1,2', "comma-separated"),
    ],
)
def test_what_is_no_curve_is_refused_in_one_sentence(text: str, reason: str) -> None:
    with pytest.raises(InputError, match=rf"^a\.csv: .*{reason}"):
        read_curve(text, "a.csv")


@given(st.text(max_size=300), st.sampled_from(["a.csv", "a.toml", "a"]))
def test_random_text_is_refused(text: str, name: str) -> None:
    with pytest.raises(InputError, match="expected"):
        dropped(1, name, text)
