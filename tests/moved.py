"""Finite differences of whole runs with respect to constants, for comparison with the tangent flow.

Helpers only; assertions are in the tests that use them.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from tests.constant_maps import constant_map
from tests.tangents import SHARP, arrive, richardson

import printhammer as ph
from printhammer.derivatives.dots import RUN_QUANTITIES, dot_values
from printhammer.derivatives.parameters import parameters
from printhammer.run.problem import Problem

Drive = ph.PulseTrain | ph.SineForce
WANTED = 1e-6
"""Largest difference between derivatives and differences of runs, relative."""
MINUTE = 1e-14
"""Tolerance of runs of which quantities are differenced."""


def moved(hammer: ph.Hammer, drive: Any, name: str, value: float) -> tuple[ph.Hammer, Any]:
    """Return hammer and drive with one constant changed to `value`, SI."""
    section, _, last = name.rpartition(".")
    waveform = drive.waveform
    if section == "waveform" and last in type(waveform).model_fields:
        other = type(waveform)(**{**waveform.model_dump(), last: value})
        if isinstance(drive, ph.SineForce):
            return hammer, ph.SineForce(other.amplitude, other.frequency, other.phase)
        return hammer, drive.with_waveform(other)
    if section == "waveform":
        return hammer, drive.scaled(value / waveform.peak)
    if section == "firing":
        times = drive.times.copy()
        times[int(last)] = value
        return hammer, drive.with_times(times)
    if name in ("period", "rate"):
        period = value if name == "period" else 1.0 / value
        if isinstance(drive, ph.SineForce):
            return hammer, ph.SineForce(waveform.amplitude, 1.0 / period, waveform.phase)
        count, first = len(drive.times), float(drive.times[0])
        train = ph.PulseTrain(waveform, period=period, pulses=count, overlap=drive.overlap, start=first)
        return hammer, train
    return hammer.replace(name, value), drive


def far_off(
    hammer: ph.Hammer, drive: Any, names: Iterable[str], end: float, state: tuple[float, float]
) -> list[str]:
    """Return the constants whose flow deviates from all differences of runs by more than `WANTED`."""
    found = constant_map(hammer, drive, 0.0, end, list(names), state=state, tolerance=SHARP)
    assert found.ok
    assert found.smooth
    return [
        name
        for name, column in zip(found.constants, found.matrix.T, strict=True)
        if not any(
            _deviation(hammer, drive, name, column, end, state, *how) < WANTED
            for how in ((1e-5, 2), (1e-4, 3), (1e-6, 3))
        )
    ]


def _deviation(
    hammer: ph.Hammer,
    drive: Any,
    name: str,
    flow: np.ndarray,
    end: float,
    state: tuple[float, float],
    size: float,
    levels: int,
) -> float:
    """Relative difference between the flow of a constant and differences of runs."""
    (parameter,) = parameters(hammer, drive, [name])
    scales = Problem(hammer, drive, state, 0.0, SHARP).scales
    units = np.array([scales[0], scales[1], scales[0]])

    def difference(step: float) -> np.ndarray:
        ends = []
        for sign in (1.0, -1.0):
            other = moved(hammer, drive, name, parameter.value + sign * step * parameter.scale)
            ends.append(arrive(Problem(*other, state, 0.0, SHARP), (*state, 0.0), -1, 0.0, end))
        return (ends[0] - ends[1]) / (2.0 * step)

    rows = len(flow)
    truth = richardson(difference, size, levels, units)[:rows] / units[:rows]
    mine = flow * parameter.scale / units[:rows]
    return float(np.linalg.norm(mine - truth)) / max(float(np.linalg.norm(truth)), 1e-3)


def quantities(hammer: ph.Hammer, drive: Any, duration: float, state: Any = None) -> np.ndarray:
    """Return all quantities of the dots and of the run, SI, in one row."""
    motion = ph.simulate(hammer, drive, duration=duration, state=state, tolerance=MINUTE, points=2)
    assert motion.ok
    energies = [name for name in RUN_QUANTITIES if name != "damping_loss" or hammer.damping is not None]
    run = [getattr(motion.energy, name) for name in energies]
    return np.concatenate([dot_values(motion).ravel(), run])


def quantity_differences(
    hammer: ph.Hammer,
    drive: Any,
    name: str,
    duration: float,
    state: Any = None,
    size: float = 4e-5,
    levels: int = 3,
    typical: np.ndarray | None = None,
) -> np.ndarray:
    """Changes of all quantities with ``value / scale`` of a constant, by Richardson extrapolation."""
    (parameter,) = parameters(hammer, drive, [name])
    typical = np.abs(quantities(hammer, drive, duration, state) if typical is None else typical)
    units = np.where(np.isfinite(typical) & (typical > 0.0), typical, 1.0)

    def difference(step: float) -> np.ndarray:
        ends = [
            quantities(
                *moved(hammer, drive, name, parameter.value + sign * step * parameter.scale), duration, state
            )
            for sign in (1.0, -1.0)
        ]
        return np.nan_to_num((ends[0] - ends[1]) / (2.0 * step))

    return np.asarray(richardson(difference, size, levels, units))
