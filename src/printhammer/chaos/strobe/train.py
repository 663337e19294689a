"""Pulse trains from an initial state to their last strobe point, run in parallel, and their classification.

The module also provides the state in which one train continues another, and runs of one period each for
trains without memory.

A motion that comes to rest on a rigid backstop forgets its past and repeats exactly. A ball on a shaken table
may bounce ever lower and lie still until the table launches it again, always at the same phase. The motion
that follows is the same each time: a superstable cycle, whose multipliers are 0. The cycle may be hundreds of
firings long; between two rests small errors grow as in a chaotic motion, so that rounding often decides the
length of a cycle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self

import numpy as np
import numpy.typing as npt

from printhammer.chaos.orbits.settled import Settled, settled
from printhammer.chaos.strobe.map import image_of
from printhammer.chaos.strobe.verdict import LARGEST_PERIOD, Verdict, period_of, repeats, verdict
from printhammer.derivatives.states import Exponent
from printhammer.drive.trains import Drive
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, part
from printhammer.run.effort import Effort
from printhammer.run.ensemble import Ensemble
from printhammer.run.regime import Regime, window_of
from printhammer.run.start import AT_REST, HELD_BRANCHES, state_to_begin
from printhammer.run.supply import current_scale
from printhammer.support.arrays import FloatArray, IntArray


def exact_cycle(states: FloatArray) -> int:
    """Return the period of a series of states, shape (n, k), that repeats exactly; 0 without a period.

    The series must contain the period at least twice.
    """
    ended = np.flatnonzero((states[:-1] == states[-1]).all(axis=1))
    for count in (len(states) - 1 - int(place) for place in ended[::-1]):
        if count <= len(states) // 2 and np.array_equal(states[count:], states[:-count]):
            return count
    return 0


def rests_of(regime: Regime, states: FloatArray, tolerance: float) -> int:
    """Count the states (m, m/s) from which the armature comes to rest before the next firing.

    After a rest, the derivative of the next state with respect to the present state is 0.
    """
    at_firings = regime.at_firings
    images = (image_of(at_firings, state, 1, tolerance, contacts=False) for state in states)
    return sum(image.ok and not image.jacobian.any() for image in images)


State = tuple[float, ...]
"""State at a firing: displacement [m], velocity [m/s], and the fields of `printhammer.run.start.Beyond`."""

NO_CURRENT: Final = AT_REST[2:]
"""Electric components of a state without current."""

FROM_REST: Final[State] = (math.nan, math.nan, *AT_REST)
"""Placeholder for the state of a train that starts from rest, without earlier firings."""

LONG_CYCLE: Final = 5
"""Shortest cycle, in firings, that is tested for rests on the backstop; arbitrary."""

STRETCH: Final = 1
"""Number of firings per run, for trains that are run segment by segment.

The rounding error of the time, and hence of the phase of a force, is proportional to the time; an armature
that comes to rest on a rigid backstop and leaves it again amplifies the error by 1e8. Runs of one period each
have the same rounding, so that a motion that forgets its past repeats exactly.
"""


def pack_branches(x: FloatArray, branch: npt.NDArray[np.integer[Any]], front: float | FloatArray) -> IntArray:
    """Determine the branch of the pack's force law on which each state lies; 0 outside the pack.

    `x` are the displacements [m], `branch` the modes of motion, and `front` the front of the pack [m].
    """
    branches = np.where(x > front, branch, 0).astype(np.int64)
    for held, part_of in HELD_BRANCHES.items():
        branches[branches == held] = part_of
    return branches


def handed_on(
    hammer: Hammer, x: float, v: float, mode: int, memory: float, electric: Sequence[float] = NO_CURRENT
) -> State:
    """Return the state from which the next train starts: the given final state, or `FROM_REST` if invalid."""
    begun = state_to_begin(hammer, x, v, mode, memory)
    return FROM_REST if begun is None else (*begun, *electric)


def is_memoryless(regime: Regime) -> bool:
    """Whether (x, v) at a firing determines the motion that follows, for every firing phase.

    True under a continuous periodic force, with a rigid backstop and no pack.
    """
    backstop = regime.hammer.backstop
    rigid = backstop is not None and backstop.law == "rigid"
    return regime.drive is not None and regime.hammer.pack is None and rigid


_BEFORE: Final = 100
"""Number of firings discarded before the exponent of a continued train is averaged; arbitrary."""


class Train(Declared):
    """Pulse train: a regime that starts from an initial state, without earlier firings."""

    regime: Regime = part("hammer and periodic drive")
    drive: Drive = part("a sequence of pulses, or a continuous periodic force")
    state: tuple[float, ...] | None = part(
        "displacement, m, velocity, m/s, and further components of the state at time 0, as for"
        " `printhammer.simulate`",
        more="None for the rest state",
        default=None,
    )

    @classmethod
    def of(cls, regime: Regime, firings: int, state: tuple[float, ...] | None = None) -> Self:
        """Build a train of `firings` + 1 pulses, to compute its states at the first `firings` firings.

        The last pulse is fired so that no state depends on the end of the run.
        """
        return cls(regime, regime.pulses(firings + 1), state)

    @property
    def hammer(self) -> Hammer:
        """Hammer of the train."""
        return self.regime.hammer

    @property
    def period(self) -> float:
        """Time between firings, s."""
        return self.regime.period

    def times(self, firings: IntArray) -> FloatArray:
        """Return the times [s] of the firings with given numbers; the first firing is number 1."""
        if len(self.drive.times) > 1:
            return np.asarray(self.drive.times[firings - 1], dtype=np.float64)
        return np.asarray(self.drive.times[0] + self.period * (firings - 1.0), dtype=np.float64)


@dataclass(frozen=True)
class States:
    """States of one train at selected firings; fields as in `printhammer.chaos.strobe.points.Strobe`."""

    t: FloatArray
    x: FloatArray
    v: FloatArray
    branch: IntArray
    memory: FloatArray
    status: str
    current: FloatArray | None = None

    def distances(self, train: Train) -> FloatArray:
        """Compute, for each q, the largest distance of states q firings apart; see `verdict.repeats`."""
        front = math.inf if train.hammer.front is None else train.hammer.front
        return repeats(self.points, pack_branches(self.x, self.branch, front), _scales(train))

    @property
    def points(self) -> FloatArray:
        """Table of states, one row per firing: displacement, velocity, memory and, with a driver, current."""
        current = [] if self.current is None else [self.current]
        return np.column_stack([self.x, self.v, self.memory, *current])

    def scaled(self, train: Train) -> FloatArray:
        """Return `points`, divided by the half-widths of the strobe window and by a typical current."""
        return np.asarray(self.points / _scales(train))

    def settled(self, train: Train, distances: FloatArray) -> Settled | None:
        """Find the orbit to which the train has settled; None if its states do not repeat."""
        period = period_of(distances)
        if period is None:
            return None
        return settled(train.regime.at_firings, self.points, period, _scales(train))

    def resting(self, train: Train, distances: FloatArray, tolerance: float) -> tuple[int, int] | None:
        """Return the cycle length [firings] and the number of rests of a motion that rests on the backstop.

        None if the motion does not come to rest. The cycle length is 0 if the motion does not repeat; then at
        least two rests are required. For cycles shorter than `LONG_CYCLE` firings the result is None, since
        rounding does not change their length.
        """
        if not is_memoryless(train.regime):
            return None
        count = period_of(distances) or exact_cycle(self.points)
        if 0 < count < LONG_CYCLE:
            return None
        rests = rests_of(train.regime, self.points[-count:, :2], tolerance)
        return (count, rests) if rests > (count == 0) else None


def _scales(train: Train) -> FloatArray:
    width, speed = window_of(train.hammer, train.drive).half_widths
    current = [current_scale(train.hammer, train.drive)] if train.regime.fired.quantity == "voltage" else []
    return np.array([width, speed, width, *current])


def run_trains(
    trains: Sequence[Train],
    chosen: IntArray,
    judged: tuple[int, int] | None,
    effort: Effort,
    *,
    every_exponent: bool = False,
) -> tuple[list[States], list[Verdict | None]]:
    """Compute the states of trains at chosen firings, at the phases of their regimes; classify the trains.

    A classification is based on the firings from the first to the last of `judged`. If `judged` is None, no
    train is classified. Exponents of periodic trains are computed only with `every_exponent`. Returns the
    states and the classification of each train.
    """
    if not trains:
        return [], []
    total = len(trains)
    firings = np.arange(judged[0], judged[1] + 1) if judged is not None else np.zeros(0, np.int64)
    own = [train.times(chosen) + train.regime.phase * train.period for train in trains]
    theirs = [train.times(firings) for train in trains]
    every = [np.union1d(mine, other) for mine, other in zip(own, theirs, strict=True)]
    after = np.array([max(int(chosen.max(initial=1)), int(firings.max(initial=1))) + 1])
    ends = [float(train.times(after)[0]) for train in trains]
    runs = effort.within(0, total if judged is None else 2 * total)
    current: FloatArray | None = None
    if all(is_memoryless(train.regime) for train in trains):
        x, v, branch, memory, names, reached = _in_stretches(trains, every, runs)
    else:
        result = _ensemble(trains, ends, runs.tolerance).run(strobes=every, **runs.running)
        table, names, reached = result.strobes, result.status_names, result.reached
        assert table is not None
        x, v, branch, memory, current = table.x, table.v, table.branch, table.memory, table.current

    def at(i: int, times: FloatArray) -> States:
        rows = np.searchsorted(every[i], times)
        own_x, own_v, own_branch, own_memory = (part[i, rows].copy() for part in (x, v, branch, memory))
        own_current = None
        if current is not None and trains[i].regime.fired.quantity == "voltage":
            own_current = current[i, rows].copy()
        return States(times, own_x, own_v, own_branch, own_memory, names[i], own_current)

    states = [at(i, times) for i, times in enumerate(own)]
    if judged is None:
        return states, [None] * total
    stopped = [names[i] if reached[i] < theirs[i][-1] else "" for i in range(total)]
    watched = [at(i, times) for i, times in enumerate(theirs)]
    distances = [of_train.distances(train) for of_train, train in zip(watched, trains, strict=True)]
    ends_at = effort.quiet.mapped(
        lambda i: None if stopped[i] else watched[i].settled(trains[i], distances[i]), range(total)
    )
    resting = effort.quiet.mapped(
        lambda i: None if stopped[i] else watched[i].resting(trains[i], distances[i], effort.tolerance),
        range(total),
    )
    open_cases = [
        i
        for i in range(total)
        if not stopped[i] and resting[i] is None and (every_exponent or period_of(distances[i]) is None)
    ]
    onward = effort.within(2 * total - len(open_cases), 2 * total)
    exponents = exponents_of([trains[i] for i in open_cases], judged, onward)
    growth = dict(zip(open_cases, exponents, strict=True))
    verdicts = [
        verdict(distances[i], judged, effort.tolerance, growth.get(i), stopped[i], ends_at[i], resting[i])
        for i in range(total)
    ]
    long = [i for i, each in enumerate(verdicts) if each.period is not None and each.rests]
    for i, elsewhere in zip(long, _at_finer([trains[i] for i in long], judged, effort), strict=True):
        verdicts[i] = replace(verdicts[i], elsewhere=elsewhere)
    return states, list(verdicts)


FINER: Final = (0.1, 0.01)
"""Factors on the tolerance for recomputed periods of motions that rest on the backstop; arbitrary."""


def _at_finer(
    trains: Sequence[Train], judged: tuple[int, int], effort: Effort
) -> list[tuple[tuple[float, str], ...]]:
    """Recompute the periods of trains at a tenth and a hundredth of the tolerance.

    Returns, for each train, pairs of the tolerance and the period as text. Between two rests small errors
    grow; if they reach the size of the motion, rounding decides its period.
    """
    firings = np.arange(judged[0], judged[1] + 1)
    rows: list[tuple[tuple[float, str], ...]] = [() for _ in trains]
    for share in FINER:
        finer = effort.at(share * effort.tolerance)
        states, _ = run_trains(
            [replace(train, regime=train.regime.at_firings) for train in trains], firings, None, finer
        )
        for i, own in enumerate(states):
            period = period_of(own.distances(trains[i]))
            name = f"no period up to {LARGEST_PERIOD}" if period is None else f"period-{period}"
            rows[i] = (*rows[i], (finer.tolerance, name))
    return rows


def _ensemble(
    trains: Sequence[Train], ends: Sequence[float], tolerance: float, states: FloatArray | None = None
) -> Ensemble:
    """Build the ensemble that runs trains to the times `ends` [s]; `states` replace their initial states."""
    begun = [train.state for train in trains if train.state is not None]
    own = np.array(begun) if len(begun) == len(trains) else None
    return Ensemble(
        [train.hammer for train in trains],
        [train.drive for train in trains],
        ends,
        states=own if states is None else states,
        tolerance=tolerance,
    )


def _in_stretches(
    trains: Sequence[Train], every: Sequence[FloatArray], effort: Effort
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray, list[str], FloatArray]:
    """Compute the states of trains at given times [s], by successive runs of one period each.

    In a run of one period the time and its rounding error stay small. Returns, in this order: displacements
    [m], velocities [m/s], modes and memories [m], each with one row per train; the status of each train; and
    the time reached by each train [s].
    """
    shape = len(trains), max(len(times) for times in every)
    x, v, memory = (np.full(shape, np.nan) for _ in range(3))
    branch = np.full(shape, -1, np.int64)
    names, reached = ["ok"] * len(trains), np.array([times[-1] for times in every])
    turns = [
        np.floor((times - train.drive.times[0]) / train.period + 1e-9).astype(np.int64)
        for times, train in zip(every, trains, strict=True)
    ]
    last = max(int(turn[-1]) for turn in turns)
    left = list(range(len(trains)))
    states: FloatArray | None = None
    for begin in range(0, last + 1, STRETCH):
        columns = [np.flatnonzero((turns[i] >= begin) & (turns[i] < begin + STRETCH)) for i in left]
        ends = [float(trains[i].drive.times[0]) + STRETCH * trains[i].period for i in left]
        strobes = [
            np.append(np.clip(every[i][some] - begin * trains[i].period, 0.0, end), end)
            for i, some, end in zip(left, columns, ends, strict=True)
        ]
        result = _ensemble([trains[i] for i in left], ends, effort.tolerance, states).run(
            strobes=strobes, threads=effort.threads
        )
        table = result.strobes
        assert table is not None
        onward = []
        for row, (i, some) in enumerate(zip(left, columns, strict=True)):
            for all_of, own in ((x, table.x), (v, table.v), (branch, table.branch), (memory, table.memory)):
                all_of[i, some] = own[row, : len(some)]
            end = len(some)
            ended = result.status_names[row] != "ok"
            last_x, last_v = float(table.x[row, end]), float(table.v[row, end])
            onward.append(FROM_REST if ended else handed_on(trains[i].hammer, last_x, last_v, -1, 0.0))
            if onward[-1] is FROM_REST:
                names[i] = result.status_names[row]
                reached[i] = begin * trains[i].period + result.reached[row]
        going = [row for row, state in enumerate(onward) if state is not FROM_REST]
        left, states = [left[row] for row in going], np.array([onward[row][:2] for row in going])
        effort.report(min(len(trains) * (begin + STRETCH) // (last + 1), len(trains)), len(trains))
        if not left:
            break
    return x, v, branch, memory, names, reached


def exponents_onward(
    begun: Sequence[tuple[Regime, tuple[float, ...]]], points: int, effort: Effort
) -> list[Exponent]:
    """Compute the largest Lyapunov exponents of trains that continue from a state at a firing.

    `begun` contains the regime and the state of each train. The exponents are averaged over `points` firings,
    after a hundred discarded firings.
    """
    window = _BEFORE + 1, _BEFORE + points
    # The tails of earlier pulses are omitted: they are the same for all neighbouring motions.
    trains = [Train(regime, regime.pulses(window[1] + 2), state) for regime, state in begun]
    return exponents_of(trains, window, effort)


def exponents_of(trains: Sequence[Train], firings: tuple[int, int], effort: Effort) -> list[Exponent]:
    """Compute the Lyapunov exponents of trains, averaged from the first to the last of `firings`."""
    from printhammer.derivatives.states import strobe_exponent

    return effort.mapped(
        lambda train: strobe_exponent(
            train.hammer,
            train.drive,
            train.period,
            first=firings[0],
            last=firings[1],
            state=train.state,
            tolerance=effort.tolerance,
        ),
        trains,
    )
