"""Soft landing after a dot, and the launch from rest.

Landing: the bucking current slows the armature on its return, as in the quenched response of Fig. 6 of
F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), so that it meets the backstop with
little speed and stays there, held by the magnet.

Launch: a push from rest that is released before impact, so that the armature flies freely.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.control.feedback.impact_map import AHEAD, FREE, PUSHED, ForceMap
from printhammer.control.feedback.plant import Plant
from printhammer.drive.sequence import PulseSequence
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.support.arrays import FloatArray, IntArray

# Start times and widths of the brake pulses in the first grid, in single-pulse flight times; arbitrary
_STARTS: Final = np.linspace(0.85, 1.75, 28)
_WIDTHS: Final = np.linspace(0.1, 0.75, 20)
# Half-widths of the finer grids around the best pulse, in single-pulse flight times: a grid spans one step of
# the preceding grid to either side; arbitrary
_NEAR: Final = np.linspace(-1.0, 1.0, 7)
_FINER: Final = (0.034, 0.01, 0.003)
# Distances from rest are divided by this time, in single-pulse flight times, to give an equivalent speed;
# arbitrary
_FALL: Final = 1.0 / 3.0
# Times after the touch at which the residual motion is evaluated, in single-pulse flight times; arbitrary
_WATCHED: Final = np.linspace(2.2, 3.4, 16)
_SETTLED: Final = 0.65
"""Time from the end of the brake pulse until the armature counts as at rest, in flight times; arbitrary."""


@dataclass(frozen=True)
class Landing:
    """Best brake pulse for each of the T touches of a force map; NaN if the print force is not reached."""

    release: FloatArray  # Time after the touch at which the push ends, s, (T,)
    force: FloatArray  # Force relative to the single pulse, (T,)
    # Start of the brake pulse after the touch, and width of the brake pulse, s, (T,)
    brake: FloatArray
    width: FloatArray
    # Residual speed, m/s; a distance from rest counts as the speed that covers it in a third of the
    # single-pulse flight time, (T,)
    left: FloatArray
    settled: float  # Time from the touch until the armature counts as at rest, s


def soft_landing(plant: Plant, forces: ForceMap) -> Landing:
    """Find the brake pulse after each touch that leaves the least residual motion, by refined grid search."""
    scale = plant.single.flight_time
    release = forces.release_for(1.0)[:, forces.off]
    force = np.full(len(release), np.nan)
    rows = np.flatnonzero(~np.isnan(release))
    for row in rows.tolist():
        force[row] = np.interp(release[row], forces.release, forces.force[row, forces.off])
    grid = np.stack([axis.ravel() for axis in np.meshgrid(_STARTS, _WIDTHS, indexing="ij")], axis=1)
    near = np.stack([axis.ravel() for axis in np.meshgrid(_NEAR, _NEAR, indexing="ij")], axis=1)
    tried = np.broadcast_to(grid, (len(rows), *grid.shape))
    best = np.full((len(release), 2), np.nan)
    left = np.full(len(release), np.nan)
    for finer in (*_FINER, None):
        remains = _residual_speeds(plant, forces, release, rows, np.maximum(tried * scale, AHEAD))
        way = np.argmin(remains, axis=1)
        best[rows] = tried[np.arange(len(rows)), way]
        left[rows] = remains[np.arange(len(rows)), way]
        if finer is not None:
            tried = best[rows][:, np.newaxis, :] + finer * near
    left[np.isinf(left)] = np.nan
    braked = float(np.nanmedian(best.sum(axis=1))) if len(rows) else float(_STARTS[-1])
    return Landing(release, force, best[:, 0] * scale, best[:, 1] * scale, left, (braked + _SETTLED) * scale)


def _residual_speeds(
    plant: Plant, forces: ForceMap, release: FloatArray, rows: IntArray, tried: FloatArray
) -> FloatArray:
    """Simulate trial brake pulses after touches; return the residual speeds of the armature, m/s.

    `rows` are the indices of the touches in `forces`; `release` is the end of the push after every touch [s];
    `tried` contains the start and width [s] of the trial pulses, shape (touches, pulses, 2). The speed is
    infinite if the simulation fails or the armature touches the pack again.
    """
    driver, scale = plant.driver, plant.single.flight_time
    drives, states = [], []
    for row, pulses in zip(rows.tolist(), tried, strict=True):
        initial = driver.current if forces.kind[row] == PUSHED else 0.0
        levels = (initial, driver.current if release[row] > 0.0 else 0.0, 0.0, driver.current, 0.0)
        released = AHEAD + max(float(release[row]), AHEAD)
        for begin, width in pulses.tolist():
            brake = max(AHEAD + begin, released + AHEAD)
            at = (0.0, AHEAD, released, brake, brake + width)
            drives.append(driver.drive([driver.switched(at, levels, initial)]))
            states.append(forces.state(row))
    watched = AHEAD + _WATCHED * scale
    ok, dots, strobes = plant.run(drives, float(watched[-1]), states, [watched] * len(drives))
    # An armature that hovers between backstop and pack is slow, but not at rest.
    away = np.abs(strobes.x - rest_state(plant.hammer)) / (_FALL * scale)
    remaining = np.maximum(np.abs(strobes.v), away).max(axis=1)
    return np.where(ok & (dots.extra_contacts[:, 0] == 0), remaining, np.inf).reshape(tried.shape[:2])


# Candidate widths of the launch, in single-pulse flight times; arbitrary
_WIDTHS_LAUNCH: Final = np.linspace(0.2, 1.0, 81)
_LENGTH: Final = 4.0  # Length of launch simulations, in single-pulse flight times; arbitrary
_ALMOST: Final = 0.9  # Force of the touch without a push, relative to the single pulse; arbitrary
_WEAKER: Final = 0.03  # Change of the current scale for the finite difference; arbitrary


@dataclass(frozen=True)
class Launch:
    """Launch from rest: width of the push, time and speed of the touch, and sensitivities to the current."""

    width: float  # Width of the push, s
    flight: float  # Time from firing to touch, s
    speed: float  # Speed at the touch, m/s
    # Derivatives of displacement, m, and speed, m/s, at the time of the touch with respect to the
    # relative current scale
    place_slope: float
    speed_slope: float


def launch(plant: Plant, forces: ForceMap) -> Launch:
    """Compute the launch from rest whose touch, without a push, has 0.9 times the single-pulse force.

    A short push into the pack adds the missing force; its length is chosen once the impact speed is known.
    """
    driver, scale = plant.driver, plant.single.flight_time
    widths = _WIDTHS_LAUNCH * scale
    pushes = [PulseSequence([driver.push(width)], at=[0.0]) for width in widths.tolist()]
    ok, dots, _ = plant.run(pushes, _LENGTH * scale)
    free = forces.kind == FREE
    wanted = float(np.interp(_ALMOST, forces.force[free, forces.off, 0], forces.speed[free]))
    speed, flight = dots.impact_speed[:, 0], dots.flight_time[:, 0]
    struck = ok & dots.struck[:, 0]
    if not struck.any() or not speed[struck].min() <= wanted <= speed[struck].max():
        raise InputError(
            (
                f"{plant.hammer.path}: no push of {driver.current:g} A from rest touches the pack at"
                f" {wanted:.3g}"
                " m/s"
            ),
            file=plant.hammer.path,
            key="current",
            expected="a stronger driver",
        )
    order = np.argsort(speed[struck])
    width, time = (
        float(np.interp(wanted, speed[struck][order], values[struck][order])) for values in (widths, flight)
    )
    # Sensitivity to the current scale by a backward difference: with less current the armature is still in
    # flight at the nominal touch time.
    pulse, before = driver.push(width), time - AHEAD
    drives = [PulseSequence([pulse.scaled(factor)], at=[0.0]) for factor in (1.0, 1.0 - _WEAKER)]
    _, _, states = plant.run(drives, before, strobes=[np.array([before])] * 2)
    place, faster = ((values[0, 0] - values[1, 0]) / _WEAKER for values in (states.x, states.v))
    return Launch(width, time, wanted, float(place), float(faster))
