"""From one touch of the pack to the next: what a hammer does when its coil is switched in a certain way.

At the touch the armature has a speed, and the coil is either on already (the armature is *pushed*) or off (it
flies *freely*: it was released before impact). The coil is then held at the push current until `release`, at
the return current until `fire`, and at the push current again: up to the next touch and beyond, or for some
width after which the armature flies freely. Which force this prints, and when and how fast the next touch
comes, has nothing to do with the rate of printing: one table holds for all rates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.bounded import BoundedSequence
from printhammer.drive.waveforms.shapes import Switched
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble

if TYPE_CHECKING:
    import numpy.typing as npt

    from printhammer.control.feedback.driver import Driver
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal
    from printhammer.support.arrays import FloatArray

    IntArray = npt.NDArray[np.int64]

AHEAD: Final = 1e-6
"""Time before the touch at which the runs of a table begin, s."""

PUSHED, FREE = 0, 1
"""Kinds of touches."""

ALWAYS: Final = 2e-3
"""Width of a push that is still on at the next touch, s."""

FORCES: Final = 3
"""Number of forces for which ways are computed; only the return currents vary more slowly over the ways."""

_PUSHED_SPEEDS: Final = np.linspace(0.3, 1.1, 17)
_FREE_SPEEDS: Final = np.linspace(0.6, 1.25, 14)
_RETURNS: Final = (0.0, -0.4, -1.0)
_FORCES: Final = (0.95, 1.0, 1.05)
_WIDTHS: Final = (0.85, 1.0, 1.2)
_LAST_RELEASE: Final = 0.85
_RELEASES: Final = 29
_EARLY: Final = np.linspace(0.14, 1.07, 38)
_LATE: Final = np.linspace(1.1, 2.9, 48)
_WAIT: Final = 1.7
_FADED: Final = 2.5
_LARGEST_FORCE: Final = 1.15


@dataclass(frozen=True)
class SwingTable:
    """What becomes of the ways to switch the coil from one touch to the next.

    The touches at which a row begins are numbered (T,), the ways to go on (A,).

    Attributes
    ----------
    kind : int array, shape (T,)
        `PUSHED` or `FREE`.
    speed : array, shape (T,)
        Of the touch, m/s; evenly spaced within a kind.
    back : array, shape (A,)
        Return current, A.
    fire : array, shape (A,)
        Time after the touch at which the next push begins, s.
    width : array, shape (A,)
        Of that push, s; `ALWAYS` for one up to the next touch.
    release : array, shape (T, A)
        Time after the touch at which the push ends, s.
    force : array, shape (T, A)
        Peak force in parts of the single-pulse force; NaN where this way leads nowhere.
    next_touch : array, shape (T, A)
        Time of the next touch after this one, s; NaN likewise.
    next_speed : array, shape (T, A)
        Its speed, m/s; NaN likewise.
    next_kind : int array, shape (A,)
        `PUSHED` or `FREE`.
    leaves : array, shape (T, A)
        Time after the touch at which the armature leaves the pack, s.
    force_map : ForceMap
        Peak force by release.
    driver : Driver
        Of the coil.
    stroke : float
        Way from backstop to pack, m.
    """

    kind: IntArray
    speed: FloatArray
    back: FloatArray
    fire: FloatArray
    width: FloatArray
    release: FloatArray
    force: FloatArray
    next_touch: FloatArray
    next_speed: FloatArray
    next_kind: IntArray
    leaves: FloatArray
    force_map: ForceMap
    driver: Driver
    stroke: float


@dataclass(frozen=True)
class ForceMap:
    """Peak force by touch, return current and release.

    Attributes
    ----------
    kind : int array, shape (T,)
        `PUSHED` or `FREE`.
    speed : array, shape (T,)
        Of the touch, m/s.
    back : array, shape (B,)
        Return currents, A.
    release : array, shape (R,)
        Time after the touch at which the push ends, s.
    force : array, shape (T, B, R)
        In parts of the single-pulse force.
    front : float
        Front of the pack, m.
    """

    kind: IntArray
    speed: FloatArray
    back: FloatArray
    release: FloatArray
    force: FloatArray
    front: float

    def release_for(self, force: float) -> FloatArray:
        """Return the release that gives a force, shape (T, B), s; NaN where the push is too weak for it.

        Where even no push is too much, it is 0.
        """
        found = np.full(self.force.shape[:2], np.nan)
        for place in np.ndindex(found.shape):
            row = np.maximum.accumulate(self.force[place])
            if row[-1] >= force:
                found[place] = np.interp(force, row, self.release) if row[0] < force else 0.0
        return found

    def force_at(self, row: int, release: float, back: float) -> float:
        """Return the force of a touch, in parts of the single-pulse force."""
        number = int(np.argmin(np.abs(self.back - back)))
        return float(np.interp(release, self.release, self.force[row, number]))


def touches(single: Nominal) -> tuple[IntArray, FloatArray]:
    """Return kinds and speeds, m/s, of the touches from which tables begin."""
    kinds = np.repeat([PUSHED, FREE], [len(_PUSHED_SPEEDS), len(_FREE_SPEEDS)])
    return kinds, np.concatenate([_PUSHED_SPEEDS, _FREE_SPEEDS]) * single.impact_speed


def force_map(hammer: Hammer, driver: Driver, single: Nominal, *, threads: int | None = None) -> ForceMap:
    """Compute the peak force for all touches, return currents and releases.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    driver : Driver
        Of its coil.
    single : Nominal
        Its single-pulse dot.
    threads : int, optional
        By default as many as there are cores.
    """
    kinds, speeds = touches(single)
    assert hammer.front is not None
    front = hammer.front
    releases = np.linspace(0.0, _LAST_RELEASE, _RELEASES) * single.flight_time
    back = np.array(_RETURNS) * driver.current
    long = 3.0 * single.flight_time
    drives, states = [], []
    for kind, speed in zip(kinds.tolist(), speeds.tolist(), strict=True):
        for level in back.tolist():
            for release in releases.tolist():
                drives.append(
                    BoundedSequence([first_pulse(kind, release, level, long, driver)], [0.0], driver.current)
                )
                states.append((front - AHEAD * speed, speed))
    result = Ensemble(hammer, drives, long, states=np.array(states), tolerance=DISPLAY_TOLERANCE).run(
        dots=True, threads=threads
    )
    assert result.dots is not None
    force = np.where(result.ok, result.dots.peak_force[:, 0], np.nan) / single.force
    shape = len(kinds), len(back), len(releases)
    return ForceMap(kinds, speeds, back, releases, force.reshape(shape), front)


def swing_table(
    hammer: Hammer,
    driver: Driver,
    single: Nominal,
    forces: ForceMap,
    launched: float,
    *,
    threads: int | None = None,
) -> SwingTable:
    """Compute where all ways to switch the coil lead.

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
    launched : float
        Width of the push by which it is launched from rest, s.
    threads : int, optional
        By default as many as there are cores.
    """
    scale = single.flight_time
    fires = np.concatenate([_EARLY, _LATE]) * scale
    widths = np.array([ALWAYS, *(width * launched for width in _WIDTHS)])
    shape = len(forces.back), len(_FORCES), len(fires), len(widths)
    back, _, fire, width = (
        axis.ravel() for axis in np.meshgrid(forces.back, _FORCES, fires, widths, indexing="ij")
    )
    release = np.stack([forces.release_for(share) for share in _FORCES], axis=2)
    every = np.broadcast_to(release[..., np.newaxis, np.newaxis], (len(forces.kind), *shape))
    every = every.reshape(len(forces.kind), -1)
    possible = (fire > every + 2.0 * AHEAD) & ((width == ALWAYS) | (fire > _EARLY[-1] * scale))
    rows, ways = np.nonzero(possible)
    pushes = {
        number: Switched(at=(0.0, number), levels=(driver.current, 0.0), edge=driver.edge)
        for number in widths.tolist()
    }
    drives, firsts = [], {}
    for row, way in zip(rows.tolist(), ways.tolist(), strict=True):
        key = row, float(every[row, way]), float(back[way]), float(fire[way])
        if key not in firsts:
            firsts[key] = first_pulse(int(forces.kind[row]), *key[1:], driver)
        both = [firsts[key], pushes[float(width[way])]]
        drives.append(BoundedSequence(both, [0.0, key[3] + AHEAD], driver.current))
    speed = forces.speed[rows]
    states = np.stack([forces.front - AHEAD * speed, speed], axis=1)
    ends = fire[ways] + _WAIT * scale
    result = Ensemble(hammer, drives, ends, states=states, tolerance=DISPLAY_TOLERANCE).run(
        dots=True, threads=threads
    )
    dots = result.dots
    assert dots is not None
    flight = dots.flight_time[:, 1]
    pushed = width[ways] == ALWAYS
    with np.errstate(invalid="ignore"):
        # Free means that next to nothing is left of the current at the touch, pushed that all of it is there.
        settled = np.where(pushed, flight, flight - width[ways]) > _FADED * driver.edge
        good = result.ok & dots.struck[:, 0] & dots.struck[:, 1] & (dots.extra_contacts[:, 0] == 0) & settled
        good &= dots.peak_force[:, 0] < _LARGEST_FORCE * single.force

    def spread(values: FloatArray) -> FloatArray:
        whole = np.full(possible.shape, np.nan)
        whole[rows[good], ways[good]] = values[good]
        return whole

    return SwingTable(
        kind=forces.kind,
        speed=forces.speed,
        back=back,
        fire=fire,
        width=width,
        release=every,
        force=spread(dots.peak_force[:, 0] / single.force),
        next_touch=spread(fire[ways] + AHEAD + flight - dots.flight_time[:, 0]),
        next_speed=spread(dots.impact_speed[:, 1]),
        next_kind=np.where(width == ALWAYS, PUSHED, FREE),
        leaves=spread(dots.contact_time[:, 0]),
        force_map=forces,
        driver=driver,
        stroke=forces.front - hammer.origin,
    )


def first_pulse(kind: int, release: float, back: float, fire: float, driver: Driver) -> Switched:
    """Return what the coil does from just before the touch up to the next push."""
    at, levels = [0.0], [driver.current if kind == PUSHED else 0.0]
    if release > 0.0:
        at.append(AHEAD)
        levels.append(driver.current)
    return Switched(
        at=(*at, AHEAD + release, AHEAD + fire),
        levels=(*levels, back, 0.0),
        edge=driver.edge,
        initial=levels[0],
    )
