"""Members share objects: equal drives are one object, for any hammer."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import printhammer as ph
from printhammer.drive.file import read_drive
from printhammer.sweep.members import Maker
from printhammer.sweep.spec import read_spec

SPEC: dict[str, Any] = {
    "format": 1,
    "title": "members",
    "hammer": "hendriks-1983",
    "drive": {"overlap": "replace", "train": {"pulses": 3, "start": "1 ms"}},
    "outputs": {"scalars": ["lost_dots"]},
}
RATE = {"key": "drive.rate", "values": ["600 Hz", "1.2 kHz"]}


def drives(*axes: dict[str, Any]) -> list[ph.PulseTrain]:
    spec = read_spec({**SPEC, "axis": list(axes)})
    maker = Maker(spec.base)
    first, second = (axis.values for axis in spec.axes)
    made: list[Any] = [maker.member((a, b)).drive for a in first for b in second]
    return made


def test_hammers_with_the_same_pulse_share_drives() -> None:
    slow, fast, slow_too, fast_too = drives({"key": "pack.stiffness", "values": ["50 lbf", "60 lbf"]}, RATE)
    assert slow is slow_too
    assert fast is fast_too
    waveform = ph.load("hendriks-1983").waveform
    assert waveform is not None
    for drive, rate in ((slow, "600 Hz"), (fast, "1.2 kHz")):
        assert drive == ph.PulseTrain(waveform, rate=rate, pulses=3, overlap="replace", start="1 ms")


@pytest.mark.parametrize("own", [{}, {"waveform": {"shape": "half-sine", "amplitude": "1 A"}}])
def test_another_pulse_is_another_drive(own: dict[str, Any]) -> None:
    """The waveform of the hammer, or the waveform of the drive."""
    axis = {"key": "waveform.width", "values": ["300 us", "350 us"]}
    content = {**SPEC, "drive": {**SPEC["drive"], **own}, "axis": [axis, RATE]}
    base = read_spec(content).base
    maker = Maker(base)
    found = [maker.member((width, 600.0)).drive for width in (300e-6, 350e-6)]
    assert found[0] != found[1]
    assert [drive.waveform.width for drive in found] == [300e-6, 350e-6]  # type: ignore[attr-defined]


def test_a_member_is_what_its_drive_file_says() -> None:
    slow = drives({"key": "pack.stiffness", "values": ["50 lbf"]}, RATE)[0]
    assert read_drive(slow.to_toml()) == slow


@pytest.mark.parametrize(
    ("axes", "own", "arrays"),
    [
        ([RATE, {"key": "pack.stiffness", "values": ["50 lbf", "60 lbf"]}], {}, True),
        ([RATE], {"waveform": {"shape": "half-sine", "amplitude": "1 A", "width": "300 us"}}, True),
        ([{"key": "waveform.width", "values": ["300 us", "350 us"]}, RATE], {}, False),
        ([RATE, {"key": "drive.pulses", "values": ["2", "3"]}], {"train": {}}, False),
        ([{"key": "drive.period", "values": ["1 ms", "2 ms"]}], {}, False),
    ],
)
def test_members_together_are_those_one_by_one(axes: list[Any], own: dict[str, Any], arrays: bool) -> None:
    spec = read_spec({**SPEC, "drive": {**SPEC["drive"], **own}, "axis": axes})
    rows = np.array(list(itertools.product(*(axis.values for axis in spec.base.axes))))
    which, members = Maker(spec.base).members(rows)
    maker = Maker(spec.base)
    assert which.tolist() == list(range(len(rows)))
    assert isinstance(members.drives, ph.PulseTrains) == arrays
    for i, row in enumerate(rows):
        alone = maker.member(row)
        assert members.hammers[i] == alone.hammer
        assert members.drives[i] == alone.drive
        assert (members.ends[i], *members.states[i]) == (alone.end, *alone.state)


def test_rates_that_make_no_train_leave_the_others() -> None:
    base = read_spec({**SPEC, "axis": [RATE]}).base
    which, members = Maker(base).members(np.array([[600.0], [1e-320], [1200.0]]))
    assert which.tolist() == [0, 2]
    assert [drive.times[0] for drive in members.drives] == [1e-3, 1e-3]
