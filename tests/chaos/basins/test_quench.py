import math
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.chaos.basins.quench import QuenchMap, TwoPulseDrive, two_pulse_drives
from printhammer.drive.segments import table
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.drivers import Rail
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Trapezoid

TIGHT = 1e-11
US = 1e-6


@pytest.fixture(scope="module")
def found(hammer: "ph.Hammer") -> QuenchMap:
    """Quench map around the two cases of Fig. 6; the width of the first pulse is among the widths."""
    width = hammer.waveform.width
    return ph.quench_map(
        hammer, gaps=(640e-6, 720e-6, 5), widths=(0.8 * width, 1.2 * width, 3), tolerance=TIGHT
    )


def test_cells_of_equal_pulses_are_single_runs(hammer: "ph.Hammer", found: QuenchMap) -> None:
    assert found.widths[1] == pytest.approx(hammer.waveform.width, rel=1e-12)
    for row, gap in enumerate(found.gaps.tolist()):
        drive = ph.PulseTrain(hammer.waveform, at=[0.0, gap])
        motion = ph.simulate(hammer, drive, duration=gap + found.tail, tolerance=TIGHT)
        dot, peak = motion.dots[1], motion.peak_after(1)
        assert found.struck[row, 1] == dot.struck
        if dot.struck:
            assert found.force[row, 1] == pytest.approx(dot.peak_force, rel=1e-6)
            assert found.flight_time[row, 1] == pytest.approx(dot.flight_time, rel=1e-7)
        # Without a dot, the peak is interpolated from samples.
        way = hammer.front - hammer.position
        assert found.peak[row, 1] == pytest.approx(peak[1], abs=1e-5 * way)
    assert found.lost[:, 1].any()
    assert found.struck[:, 1].any()


def test_the_peak_of_a_lost_dot_is_that_of_the_motion_at_the_tolerance_of_a_display() -> None:
    hammer = ph.load("hendriks-1983-1")
    assert hammer.waveform is not None
    pulse = hammer.waveform
    found = ph.quench_map(hammer, gaps=(0.97e-3, 0.99e-3, 3), widths=(60e-6, 100e-6, 3))
    way = hammer.front - hammer.origin
    for row, gap in enumerate(found.gaps.tolist()):
        for column, width in enumerate(found.widths.tolist()):
            if found.struck[row, column]:
                continue
            second = type(pulse)(**{**dict(pulse), "width": width})
            motion = ph.simulate(
                hammer, PulseSequence([pulse, second], [0.0, gap]), duration=gap + found.tail, tolerance=TIGHT
            )
            t = np.linspace(gap, gap + found.tail, 100_001)
            x, v = motion.at(t)
            tops = x[1:][(v[:-1] > 0.0) & (v[1:] <= 0.0)]
            # Of samples every 10 ns one is no more than 1e-11 m below a turn.
            assert found.peak[row, column] == pytest.approx(tops.max(), abs=1e-5 * way)
    assert found.lost.any()


class Both(Rectangle):
    """Two rectangles in one waveform, the second beginning after the end of the first."""

    shape: ClassVar[str] = "both"
    later: float
    second_width: float

    def segments(self) -> np.ndarray:
        common = {"amplitude": self.amplitude, "rise": self.rise, "decay": self.decay}
        first = Rectangle(width=self.width, **common).segments()
        second = Rectangle(width=self.second_width, **common).segments()
        rows = [*first.tolist(), *([self.later + row[0], *row[1:]] for row in second.tolist())]
        return table(rows[:-1], rows[-1][0])


def test_cells_of_different_pulses_are_single_runs(hammer: "ph.Hammer") -> None:
    # So far apart that one waveform can hold both pulses.
    pulse = hammer.waveform
    gap, width = pulse.support + 50e-6, 280e-6
    found = ph.quench_map(hammer, gaps=(gap, gap + 40e-6, 2), widths=(width, 400e-6, 2), tolerance=TIGHT)
    for row, later in enumerate(found.gaps.tolist()):
        for column, wide in enumerate(found.widths.tolist()):
            both = Both(**dict(pulse), later=later, second_width=wide)
            motion = ph.simulate(
                hammer, ph.PulseTrain(both, at=[0.0]), duration=later + found.tail, tolerance=TIGHT
            )
            dots = [c for c in motion.contacts if c.surface == "pack" and c.t_in > later]
            assert found.struck[row, column] == bool(dots)
            if dots:
                assert found.flight_time[row, column] == pytest.approx(dots[0].t_in - later, rel=1e-7)
                assert found.force[row, column] == pytest.approx(dots[0].peak_force, rel=1e-6)


@given(
    shape=st.sampled_from([HalfSine, Rectangle, Trapezoid]),
    first=st.floats(1e-4, 6e-4),
    second=st.floats(1e-4, 6e-4),
    gap=st.floats(1e-4, 2e-3),
    at=st.floats(0.0, 1.0),
)
def test_the_drive_fires_two_different_pulses(
    shape: type, first: float, second: float, gap: float, at: float
) -> None:
    more = {"rise": 2e-5, "decay": 3e-5} if shape is Rectangle else {"rise": 2e-5, "fall": 3e-5}
    more = {} if shape is HalfSine else more
    pulses = [shape(amplitude=0.9, width=width, **more) for width in (first, second)]
    last = gap + 1e-3
    (drive,) = two_pulse_drives(pulses[0], pulses[1:], last)
    drive = drive.with_firings(TwoPulseDrive.firings(0.5 * drive.begin, gap))
    t = at * last
    expected = pulses[0].value(t) + pulses[1].value(t - gap)
    # Times count from later on in the drive, and are rounded there.
    near = [drive.value(drive.begin + t + shift) for shift in (-1e-14, 0.0, 1e-14)]
    assert min(abs(float(value - expected)) for value in near) < 1e-8
    assert drive.times[-1] - drive.times[-2] == pytest.approx(gap, abs=1e-15)


def test_the_result_does_not_depend_on_threads_or_company(hammer: "ph.Hammer") -> None:
    options = {"gaps": (600e-6, 700e-6, 7), "widths": (300e-6, 400e-6, 5)}
    one, two = (ph.quench_map(hammer, threads=threads, **options) for threads in (1, 2))
    for name in ("struck", "force", "flight_time", "peak"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    ends = ph.quench_map(hammer, gaps=(600e-6, 700e-6, 2), widths=(300e-6, 400e-6, 2))
    np.testing.assert_array_equal(ends.force, one.force[::6, ::4])
    np.testing.assert_array_equal(ends.struck, one.struck[::6, ::4])


def test_quantities_follow_from_the_single_pulse(hammer: "ph.Hammer", found: QuenchMap) -> None:
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=3e-3, tolerance=TIGHT)
    assert found.single_force == pytest.approx(motion.dots[0].peak_force, rel=1e-9)
    np.testing.assert_allclose(found.force_ratio, found.force / motion.dots[0].peak_force)
    np.testing.assert_allclose(found.flight_gain, motion.dots[0].flight_time - found.flight_time)
    way = hammer.front - hammer.position
    np.testing.assert_allclose(found.peak_share, (found.peak - hammer.position) / way)
    assert (found.peak_share[found.struck] > 1.0).all()
    assert (found.peak_share[found.lost] < 1.0).all()
    assert np.isnan(found.force[found.lost]).all()


def test_a_run_that_stops_is_neither_printed_nor_lost(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "285 um")
    found = ph.quench_map(short, gaps=(660e-6, 700e-6, 2), widths=(350e-6, 360e-6, 2))
    assert (found.status == "range left").any()
    stopped = found.status != "ok"
    assert not found.lost[stopped].any()
    assert np.isnan(found.peak[stopped]).all()


def test_other_pulses_have_widths_too(hammer: "ph.Hammer") -> None:
    sine = HalfSine(amplitude=1.5, width=400 * US)
    found = ph.quench_map(hammer, waveform=sine, gaps=(600e-6, 700e-6, 2), widths=(300e-6, 400e-6, 2))
    motion = ph.simulate(
        hammer, ph.PulseTrain(sine, at=[0.0, 700e-6]), duration=1.7e-3, tolerance=found.tolerance
    )
    assert found.struck[1, 1] == motion.dots[1].struck


def test_progress_comes_to_its_end(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    ph.quench_map(
        hammer,
        gaps=(600e-6, 700e-6, 3),
        widths=(300e-6, 400e-6, 3),
        progress=lambda done, total: told.append((done, total)),
    )
    assert told[-1] == (9, 9)


def test_a_dataset_and_files_hold_everything(found: QuenchMap, tmp_path: Path) -> None:
    chart = found.to_dataset()
    assert chart["force"].dims == ("gap", "width")
    assert chart["flight_gain"].attrs["units"] == "s"
    found.save(tmp_path / "quench.nc")
    with xr.open_dataset(tmp_path / "quench.nc", engine="scipy") as kept:
        np.testing.assert_array_equal(kept["peak"], found.peak)
        np.testing.assert_array_equal(kept["struck"], found.struck)
    found.save(tmp_path / "quench.csv")
    rows = pd.read_csv(tmp_path / "quench.csv", comment="#")
    assert len(rows) == found.struck.size
    assert rows["struck"].tolist() == found.struck.reshape(-1).tolist()
    assert "flight_time [s]" in found.to_dataframe()
    with refused(None, file="quench.txt"):
        found.save(tmp_path / "quench.txt")


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"gaps": (0.0, 1e-3, 4)}, "gaps"),
        ({"gaps": (2e-3, 1e-3, 4)}, "gaps"),
        ({"gaps": (1e-4, 1e-3, 1)}, "gaps"),
        ({"gaps": 1e-3}, "gaps"),
        ({"widths": (1e-4, "1 kg", 4)}, "widths"),
        ({"tail": -1.0}, "tail"),
        ({"tolerance": 1.0}, "tolerance"),
        ({"gaps": (1e-4, 1e-3, 10_000), "widths": (1e-4, 1e-3, 10_000)}, "cells"),
    ],
)
def test_what_makes_no_sense_is_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        ph.quench_map(hammer, **options)


def test_a_hammer_that_cannot_be_mapped_is_refused(hammer: "ph.Hammer") -> None:
    for bare, key in (
        (hammer.replace("waveform", None), "waveform"),
        (hammer.replace("pack", None), "pack"),
    ):
        with refused(key):
            ph.quench_map(bare)
    assert math.isfinite(ph.quench_map(hammer, gaps=(6e-4, 7e-4, 2), widths=(3e-4, 4e-4, 2)).single_force)


def test_a_driver_s_second_pulse_comes_after_its_own_gap() -> None:
    """The latest firing of a driver replaces all earlier firings; each cell is a run of its two pulses."""
    hammer = ph.load("hendriks-1983").replace("coil", {"resistance": "28.6 ohm", "inductance": "6.5 mH"})
    rail = Rail(voltage=100.0, width=177e-6, decay="diode", decay_resistance=159.0)
    gaps, widths = (0.6e-3, 0.8e-3, 2), (120e-6, 180e-6, 2)
    found = ph.quench_map(hammer, gaps=gaps, widths=widths, waveform=rail, tolerance=1e-9, threads=1)
    for row, gap in enumerate(gaps[:2]):
        for column, width in enumerate(widths[:2]):
            pair = (rail, rail.model_copy(update={"width": width}))
            drive = ph.PulseSequence(pair, [0.0, gap])
            dot = ph.simulate(hammer, drive, duration=gap + found.tail, tolerance=1e-9).dots[1]
            assert found.struck[row, column] == dot.struck
            if dot.struck:
                assert found.force[row, column] == pytest.approx(dot.peak_force, rel=1e-6)
    assert np.ptp(np.nan_to_num(found.force), axis=0).min() > 1.0
