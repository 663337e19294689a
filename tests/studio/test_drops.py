"""Dropped files: a state, a hammer or curves, a question what columns hold, or one sentence."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE

from printhammer.errors import InputError
from printhammer.studio.bounds import MOST_SAMPLES
from printhammer.studio.frames import unframe
from printhammer.studio.messages import read_message
from printhammer.studio.states.drops import dropped
from printhammer.studio.states.records import Record, read_record
from printhammer.studio.states.state import ProtocolError

TIMES = np.array([0.0, 1e-5, 2e-5])
PLACES = np.array([50e-6, 51.5e-6, 52e-6])
CURRENTS = np.array([0.0, 0.5, 1.25])
# The same three samples, as programs write them.
WRITTEN = {
    "ours": "# by hand\ntime [us],displacement [um],current [A]\n0,50,0\n10,51.5,0.5\n20,52,1.25\n",
    "semicolons": "time (us);displacement (um);current (A)\n0;50;0\n10;51,5;0,5\n20;52;1,25\n",
    "tabs": "Time [us]\tPosition [um]\tCurrent [mA]\n0\t50\t0\n10\t51.5\t500\n20\t52\t1250\n",
    "units below": "x-axis,Position,Current\nsecond,mm,A\n0,0.05,0\n1e-5,0.0515,0.5\n2E-5,0.052,1.25\n",
    "lines above": (
        "Model,XYZ\nSample Interval,1e-5\n\n"
        "time [s],displacement [m],current [A]\n0,50e-6,0\n1e-5,51.5e-6,.5\n2e-5,52e-6,1.25\n"
    ),
}


def record_of(text: str, told: Any = None) -> Record:
    found = read_record(text, "a.csv", told)
    assert isinstance(found, Record)
    return found


def test_a_hammer_file_is_told_by_its_name() -> None:
    text = CRUDE.read_text("utf-8")
    heading, _ = unframe(dropped(3, "mine.toml", text))
    assert (heading["what"], heading["text"]) == ("hammer", text)


def test_a_curve_is_converted_to_si() -> None:
    heading, found = unframe(dropped(3, "a.csv", "# by hand\ntime [us],displacement [mil]\n0,2\n10,4\n"))
    assert heading["what"] == "curves"
    np.testing.assert_allclose(found["t"], [0.0, 1e-5], rtol=1e-7)
    np.testing.assert_allclose(found["displacement"], [50.8e-6, 101.6e-6], rtol=1e-7)


@pytest.mark.parametrize("written", WRITTEN.values(), ids=list(WRITTEN))
def test_what_oscilloscopes_write_is_read(written: str) -> None:
    found = record_of(written)
    np.testing.assert_allclose(found.times, TIMES, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(found.curves["displacement"], PLACES, rtol=1e-12)
    np.testing.assert_allclose(found.curves["current"], CURRENTS, rtol=1e-12)


def test_what_columns_hold_is_asked_for_where_the_heading_does_not_say_it() -> None:
    text = "time,displacement,current\n0,50,0\n10,51.5,0.5\n20,52,1.25\n"
    heading, _ = unframe(dropped(3, "a.csv", text))
    assert heading["what"] == "columns"
    assert [column["quantity"] for column in heading["columns"]] == ["time", "displacement", "current"]
    assert heading["columns"][1]["first"] == ["50", "51.5", "52"]
    told = [("time", "us"), ("displacement", "um"), ("current", "1 A")]
    found = record_of(text, told)
    np.testing.assert_allclose(found.curves["displacement"], PLACES)
    np.testing.assert_allclose(found.curves["current"], CURRENTS)
    # A probe of 0.1 V/A, and a column that nobody needs.
    found = record_of(
        "sec,CH1,CH2\n0,0,7\n1e-5,0.05,7\n2e-5,0.125,7\n", [("time", "s"), ("current", "10 A"), ("", "")]
    )
    np.testing.assert_allclose(found.curves["current"], CURRENTS)
    assert set(found.curves) == {"current"}


def test_a_curve_keeps_its_times_before_the_firing() -> None:
    found = record_of("time [ms],current [A]\n-0.5,0\n0,0\n0.5,1\n1,1.2\n")
    np.testing.assert_allclose(found.times, [-0.5e-3, 0.0, 0.5e-3, 1e-3])
    with refused("current"):
        record_of("time [ms],current [A]\n-0.5,0.3\n0,0.5\n0.5,1\n")


def test_a_long_curve_is_thinned_and_keeps_its_ends() -> None:
    rows = "\n".join(f"{k / 10},{k % 7}" for k in range(10 * MOST_SAMPLES))
    found = record_of(f"time [us],current [A]\n{rows}")
    assert len(found.times) == len(found.curves["current"]) == MOST_SAMPLES
    assert (found.times[0], found.times[-1]) == (0.0, pytest.approx((10 * MOST_SAMPLES - 1) * 1e-7))


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "heading"),
        ("time [us],colour [m]\nred,blue", "heading"),
        ("time [us],current [A]\n0,1\n0,2", "time"),
        ("time [us],current [A]\n0,1\n1,x", "current"),
        ("time [us],current [A]\n0,1\n1,nan", "current"),
        ("time [us],current [A]\n0,1\n1", "line 3"),
        ("time [us],current [s]\n0,1\n1,2", "current"),
        ('time [us],current [A]\n0,"1\n1,2', "line 3"),
        ("time [us],current [A],current [A]\n0,1,1\n1,2,2", "current"),
        ("time [s],current [A]\n0,1\n1,2", "current"),
        ("time [us],current [kA]\n0,1\n1,2", "current"),
        (",".join("1" * 17), "columns"),
    ],
)
def test_what_is_no_curve_is_refused_in_one_sentence(text: str, key: str) -> None:
    with refused(key):
        read_record(text, "a.csv")


@pytest.mark.parametrize(
    ("told", "key"),
    [
        ([("time", "us")], "columns"),
        ([("", ""), ("current", "A")], "time"),
        ([("time", "us"), ("", "")], "time"),
        ([("time", "us"), ("current", "")], "b"),
        ([("time", "us"), ("current", "V")], "b"),
    ],
)
def test_an_answer_that_is_none_is_refused(told: list[tuple[str, str]], key: str) -> None:
    with refused(key):
        read_record("a,b\n0,1\n1,2\n", "a.csv", told)


@pytest.mark.parametrize("columns", ["[1]", '[["x", "m"]]', '[["time"]]', "{}", str([["time", "s"]] * 99)])
def test_columns_that_no_page_sends_end_the_connection(columns: str) -> None:
    columns = columns.replace("'", '"')
    with pytest.raises(ProtocolError, match="columns"):
        read_message(f'{{"kind": "drop", "serial": 1, "name": "a", "text": "", "columns": {columns}}}')


@given(st.text(max_size=300), st.sampled_from(["a.csv", "a.toml", "a", "a.json"]))
def test_random_text_is_refused_or_asked_about(text: str, name: str) -> None:
    try:
        heading, _ = unframe(dropped(1, name, text))
    except InputError as error:
        sentence = str(error)
    else:
        sentence = f"expected {heading['what']}"
    assert "expected" in sentence
    assert sentence.removeprefix("expected ") not in ("state", "hammer", "curves")
