"""A switched current: bounded by its levels, and the sum of the responses to its switchings."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.drive.file import read_drive
from printhammer.drive.waveforms.shapes import Switched

EDGES = st.floats(1e-6, 1e-4)
STEPS = st.lists(st.tuples(st.floats(1e-6, 3e-4), st.floats(-2.0, 2.0)), min_size=1, max_size=8)


def switched(steps: list[tuple[float, float]], edge: float) -> Switched:
    at = np.concatenate([[0.0], np.cumsum([wait for wait, _level in steps])])
    return Switched(at=tuple(at.tolist()), levels=(*(level for _wait, level in steps), 0.0), edge=edge)


@given(STEPS, EDGES)
def test_the_current_never_exceeds_its_levels(steps: list[tuple[float, float]], edge: float) -> None:
    waveform = switched(steps, edge)
    largest = max(abs(level) for level in waveform.levels)
    assert waveform.peak <= largest * (1.0 + 1e-12)


@given(STEPS, EDGES)
def test_the_current_is_the_sum_of_what_each_switching_does(
    steps: list[tuple[float, float]], edge: float
) -> None:
    waveform = switched(steps, edge)
    times = np.linspace(0.0, waveform.at[-1] + 3.0 * edge, 97)
    total = np.zeros_like(times)
    for at, level, before in zip(waveform.at, waveform.levels, (0.0, *waveform.levels[:-1]), strict=True):
        total += (level - before) * -np.expm1(-np.maximum(times - at, 0.0) / edge)
    assert np.allclose(waveform.value(times), total, rtol=0.0, atol=1e-11)
    assert np.allclose(waveform.scaled(-0.5).value(times), -0.5 * total, rtol=0.0, atol=1e-11)


def test_a_run_may_begin_within_a_pulse() -> None:
    waveform = Switched(at=(10e-6, 50e-6), levels=(-1.0, 0.0), edge=20e-6, initial=2.0)
    assert waveform.value([0.0])[0] == 2.0
    assert waveform.value([10e-6])[0] == pytest.approx(2.0 * np.exp(-0.5))


@given(STEPS, EDGES, st.floats(-2.0, 2.0))
def test_what_is_written_is_read_back_to_the_last_bit(
    steps: list[tuple[float, float]], edge: float, initial: float
) -> None:
    one = switched(steps, edge)
    drive = ph.PulseSequence([one, one.model_copy(update={"initial": initial + 0.0})], at=[0.0, 1.0])
    again = read_drive(drive.to_toml())
    assert again == drive
    assert again.to_toml() == drive.to_toml()


def test_text_carries_units() -> None:
    given = Switched(at=("10 us", "50 us"), levels=("-1 A", "0 A"), edge="20 us", initial="2 A")
    assert given == Switched(at=(10e-6, 50e-6), levels=(-1.0, 0.0), edge=20e-6, initial=2.0)
    force = Switched(at=("0 ms", "1 ms"), levels=("2 N", "0 N"), edge="20 us")
    assert (force.quantity, force.unit, force.levels) == ("force", "N", (2.0, 0.0))


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"at": (1e-5,)}, "levels"),
        ({"at": (), "levels": ()}, "levels"),
        ({"at": (1e-5, 1e-5)}, "at"),
        ({"at": (-1e-5, 1e-5)}, "at"),
        ({"levels": (0.0, 1.0)}, "levels"),
        ({"edge": 0.0}, "edge"),
        ({"at": ("1 A", "2 A")}, "at"),
        ({"levels": ("1 A", "0 N")}, "levels"),
        ({"levels": (float("nan"), 0.0)}, "levels.0"),
    ],
)
def test_bad_input(change: dict[str, object], key: str) -> None:
    given = {"at": (0.0, 1e-4), "levels": (1.0, 0.0), "edge": 1e-5, **change}
    with refused(key):
        Switched(**given)


FILE = """
format = 1
[times]
at = ["0 s"]
[waveform]
shape = "switched"
at = ["0 us", "100 us"]
levels = ["1.5 A", "0 A"]
edge = "20 us"
"""


def test_a_file_may_hold_one() -> None:
    drive = read_drive(FILE)
    assert drive.waveform == Switched(at=(0.0, 100e-6), levels=(1.5, 0.0), edge=20e-6)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('"1.5 A", "0 A"', '"1.5 A"', "waveform.levels"),
        ('"1.5 A", "0 A"', '"1.5 s", "0 s"', "waveform.levels"),
        ('edge = "20 us"', "edge = 2e-5", "waveform.edge"),
        ('edge = "20 us"', "", "waveform.edge"),
        ('edge = "20 us"', 'edge = "0 us"', "waveform.edge"),
        ('edge = "20 us"', 'edge = "20 us"\nends = 3', "waveform.ends"),
        ('"100 us"', '"0 us"', "waveform.at"),
    ],
)
def test_a_bad_file(old: str, new: str, key: str) -> None:
    with refused(key):
        read_drive(FILE.replace(old, new))
