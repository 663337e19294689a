"""The control policy: the action of least present and future cost, by dynamic programming.

The cost of a dot is a² (1 + k a⁴) + b² (1 + k b⁴), with a and b its deviations of force and arrival as
fractions of the limits, so that a deviation near its limit costs far more than a small deviation. Small costs
are added for the return current, and for an action whose next touch depends strongly on the uncertain speed
of the present touch. The discounted cost-to-go is a function of the touch (kind, lateness, speed) and of the
number of dots before the next rest, and satisfies Bellman's equation (R. Bellman, *Dynamic Programming*,
1957). The cost-to-go is computed by backward induction from the last dot before a rest.

The maps are computed for packs at several distances and interpolated to the estimated distance, which is gain
scheduling with the distance as scheduling variable. The contact itself depends only on the distance from the
front; but magnet and spring forces, and the time of a flight that ends at the backstop, depend on the
displacement.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from printhammer.control.feedback.impact_map import (
    FORCES,
    ForceMap,
    ImpactMap,
    bilinear,
    blend,
    force_map,
    impact_map,
    place_of,
    released_forces,
)
from printhammer.control.feedback.plant import Plant
from printhammer.control.feedback.soft_landing import Landing, Launch, soft_landing
from printhammer.printing.dots.judging import Limits
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.threads import Progress

OFFSETS: Final = (-0.07, 0.0, 0.07)  # Arbitrary
"""Displacements of the pack from its nominal position, one per map, in strokes; evenly spaced."""

STEPS: Final = 100
"""Number of steps of the progress bar for each distance of the pack; arbitrary."""

_MAPPING: Final = 70
"""Number of these steps that are done when the impact map of a pack distance is complete; arbitrary."""

MIDDLE: Final = 1  # Index of the nominal distance


@dataclass(frozen=True)
class Fronts:
    """Impact maps and brake pulses for soft landings, for several distances of the pack from the backstop."""

    # One impact map for each of `OFFSETS`, with the same touches and the same actions
    maps: tuple[ImpactMap, ...]
    landings: tuple[Landing, ...]  # One set of landings for each of `OFFSETS`
    # Derivative of the force with respect to the distance of the pack's front, with unchanged switching: in
    # single-pulse forces per stroke, (T, A)
    front_force: FloatArray

    @property
    def table(self) -> ImpactMap:
        """Impact map for the nominal distance of the pack: outcome of each action from each touch."""
        return self.maps[MIDDLE]

    @property
    def landing(self) -> Landing:
        """Brake pulses for soft landings with the pack at its nominal distance."""
        return self.landings[MIDDLE]


def fronts(plant: Plant, forces: ForceMap, start: Launch, progress: Progress | None = None) -> Fronts:
    """Compute impact maps and brake pulses for soft landings, for the pack distances of `OFFSETS`.

    `progress(done, total)` is called after each step; there are `STEPS` steps per distance.
    """
    maps: list[ImpactMap] = []
    landings: list[Landing] = []

    def mapping(done: int, total: int) -> None:
        if progress is not None:
            progress(STEPS * len(landings) + int(_MAPPING * done / total), STEPS * len(OFFSETS))

    for offset in OFFSETS:
        moved = plant.moved(offset)
        own = force_map(moved) if offset else forces
        maps.append(impact_map(moved, own, start.width, mapping))
        landings.append(soft_landing(moved, own))
    return Fronts(tuple(maps), tuple(landings), front_force(plant.moved(OFFSETS[-1]), maps[MIDDLE]))


def front_force(farther: Plant, table: ImpactMap) -> FloatArray:
    """Compute the derivative of the peak force of each touch and action with respect to the pack distance.

    `farther` is the plant with the farthest pack; `table` is the impact map of the nominal hammer. The unit
    is single-pulse forces per stroke, the shape (touches, actions).
    """
    keys: dict[tuple[int, float, float], int] = {}
    which = np.full(table.release.shape, -1)
    for row, way in zip(*np.nonzero(np.isfinite(table.release)), strict=True):
        key = int(row), float(table.release[row, way]), float(table.back[way])
        which[row, way] = keys.setdefault(key, len(keys))
    # From the states in which the nominal hammer touches its pack.
    forces = released_forces(farther, table.forces, list(keys))
    nominal = np.array([table.forces.force_at(*key) for key in keys])
    slopes = np.append(np.nan_to_num((forces - nominal) / OFFSETS[-1]), 0.0)
    return np.asarray(slopes[which])


def between_fronts(front: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the index of the map below each pack distance, and the interpolation weight of the map above.

    `front` is the pack distance beyond nominal, as a fraction of the stroke; values outside the range of the
    maps are clipped.
    """
    return place_of(np.clip(front, OFFSETS[0], OFFSETS[-1]), np.array(OFFSETS))


NEVER: Final = 50.0  # Cost of an inadmissible action; arbitrary
# Standard deviation of the pack front, as a fraction of the stroke, above which a penalty applies; arbitrary
KNOWN: Final = 0.01
_DISCOUNT: Final = 0.9  # Discount factor per dot; arbitrary
_ROUNDS: Final = 8  # Number of dots before a rest after which the cost-to-go counts as converged; arbitrary
_LATENESS: Final = np.linspace(-0.9, 0.9, 13)  # Nodes of the lateness, as fractions of the limit; arbitrary
_SPEED_DOUBT: Final = 0.04  # Standard deviation of the estimated speed of a touch, m/s; arbitrary
# Derivative of the next touch time with respect to speed, s / (m/s), where no finite difference is available;
# arbitrary
_STEEPEST: Final = 2e-3
_NEAR: Final = 2  # Number of speed nodes on either side that are searched for the steepest slope; arbitrary
_FAST: Final = 0.3  # Residual speed after a landing that costs 1, m/s; arbitrary
_STEEP: Final = 8.0  # Weight of the sixth power of a deviation relative to its square; arbitrary
_EFFORT: Final = 0.1  # Cost of the largest return current over a whole period; arbitrary


class Committed(NamedTuple):
    """Decisions already carried out at M pack contacts in progress; only the next throw is still open.

    `back` is the return current [A], `force` the printed force relative to the single pulse, and `time` the
    time since the touch, s.
    """

    back: FloatArray
    force: FloatArray
    time: FloatArray


class Policy:
    """Cost-to-go of all actions at one slot period [s]; `limits` normalise the deviations of the dots."""

    def __init__(self, fronts: Fronts, period: float, limits: Limits) -> None:
        self.fronts = fronts
        self.table = table = fronts.table
        self.landing = fronts.landing
        self.period = period
        self.limits = limits
        self._late = _LATENESS * limits.arrival
        self._rows = [np.flatnonzero(table.kind == kind) for kind in range(int(table.kind.max()) + 1)]
        self._doubt = self._doubts()
        self._ways = [np.flatnonzero(np.isfinite(row)) for row in table.next_touch]
        self._efforts = self.effort(table.release) + self._doubt
        self._costs = [self._resting()]

    def dot_cost(self, force: FloatArray, late: FloatArray) -> FloatArray:
        """Return the cost of a dot, a² (1 + k a⁴) + b² (1 + k b⁴), with k = `_STEEP`.

        a = (`force` - 1) / force limit, with `force` relative to the single pulse; b = `late` [s] / arrival
        limit.
        """
        a, b = (force - 1.0) / self.limits.force, late / self.limits.arrival
        return np.asarray(a**2 * (1.0 + _STEEP * a**4) + b**2 * (1.0 + _STEEP * b**4))

    def effort(self, release: FloatArray) -> FloatArray:
        """Return the cost of the coil current during the armature's return from the pack, for all actions.

        This current makes the armature strike the backstop harder. It flows from `release` [s] after the
        touch, the end of the push, until the next firing.
        """
        table = self.table
        cost = _EFFORT * np.square(table.back / table.driver.current) * (table.fire - release)
        return np.asarray(cost / self.period)

    def ahead(self, kind: IntArray, late: FloatArray, speed: FloatArray, costs: FloatArray) -> FloatArray:
        """Interpolate the cost-to-go from pack contacts, including the cost of the dot of each contact.

        The contacts have a `kind`, a lateness `late` [s] and a `speed` [m/s]; `costs` is a table of
        `Policy.costs`.
        """
        kinds, lates, speeds = np.broadcast_arrays(kind, late, speed)
        total = np.full(kinds.shape, NEVER)
        end = self._late[-1]
        for number, rows in enumerate(self._rows):
            nodes = self.table.speed[rows]
            with np.errstate(invalid="ignore"):
                inside = (kinds == number) & (speeds >= nodes[0]) & (speeds <= nodes[-1])
            if not inside.any():
                continue
            off = lates[inside]
            places = place_of(speeds[inside], nodes), place_of(np.clip(off, -end, end), self._late)
            total[inside] = bilinear(costs[rows], *places[0], *places[1])
            # The cost grows beyond the last node, so that lost time is recovered.
            total[inside] += NEVER * np.maximum(np.abs(off) - end, 0.0) / self.limits.arrival
        return total

    def best(
        self,
        kind: IntArray,
        late: FloatArray,
        speed: FloatArray,
        wait: FloatArray,
        after: IntArray,
        front: FloatArray,
        front_error: FloatArray,
        done: Committed | None = None,
    ) -> tuple[IntArray, FloatArray, Choice]:
        """Select the action of least cost for each of M touches.

        Returns, in this order: the index of the selected action for each touch; the cost of this action for
        each touch; and the outcomes of all actions.

        The touches have a `kind`, a lateness `late` [s] and a `speed` [m/s]. The next dot is due after `wait`
        [s], and `after` dots follow between the next dot and a rest. The pack is `front` farther away than
        nominal, with standard deviation `front_error`, as fractions of the stroke. If only the throw remains
        to be decided, `done` states the actions already taken.
        """
        choice = Choice(self.fronts, kind, speed, front)
        if done is not None:
            choice.settle(done.force)
        later = late[:, np.newaxis] + choice.next_touch - wait[:, np.newaxis]
        cost = self.dot_cost(choice.force, late[:, np.newaxis]) + self.effort(choice.of("release"))
        cost = cost + choice.by_speed(self._doubt)
        unsure = np.flatnonzero(front_error > KNOWN)
        if unsure.size:
            cost[unsure] += self._front_doubt(choice, unsure, front_error[unsure])
        for number in np.unique(after).tolist():
            own = after == number
            cost[own] += _DISCOUNT * self.ahead(
                self.table.next_kind[np.newaxis, :],
                later[own],
                choice.next_speed[own],
                self.costs(number),
            )
        if done is not None:
            open_ways = self.table.back == done.back[:, np.newaxis]
            open_ways &= self.table.fire > done.time[:, np.newaxis]
            cost = np.where(open_ways, cost, np.inf)
        # An action that is inadmissible after the previous decisions may still have a known force.
        cost = np.where(np.isnan(cost) | np.isnan(choice.next_touch), np.inf, cost)
        way = np.argmin(cost, axis=1)
        return way, np.take_along_axis(cost, way[:, np.newaxis], axis=1)[:, 0], choice

    def _doubts(self) -> FloatArray:
        """Return the cost due to the uncertain speed of a touch, for all actions, shape (touches, actions).

        The cost depends on the derivative of the next touch time with respect to the speed of the present
        touch, and uses the steepest slope among neighbouring speeds: near a discontinuity, where the number
        of bounces changes, interpolation between two speeds is meaningless.
        """
        table = self.table
        doubts = np.zeros(table.next_touch.shape)
        for rows in self._rows:
            speeds, touch = table.speed[rows], table.next_touch[rows]
            slope = np.abs(np.gradient(touch, speeds, axis=0))
            steps = np.nan_to_num(np.abs(np.diff(touch, axis=0)) / np.diff(speeds)[:, np.newaxis])
            steepest = maximum_filter1d(steps, 2 * _NEAR, axis=0, mode="constant")
            around = np.vstack([steepest, steepest[-1:]])
            # At the ends of the admissible range a slope may be missing on both sides.
            slope = np.nan_to_num(np.maximum(slope, around), nan=_STEEPEST)
            doubts[rows] = np.square(slope * _SPEED_DOUBT / self.limits.arrival)
        return doubts

    def _front_doubt(self, choice: Choice, rows: IntArray, error: FloatArray) -> FloatArray:
        """Return the cost due to the uncertain position of the pack front, shape (touches, actions).

        `rows` are the indices of the touches in `choice`; `error` is the standard deviation of the front for
        each of these touches, as a fraction of the stroke.
        """
        weaker = error[:, np.newaxis] * choice.by_speed(self.fronts.front_force)[rows]
        force = choice.force[rows]
        zero = np.zeros(1)
        both = 0.5 * (self.dot_cost(force + weaker, zero) + self.dot_cost(force - weaker, zero))
        near, far = (self.fronts.maps[end].next_touch for end in (0, -1))
        slope = np.nan_to_num((far - near) / (OFFSETS[-1] - OFFSETS[0]))
        late = error[:, np.newaxis] * choice.by_speed(slope)[rows] / self.limits.arrival
        return both - self.dot_cost(force, zero) + np.square(late)

    def costs(self, number: int) -> FloatArray:
        """Compute the cost-to-go, shape (touches, lateness), with `number` dots before a rest."""
        while len(self._costs) <= min(number, _ROUNDS):
            self._costs.append(self._one_more(self._costs[-1]))
        return self._costs[min(number, _ROUNDS)]

    def _resting(self) -> FloatArray:
        left = np.where(np.isnan(self.landing.left), _FAST, self.landing.left)
        force = np.where(np.isnan(self.landing.force), 0.0, self.landing.force)
        rest = self.dot_cost(force[:, np.newaxis], self._late[np.newaxis, :])
        return np.minimum(rest + np.square(left / _FAST)[:, np.newaxis], NEVER)

    def _one_more(self, costs: FloatArray) -> FloatArray:
        table = self.table
        late = self._late[:, np.newaxis]
        new = np.full_like(costs, NEVER)
        for row, ways in enumerate(self._ways):
            if not ways.size:
                continue
            later = late + table.next_touch[row, ways] - self.period
            cost = self.dot_cost(table.force[row, ways], late) + self._efforts[row, ways]
            cost = cost + _DISCOUNT * self.ahead(
                table.next_kind[ways], later, table.next_speed[row, ways], costs
            )
            new[row] = np.minimum(cost.min(axis=1), NEVER)
        return new


class Choice:
    """Outcomes of all switching actions after M touches, interpolated in touch speed and pack distance."""

    def __init__(self, fronts: Fronts, kind: IntArray, speed: FloatArray, front: FloatArray) -> None:
        self._fronts = fronts
        self.below, self.share = between(fronts.table, kind, speed)
        self.nearer, self.farther = between_fronts(front)
        self.force = self.of("force")
        self.next_touch = self.of("next_touch")
        self.next_speed = self.of("next_speed")

    def settle(self, force: FloatArray) -> None:
        """Condition the outcomes on M dots with known forces, relative to the single pulse.

        Actions are tabulated for each of `FORCES`. The outcomes of the actions for the middle force are
        interpolated linearly to the known force; actions for the other forces become inadmissible.
        """
        middle = len(FORCES) // 2
        shape = len(self.below), len(np.unique(self._fronts.table.back)), len(FORCES), -1
        own = self.force.reshape(shape)
        apart = own[:, :, -1] - own[:, :, 0]
        away = force[:, np.newaxis, np.newaxis] - own[:, :, middle]
        for name in ("next_touch", "next_speed"):
            values = getattr(self, name).reshape(shape)
            change = values[:, :, -1] - values[:, :, 0]
            # If no push is needed, all forces of the map are equal, and so are the outcomes.
            shift = np.divide(change, apart, out=np.zeros_like(change), where=apart != 0.0) * away
            settled = np.full_like(values, np.nan)
            settled[:, :, middle] = values[:, :, middle] + np.nan_to_num(shift)
            setattr(self, name, settled.reshape(self.force.shape))

    def by_speed(self, values: FloatArray, way: IntArray | None = None) -> FloatArray:
        """Interpolate a table of the nominal map at the speeds of the M touches.

        `values` has a row per tabulated touch and a column per action. `way` is the index of one action per
        touch; without it, all actions are interpolated, shape (M, actions).
        """
        every: Any = slice(None) if way is None else way
        share = self.share[:, np.newaxis] if way is None else self.share
        return blend(values[self.below, every], values[self.below + 1, every], share)

    def of(self, name: str, way: IntArray | None = None) -> FloatArray:
        """Interpolate the field `name` of the impact maps at the speeds and pack distances of the M touches.

        `way` is the index of one action per touch; without it, all actions are interpolated, shape
        (M, actions).
        """
        tables = [getattr(table, name) for table in self._fronts.maps]
        shape = (len(self.below), tables[MIDDLE].shape[1]) if way is None else (len(self.below),)
        values = np.empty(shape)
        for number, (near, far) in enumerate(itertools.pairwise(tables)):
            rows = np.flatnonzero(self.nearer == number)
            own: Any = slice(None) if way is None else way[rows]
            below, share, farther = self.below[rows], self.share[rows], self.farther[rows]
            if way is None:
                share, farther = share[:, np.newaxis], farther[:, np.newaxis]
            low, high = (blend(table[below, own], table[below + 1, own], share) for table in (near, far))
            values[rows] = blend(low, high, farther)
        return values


def between(table: ImpactMap, kind: IntArray, speed: FloatArray) -> tuple[IntArray, FloatArray]:
    """Locate touches of given kind and speed [m/s] between the touches of an impact map.

    Return, for each touch, the row below its speed, and the interpolation weight of the row above.
    """
    below, share = np.zeros(len(kind), np.int64), np.zeros(len(kind))
    for number in range(int(table.kind.max()) + 1):
        rows = np.flatnonzero(table.kind == number)
        own, nodes = kind == number, table.speed[rows]
        i, p = place_of(np.clip(speed[own], nodes[0], nodes[-1]), nodes)
        below[own], share[own] = rows[0] + i, p
    return below, share
