"""Soft landing after a dot: the push that prints it, and the brake pulse by which the armature comes to rest.

On its way back the armature is slowed down by the bucking current, as in the quenched response of Fig. 6 of
F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), so that it meets the backstop with
little speed and stays there, held by the magnet.

From rest to the first touch: a push, and its release before impact, so that the armature flies freely.
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

# Beginnings and widths of the brake pulses of the first grid, in flight times of the single pulse
_STARTS: Final = np.linspace(0.85, 1.75, 28)
_WIDTHS: Final = np.linspace(0.1, 0.75, 20)
# Finer grids about the best, and their half widths, likewise: each covers a step of the one before
_NEAR: Final = np.linspace(-1.0, 1.0, 7)
_FINER: Final = (0.034, 0.01, 0.003)
# Time in which a distance from rest would be covered, by which it counts as a speed, likewise
_FALL: Final = 1.0 / 3.0
# Times after the touch at which the armature is to be at rest, likewise
_WATCHED: Final = np.linspace(2.2, 3.4, 16)
_SETTLED: Final = 0.65  # Time after the brake pulse from which on it counts as at rest, likewise


@dataclass(frozen=True)
class Landing:
    """The best way to land, for each of the touches of a map (T,); NaN where the force cannot be had."""

    release: FloatArray  # Time after the touch at which the push ends, s, (T,)
    force: FloatArray  # Force in parts of the single-pulse force, (T,)
    # Time after the touch at which the brake pulse begins, and its width, s, (T,)
    brake: FloatArray
    width: FloatArray
    # Largest speed that is left, m/s; a distance from rest counts as the speed with which it is covered
    # in a third of the flight time of a single pulse, (T,)
    left: FloatArray
    settled: float  # Time after the touch from which on the armature counts as at rest, s


def soft_landing(plant: Plant, forces: ForceMap) -> Landing:
    """Find the brake pulses that leave least of the motion: on a grid, and on finer ones about the best."""
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
        remains = _left(plant, forces, release, rows, np.maximum(tried * scale, AHEAD))
        way = np.argmin(remains, axis=1)
        best[rows] = tried[np.arange(len(rows)), way]
        left[rows] = remains[np.arange(len(rows)), way]
        if finer is not None:
            tried = best[rows][:, np.newaxis, :] + finer * near
    left[np.isinf(left)] = np.nan
    braked = float(np.nanmedian(best.sum(axis=1))) if len(rows) else float(_STARTS[-1])
    return Landing(release, force, best[:, 0] * scale, best[:, 1] * scale, left, (braked + _SETTLED) * scale)


def _left(
    plant: Plant, forces: ForceMap, release: FloatArray, rows: IntArray, tried: FloatArray
) -> FloatArray:
    """Return what is left of the motion after brake pulses (rows, pulses, begin and width), m/s."""
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
    # An armature that hovers between backstop and pack is slow too, but not at rest.
    away = np.abs(strobes.x - rest_state(plant.hammer)) / (_FALL * scale)
    remaining = np.maximum(np.abs(strobes.v), away).max(axis=1)
    return np.where(ok & (dots.extra_contacts[:, 0] == 0), remaining, np.inf).reshape(tried.shape[:2])


# Widths of pushes that are tried, in flight times of the single pulse
_WIDTHS_LAUNCH: Final = np.linspace(0.2, 1.0, 81)
_LENGTH: Final = 4.0  # Length of their runs, likewise
_ALMOST: Final = 0.9  # Force that the touch alone is to print, in parts of that of the single pulse
_WEAKER: Final = 0.03  # Change of the scale of the currents from which derivatives are taken


@dataclass(frozen=True)
class Launch:
    """A start from rest."""

    width: float  # Of the push, s
    flight: float  # From firing to touch, s
    speed: float  # At the touch, m/s
    # By how much the displacement, m, and the speed, m/s, at the time of the touch grow with the
    # currents, for currents twice as large
    place_slope: float
    speed_slope: float


def launch(plant: Plant, forces: ForceMap) -> Launch:
    """Find the push from rest after which the touch alone prints almost the single-pulse force.

    The rest of the force comes from a short push into the pack, which can be measured out when the speed is
    known.
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
    # How displacement and speed before the touch depend on the scale of the currents: weaker, so that the
    # armature is not at the pack by then.
    pulse, before = driver.push(width), time - AHEAD
    drives = [PulseSequence([pulse.scaled(factor)], at=[0.0]) for factor in (1.0, 1.0 - _WEAKER)]
    _, _, states = plant.run(drives, before, strobes=[np.array([before])] * 2)
    place, faster = ((values[0, 0] - values[1, 0]) / _WEAKER for values in (states.x, states.v))
    return Launch(width, time, wanted, float(place), float(faster))
