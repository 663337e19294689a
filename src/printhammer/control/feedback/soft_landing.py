"""Back to rest after a dot: the push that prints it, and the brake pulse by which the armature lands softly.

On its way back the armature is slowed down by the bucking current, as in the quenched response of Fig. 6 of
F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), so that it meets the backstop with
little speed and stays there, held by the magnet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.bounded import BoundedSequence
from printhammer.control.feedback.impact_map import AHEAD, PUSHED
from printhammer.drive.waveforms.shapes import Switched
from printhammer.hammer.equilibrium import rest_state
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble

if TYPE_CHECKING:
    from printhammer.control.feedback.driver import Driver
    from printhammer.control.feedback.impact_map import ForceMap, IntArray
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal
    from printhammer.support.arrays import FloatArray

_STARTS: Final = np.linspace(0.85, 1.75, 28)
_WIDTHS: Final = np.linspace(0.1, 0.75, 20)
_NEAR: Final = np.linspace(-1.0, 1.0, 7)
_FINER: Final = (0.034, 0.01, 0.003)
_FALL: Final = 1.0 / 3.0
_WATCHED: Final = np.linspace(2.2, 3.4, 16)
_SETTLED: Final = 0.65


@dataclass(frozen=True)
class Landing:
    """The best way to land, for each of the touches of a table (T,).

    Attributes
    ----------
    release : array, shape (T,)
        Time after the touch at which the push ends, s; NaN where the force cannot be had.
    force : array, shape (T,)
        Force in parts of the single-pulse force; NaN likewise.
    brake : array, shape (T,)
        Time after the touch at which the brake pulse begins, s; NaN likewise.
    width : array, shape (T,)
        Of the brake pulse, s; NaN likewise.
    left : array, shape (T,)
        Largest speed that is left, m/s; a distance from rest counts as the speed with which it is covered in
        a third of the flight time of a single pulse. NaN likewise.
    settled : float
        Time after the touch from which on the armature counts as at rest, s.
    """

    release: FloatArray
    force: FloatArray
    brake: FloatArray
    width: FloatArray
    left: FloatArray
    settled: float


def landing(
    hammer: Hammer, driver: Driver, single: Nominal, forces: ForceMap, *, threads: int | None = None
) -> Landing:
    """Find the brake pulses that leave least of the motion: on a grid, and on finer ones about the best.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    driver : Driver
        Of its coil.
    single : Nominal
        Its single-pulse dot.
    forces : ForceMap
        Its forces.
    threads : int, optional
        By default as many as there are cores.
    """
    scale = single.flight_time
    off = int(np.argmin(np.abs(forces.back)))
    release = forces.release_for(1.0)[:, off]
    force = np.full(len(release), np.nan)
    rows = np.flatnonzero(~np.isnan(release))
    for row in rows.tolist():
        force[row] = np.interp(release[row], forces.release, forces.force[row, off])
    grid = np.stack([axis.ravel() for axis in np.meshgrid(_STARTS, _WIDTHS, indexing="ij")], axis=1)
    near = np.stack([axis.ravel() for axis in np.meshgrid(_NEAR, _NEAR, indexing="ij")], axis=1)
    tried = np.broadcast_to(grid, (len(rows), *grid.shape))
    best = np.full((len(release), 2), np.nan)
    left = np.full(len(release), np.nan)
    for finer in (*_FINER, None):
        remains = _left(
            hammer, driver, scale, forces, release, rows, np.maximum(tried * scale, AHEAD), threads
        )
        way = np.argmin(remains, axis=1)
        best[rows] = tried[np.arange(len(rows)), way]
        left[rows] = remains[np.arange(len(rows)), way]
        if finer is not None:
            tried = best[rows][:, np.newaxis, :] + finer * near
    left[np.isinf(left)] = np.nan
    braked = float(np.nanmedian(best.sum(axis=1))) if len(rows) else float(_STARTS[-1])
    return Landing(release, force, best[:, 0] * scale, best[:, 1] * scale, left, (braked + _SETTLED) * scale)


def _left(
    hammer: Hammer,
    driver: Driver,
    scale: float,
    forces: ForceMap,
    release: FloatArray,
    rows: IntArray,
    tried: FloatArray,
    threads: int | None,
) -> FloatArray:
    """Return what is left of the motion after brake pulses (rows, pulses, begin and width), m/s."""
    drives, states = [], []
    for row, pulses in zip(rows.tolist(), tried, strict=True):
        initial = driver.current if forces.kind[row] == PUSHED else 0.0
        levels = (initial, driver.current if release[row] > 0.0 else 0.0, 0.0, driver.current, 0.0)
        released = AHEAD + max(float(release[row]), AHEAD)
        state = float(forces.front - AHEAD * forces.speed[row]), float(forces.speed[row])
        for begin, width in pulses.tolist():
            brake = max(AHEAD + begin, released + AHEAD)
            pulse = Switched(
                at=(0.0, AHEAD, released, brake, brake + width),
                levels=levels,
                edge=driver.edge,
                initial=initial,
            )
            drives.append(BoundedSequence([pulse], [0.0], driver.current))
            states.append(state)
    watched = AHEAD + _WATCHED * scale
    result = Ensemble(
        hammer, drives, float(watched[-1]), states=np.array(states), tolerance=DISPLAY_TOLERANCE
    ).run(dots=True, strobes=[watched] * len(drives), threads=threads)
    assert result.dots is not None
    assert result.strobes is not None
    good = result.ok & (result.dots.extra_contacts[:, 0] == 0)
    # An armature that hovers between backstop and pack is slow too, but not at rest.
    away = np.abs(result.strobes.x - rest_state(hammer)) / (_FALL * scale)
    found = np.maximum(np.abs(result.strobes.v), away).max(axis=1)
    return np.where(good, found, np.inf).reshape(tried.shape[:2])
