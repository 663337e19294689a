"""The Poincaré map from each pack contact to the next, for every switching action of the coil.

At the touch the armature has a speed, and the coil is either on (a *pushed* touch) or off (a *free* touch:
the armature was released before impact). An action then holds the coil at the push current until `release`,
at the return current until `fire`, and at the push current again: either beyond the next touch, or for a
given pulse width, after which the armature flies freely. The printed force and the time and speed of the next
touch do not depend on the slot rate, so one map serves all rates.

The tables are interpolated linearly, vectorised over touches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.threads import Progress

if TYPE_CHECKING:
    from printhammer.control.feedback.plant import Driver, Plant
    from printhammer.drive.base import Drive
    from printhammer.drive.waveforms.shapes import Switched

AHEAD: Final = 1e-6  # Time before the touch at which the simulations of a map begin, s; arbitrary
PUSHED, FREE = 0, 1
"""Kinds of pack touch: with the coil current on, or in free flight."""

ALWAYS: Final = 2e-3  # Width assigned to a push that is still on at the next touch, s; arbitrary, but long
# Speeds of the touches, as fractions of the single pulse's impact speed; arbitrary
_PUSHED_SPEEDS: Final = np.linspace(0.3, 1.1, 17)
_FREE_SPEEDS: Final = np.linspace(0.6, 1.25, 14)
_RETURNS: Final = (0.0, -0.4, -1.0)  # Return currents, as fractions of the largest current; arbitrary

FORCES: Final = (0.95, 1.0, 1.05)
"""Forces for which actions are computed, as fractions of the single-pulse force. Actions are enumerated with
the return current as the slowest index and the force as the next. Arbitrary."""

# Widths of the pushes that end before the touch, as fractions of the launch width; arbitrary
_WIDTHS: Final = (0.85, 1.0, 1.2)
# Times of releases, and of throws before and after the bounce, in single-pulse flight times; arbitrary
_RELEASES: Final = np.linspace(0.0, 0.85, 29)
_EARLY: Final = np.linspace(0.14, 1.07, 38)
_LATE: Final = np.linspace(1.1, 2.9, 48)
# Durations of force simulations, and of simulations after a throw, in single-pulse flight times; arbitrary
_WATCHED, _WAIT = 3.0, 1.7
# Time after which a change of the current has decayed, in time constants of the driver; arbitrary
_FADED: Final = 2.5
_LARGEST_FORCE: Final = 1.15
"""Force above which an action is inadmissible, relative to the single pulse; arbitrary."""


@dataclass(frozen=True)
class ForceMap:
    """Peak force on the pack for all combinations of T touches, B return currents and R release times."""

    kind: IntArray  # `PUSHED` or `FREE`, (T,)
    speed: FloatArray  # Speed of the touch, m/s; evenly spaced within a kind, (T,)
    back: FloatArray  # Return currents, A, (B,)
    release: FloatArray  # Time after the touch at which the push ends, s, (R,)
    force: FloatArray  # Peak force relative to the single pulse, (T, B, R)
    front: float  # Front of the pack, m

    @property
    def off(self) -> int:
        """Index of the return current that is closest to zero."""
        return int(np.argmin(np.abs(self.back)))

    def release_for(self, force: float) -> FloatArray:
        """Return the release times [s] that give the peak force `force`, relative to the single pulse.

        The result has one row per touch and one column per return current. A release time is 0 if the touch
        exceeds the force without a push, and NaN if no push gives the force.
        """
        releases = np.full(self.force.shape[:2], np.nan)
        for place in np.ndindex(releases.shape):
            row = np.maximum.accumulate(self.force[place])
            if row[-1] >= force:
                releases[place] = np.interp(force, row, self.release) if row[0] < force else 0.0
        return releases

    def force_at(self, row: int, release: float, back: float) -> float:
        """Interpolate the peak force of touch `row`, as a fraction of the single-pulse force.

        The push current flows until `release` [s] after the touch, then the return current `back` [A].
        """
        number = int(np.argmin(np.abs(self.back - back)))
        return float(np.interp(release, self.release, self.force[row, number]))

    def state(self, row: int) -> tuple[float, float]:
        """Return displacement [m] and speed [m/s] of touch `row` just before the pack contact."""
        speed = float(self.speed[row])
        return self.front - AHEAD * speed, speed


@dataclass(frozen=True)
class ImpactMap:
    """Outcomes of A switching actions of the coil after each of the T touches of a force map."""

    back: FloatArray  # Return current after the push, A, (A,)
    fire: FloatArray  # Time after the touch at which the next push begins, s, (A,)
    width: FloatArray  # Width of the next push, s; `ALWAYS` if the push lasts to the next touch, (A,)
    release: FloatArray  # Time after the touch at which the push ends, s, (T, A)
    # Peak force relative to the single pulse; NaN for an inadmissible action, (T, A)
    force: FloatArray
    # Time from this touch to the next, s, and speed of the next touch, m/s; NaN if inadmissible, (T, A)
    next_touch: FloatArray
    next_speed: FloatArray
    next_kind: IntArray  # `PUSHED` or `FREE`, (A,)
    leaves: FloatArray  # Time after the touch at which the armature leaves the pack, s, (T, A)
    # Kind and speed of the touches, as in the force map, (T,)
    kind: IntArray
    speed: FloatArray
    forces: ForceMap  # Peak force by release
    driver: Driver  # Driver of the coil


def force_map(plant: Plant) -> ForceMap:
    """Simulate the peak force for all combinations of touch, return current and release time."""
    single, driver = plant.single, plant.driver
    kinds = np.repeat([PUSHED, FREE], [len(_PUSHED_SPEEDS), len(_FREE_SPEEDS)])
    speeds = np.concatenate([_PUSHED_SPEEDS, _FREE_SPEEDS]) * single.impact_speed
    releases, back = _RELEASES * single.flight_time, np.array(_RETURNS) * driver.current
    force = np.empty((len(kinds), len(back), len(releases)))
    forces = ForceMap(kinds, speeds, back, releases, force, plant.front)
    keys = [
        (row, release, level)
        for row in range(len(kinds))
        for level in back.tolist()
        for release in releases.tolist()
    ]
    force[:] = released_forces(plant, forces, keys).reshape(force.shape)
    return forces


def released_forces(plant: Plant, forces: ForceMap, keys: list[tuple[int, float, float]]) -> FloatArray:
    """Simulate the peak forces of pack touches, relative to the single pulse; NaN for a failed simulation.

    A key consists of the index of a touch in `forces`, the release time [s] and the return current [A].
    """
    long = _WATCHED * plant.single.flight_time
    drives = [
        plant.driver.drive([first_pulse(int(forces.kind[row]), release, back, long, plant.driver)])
        for row, release, back in keys
    ]
    ok, dots, _ = plant.run(drives, long, [forces.state(row) for row, _release, _back in keys])
    return np.where(ok, dots.peak_force[:, 0], np.nan) / plant.single.force


def impact_map(
    plant: Plant, forces: ForceMap, launched: float, progress: Progress | None = None
) -> ImpactMap:
    """Simulate all switching actions of the coil after each touch of the force map.

    `launched` is the pulse width of a launch from rest, s.
    """
    single, driver = plant.single, plant.driver
    scale = single.flight_time
    fires = np.concatenate([_EARLY, _LATE]) * scale
    widths = np.array([ALWAYS, *(width * launched for width in _WIDTHS)])
    shape = len(forces.back), len(FORCES), len(fires), len(widths)
    back, _, fire, width = (
        axis.ravel() for axis in np.meshgrid(forces.back, FORCES, fires, widths, indexing="ij")
    )
    release = np.stack([forces.release_for(share) for share in FORCES], axis=2)
    every = np.broadcast_to(release[..., np.newaxis, np.newaxis], (len(forces.kind), *shape))
    every = every.reshape(len(forces.kind), -1)
    possible = (fire > every + 2.0 * AHEAD) & ((width == ALWAYS) | (fire > _EARLY[-1] * scale))
    rows, ways = np.nonzero(possible)
    pushes = {number: driver.push(number) for number in widths.tolist()}
    drives: list[Drive] = []
    firsts: dict[tuple[int, float, float, float], Switched] = {}
    # Touches that need no push share their drives.
    made: dict[tuple[int, float, float, float, float], Drive] = {}
    for row, way in zip(rows.tolist(), ways.tolist(), strict=True):
        first = int(forces.kind[row]), float(every[row, way]), float(back[way]), float(fire[way])
        key = *first, float(width[way])
        if key not in made:
            if first not in firsts:
                firsts[first] = first_pulse(*first, driver)
            made[key] = driver.drive([firsts[first], pushes[key[4]]], [0.0, first[3] + AHEAD])
        drives.append(made[key])
    speed = forces.speed[rows]
    states = np.stack([forces.front - AHEAD * speed, speed], axis=1)
    ok, dots, _ = plant.run(drives, fire[ways] + _WAIT * scale, states, progress=progress)
    flight = dots.flight_time[:, 1]
    pushed = width[ways] == ALWAYS
    with np.errstate(invalid="ignore"):
        # Before a free touch the current must have decayed; before a pushed touch it must have risen.
        settled = np.where(pushed, flight, flight - width[ways]) > _FADED * driver.edge
        good = ok & dots.struck[:, 0] & dots.struck[:, 1] & (dots.extra_contacts[:, 0] == 0) & settled
        good &= dots.peak_force[:, 0] < _LARGEST_FORCE * single.force

    def spread(values: FloatArray) -> FloatArray:
        whole = np.full(possible.shape, np.nan)
        whole[rows[good], ways[good]] = values[good]
        return whole

    return ImpactMap(
        back=back,
        fire=fire,
        width=width,
        release=every,
        force=spread(dots.peak_force[:, 0] / single.force),
        next_touch=spread(fire[ways] + AHEAD + flight - dots.flight_time[:, 0]),
        next_speed=spread(dots.impact_speed[:, 1]),
        next_kind=np.where(width == ALWAYS, PUSHED, FREE),
        leaves=spread(dots.contact_time[:, 0]),
        kind=forces.kind,
        speed=forces.speed,
        forces=forces,
        driver=driver,
    )


def first_pulse(kind: int, release: float, back: float, fire: float, driver: Driver) -> Switched:
    """Return the waveform of the coil current from just before a touch up to the next firing.

    `kind` is `PUSHED` or `FREE`: with or without coil current before the touch. From the touch on, the push
    current flows until `release` [s] after the touch, then the return current `back` [A] until the next
    firing, `fire` [s] after the touch.
    """
    at, levels = [0.0], [driver.current if kind == PUSHED else 0.0]
    if release > 0.0:
        at.append(AHEAD)
        levels.append(driver.current)
    at += [AHEAD + release, AHEAD + fire]
    return driver.switched(at, [*levels, back, 0.0], levels[0])


def place_of(values: FloatArray, nodes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return, for each value, the index of the node below and the interpolation weight of the node above.

    The nodes ascend and are evenly spaced.
    """
    place = (values - nodes[0]) / (nodes[1] - nodes[0])
    below = np.clip(place.astype(np.int64), 0, len(nodes) - 2)
    return below, place - below


def blend(low: FloatArray, high: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolate linearly between two values, with weight `share` on the second value."""
    return np.asarray((1.0 - share) * low + share * high)


def bilinear(table: FloatArray, i: IntArray, p: FloatArray, j: IntArray, q: FloatArray) -> FloatArray:
    """Interpolate a table between rows i, i + 1 (weight p) and columns j, j + 1 (weight q)."""
    low, high = blend(table[i, j], table[i, j + 1], q), blend(table[i + 1, j], table[i + 1, j + 1], q)
    return blend(low, high, p)


def blend_known(low: FloatArray, high: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolate linearly between two values; if either value is NaN, return the other value."""
    return blend(np.where(np.isnan(low), high, low), np.where(np.isnan(high), low, high), share)
