"""Carrying the state from one value of a parameter to the next, on all cores.

Strictly, each train begins where the one before it ended, so that they cannot be run side by side. Here the
values are cut into strands of `STRAND` successive values. Every strand is begun from rest, and within it the
state is carried; all strands run side by side. Then the joints are closed: the first train of a strand is run
again from the state at which the strand before it ended. Where it comes to the same attractor, the rest of
the strand stands as it is; where it does not, it replaces what was there, and the state is carried on from
it, until the same attractor is met or the strand ends, in which case the next joint is closed anew.

So every train lies on the attractor to which a strict carrying leads, up to what an attractor is known by
(`same_attractor`). The strands depend on the values alone, and so does the result: not on threads or chunks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.bifurcation.columns import OK, Columns, orbit_distance, put, state_or_rest

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.chaos.strobe.handing import State
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray

STRAND: Final = 16
"""Values in a strand."""

SAME: Final = 1e-3
"""Distance, in half-widths of the window, up to which periodic orbits count as the same."""

_SHIFTED: Final = 0.5
"""Difference of the means of two clouds, in their standard deviations, up to which they count as the same."""


@dataclass
class Strand:
    """Successive trains, the state being carried from each to the next."""

    rows: list[int]
    """Their rows in the table of all trains, in the order in which the state is carried."""
    before: int
    """Number of the strand that ends where this one begins; -1 for the first one."""


@dataclass
class Trains:
    """All trains of a diagram: what is run, and what is found."""

    regimes: list[Regime]
    """One for each train."""
    columns: Columns
    """Their states."""
    cycles: Any
    """Their periods, 0 for none."""
    distances: Any
    scales: FloatArray
    """By which differences of displacement, velocity, memory and current are divided. Shape (M, 4)."""
    carried: int = field(default=0)
    """Number of trains that were run again to close the joints."""


def strands_of(rows: Sequence[int], first: int) -> list[Strand]:
    """Cut trains, in the order in which the state is carried, into strands numbered from `first` on."""
    cut = [list(rows[k : k + STRAND]) for k in range(0, len(rows), STRAND)]
    return [Strand(part, first + k - 1 if k else -1) for k, part in enumerate(cut)]


def carry(
    table: Trains,
    strands: Sequence[Strand],
    start: State,
    run: Callable[[list[int], FloatArray], None],
    trial: Callable[[list[int], FloatArray], tuple[Columns, Any, Any]],
) -> None:
    """Run the trains of strands of one or several directions, and close their joints.

    `start` is the state with which a strand begins; `run` runs rows of the table from states and keeps the
    results there, `trial` returns them: columns, periods, distances.
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
        # Every open joint is taken one train further, all of them side by side.
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
            if same_attractor(table, row, columns, i, int(cycles[i])):
                continue
            put(table.columns, [row], Columns(*(values[[i]] for values in vars(columns).values())))
            table.cycles[row], table.distances[row] = cycles[i], distances[i]
            if place + 1 < len(strands[number].rows):
                open_.add((number, place + 1))
            else:
                open_ |= {(n, 0) for n, other in enumerate(strands) if other.before == number}


def same_attractor(table: Trains, row: int, columns: Columns, place: int, cycle: int) -> bool:
    """Tell whether a train that was run again came to the attractor on which it was before.

    Periodic trains did if their orbits agree within `SAME`. Of trains without a period it is asked that the
    means of their points differ by less than half of their standard deviations; trains whose run ended early
    must have ended the same way.
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
