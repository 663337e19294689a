"""Search for the optimal current of a slot, and for the current that lands the armature softly.

The currents at the nodes are optimised by sequential quadratic programming (SLSQP). A search starts from the
current of the preceding slot, or from the best profiles. A profile is a current with a few levels: brake,
wait and throw for a dot; brake and lower for the landing.

Profiles are parameterised by a few numbers in [0, 1], called shares. A Sobol sequence of profiles is
evaluated, and each of the best is refined by a deterministic local search over a shrinking cloud of points.
Without the refinement SLSQP would stop in one of many local minima, and rounding errors that differ between
processors would select the minimum.

SLSQP (D. Kraft, DFVLR-FB 88-28 (1988)) is used as implemented in SciPy. The derivatives are finite
differences, all of whose simulations form one ensemble.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from printhammer.control.least_work.slot import RELOADING, Outcomes, SlotState, Task, node_times
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Sampled
from printhammer.hammer.equilibrium import rest_state
from printhammer.support.arrays import FloatArray

LOST: Final = 25.0  # Normalised deviation assigned to a failed simulation; arbitrary, but well above 1
_MISSED: Final = 0.05  # Accepted deviation from the arrival time, in units of `ARRIVAL`; arbitrary
_SLACK: Final = 8e-3  # Accepted shortfall of the force, in units of `_FORCE`; arbitrary
ARRIVAL: Final = 20e-6  # Scale of arrival deviations, s; arbitrary
_FORCE: Final = 0.05  # Scale of force deviations, relative; arbitrary
_DIFFERENCE: Final = 1e-5  # Step of the finite differences; arbitrary
_ENDS_AT: Final = 1e-5  # Change of the cost at which SLSQP stops; arbitrary


def descend(
    measured: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    bounds: tuple[float, float],
    rounds: int,
    *,
    conditions: bool,
    linear: tuple[FloatArray, FloatArray] | None = None,
    inward: bool = False,
) -> tuple[FloatArray, float]:
    """Minimise an objective by SLSQP, with optional constraints; `measured` evaluates all functions.

    The search begins at the point `start` and ends after at most `rounds` iterations. `measured` evaluates k
    points of n variables, shape (k, n), and returns one row, the objective, shape (1, k). With `conditions`
    it returns two more rows: an equality constraint (row = 0) and an inequality constraint (row >= 0).
    `bounds` apply to every variable. `linear`, an offset and a matrix, are linear inequality constraints,
    offset + matrix @ y >= 0, on a point y. With `inward`, the finite-difference step points away from the
    nearer of the bounds 0 and 1. Returns the final point and its objective.
    """
    from scipy import optimize

    known: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def values(place: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = place.tobytes()
        if key not in known:
            known.clear()
            side = np.where((place < 0.5) | (not inward), _DIFFERENCE, -_DIFFERENCE)
            rows = np.nan_to_num(measured(np.vstack([place, place + np.diag(side)])), nan=LOST)
            known[key] = rows[:, 0], (rows[:, 1:] - rows[:, :1]) / side
        return known[key]

    def row(number: int) -> dict[str, Any]:
        return {"fun": lambda y: values(y)[0][number], "jac": lambda y: values(y)[1][number]}

    asked: list[dict[str, Any]] = []
    if linear is not None:
        offset, matrix = linear
        asked.append({"type": "ineq", "fun": lambda y: offset + matrix @ y, "jac": lambda _y: matrix})
    if conditions:
        asked += [{"type": "eq", **row(1)}, {"type": "ineq", **row(2)}]
    minimize: Any = optimize.minimize
    optimum = minimize(
        **row(0),
        x0=start,
        bounds=[bounds] * start.size,
        method="SLSQP",
        options={"maxiter": rounds, "ftol": _ENDS_AT},
        constraints=asked,
    )
    return np.asarray(optimum.x, dtype=np.float64), float(optimum.fun)


def deviations(late: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normalise the deviations of dots: arrival by `ARRIVAL`, excess of the force over 1 by `_FORCE`.

    `late` is the deviation of the arrival, s, not finite for a lost dot; `force` is relative to the requested
    force.
    """
    return np.where(np.isfinite(late), late / ARRIVAL, LOST), (force - 1.0) / _FORCE


def is_acceptable(missed: float, spare: float) -> bool:
    """Whether a dot is acceptable, from its normalised arrival deviation and excess force."""
    return abs(missed) < _MISSED and spare > -_SLACK


def best_of(
    badness: FloatArray,
    attempt: Callable[[int], tuple[float, FloatArray] | None],
    tries: int,
    most: int | None = None,
) -> FloatArray | None:
    """Run a multi-start search from the most promising starts; return the outcome of least cost, or None.

    Starts are ordered by `badness`, lowest first. `attempt` maps the index of a start to its cost and
    outcome, or to None if the search fails. The first `tries` starts are always run; if all fail, further
    starts, up to `most` (by default `tries`), are run until one succeeds.
    """
    best: tuple[float, FloatArray] | None = None
    for number, start in enumerate(np.argsort(badness, kind="stable")[: most or tries].tolist()):
        if number >= tries and best is not None:
            break
        outcome = attempt(start)
        if outcome is not None and (best is None or outcome[0] < best[0]):
            best = outcome
    return None if best is None else best[1]


def sobol(dimensions: int, count: int) -> FloatArray:
    """Return the first `count` points of an unscrambled Sobol sequence in [0, 1), one point per row."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(dimensions, scramble=False).random(count))


PRINTING_SHARES, LANDING_SHARES = 5, 4  # Number of parameters of a profile, each in [0, 1]; arbitrary
_SPREAD: Final = 512  # Number of profiles at Sobol points; arbitrary
_KEPT: Final = 16  # Number of profiles refined; arbitrary
_CLOUD: Final = 32  # Number of trial points of the local search (the cloud); arbitrary
_MOVES: Final = 8  # Number of steps of the local search; arbitrary
_REACH, _SHRINKS = 0.25, 0.7
"""Half-width of the first cloud, and factor by which each move reduces the half-width; arbitrary."""


def printing_profile(
    shares: FloatArray, largest: float, duration: float, arrival: float, nodes: int
) -> FloatArray:
    """Return the currents [A] of n profiles that brake, hold and throw the armature, shape (n, nodes).

    `shares`, shape (n, `PRINTING_SHARES`), in [0, 1], set three current levels and two switching times.
    `largest` is the current limit, A; the slot lasts `duration`, and its dot is due at `arrival`, both in s.
    """
    low, high = np.array([0.0, 0.0, 0.3]), np.array([1.0, 0.6, 1.0])
    released = 0.5 * arrival * shares[:, 3]
    thrown = released + shares[:, 4] * (arrival - released)
    levels = largest * (low + shares[:, :3] * (high - low))
    return _in_steps(levels, np.stack([released, thrown], axis=1), duration, nodes)


def landing_profile(shares: FloatArray, largest: float, duration: float, nodes: int) -> FloatArray:
    """Return the currents [A] of n profiles that brake the armature and lower it onto the backstop.

    The arguments are as for `printing_profile`, but `shares` has the shape (n, `LANDING_SHARES`) and sets two
    current levels and two switching times. The result has the shape (n, nodes - 1): the last node, where the
    current is zero, is omitted.
    """
    caught = 0.7 * duration * shares[:, 2]
    landed = caught + shares[:, 3] * (duration - caught)
    levels = largest * np.stack([1.1 * shares[:, 0] - 0.1, shares[:, 1], np.zeros(len(shares))], axis=1)
    return _in_steps(levels, np.stack([caught, landed], axis=1), duration, nodes)[:, :-1]


def refined(
    profile: Callable[[FloatArray], FloatArray],
    badness: Callable[[FloatArray], FloatArray],
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """Evaluate profiles at Sobol points and refine the best; return the currents and objectives of the best.

    `profile` maps points of the unit cube, shape (n, `count`), to currents [A], shape (n, nodes); `badness`
    maps the currents to the objectives, shape (n,).
    """
    places = sobol(count, _SPREAD)
    bad = badness(profile(places))
    kept = np.argsort(bad, kind="stable")[:_KEPT]
    places, bad = places[kept], bad[kept]
    cloud = 2.0 * sobol(count, _CLOUD) - 1.0
    rows = np.arange(_KEPT)
    for move in range(_MOVES):
        near = np.clip(places[:, np.newaxis] + _REACH * _SHRINKS**move * cloud, 0.0, 1.0)
        worth = badness(profile(near.reshape(-1, count))).reshape(_KEPT, _CLOUD)
        best = worth.argmin(axis=1)
        better = worth[rows, best] < bad
        places[better], bad[better] = near[rows, best][better], worth[rows, best][better]
    return profile(places), bad


def _in_steps(levels: FloatArray, edges: FloatArray, duration: float, nodes: int) -> FloatArray:
    """Average piecewise constant currents over the steps between nodes, shape (n, nodes).

    `levels` are the successive currents [A] of each profile, and `edges` the times [s] at which the current
    changes to the next level.
    """
    ends = np.pad(edges, ((0, 0), (1, 1)), constant_values=((0.0, 0.0), (0.0, duration)))
    times = node_times(duration, nodes)
    past = np.clip(times, ends[:, :-1, np.newaxis], ends[:, 1:, np.newaxis]) - ends[:, :-1, np.newaxis]
    return np.asarray(np.diff((levels[:, :, np.newaxis] * past).sum(axis=1), axis=1) / np.diff(times))


LEAD: Final = 2.0
"""Time from the start, at rest, to the first touch, in flight times of the single pulse; arbitrary."""
LANDING: Final = 5.0  # Length of the landing, in flight times of the single pulse; arbitrary
_FEWEST, _MOST = 8, 96  # Smallest and largest number of nodes per slot; arbitrary
# Fraction of a step by which a slot's current overlaps the next slot, whose current replaces it; arbitrary
_OVERLAP: Final = 0.01
_LAGS: Final = 1e-3  # Largest accepted lag in the pack (see `Outcomes`), in units of `RELOADING`; arbitrary
_WRONG: Final = 10.0
"""Penalty for an extra contact or a failed simulation, in units of the loading work; arbitrary."""
_WEAK: Final = 3.0  # Weight of a force shortfall in the comparison of profiles; arbitrary
_TRIES, _MOST_TRIES = 3, 12  # Number of starts, and maximum number while no start succeeds; arbitrary
_LEGS: Final = 2
"""Maximum number of consecutive SLSQP runs, each restarted from the previous result; arbitrary."""
_ROUNDS, _ROUNDS_AGAIN = 30, 20
"""SLSQP iteration limits for a start from a profile, and for a start from the preceding current;
arbitrary."""
_SEARCH_TOLERANCE: Final = 5e-7  # Integration tolerance of the comparison of profiles; arbitrary
_INSIDE: Final = 1.0 - 1e-9  # Factor on current and slope limits: rounding errors stay within the limits


class NodePlan:
    """Partial plan of a burst with piecewise-linear current: planned nodal currents and resulting state.

    Arguments are times [s]: the slot `period`, the time `past` between a pack contact and the end of its
    slot, the `spacing` of the nodes, and the `flight` time of the single pulse.
    """

    def __init__(self, task: Task, period: float, past: float, spacing: float, flight: float) -> None:
        self._task = task
        self._past = past
        self._nodes = min(max(round(period / spacing), _FEWEST), _MOST)
        self._step = period / self._nodes
        self._lead = max(self._nodes, math.ceil((LEAD * flight + past) / self._step))
        self._landing = max(_FEWEST, math.ceil(LANDING * flight / self._step))
        self._state = SlotState(rest_state(task.hammer), 0.0, -1, 0.0, 0.0)
        self._currents: list[FloatArray] = []
        self.touches: list[float] = []

    def add_dot(self) -> bool:
        """Plan the next dot of the burst; return False if no current that prints the dot was found."""
        nodes = self._nodes if self._currents else self._lead
        duration = nodes * self._step
        before = self._currents[-1] if len(self._currents) > 1 else None
        current = printing_current(self._task, self._state, duration, duration - self._past, nodes, before)
        if current is None:
            return False
        self._state = self._task.end(self._state, current, duration)
        self._currents.append(current)
        self.touches.append(sum(c.size for c in self._currents) * self._step - self._past)
        return True

    def land(self) -> None:
        """Plan the landing of the armature on the backstop."""
        current = landing_current(self._task, self._state, self._landing * self._step, self._landing)
        self._currents.append(current)

    def drive(self) -> PulseSequence:
        """Return the drive of the whole burst, fired slot by slot; the last firing includes the landing."""
        *slots, last, landing = self._currents
        waveforms, times, begin, node = [], [], 0.0, 0
        for current in (*slots, np.concatenate([last, landing])):
            # Each slot's current overlaps the next slot, whose current replaces it, so that rounding leaves
            # no gap.
            values = np.concatenate([[begin], current, current[-1:]])
            offsets = np.append(np.arange(current.size + 1), current.size + _OVERLAP) * self._step
            waveforms.append(Sampled.from_samples(offsets, values, interpolation="linear"))
            times.append(node * self._step)
            node += current.size
            begin = float(current[-1])
        return PulseSequence(waveforms, times, overlap="replace")


def printing_current(
    task: Task,
    begin: SlotState,
    duration: float,
    arrival: float,
    nodes: int,
    before: FloatArray | None = None,
) -> FloatArray | None:
    """Optimise the current of a slot: print the dot of the slot at least cost.

    The slot lasts `duration` [s] and starts from the state `begin`; the dot is due `arrival` [s] after its
    start. The current has `nodes` nodes, not counting the node at the start. The first search starts from
    `before`, the current of the preceding slot. Returns the currents at the nodes, A; None if no start leads
    to an acceptable dot.
    """

    def asked(outcomes: Outcomes) -> tuple[FloatArray, FloatArray]:
        return deviations(outcomes.arrival - arrival, outcomes.force / task.force)

    def measured(currents: FloatArray) -> FloatArray:
        outcomes = task.run(begin, currents, duration, task.tolerance)
        return np.stack([task.cost(outcomes, duration), *asked(outcomes)])

    def meets(currents: FloatArray) -> bool:
        outcomes = task.run(begin, currents[np.newaxis], duration, task.tolerance)
        missed, above = asked(outcomes)
        once = outcomes.ok[0] and outcomes.extra_contacts[0] == 0
        return bool(once and outcomes.reloading[0] < _LAGS * RELOADING and is_acceptable(missed[0], above[0]))

    def attempt(start: FloatArray, rounds: int = _ROUNDS) -> tuple[float, FloatArray] | None:
        currents = start
        for _leg in range(_LEGS):
            cost, currents = _descend(
                task, measured, begin.current, currents, duration, rounds, printing=True
            )
            if meets(currents):
                return cost, currents
        return None

    def badness(tried: FloatArray) -> FloatArray:
        outcomes = task.run(begin, tried, duration, _SEARCH_TOLERANCE)
        missed, above = asked(outcomes)
        odd = _WRONG * ((outcomes.extra_contacts > 0).astype(float) + ~outcomes.ok)
        weak = np.where(above < 0.0, _WEAK * np.abs(above), above)
        return np.asarray(task.cost(outcomes, duration) + np.abs(missed) + weak + odd)

    def profile(shares: FloatArray) -> FloatArray:
        wanted = printing_profile(shares, task.largest, duration, arrival, nodes)
        return _limited(task, wanted, begin.current, duration / nodes, to_zero=False)

    again = None if before is None else attempt(before, _ROUNDS_AGAIN)
    if again is not None:
        return again[1]
    tried, bad = refined(profile, badness, PRINTING_SHARES)
    return best_of(bad, lambda row: attempt(tried[row]), _TRIES, _MOST_TRIES)


def landing_current(task: Task, begin: SlotState, duration: float, nodes: int) -> FloatArray:
    """Optimise the current that lands the armature softly after the last dot of a burst.

    The landing lasts `duration` [s] and starts from the state `begin`. Returns the currents at the `nodes`
    nodes after the start, A; the last is zero.
    """

    def rated(currents: FloatArray, tolerance: float) -> FloatArray:
        outcomes = task.run(begin, np.pad(currents, ((0, 0), (0, 1))), duration, tolerance)
        odd = _WRONG * ((outcomes.force > 0.0).astype(float) + ~outcomes.ok)
        return np.asarray(task.cost(outcomes, duration) + odd)

    def measured(currents: FloatArray) -> FloatArray:
        return rated(currents, task.tolerance)[np.newaxis]

    def profile(shares: FloatArray) -> FloatArray:
        wanted = landing_profile(shares, task.largest, duration, nodes)
        return _limited(task, wanted, begin.current, duration / nodes, to_zero=True)

    tried, bad = refined(profile, lambda rows: rated(rows, _SEARCH_TOLERANCE), LANDING_SHARES)

    def attempt(row: int) -> tuple[float, FloatArray]:
        return _descend(task, measured, begin.current, tried[row], duration, _ROUNDS, printing=False)

    best = best_of(bad, attempt, _TRIES)
    assert best is not None
    return np.append(best, 0.0)


def _descend(
    task: Task,
    measured: Callable[[FloatArray], FloatArray],
    begin: float,
    start: FloatArray,
    duration: float,
    rounds: int,
    *,
    printing: bool,
) -> tuple[float, FloatArray]:
    """Minimise the cost by SLSQP within the limits on value and slope; return the cost and the currents, A.

    `measured` is as for `descend`, and `start` is the initial guess of the nodal currents; the current at the
    start of the slot is `begin`. For a landing (not `printing`), the current must be able to return to zero
    in one more step.
    """
    steps = start.size if printing else start.size + 1
    slope = (np.eye(steps) - np.eye(steps, k=-1))[:, : start.size]
    offset = np.zeros(steps)
    offset[0] = -begin
    reach = _INSIDE * task.slew * duration / steps
    both = np.concatenate([-slope, slope])
    room = reach + np.concatenate([-offset, offset])
    currents, cost = descend(
        measured,
        start,
        (-task.largest, task.largest),
        rounds,
        conditions=printing,
        linear=(room / task.largest, both / task.largest),
    )
    return cost, _within(task, currents, begin, reach, not printing)


def _within(task: Task, wanted: FloatArray, begin: float, reach: float, to_zero: bool) -> FloatArray:
    """Clip the nodal currents `wanted` [A] to the limits on value and slope.

    The current at the start is `begin` and changes by at most `reach` per step, both in A. With `to_zero`,
    the current must be able to reach zero one step after the last node.
    """
    result = np.empty(wanted.size)
    current = begin
    for node, value in enumerate(wanted.tolist()):
        room = reach * (wanted.size - node) if to_zero else np.inf
        current = float(np.clip(value, current - reach, current + reach))
        current = float(np.clip(current, -min(task.largest, room), min(task.largest, room)))
        result[node] = current
    return result


def _limited(task: Task, wanted: FloatArray, begin: float, step: float, *, to_zero: bool) -> FloatArray:
    reach = _INSIDE * task.slew * step
    return np.array([_within(task, row, begin, reach, to_zero) for row in wanted])
