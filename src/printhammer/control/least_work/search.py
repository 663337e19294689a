"""The current of one slot whose dot costs least work, and the current that lands the armature softly.

Sequential quadratic programming (SLSQP: D. Kraft, DFVLR-FB 88-28 (1988)) over the currents at the nodes. Each
step of it takes its derivatives from differences, all runs of which are one ensemble. It starts from the best
of a few hundred simple profiles (brake, wait, throw), or from what did for the slot before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.least_work.slot import outcomes, slot_end

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.control.least_work.coil_force import CoilForce
    from printhammer.control.least_work.slot import Outcomes, SlotState
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_DIFFERENCE: Final = 1e-5
_ARRIVAL: Final = 20e-6
_FORCE: Final = 0.05
_RELOADING: Final = 1e-6
_LAGS: Final = 1e-3
_SLACK: Final = 8e-3
_LOST: Final = 25.0
_WRONG: Final = 10.0
_PROFILES: Final = 512
_TRIES: Final = 3
_MOST_TRIES: Final = 12
_ROUNDS: Final = 30
_ROUNDS_AGAIN: Final = 20
_ENDS_AT: Final = 1e-5
_SMOOTHING: Final = 1e-3
_SEARCH_TOLERANCE: Final = 5e-7


@dataclass(frozen=True)
class Task:
    """What the slots of a burst have in common.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    coil : CoilForce
        Force of its coil.
    largest : float
        Largest current of either sign, A.
    slew : float
        Largest slope of the current of either sign, A/s.
    force : float
        Least force of a dot, N.
    loading : float
        Loading work of such a dot, J, by which work is measured.
    heat : bool
        Whether the squared current is to be least instead of the positive work.
    tolerance : float
        As for `printhammer.simulate`.
    """

    hammer: Hammer
    coil: CoilForce
    largest: float
    slew: float
    force: float
    loading: float
    heat: bool
    tolerance: float

    def run(self, begin: SlotState, currents: FloatArray, duration: float, tolerance: float) -> Outcomes:
        """Run a slot with many currents."""
        return outcomes(self.hammer, self.coil, begin, currents, duration, tolerance, self.largest)

    def end(self, begin: SlotState, currents: FloatArray, duration: float) -> SlotState:
        """Return how the slot after one begins."""
        return slot_end(self.hammer, begin, currents, duration, self.tolerance, self.largest)

    def cost(self, found: Outcomes, duration: float) -> FloatArray:
        """Return what is to be least, in parts of the loading work.

        The net work counts as well, since it grows with what the backstop takes. Lagging in the pack is dear:
        where the armature went into it again, the law as printed would jump to the loading branch, and the
        pack give back more than it does once unloaded.
        """
        heat = found.squared_current / (self.largest**2 * duration)
        spent = heat if self.heat else found.positive / self.loading + _SMOOTHING * heat
        return np.asarray(spent + found.net / self.loading + found.reloading / _RELOADING)


def printing_current(
    task: Task,
    begin: SlotState,
    duration: float,
    arrival: float,
    nodes: int,
    before: FloatArray | None = None,
) -> FloatArray | None:
    """Find the current of a slot with which its dot costs least.

    Parameters
    ----------
    task : Task
        What is asked.
    begin : SlotState
        How the slot begins.
    duration, arrival : float
        Of the slot, and from its beginning to the touch, s.
    nodes : int
        Number of nodes after the first one.
    before : array, optional
        What did for the slot before.

    Returns
    -------
    array, shape (nodes,), or None
        Currents at the nodes, A; None where none was found.
    """

    def asked(found: Outcomes) -> tuple[FloatArray, FloatArray]:
        missed = np.where(np.isnan(found.arrival), _LOST, (found.arrival - arrival) / _ARRIVAL)
        return missed, (found.force / task.force - 1.0) / _FORCE

    def measured(currents: FloatArray) -> FloatArray:
        found = task.run(begin, currents, duration, task.tolerance)
        return np.stack([task.cost(found, duration), *asked(found)])

    def meets(currents: FloatArray) -> bool:
        found = task.run(begin, currents[np.newaxis], duration, task.tolerance)
        missed, above = asked(found)
        clean = found.ok[0] and found.extra_contacts[0] == 0 and found.reloading[0] < _LAGS * _RELOADING
        return bool(clean and abs(missed[0]) < 0.05 and above[0] > -_SLACK)

    if before is not None:
        currents, cost = _descend(task, measured, begin.current, before, duration, _ROUNDS_AGAIN, 2)
        if meets(currents):
            return currents
    tried = _profiles(task, begin.current, duration, arrival, nodes)
    found = task.run(begin, tried, duration, _SEARCH_TOLERANCE)
    missed, above = asked(found)
    odd = _WRONG * ((found.extra_contacts > 0).astype(float) + ~found.ok)
    badness = task.cost(found, duration) + np.abs(missed) + np.abs(above) + odd
    best: tuple[float, FloatArray] | None = None
    for number, row in enumerate(np.argsort(badness, kind="stable")[:_MOST_TRIES]):
        if number >= _TRIES and best is not None:
            break
        currents, cost = _descend(task, measured, begin.current, tried[row], duration, _ROUNDS, 2)
        if meets(currents) and (best is None or cost < best[0]):
            best = cost, currents
    return None if best is None else best[1]


def landing_current(task: Task, begin: SlotState, duration: float, nodes: int) -> FloatArray:
    """Find the current after the last dot with which the backstop takes least; it ends at zero.

    Parameters
    ----------
    task, begin, duration, nodes
        As for `printing_current`.

    Returns
    -------
    array, shape (nodes,)
        Currents at the nodes, A, the last one 0.
    """

    def whole(currents: FloatArray) -> FloatArray:
        return np.concatenate([currents, np.zeros((len(currents), 1))], axis=1)

    def rated(currents: FloatArray, tolerance: float) -> FloatArray:
        found = task.run(begin, whole(currents), duration, tolerance)
        odd = _WRONG * ((found.force > 0.0).astype(float) + ~found.ok)
        return np.asarray(task.cost(found, duration) + odd)

    def measured(currents: FloatArray) -> FloatArray:
        return rated(currents, task.tolerance)[np.newaxis]

    tried = _landings(task, begin.current, duration, nodes)
    order = np.argsort(rated(tried, _SEARCH_TOLERANCE), kind="stable")
    best: tuple[float, FloatArray] | None = None
    for row in order[:_TRIES]:
        currents, cost = _descend(task, measured, begin.current, tried[row], duration, _ROUNDS, 0)
        if best is None or cost < best[0]:
            best = cost, currents
    assert best is not None
    return np.append(best[1], 0.0)


def _descend(
    task: Task,
    measured: Callable[[FloatArray], FloatArray],
    begin: float,
    start: FloatArray,
    duration: float,
    rounds: int,
    conditions: int,
) -> tuple[FloatArray, float]:
    """Minimise the first row that `measured` returns; of two more the first is 0, the second not negative.

    `start` may lack a last node, at which the current is 0 then.
    """
    from scipy import optimize

    free = start.size
    known: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def values(currents: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = currents.tobytes()
        if key not in known:
            known.clear()
            rows = np.concatenate([currents[np.newaxis], currents + _DIFFERENCE * np.eye(free)])
            found = np.nan_to_num(measured(rows), nan=_LOST)
            known[key] = found[:, 0], (found[:, 1:] - found[:, :1]) / _DIFFERENCE
        return known[key]

    # Of zero conditions on the dot, the current has to come back to zero in one more step.
    steps = free if conditions else free + 1
    slope = (np.eye(steps) - np.eye(steps, k=-1))[:, :free]
    offset = np.zeros(steps)
    offset[0] = -begin
    # A hair inside the bound, which rounding would exceed.
    reach = (1.0 - 1e-9) * task.slew * duration / (start.size if conditions else steps)
    both = np.concatenate([-slope, slope])
    room = reach + np.concatenate([-offset, offset])
    steepness = both / task.largest
    conditions_on_current: list[dict[str, Any]] = [
        {"type": "ineq", "fun": lambda y: room / task.largest + steepness @ y, "jac": lambda _y: steepness}
    ]
    if conditions:
        conditions_on_current += [
            {"type": "eq", "fun": lambda y: values(y)[0][1], "jac": lambda y: values(y)[1][1]},
            {"type": "ineq", "fun": lambda y: values(y)[0][2], "jac": lambda y: values(y)[1][2]},
        ]
    minimize: Any = optimize.minimize
    options = {"maxiter": rounds, "ftol": _ENDS_AT}
    found = minimize(
        lambda y: values(y)[0][0],
        start,
        jac=lambda y: values(y)[1][0],
        bounds=[(-task.largest, task.largest)] * free,
        method="SLSQP",
        options=options,
        constraints=conditions_on_current,
    )
    return _within(task, np.asarray(found.x), begin, reach, conditions == 0), float(found.fun)


def _within(task: Task, wanted: FloatArray, begin: float, reach: float, to_zero: bool) -> FloatArray:
    """Return currents that keep the bounds on value and slope to the last bit."""
    result = np.empty(wanted.size)
    current = begin
    for node, value in enumerate(wanted.tolist()):
        room = reach * (wanted.size - node) if to_zero else np.inf
        current = float(np.clip(value, current - reach, current + reach))
        current = float(np.clip(current, -min(task.largest, room), min(task.largest, room)))
        result[node] = current
    return result


def _profiles(task: Task, begin: float, duration: float, arrival: float, nodes: int) -> FloatArray:
    """Return currents that brake, wait and throw, at levels and times evenly spread, within the bounds."""
    share = _spread(5, _PROFILES)
    levels = task.largest * np.stack([share[:, 0], 0.6 * share[:, 1], 0.3 + 0.7 * share[:, 2]], axis=1)
    released = 0.5 * arrival * share[:, 3]
    thrown = released + share[:, 4] * (arrival - released)
    times = np.linspace(0.0, duration, nodes + 1)[1:]
    wanted = np.where(
        times < released[:, np.newaxis],
        levels[:, :1],
        np.where(times < thrown[:, np.newaxis], levels[:, 1:2], levels[:, 2:]),
    )
    return _limited(task, wanted, begin, duration / nodes, to_zero=False)


def _landings(task: Task, begin: float, duration: float, nodes: int) -> FloatArray:
    """Return currents that hold the armature back on its way, then a little before the backstop."""
    share = _spread(4, _PROFILES)
    first, second = task.largest * (1.1 * share[:, 0] - 0.1), task.largest * share[:, 1]
    caught = 0.7 * duration * share[:, 2]
    landed = caught + share[:, 3] * (duration - caught)
    times = np.linspace(0.0, duration, nodes + 1)[1:-1]
    wanted = np.where(
        times < caught[:, np.newaxis],
        first[:, np.newaxis],
        np.where(times < landed[:, np.newaxis], second[:, np.newaxis], 0.0),
    )
    return _limited(task, wanted, begin, duration / nodes, to_zero=True)


def _limited(task: Task, wanted: FloatArray, begin: float, step: float, *, to_zero: bool) -> FloatArray:
    reach = (1.0 - 1e-9) * task.slew * step
    return np.array([_within(task, row, begin, reach, to_zero) for row in wanted])


def _spread(dimensions: int, count: int) -> FloatArray:
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(dimensions, scramble=False).random(count))
