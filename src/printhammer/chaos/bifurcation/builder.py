"""Construction of a bifurcation diagram: trains on a parameter grid, refinement, Lyapunov exponents.

The final state at one value of the parameter is the initial state at the next value.

Strictly, each train begins where the preceding train ended, which is a serial computation. Here the values
are divided into strands of `STRAND` successive values. The first train of a strand begins at rest, states are
passed on within the strand, and all strands run in parallel. Then successive strands are joined: the first
train of a strand is run again from the final state of the preceding strand. If the train reaches the same
attractor as before, the rest of the strand is kept. Otherwise the new train replaces the old train, and its
final state is passed on through the strand until a train reaches the same attractor as before. If no train of
the strand does, the next strand is joined in the same way.

So every train lies on the attractor to which a strictly serial computation leads, up to the resolution of
`is_same_attractor`. The strands, and hence the result, depend on the values alone, not on threads or chunks.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from printhammer.chaos.bifurcation.columns import (
    OK,
    Columns,
    blank_columns,
    confirm,
    cycles_of,
    orbit_distance,
    put,
    run_columns,
    run_in_stretches,
    scales_of_columns,
    state_or_rest,
)
from printhammer.chaos.strobe.train import (
    FINER,
    LONG_CYCLE,
    State,
    exact_cycle,
    exponents_onward,
    is_memoryless,
    rests_of,
)
from printhammer.run.effort import Effort
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

STRAND: Final = 16
"""Number of successive parameter values in a strand; strands are computed in parallel. Arbitrary."""

SAME: Final = 1e-3  # Arbitrary
"""Largest distance of two periodic orbits on the same attractor, in half-widths of the strobe window."""

_SHIFTED: Final = 0.5
"""Largest difference of the means of two point sets on one attractor, in standard deviations; arbitrary."""


@dataclass
class Strand:
    """Strand of a diagram: successive trains, each starting in the final state of its predecessor."""

    rows: list[int]
    """Row indices in the table of all trains; each train starts in the final state of the preceding row."""
    before: int
    """Index of the preceding strand, whose last train this strand continues; -1 for the first strand."""


@dataclass
class Trains:
    """Table of all trains of a diagram: their regimes and the results of their runs."""

    regimes: list[Regime]
    """Regime of each train, in row order."""
    columns: Columns
    """States of the trains at the recorded firings."""
    cycles: Any
    """Period of each train in firings, 0 if aperiodic; shape (M,)."""
    distances: Any
    scales: FloatArray
    """Scales of displacement, velocity, pack memory and current of each train, shape (M, 4)."""
    carried: int = field(default=0)
    """Number of trains that were run again so that successive strands join."""


def strands_of(rows: Sequence[int], first: int) -> list[Strand]:
    """Divide the table rows of successive trains into strands of `STRAND` trains.

    `first` is the index of the first strand in the list of all strands.
    """
    cut = [list(rows[k : k + STRAND]) for k in range(0, len(rows), STRAND)]
    return [Strand(part, first + k - 1 if k else -1) for k, part in enumerate(cut)]


def carry(
    table: Trains,
    strands: Sequence[Strand],
    start: State,
    run: Callable[[list[int], FloatArray], None],
    trial: Callable[[list[int], FloatArray], tuple[Columns, Any, Any]],
) -> None:
    """Run all strands in parallel; then rerun trains until every strand continues its predecessor.

    `start` is the initial state of the first train of each strand. `run` runs the trains of given table rows
    from given initial states and stores the results in the table. `trial` runs them, too, but returns the
    results: columns, periods, and distances between states a period apart.
    """
    for k in range(max(len(strand.rows) for strand in strands)):
        long = [strand.rows for strand in strands if k < len(strand.rows)]
        begun = [
            state_or_rest(table.regimes[rows[k]], table.columns.handed(rows[k - 1]) if k else start)
            for rows in long
        ]
        run([rows[k] for rows in long], np.array(begun))
    open_ = {(number, 0) for number, strand in enumerate(strands) if strand.before >= 0}
    while open_:
        # Run one more train of each strand that does not yet join its predecessor, all strands in parallel.
        order = sorted(open_)
        rows = [strands[number].rows[place] for number, place in order]
        ended = [
            strands[number].rows[place - 1] if place else strands[strands[number].before].rows[-1]
            for number, place in order
        ]
        states = [
            state_or_rest(table.regimes[row], table.columns.handed(before))
            for before, row in zip(ended, rows, strict=True)
        ]
        columns, cycles, distances = trial(rows, np.array(states))
        table.carried += len(rows)
        open_ = set()
        for i, ((number, place), row) in enumerate(zip(order, rows, strict=True)):
            if is_same_attractor(table, row, columns, i, int(cycles[i])):
                continue
            put(table.columns, [row], Columns(*(values[[i]] for values in vars(columns).values())))
            table.cycles[row], table.distances[row] = cycles[i], distances[i]
            if place + 1 < len(strands[number].rows):
                open_.add((number, place + 1))
            else:
                open_ |= {(n, 0) for n, other in enumerate(strands) if other.before == number}


def is_same_attractor(table: Trains, row: int, columns: Columns, place: int, cycle: int) -> bool:
    """Whether a train that was run again reached the same attractor as its first run.

    The first run is `row` of the table, the second run is row `place` of `columns`, with the period `cycle`.
    Two periodic trains are on the same attractor if their orbits agree within `SAME`, two aperiodic trains if
    the means of their points differ by at most half of their standard deviations, and two trains whose runs
    ended early if their statuses are equal.
    """
    was = table.columns
    if columns.status[place] != OK or was.status[row] != OK:
        return bool(columns.status[place] == was.status[row])
    if cycle != table.cycles[row]:
        return False
    one, other = (
        np.column_stack([states.x[at], states.v[at]]) / table.scales[row, :2]
        for states, at in ((columns, place), (was, row))
    )
    if cycle:
        return orbit_distance(one[-cycle:], other[-cycle:]) <= SAME
    spread = np.maximum(one.std(axis=0), other.std(axis=0))
    return bool((np.abs(one.mean(axis=0) - other.mean(axis=0)) <= _SHIFTED * spread).all())


JUMP: Final = 0.2  # Arbitrary
"""Distance between neighbouring orbits, in half-widths of the strobe window, that requires a finer step."""


@dataclass
class DiagramBuilder:
    """Builder of a bifurcation diagram; one table row per parameter value and direction."""

    regime: Regime
    name: str
    ways: tuple[str, ...]
    counts: tuple[int, int]
    begin: State
    effort: Effort

    def __post_init__(self) -> None:
        self.points = self.counts[0] - self.counts[1]
        whole, none = np.zeros(0, np.int64), np.zeros(0)
        self.values, self.levels, self.exponents, self.errors = none, whole, none, none
        self.table = Trains([], blank_columns(0, self.points), whole, none, np.zeros((0, 4)))
        self.sensitive = np.zeros(0, np.bool_)
        self.done = self.known = 0

    def add(self, values: FloatArray, level: int) -> list[int]:
        """Add table rows for trains at new parameter values; return the indices of the new values.

        `level` is the refinement level of the values: 0 for given values, k for the k-th refinement.
        """
        first = len(self.values)
        regimes = [self.regime.with_(self.name, value) for value in values.tolist()]
        every = [regime for regime in regimes for _way in self.ways]
        table = self.table
        longer = blank_columns(len(table.regimes) + len(every), self.points)
        put(longer, np.arange(len(table.regimes)), table.columns)
        scales = np.repeat(scales_of_columns(regimes), len(self.ways), axis=0)
        nothing = np.full(len(every), np.nan)
        table.regimes += every
        table.columns = longer
        table.cycles = np.append(table.cycles, np.zeros(len(every), np.int64))
        table.distances = np.append(table.distances, nothing)
        table.scales = np.concatenate([table.scales, scales])
        self.exponents, self.errors = np.append(self.exponents, nothing), np.append(self.errors, nothing)
        self.sensitive = np.append(self.sensitive, np.zeros(len(every), np.bool_))
        self.values = np.append(self.values, values)
        self.levels = np.append(self.levels, np.full(len(values), level))
        self.known += len(every)
        return list(range(first, len(self.values)))

    def rows(self, places: Sequence[int], way: int) -> list[int]:
        """Return the table rows of trains in direction `way`, from the indices of their parameter values."""
        return [len(self.ways) * place + way for place in places]

    def base(self, grid: FloatArray) -> None:
        """Add and run the trains at the parameter values of `grid`, in all directions."""
        places = self.add(grid, 0)
        if self.ways == ("from rest",):
            self.run(places, np.array([state_or_rest(self.table.regimes[row], self.begin) for row in places]))
            return
        strands: list[Strand] = []
        for way, name in enumerate(self.ways):
            order = places if name == "up" else places[::-1]
            strands += strands_of(self.rows(order, way), len(strands))
        carry(self.table, strands, self.begin, self.run, self.trial)

    def refine(self, level: int) -> None:
        """Add and run trains midway between neighbouring parameter values whose trains differ.

        `level` is the number of this refinement, counted from 1.
        """
        order = np.argsort(self.values, kind="stable").tolist()
        pairs = [pair for pair in itertools.pairwise(order) if self.is_different(*pair)]
        middles = [0.5 * (self.values[low] + self.values[high]) for low, high in pairs]
        new = [
            (pair, middle)
            for pair, middle in zip(pairs, middles, strict=True)
            if self.values[pair[0]] < middle < self.values[pair[1]]
        ]
        if not new:
            return
        places = self.add(np.array([middle for _pair, middle in new]), level)
        rows: list[int] = []
        states: list[State] = []
        for way, name in enumerate(self.ways):
            rows += self.rows(places, way)
            befores = self.rows([pair[0 if name == "up" else 1] for pair, _middle in new], way)
            for row, before in zip(self.rows(places, way), befores, strict=True):
                begin = self.begin if name == "from rest" else self.table.columns.handed(before)
                states.append(state_or_rest(self.table.regimes[row], begin))
        self.run(rows, np.array(states))

    def is_different(self, place: int, neighbour: int) -> bool:
        """Whether the trains at two parameter values, given by their indices, differ in any direction.

        They differ if their statuses or periods differ, or if their orbits are more than `JUMP` apart.
        """
        table = self.table
        for way in range(len(self.ways)):
            a, b = self.rows([place, neighbour], way)
            q = int(table.cycles[a])
            if q != table.cycles[b] or table.columns.status[a] != table.columns.status[b]:
                return True
            if q:
                orbits = [
                    np.column_stack([table.columns.x[row, -q:], table.columns.v[row, -q:]])
                    / table.scales[row, :2]
                    for row in (a, b)
                ]
                if orbit_distance(*orbits) > JUMP:
                    return True
        return False

    def trial(self, rows: Sequence[int], states: FloatArray) -> tuple[Any, Any, Any]:
        """Run the trains of table rows from given initial states; return the results without storing them.

        The results are the columns, the periods [firings], and the distances of states a period apart.
        """
        regimes = [self.table.regimes[row] for row in rows]
        done = self.done
        effort = replace(self.effort, progress=lambda part, _all: self.report_progress(done + part))
        columns = run_columns(regimes, states, *self.counts, effort)
        fronts = np.array([math.inf if r.hammer.front is None else r.hammer.front for r in regimes])
        scales = self.table.scales[list(rows)]
        cycles, distances = cycles_of(columns, fronts, scales)
        # With the time counted within the period, motions that rest on the backstop repeat to the last bit.
        able = np.array([is_memoryless(regime) for regime in regimes])
        open_rows = np.flatnonzero(able & (cycles == 0) & (columns.status == OK))
        if open_rows.size:
            own = [regimes[row] for row in open_rows]
            put(columns, open_rows, run_in_stretches(own, states[open_rows], *self.counts, self.effort))
            cycles, distances = cycles_of(columns, fronts, scales)
        confirm(columns, cycles, distances, regimes, scales, self.effort)
        return columns, cycles, distances

    def run(self, rows: Sequence[int], states: FloatArray) -> None:
        """Run the trains of table rows from given initial states and store the results."""
        columns, cycles, distances = self.trial(rows, states)
        put(self.table.columns, rows, columns)
        self.table.cycles[list(rows)] = cycles
        self.table.distances[list(rows)] = distances
        for row in np.flatnonzero(cycles == 0).tolist():
            if self.is_resting(columns, row, self.table.regimes[rows[row]]):
                self.exponents[rows[row]], self.errors[rows[row]] = -math.inf, math.inf
        self.done += len(rows)

    def is_resting(self, columns: Columns, row: int, regime: Regime) -> bool:
        """Whether the motion in row `row` repeats exactly and includes a rest on the backstop."""
        if not is_memoryless(regime) or columns.status[row] != OK or regime.phase:
            return False
        points = np.column_stack([columns.x[row], columns.v[row]])
        count = exact_cycle(points)
        return bool(count and rests_of(regime, points[-count:], self.effort.tolerance))

    def compare(self) -> None:
        """Mark the trains whose period changes at a finer tolerance and thus depends on rounding errors.

        An armature that comes to rest on the backstop forgets its past, but between two rests a small error
        may grow to the size of the motion.
        """
        table = self.table
        long = table.cycles >= LONG_CYCLE
        rows = [int(row) for row in np.flatnonzero(long) if is_memoryless(table.regimes[row])]
        if not rows:
            return
        regimes = [table.regimes[row] for row in rows]
        fronts, scales = np.full(len(rows), math.inf), table.scales[rows]
        # The transient covers the longest cycle; more than one cycle follows.
        transient = int(table.cycles[rows].max())
        for share in FINER:
            finer = self.effort.at(share * self.effort.tolerance)
            again = run_in_stretches(regimes, table.columns.last[rows], 4 * transient, transient, finer)
            cycles, _distances = cycles_of(again, fronts, scales)
            self.sensitive[rows] |= cycles != table.cycles[rows]

    def report_progress(self, done: int) -> None:
        """Report `done` finished trains; trains that were rerun to join strands are not counted again."""
        self.effort.report(min(done, self.known), self.known)

    def measure(self) -> None:
        """Compute Lyapunov exponents of the aperiodic trains, over as many firings as the diagram records."""
        columns, table = self.table.columns, self.table
        begun = {}
        for row, regime in enumerate(table.regimes):
            x, v, branch, _memory, *electric = columns.last[row].tolist()
            # The initial state carries no pack memory: a train that starts inside the pack stays undecided.
            if branch >= 0.0 or math.isnan(x):
                continue
            if columns.status[row] == OK and not table.cycles[row] and math.isnan(self.exponents[row]):
                begun[row] = regime, (x, v, *(electric if regime.fired.quantity == "voltage" else ()))
        self.known += len(begun)
        done = self.done
        effort = replace(self.effort, progress=lambda part, _all: self.report_progress(done + part))
        exponents = exponents_onward(list(begun.values()), self.points, effort)
        for row, exponent in zip(begun, exponents, strict=True):
            if exponent.ok and exponent.smooth:
                self.exponents[row], self.errors[row] = exponent.value, exponent.standard_error
        self.done += len(begun)
