"""Multi-start search and dynamic programming for the pulses of a dot that follows another dot.

A candidate ("way") consists of a firing time, a pulse width and an optional brake pulse, for a dot that
follows another dot after a given period. If the first dot is right, the state after the first dot is always
the same, so the candidates are a function of the period alone. For most periods several candidates print the
second dot as required: fired before, on or after a rebound, and with different brake pulses while the
armature returns. The bucking current that releases the armature slows it down on its return; Fig. 6 of F.
Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), calls that a quenched response. The
candidates differ in stability: in a long row on a slightly different hammer, with some candidates the dots
drift away from the single-pulse dot, with others they return to the single-pulse dot. The cost of a candidate
is therefore the deviation of such a row.

Method: (1) at periods `SPACING` apart, start Newton iterations from the best cells of a grid over firing
time, width and brake pulse, and keep the best few solutions; (2) at every period, re-solve the solutions of
the neighbouring nodes; (3) where the best cost is poor, also try brake pulses between the grid values; (4)
choose one candidate per period by dynamic programming (a Viterbi recursion; R. Bellman, *Dynamic Programming*
(1957)) with a penalty for changing the branch between neighbouring periods, where the table cannot be
interpolated. A solution that is far from all grid cells is missed.

The times in this module are given for the paper's hammer; they are multiplied by the time scale of the
device.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.control.table.drive import JUMP
from printhammer.control.table.task import Task
from printhammer.control.table.ways import (
    BAD,
    LEAST_OF_OWN,
    UNSTABLE,
    Ways,
    costs,
    fits,
    joined,
    largest_of,
    seconds,
    solved,
    ways_of,
)
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

# Spacing of the periods at which a full search is run, s; other periods re-solve the solutions of their
# neighbours; arbitrary
SPACING: Final = 30e-6
_ROOM: Final = 100e-6  # Half-width of the range of firing times about the slot, s; arbitrary
_GRID: Final = (12, 8)  # Numbers of firing times and widths of the starting grid; arbitrary
_FINE: Final = 3  # Refinement factor of grid and number of starts without a brake pulse; arbitrary
_DELAY: Final = 45e-6  # Spacing of the brake delays of the grid, s; arbitrary
# Widths of brake pulses on the grid, as fractions of the hammer's own width; arbitrary
_BRAKES: Final = (0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0)
_APART: Final = 30e-6  # Smallest distance of firing times between two starts, s; arbitrary
_STARTS: Final = 2  # Number of starts per brake pulse; arbitrary
_FAR: Final = 8.0  # Deviation, as a fraction of the limits, above which no iteration starts; arbitrary
_KEPT: Final = 5  # Number of solutions kept per period; arbitrary
_ENOUGH: Final = 0.6  # Cost without a brake pulse below which brake pulses are not searched; arbitrary
_HOPELESS: Final = 20.0  # Cost at which candidates are cut off; arbitrary
_CLOSE: Final = 8e-6  # Spacing of the periods of the close search, s; arbitrary
# Delay offsets of the close search, s: at most half of `_DELAY`; arbitrary
_LATER: Final = (-22e-6, -8e-6, 8e-6, 22e-6)
_WIDER: Final = (0.75, 0.9, 1.0, 1.15, 1.35)  # Brake width factors of the close search; arbitrary
_LEAST_BRAKE: Final = 0.05
"""Smallest width of a brake pulse, as a fraction of the width of the hammer's own pulse; arbitrary."""
# Penalty for a change of branch between neighbouring periods, where the table is not interpolated; arbitrary
_SWITCH: Final = 0.15
_SAME: Final = 1e-6  # Firing-time difference below which two candidates are duplicates, s; arbitrary
_ROUNDING: Final = 1e-12
"""Tolerance by which ranges of delays are extended to include their ends, s; arbitrary."""


def chosen(task: Task, periods: FloatArray) -> tuple[FloatArray, Ways]:
    """Choose a pulse candidate for each of the ascending periods [s] from a dot to the next dot.

    Returns the periods at which a candidate exists, and the chosen candidate of each.
    """
    nodes = spaced(periods, SPACING * task.scale)
    known = []
    for node in nodes:
        known.append(searched(task, node))
        task.report()
    tried = []
    for period in periods.tolist():
        place = int(np.searchsorted(nodes, period))
        near = known[max(0, place - 1) : place + (2 if nodes[place] == period else 1)]
        tried.append(_distinct(joined(ways.at(period) for ways in near)))
    groups = _refine_groups(task, tried)
    task.report()
    if task.brake:
        _look_closely(task, periods, groups)
    stable = (group.take((group.cost < UNSTABLE) & ~_is_barred(task, group)) for group in groups)
    there = [group for group in stable if group.size]
    every = joined(there)
    ends = np.cumsum([group.size for group in there])
    best = every.take(
        _path(every, np.split(np.arange(every.size), ends[:-1]) if there else [], JUMP * task.scale)
    )
    return best.period, best


def _is_barred(task: Task, ways: Ways) -> BoolArray:
    """Return a mask of the pulse candidates that failed in a previously tuned table."""
    mask = np.zeros(ways.size, np.bool_)
    for period, delay, brake in task.barred:
        mask |= np.isclose(ways.period, period, 1e-9) & (ways.delay == delay) & (ways.brake == brake)
    return mask


def spaced(periods: FloatArray, spacing: float) -> list[float]:
    """Select periods that are at least `spacing` [s] apart, including the first and the last period."""
    nodes: list[float] = []
    for period in periods.tolist():
        if not nodes or period >= nodes[-1] + spacing or period == float(periods[-1]):
            nodes.append(period)
    return nodes


def _refine_groups(task: Task, tried: Sequence[Ways]) -> list[Ways]:
    """Solve the candidates of several groups as one batch; return the groups of feasible candidates."""
    every = solved(task, joined(tried))
    every = every._replace(cost=costs(task, every))
    ends = np.cumsum([group.size for group in tried])
    groups = [every.take(slice(end - own.size, end)) for end, own in zip(ends.tolist(), tried, strict=True)]
    return [group.take(np.isfinite(group.cost)) for group in groups]


def _look_closely(task: Task, periods: FloatArray, groups: list[Ways]) -> None:
    """Search brake pulses between the grid values, at periods whose best candidate is poor.

    New candidates are added to the groups of the periods, in place.
    """
    least = [group.cost.min(initial=np.inf) for group in groups]
    # Where even the re-solved neighbours cost more than `_FAR`, no candidate is expected. An unstable
    # candidate may have a stable neighbour.
    hope = [row for row, cost in enumerate(least) if BAD < cost <= _FAR or UNSTABLE <= cost < np.inf]
    close, shifts = _CLOSE * task.scale, [later * task.scale for later in _LATER]
    nodes = spaced(periods[hope], close)
    begin, narrowest = task.brake_from, _LEAST_BRAKE * task.width
    closer = []
    for node in nodes:
        known = groups[int(np.searchsorted(periods, node))]
        known = known.take(known.brake > 0.0)
        known = known.take(np.argsort(known.cost, kind="stable")[:_KEPT])
        cells = [
            (
                node,
                max(begin, delay + later * task.scale),
                min(max(brake * wider, narrowest), task.widest),
                fired,
                width,
            )
            for _period, delay, brake, fired, width, _cost in zip(*(v.tolist() for v in known), strict=True)
            for later in shifts
            for wider in _WIDER
        ]
        closer.append(_kept(task, solved(task, ways_of(cells))))
        task.report()
    tried = []
    for row in hope:
        period = float(periods[row])
        near = [ways for node, ways in zip(nodes, closer, strict=True) if abs(node - period) <= close]
        tried.append(_distinct(joined(ways.at(period) for ways in near)))
    for row, group in zip(hope, _refine_groups(task, tried), strict=True):
        groups[row] = joined([groups[row], group])


def searched(task: Task, period: float) -> Ways:
    """Run the multi-start search for one period [s]; return the best candidates, best first.

    Candidates with a brake pulse are searched, if allowed, only if the best candidate without a brake pulse
    is poor.
    """
    plain = _best(task, _grid(task, period, [(0.0, 0.0)], _FINE), _FINE)
    if not task.brake or (plain.size and plain.cost[0] <= _ENOUGH):
        return plain
    begin = task.brake_from
    delays = np.arange(begin, max(begin, period) + _ROUNDING, _DELAY * task.scale)
    pairs = [(delay, part * task.width) for delay in delays.tolist() for part in _BRAKES]
    return joined([plain, _best(task, _grid(task, period, pairs))])


def _grid(task: Task, period: float, brakes: Sequence[tuple[float, float]], fine: int = 1) -> Ways:
    """Return the feasible grid points over firing time and width, for each brake pulse.

    `brakes` contains delay and width of each brake pulse, s; `fine` is the refinement factor of the grid.
    """
    room = _ROOM * task.scale
    fired = np.linspace(max(period - room, task.single.left), period + room, fine * _GRID[0]).tolist()
    widths = np.linspace(LEAST_OF_OWN * task.width, task.widest, fine * _GRID[1]).tolist()
    cells = ways_of([(period, *pair, time, width) for pair in brakes for time in fired for width in widths])
    return cells.take(fits(task, cells))


def _best(task: Task, cells: Ways, more: int = 1) -> Ways:
    """Solve for pulses from the best points of a grid; return the solutions of least cost.

    `more` is a factor on the number of starts per brake pulse.
    """
    if not cells.size:
        return cells
    off, apart = largest_of(seconds(task, cells)), _APART * task.scale
    starts: list[int] = []
    counts: dict[tuple[float, float], list[float]] = {}
    for place in np.argsort(off, kind="stable").tolist():
        if not off[place] <= _FAR:
            break
        pair = float(cells.delay[place]), float(cells.brake[place])
        others = counts.setdefault(pair, [])
        if len(others) < more * _STARTS and all(abs(cells.fired[place] - time) > apart for time in others):
            others.append(float(cells.fired[place]))
            starts.append(place)
    return _kept(task, solved(task, cells.take(np.array(starts, dtype=np.int64))))


def _kept(task: Task, ways: Ways) -> Ways:
    """Return the `_KEPT` cheapest distinct solutions, cheapest first."""
    ways = _distinct(ways._replace(cost=costs(task, ways)))
    best = np.argsort(ways.cost, kind="stable")[:_KEPT]
    return ways.take(best[np.isfinite(ways.cost[best])])


def _distinct(ways: Ways) -> Ways:
    """Remove candidates with nearly the same pulses as an earlier candidate."""
    kept: list[int] = []
    for place, (delay, brake, fired) in enumerate(zip(ways.delay, ways.brake, ways.fired, strict=True)):
        same = (ways.delay[kept] == delay) & (ways.brake[kept] == brake)
        if not (same & (np.abs(ways.fired[kept] - fired) <= _SAME)).any():
            kept.append(place)
    return ways.take(np.array(kept, dtype=np.int64))


def _path(ways: Ways, groups: Sequence[IntArray], jump: float) -> IntArray:
    """Choose one candidate per group by dynamic programming over costs and branch changes.

    The groups contain indices of `ways`, one group per period; returns the indices of the chosen candidates.

    A table can be interpolated between two periods only if the branch is the same: if firing times
    relative to the slots differ by at most `jump` [s].
    """
    if not groups:
        return np.zeros(0, np.int64)
    cost = np.minimum(ways.cost, _HOPELESS)
    # Costs above the limits weigh more, since such dots fail.
    cost = cost + np.where(cost > 1.0, 2.0 * (cost - 1.0), 0.0)
    late = ways.fired - ways.period
    total = cost[groups[0]]
    steps = []
    for before, here in itertools.pairwise(groups):
        differ = (
            (ways.delay[before][:, np.newaxis] != ways.delay[here])
            | (ways.brake[before][:, np.newaxis] != ways.brake[here])
            | (np.abs(late[before][:, np.newaxis] - late[here]) > jump)
        )
        table = total[:, np.newaxis] + np.where(differ, _SWITCH, 0.0)
        steps.append(np.argmin(table, axis=0))
        total = table.min(axis=0) + cost[here]
    place = int(np.argmin(total))
    path = [int(groups[-1][place])]
    for group, step in zip(reversed(groups[:-1]), reversed(steps), strict=True):
        place = int(step[place])
        path.append(int(group[place]))
    return np.array(path[::-1], np.int64)
