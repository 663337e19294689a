"""Ensembles in lanes against the reference, for random hammers around the crude hammer."""

import dataclasses
import functools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from tests.hammers import DRAWS, TRUTH, Draw
from tests.oracle.integrator import ReferenceRun, reference

import printhammer as ph
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble, EnsembleResult
from printhammer.run.problem import TOLERANCE

BOUND = 1e-8
"""Largest error at the default tolerance, of the stroke."""
POINTS = 401


@dataclasses.dataclass(frozen=True)
class Truth:
    """Members, and the reference run of each member up to its horizon.

    Attributes
    ----------
    hammers, drives, ends
        The members.
    runs
        The reference for each, at `times`.
    counts
        Number of the times before the horizon.
    """

    hammers: list[ph.Hammer]
    drives: list[Any]
    ends: list[float]
    times: list[npt.NDArray[np.float64]]
    runs: list[ReferenceRun]
    counts: list[int]

    def run(self, tolerance: float, engine: Any = "lanes") -> EnsembleResult:
        ensemble = Ensemble(self.hammers, self.drives, self.ends, tolerance=tolerance)
        return ensemble.run(dots=True, strobes=self.times, engine=engine)

    def errors(self, result: EnsembleResult) -> npt.NDArray[np.float64]:
        """Largest displacement error of each member before its horizon, as a fraction of the stroke."""
        assert result.strobes is not None
        found = []
        for i, (run, count, hammer) in enumerate(zip(self.runs, self.counts, self.hammers, strict=True)):
            assert hammer.front is not None
            assert hammer.position is not None
            stroke = hammer.front - hammer.position
            found.append(np.abs(result.strobes.x[i, :count] - run.x[:count]).max() / stroke)
        return np.array(found)

    def touches(self, i: int) -> list[tuple[int, float]]:
        """Return the latest firing and the time of each pack touch of a member before its horizon."""
        end = self.times[i][self.counts[i] - 1] * (1.0 - 1e-6)
        touched = [e.time for e in self.runs[i].events if e.kind == "pack-touch" and e.time < end]
        fired = np.searchsorted(self.drives[i].times, touched, side="right") - 1
        return list(zip(fired.tolist(), touched, strict=True))


def truth_of(seed: int, size: int, pulses: int) -> Truth:
    rng = np.random.default_rng([1985, seed, pulses])
    draw = Draw(rng)
    members = [draw() for _ in range(size)]
    periods = rng.uniform(0.7e-3, 1.6e-3, size)
    drives = [
        ph.PulseTrain(h.waveform, at=np.arange(pulses) * p) for h, p in zip(members, periods, strict=True)
    ]
    ends = [4e-3 if pulses == 1 else float((pulses - 1) * p + 2e-3) for p in periods]
    times = [np.linspace(0.0, end, POINTS) for end in ends]
    runs, counts = [], []
    for hammer, drive, end, grid in zip(members, drives, ends, times, strict=True):
        runs.append(reference(hammer, drive, end, times=grid, tolerance=TRUTH))
        assert runs[-1].status == "ok"
        assert hammer.front is not None
        assert hammer.position is not None
        coarse = reference(hammer, drive, end, times=grid, tolerance=1e-12)
        apart = np.abs(coarse.x - runs[-1].x) > 1e-10 * (hammer.front - hammer.position)
        counts.append(int(np.argmax(apart)) if apart.any() else POINTS)
    return Truth(members, drives, ends, times, runs, counts)


@functools.cache
def small(pulses: int) -> Truth:
    return truth_of(0, 30, pulses)


def check(truth: Truth, tolerance: float) -> npt.NDArray[np.float64]:
    result = truth.run(tolerance)
    assert result.ok.all()
    errors = truth.errors(result)
    proportion = tolerance / TOLERANCE
    told = f"median {np.median(errors):.1e}, largest {errors.max():.1e} of the stroke"
    assert errors.max() < BOUND * proportion, told
    assert np.median(errors) < 0.3 * BOUND * proportion, told
    print(f"{len(errors)} members, tolerance {tolerance:g}: {told}")
    return errors


@pytest.mark.parametrize("tolerance", [TOLERANCE, 1e-9, 1e-10, 1e-12])
@pytest.mark.parametrize("pulses", [1, 3])
def test_lanes_before_the_horizon(pulses: int, tolerance: float) -> None:
    check(small(pulses), tolerance)


def test_the_horizons_are_far() -> None:
    assert np.mean(np.array(small(1).counts) == POINTS) > 0.9
    assert np.median(small(3).counts) > 0.5 * POINTS


@pytest.mark.parametrize("engine", ["lanes", "plain"])
@pytest.mark.parametrize("pulses", [1, 3])
def test_dots_before_the_horizon(pulses: int, engine: Any) -> None:
    truth = small(pulses)
    dots = truth.run(TOLERANCE, engine).dots
    assert dots is not None
    for i, drive in enumerate(truth.drives):
        horizon = truth.times[i][truth.counts[i] - 1]
        touches = truth.touches(i)
        # Firings whose whole interval lies before the horizon.
        until = np.append(drive.times[1:], np.inf)
        for firing in np.flatnonzero(np.minimum(until, truth.ends[i]) <= horizon):
            mine = [t for f, t in touches if f == firing]
            assert dots.struck[i, firing] == bool(mine)
            assert dots.extra_contacts[i, firing] == max(len(mine) - 1, 0)
            if mine:
                touch = dots.fired_at[i, firing] + dots.flight_time[i, firing]
                assert touch == pytest.approx(mine[0], abs=1e-10)


def test_peak_forces_are_those_of_the_reference() -> None:
    """Equation (5) at the largest indentation of the reference."""
    truth = small(1)
    dots = truth.run(TOLERANCE).dots
    assert dots is not None
    for i, (hammer, run) in enumerate(zip(truth.hammers, truth.runs, strict=True)):
        assert hammer.pack is not None
        assert hammer.front is not None
        peaks = [e.x for e in run.events if e.kind == "pack-peak"]
        if not peaks or truth.counts[i] < POINTS:
            continue
        depth = peaks[0] - hammer.front
        force = hammer.constants["pack.stiffness"].si * (depth / hammer.constants["pack.thickness"].si) ** 2.7
        assert dots.indentation[i, 0] == pytest.approx(depth, rel=1e-8)
        assert dots.peak_force[i, 0] == pytest.approx(force, rel=3e-8)


@pytest.mark.slow
@pytest.mark.parametrize("pulses", [1, 3, 6])
@pytest.mark.parametrize("seed", range(100, 100 + DRAWS))
def test_many_members(seed: int, pulses: int) -> None:
    check(truth_of(seed, 25, pulses), TOLERANCE)


@pytest.mark.slow
def test_display_tolerance() -> None:
    """Pictures are accurate to 1e-4 of the stroke."""
    truth = truth_of(7, 25, 1)
    assert truth.errors(truth.run(DISPLAY_TOLERANCE)).max() < 1e-4
