"""Which way to go on: the one that costs least, now and later, by dynamic programming.

A dot costs a² + b², a and b its deviations of force and arrival in parts of the limits, each raised so that
what nears a limit costs much more than what does not. Pulling the armature back costs a little, and so does a
way whose next touch depends much on the speed of this one, which is known only so well. The cost of all that
follows, discounted, is a function of how a touch comes (kind, lateness, speed) and of the number of dots
before the next rest, and satisfies Bellman's equation (R. Bellman, *Dynamic Programming*, 1957): first of the
last dot before a rest, then of the one before, and so on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.control.landing import Landing
    from printhammer.control.swing_table import IntArray, SwingTable
    from printhammer.printing.limits import Limits
    from printhammer.segments import FloatArray

NEVER: Final = 50.0
"""Cost of what leads nowhere."""

_DISCOUNT: Final = 0.9
_ROUNDS: Final = 8
_LATENESS: Final = np.linspace(-0.9, 0.9, 13)
_SPEED_DOUBT: Final = 0.04
_STEEPEST: Final = 2e-3
_FAST: Final = 0.3
_STEEP: Final = 8.0
_EFFORT: Final = 0.1


class Policy:
    """Costs of the ways to go on at one rate.

    Parameters
    ----------
    table : SwingTable
        Where they lead.
    period : float
        Time from slot to slot, s.
    limits : Limits
        How far dots may be off.
    landing : Landing
        How well the armature comes to rest.
    """

    def __init__(self, table: SwingTable, period: float, limits: Limits, landing: Landing) -> None:
        self.table = table
        self.landing = landing
        self.period = period
        self.limits = limits
        self._late = _LATENESS * limits.arrival
        self._rows = [np.flatnonzero(table.kind == kind) for kind in range(int(table.kind.max()) + 1)]
        self._doubt = self._doubts()
        self._known = [np.flatnonzero(np.isfinite(row)) for row in table.next_touch]
        self._efforts = self.effort(table.release) + self._doubt
        self._costs = [self._resting()]

    def dot_cost(self, force: FloatArray, late: FloatArray) -> FloatArray:
        """Return the cost of a dot: force in parts of the single-pulse force, lateness in s."""
        a, b = (force - 1.0) / self.limits.force, late / self.limits.arrival
        cost: FloatArray = a**2 * (1.0 + _STEEP * a**4) + b**2 * (1.0 + _STEEP * b**4)
        return cost

    def effort(self, release: FloatArray) -> FloatArray:
        """Return what it costs to pull back, where it is not needed: a hard landing wears the backstop."""
        table = self.table
        cost: FloatArray = _EFFORT * np.square(table.back / table.driver.current) * (table.fire - release)
        return cost / self.period

    def ahead(self, kind: IntArray, late: FloatArray, speed: FloatArray, costs: FloatArray) -> FloatArray:
        """Return the cost of a touch and all that follows it."""
        kinds, lates, speeds = np.broadcast_arrays(kind, late, speed)
        found = np.full(kinds.shape, NEVER)
        end = self._late[-1]
        for number, rows in enumerate(self._rows):
            nodes = self.table.speed[rows]
            with np.errstate(invalid="ignore"):
                inside = (kinds == number) & (speeds >= nodes[0]) & (speeds <= nodes[-1])
            if not inside.any():
                continue
            off = lates[inside]
            i, p = _place(speeds[inside], nodes)
            j, q = _place(np.clip(off, -end, end), self._late)
            own = costs[rows]
            found[inside] = (1.0 - p) * ((1.0 - q) * own[i, j] + q * own[i, j + 1]) + p * (
                (1.0 - q) * own[i + 1, j] + q * own[i + 1, j + 1]
            )
            # Too late is worse the later it is, so that lost time is made up for.
            found[inside] += NEVER * np.maximum(np.abs(off) - end, 0.0) / self.limits.arrival
        return found

    def best(
        self, kind: IntArray, late: FloatArray, speed: FloatArray, wait: FloatArray, after: IntArray
    ) -> tuple[IntArray, FloatArray, Choice]:
        """Return number and cost of the best way for some touches (M,), and where each leads.

        Parameters
        ----------
        kind, late, speed : array, shape (M,)
            How the touches come; lateness in s, speed in m/s.
        wait : array, shape (M,)
            Time from this dot to the next one, s.
        after : int array, shape (M,)
            Number of dots between the next one and a rest.
        """
        choice = Choice(self.table, kind, speed)
        later = late[:, np.newaxis] + choice.next_touch - wait[:, np.newaxis]
        cost = self.dot_cost(choice.force, late[:, np.newaxis]) + self.effort(choice.of(self.table.release))
        cost = cost + choice.of(self._doubt)
        for number in np.unique(after).tolist():
            own = after == number
            cost[own] += _DISCOUNT * self.ahead(
                self.table.next_kind[np.newaxis, :],
                later[own],
                choice.next_speed[own],
                self.costs(number),
            )
        cost = np.where(np.isnan(cost), np.inf, cost)
        way = np.argmin(cost, axis=1)
        return way, np.take_along_axis(cost, way[:, np.newaxis], axis=1)[:, 0], choice

    def _doubts(self) -> FloatArray:
        """Return what it costs that the speed of a touch is known only so well, for all ways, (T, A)."""
        table = self.table
        found = np.zeros(table.next_touch.shape)
        for rows in self._rows:
            slope = np.gradient(table.next_touch[rows], table.speed[rows], axis=0)
            # At the end of what is possible there is no slope to either side.
            found[rows] = np.square(np.nan_to_num(slope, nan=_STEEPEST) * _SPEED_DOUBT / self.limits.arrival)
        return found

    def costs(self, number: int) -> FloatArray:
        """Return the cost of a touch and all that follows, (T, lateness), some dots before a rest."""
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
        for row, ways in enumerate(self._known):
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
    """Where all ways lead from touches (M,) whose speed lies between those of the table: arrays (M, A)."""

    def __init__(self, table: SwingTable, kind: IntArray, speed: FloatArray) -> None:
        self.below, self.share = between(table, kind, speed)
        self.force = self.of(table.force)
        self.next_touch = self.of(table.next_touch)
        self.next_speed = self.of(table.next_speed)

    def of(self, values: FloatArray) -> FloatArray:
        """Interpolate an array (T, A) to (M, A)."""
        share = self.share[:, np.newaxis]
        found: FloatArray = (1.0 - share) * values[self.below] + share * values[self.below + 1]
        return found

    def at(self, values: FloatArray, way: IntArray) -> FloatArray:
        """Interpolate an array (T, A) for one way each, to (M,)."""
        found: FloatArray = (1.0 - self.share) * values[self.below, way] + self.share * values[
            self.below + 1, way
        ]
        return found


def between(table: SwingTable, kind: IntArray, speed: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the row of the table below some touches (M,), and the share of the one above."""
    below, share = np.zeros(len(kind), np.int64), np.zeros(len(kind))
    for number in range(int(table.kind.max()) + 1):
        rows = np.flatnonzero(table.kind == number)
        own = kind == number
        i, p = _place(np.clip(speed[own], table.speed[rows[0]], table.speed[rows[-1]]), table.speed[rows])
        below[own], share[own] = rows[0] + i, p
    return below, share


def _place(values: FloatArray, nodes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the node below each value, and the share of the one above; nodes are evenly spaced."""
    place = (values - nodes[0]) / (nodes[1] - nodes[0])
    below = np.clip(place.astype(np.int64), 0, len(nodes) - 2)
    return below, place - below
