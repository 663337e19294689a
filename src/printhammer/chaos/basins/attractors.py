"""Attractors of pulse trains: identify attractors from strobe states, and assign trains to attractors."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from printhammer.chaos.bifurcation.columns import OK, Columns, cycles_of, run_columns
from printhammer.chaos.orbits.settled import LIES_ON, is_approaching, noise_about, settled, shown
from printhammer.chaos.strobe.train import exponents_onward
from printhammer.chaos.strobe.verdict import is_positive
from printhammer.results import Declared, part
from printhammer.run.effort import Effort
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

MATCH: Final = 1e-2  # Arbitrary
"""Distance, in half-widths of the strobe window, below which two orbits are the same attractor."""

CLOUD: Final = 2000
"""Number of points that represent a strange attractor; arbitrary."""

SETTLING: Final = 1000
"""Number of firings discarded before the points of a strange attractor are recorded; arbitrary.

The number is doubled until two successive sets of points agree.
"""

LONGEST: Final = 16_000
"""Maximum number of discarded firings; a train that still drifts stays undecided. Arbitrary."""

REACH: Final = 0.99
"""Quantile of nearest-neighbour distances that sets the matching radius of a strange attractor; arbitrary."""

INSIDE: Final = 0.95  # Arbitrary
"""Minimum fraction of a train's points within the matching radius of a strange attractor for a match."""

ATTEMPTS: Final = 12
"""Maximum number of aperiodic trains followed in the search for strange attractors; arbitrary."""

POLISHED: Final = 12
"""Maximum number of unsettled trains per batch whose orbits are located by Newton's method; arbitrary."""


class Attractor(Declared):
    """Attractor of a pulse train: a periodic orbit or a strange attractor."""

    name: str = part('name of the attractor: "period-q" or "strange"')
    period: int | None = part("period q in firings; None for a strange attractor")
    states: FloatArray = part(
        "displacement [m] and velocity [m/s] at successive firings: the orbit, starting at its smallest"
        " displacement, shape (q, 2), or points of a strange attractor, shape (n, 2)"
    )
    exponent: float = part(
        "largest exponent of the strobe map, per firing; NaN for a periodic orbit", default=math.nan
    )
    standard_error: float = part("standard error of the exponent", default=math.nan)


class Cloud(NamedTuple):
    """Points of a strange attractor, and the radius within which a state belongs to the attractor."""

    tree: cKDTree  # Search tree of the points, (n, 2)
    reach: float

    @classmethod
    def of(cls, points: FloatArray) -> Cloud:
        """Build a cloud from the states of one train at successive firings, shape (n, 2).

        The radius is a quantile of the distances from the states of the second half to the nearest state of
        the first half.
        """
        half = len(points) // 2
        apart, _ = cKDTree(points[:half]).query(points[half:])
        return cls(cKDTree(points), float(np.quantile(apart, REACH)))

    def holds(self, points: FloatArray) -> BoolArray:
        """Return the mask of the trains that lie on the attractor.

        `points`, shape (..., n, 2), are n states of each train; the mask has the shape (...).
        """
        apart, _ = self.tree.query(points, distance_upper_bound=self.reach)
        return np.asarray(np.isfinite(apart).mean(axis=-1) >= INSIDE)

    def equals(self, other: Cloud) -> bool:
        """Whether two clouds are equal: the points of each lie within the radius of the other."""
        return bool(self.holds(other.tree.data) and other.holds(self.tree.data))


class Attractors:
    """Attractors of the trains examined up to now, in order of discovery.

    To compare two states, the differences in displacement, velocity, memory and current are divided by the
    four `scales`.
    """

    def __init__(self, regime: Regime, scales: FloatArray, tolerance: float) -> None:
        self.regime, self.scales = regime, scales
        self.effort = Effort(tolerance, threads=1)
        self.found: list[Attractor] = []
        self._clouds: dict[int, Cloud] = {}
        self._attempts = 0
        self._noise: dict[int, float] = {}

    def at(self, tolerance: float) -> Attractors:
        """Return a copy with the same known attractors, for trains simulated at the tolerance `tolerance`."""
        other = Attractors(self.regime, self.scales, tolerance)
        other.found, other._clouds, other._noise = list(self.found), dict(self._clouds), dict(self._noise)
        other._attempts = ATTEMPTS
        return other

    def judge(self, columns: Columns) -> IntArray:
        """Return the index of each train's attractor in the list `found`; -1 if unknown."""
        cycles, _ = self._cycles(columns)
        places = np.full(len(columns), -1, np.int64)
        for q in np.unique(cycles[cycles > 0]).tolist():
            rows = np.flatnonzero(cycles == q)
            points = self._scaled(columns.x[rows], columns.v[rows])
            clear = shown(points, q)
            places[rows[clear]] = self._periodic(points[clear, -q:])
            places[rows[~clear]] = self._match_settling(points[~clear], q)
        self._strange(columns, np.flatnonzero((cycles == 0) & (columns.status == OK)), places)
        return places

    def _cycles(self, columns: Columns) -> tuple[IntArray, FloatArray]:
        front = math.inf if self.regime.hammer.front is None else self.regime.hammer.front
        count = len(columns)
        return cycles_of(columns, np.full(count, front), np.tile(self.scales, (count, 1)))

    def _scaled(self, x: FloatArray, v: FloatArray) -> FloatArray:
        return np.stack([x, v], axis=-1) / self.scales[:2]

    def _match_settling(self, points: FloatArray, q: int) -> IntArray:
        """Match slowly settling trains to orbits in `found`, or locate new orbits by Newton's method.

        `points`, shape (n, m, 2), are the scaled states of n trains at m firings. States q firings apart
        agree, which alone does not prove the period q. Returns the index in `found` of the orbit of each
        train, -1 if no orbit is found.
        """
        places = np.full(len(points), -1, np.int64)
        left = list(range(len(points)))
        for _ in range(POLISHED):
            for place, attractor in enumerate(self.found):
                if attractor.period is not None and q % attractor.period == 0:
                    orbit = attractor.states / self.scales[:2]
                    noise = self._noise.get(place, LIES_ON)
                    near = [row for row in left if is_approaching(points[row], orbit, MATCH, noise)]
                    places[near] = place
            left = [row for row in left if places[row] < 0]
            if not left:
                break
            row = left.pop(0)
            ends_at = settled(self.regime, points[row] * self.scales[:2], q, self.scales[:2])
            if ends_at.period is not None:
                places[row] = self._periodic((ends_at.states / self.scales[:2])[np.newaxis])[0]
                if not math.isnan(ends_at.multiplier):
                    self._noise[int(places[row])] = noise_about(ends_at.multiplier)
        return places

    def _periodic(self, orbits: FloatArray) -> IntArray:
        """Return the indices in `found` of orbits of q firings, shape (n, q, 2); append new orbits first."""
        q = orbits.shape[1]
        places = self._known(orbits)
        while (left := np.flatnonzero(places < 0)).size:
            new = orbits[left[0]]
            states = np.roll(new, -int(np.argmin(new[:, 0])), axis=0) * self.scales[:2]
            places[left[_agree(orbits[left], new)]] = len(self.found)
            self.found.append(Attractor(f"period-{q}", q, states))
        return places

    def _known(self, orbits: FloatArray) -> IntArray:
        """Return the indices in `found` of orbits of q firings, shape (n, q, 2); -1 for a new orbit."""
        places = np.full(len(orbits), -1, np.int64)
        for place, attractor in enumerate(self.found):
            if attractor.period == orbits.shape[1]:
                left = np.flatnonzero(places < 0)
                places[left[_agree(orbits[left], attractor.states / self.scales[:2])]] = place
        return places

    def _strange(self, columns: Columns, rows: IntArray, places: IntArray) -> None:
        """Match the aperiodic trains in `rows` of the columns to strange attractors, known or new.

        Some of the trains that match no known attractor are followed to find new attractors. The indices of
        the attractors are written to `places`, which has one entry per train.
        """
        points = self._scaled(columns.x, columns.v)
        left = rows
        for place in self._clouds:
            left = self._within(points, left, place, places)
        while left.size and self._attempts < ATTEMPTS:
            self._attempts += 1
            row, known = int(left[0]), len(self.found)
            followed = self._follow(columns, row)
            left = left[1:]
            if followed is None:
                continue
            places[row] = followed
            if followed in self._clouds:
                left = self._within(points, left, followed, places)
                if followed < known:
                    # Other trains may converge to the same attractor: continue them to the next test first.
                    break

    def _within(self, points: FloatArray, rows: IntArray, place: int, places: IntArray) -> IntArray:
        """Match the trains in `rows` to the strange attractor with index `place`; return the unmatched rows.

        The index is written to the entries of `places` that belong to matching trains.
        """
        if not rows.size:
            return rows
        lies = self._clouds[place].holds(points[rows])
        places[rows[lies]] = place
        return np.asarray(rows[~lies])

    def _follow(self, columns: Columns, row: int) -> int | None:
        """Continue the train in `row` of the columns to its attractor; return the index of the attractor.

        The train is continued until its points lie on a known strange attractor, or until two successive sets
        of points agree. Otherwise every train that converges slowly would define an attractor of its own. The
        result is None if the attractor stays undecided.
        """
        begin, before, settling = columns.last[row : row + 1], None, SETTLING
        while True:
            if math.isnan(begin[0, 0]):
                return None
            longer = run_columns([self.regime], begin, settling + CLOUD, settling, self.effort)
            if longer.status[0] != OK:
                return None
            cycles, _ = self._cycles(longer)
            q, points = int(cycles[0]), self._scaled(longer.x, longer.v)
            if q:
                orbit = (
                    self._periodic(points[:, -q:]) if shown(points, q)[0] else self._match_settling(points, q)
                )
                return int(orbit[0])
            cloud = Cloud.of(points[0])
            late = points[0, CLOUD // 2 :]
            for place, other in self._clouds.items():
                if other.holds(late):
                    return place
            if settling >= LONGEST or (before is not None and cloud.equals(before)):
                break
            begin, before, settling = longer.last, cloud, 2 * settling
        x, v, branch, *_ = longer.last[0].tolist()
        if branch >= 0.0:
            return None
        (exponent,) = exponents_onward([(self.regime, (x, v))], CLOUD, self.effort)
        if not is_positive(exponent):
            return None
        self._clouds[len(self.found)] = cloud
        states = np.column_stack([longer.x[0], longer.v[0]])
        self.found.append(Attractor("strange", None, states, exponent.value, exponent.standard_error))
        return len(self.found) - 1


def _agree(orbits: FloatArray, known: FloatArray) -> BoolArray:
    """Return the mask, shape (n,), of the orbits that equal a known orbit, shape (q, 2), at some phase.

    `orbits`, shape (n, q, 2), contains the scaled states of n orbits of q firings. All q cyclic shifts of the
    known orbit are equivalent.
    """
    count = len(known)
    # The point nearest to the first point gives the shift.
    shift = np.abs(known - orbits[:, :1]).max(axis=2).argmin(axis=1)
    turned = known[(shift[:, np.newaxis] + np.arange(count)) % count]
    return np.asarray(np.abs(turned - orbits).max(axis=(1, 2)) <= MATCH)
