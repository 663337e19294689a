"""How a dot is fired some time after another one: when, how wide, and after which brake pulse.

A dot made right leaves the hammer as every dot does. What the next dot needs is therefore a function of the
time since then. At most times there is more than one way: fired before a rebound, on it or after it, and with
one brake pulse or another on the way back of the armature. The bucking current that releases the armature
slows it down when it returns; Fig. 6 of F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers*
(1983), calls that a quenched response. All of these ways make the second dot right. They differ in what
becomes of a dot that is a little off: in a long row on a hammer that is not quite the one in the table, some
of them lead away from the single pulse, dot by dot, and others back to it. So the row decides which is taken.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.control.table.drive import JUMP
from printhammer.control.table.task import Task
from printhammer.control.table.ways import (
    LEAST_OF_OWN,
    Ways,
    costs,
    fits,
    joined,
    largest_of,
    seconds,
    solved,
    ways_of,
)
from printhammer.support.arrays import FloatArray, IntArray

# Between the times at which all ways are looked for; between them those of the neighbours are tried, s
SPACING: Final = 30e-6
BAD: Final = 0.75  # Cost from which on more ways are looked for
_ROOM: Final = 100e-6  # How far before and after its slot a dot is tried, s
_GRID: Final = (12, 8)  # Numbers of firing times and widths of the grid on which a search begins
_FINE: Final = 3  # How much finer this grid is without a brake pulse, and how many more searches begin on it
_DELAY: Final = 45e-6  # Step of the beginnings of brake pulses, s
# Widths of brake pulses, in parts of that of the hammer's own
_BRAKES: Final = (0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0)
_APART: Final = 30e-6  # Least difference of the firing times from which searches begin, s
_STARTS: Final = 2  # Number of searches for each brake pulse
_FAR: Final = 8.0  # Deviation, in parts of the limits, beyond which no search begins
_KEPT: Final = 5  # Number of ways that are kept for a time
_ENOUGH: Final = 0.6  # Cost of a way without a brake pulse up to which none with one is looked for
_HOPELESS: Final = 20.0  # Cost above which a way is as bad as any
_CLOSE: Final = 8e-6  # Between the times at which brake pulses between those of the grid are tried, s
# By how much these begin later, s: no more than half of `_DELAY`
_LATER: Final = (-22e-6, -8e-6, 8e-6, 22e-6)
_WIDER: Final = (0.75, 0.9, 1.0, 1.15, 1.35)  # How much wider these are: between neighbours of `_BRAKES`
_LEAST_BRAKE: Final = 0.05  # Least width of a brake pulse, in parts of that of the hammer's own
# What it costs to go to another way from one time to the next: there nothing is interpolated
_SWITCH: Final = 0.15
_SAME: Final = 1e-6  # Difference of firing times up to which ways with the same brake pulse are the same, s
_ROUNDING: Final = 1e-12


def chosen(task: Task, periods: FloatArray) -> tuple[FloatArray, Ways]:
    """Choose a way for each of some times after a dot, from slot to slot, s, ascending.

    Returns the times at which there is a way at all, and one for each of these.
    """
    nodes = spaced(periods, SPACING)
    known = []
    for node in nodes:
        known.append(searched(task, node))
        task.report()
    tried = []
    for period in periods.tolist():
        place = int(np.searchsorted(nodes, period))
        near = known[max(0, place - 1) : place + (2 if nodes[place] == period else 1)]
        tried.append(_distinct(joined(ways.at(period) for ways in near)))
    groups = _valued(task, tried)
    task.report()
    if task.brake:
        _look_closely(task, periods, groups)
    there = [group for group in groups if group.size]
    every = joined(there)
    ends = np.cumsum([group.size for group in there])
    best = every.take(_path(every, np.split(np.arange(every.size), ends[:-1]) if there else []))
    return best.period, best


def spaced(periods: FloatArray, spacing: float) -> list[float]:
    """Return some of the times, the first and the last one among them."""
    nodes: list[float] = []
    for period in periods.tolist():
        if not nodes or period >= nodes[-1] + spacing or period == float(periods[-1]):
            nodes.append(period)
    return nodes


def _valued(task: Task, tried: Sequence[Ways]) -> list[Ways]:
    """Solve several groups of ways together, and keep those of each group that make dots."""
    every = solved(task, joined(tried))
    every = every._replace(cost=costs(task, every))
    ends = np.cumsum([group.size for group in tried])
    groups = [every.take(slice(end - own.size, end)) for end, own in zip(ends.tolist(), tried, strict=True)]
    return [group.take(np.isfinite(group.cost)) for group in groups]


def _look_closely(task: Task, periods: FloatArray, groups: list[Ways]) -> None:
    """Look for more ways, with brake pulses between those tried before, where the best is not good enough.

    Adds to the groups of ways that are known at each of the times from slot to slot.
    """
    least = [group.cost.min(initial=np.inf) for group in groups]
    # Where not even the neighbours have a way that is any good, there is none.
    hope = [row for row, cost in enumerate(least) if not cost <= BAD and cost <= _FAR]
    nodes = spaced(periods[hope], _CLOSE)
    begin, narrowest = task.brake_from, _LEAST_BRAKE * task.width
    closer = []
    for node in nodes:
        known = groups[int(np.searchsorted(periods, node))]
        known = known.take(known.brake > 0.0)
        known = known.take(np.argsort(known.cost, kind="stable")[:_KEPT])
        cells = [
            (node, max(begin, delay + later), min(max(brake * wider, narrowest), task.widest), fired, width)
            for _period, delay, brake, fired, width, _cost in zip(*(v.tolist() for v in known), strict=True)
            for later in _LATER
            for wider in _WIDER
        ]
        closer.append(_kept(task, solved(task, ways_of(cells))))
        task.report()
    tried = []
    for row in hope:
        period = float(periods[row])
        near = [ways for node, ways in zip(nodes, closer, strict=True) if abs(node - period) <= _CLOSE]
        tried.append(_distinct(joined(ways.at(period) for ways in near)))
    for row, group in zip(hope, _valued(task, tried), strict=True):
        groups[row] = joined([groups[row], group])


def searched(task: Task, period: float) -> Ways:
    """Look for all ways to make a dot a time after another one, s, and keep the best, the best one first.

    Those with a brake pulse, if it may be used, come after those without, where these are not good enough.
    """
    plain = _best(task, _grid(task, period, [(0.0, 0.0)], _FINE), _FINE)
    if not task.brake or (plain.size and plain.cost[0] <= _ENOUGH):
        return plain
    begin = task.brake_from
    delays = np.arange(begin, max(begin, period) + _ROUNDING, _DELAY)
    pairs = [(delay, part * task.width) for delay in delays.tolist() for part in _BRAKES]
    return joined([plain, _best(task, _grid(task, period, pairs))])


def _grid(task: Task, period: float, brakes: Sequence[tuple[float, float]], fine: int = 1) -> Ways:
    """Return cells of firing times and widths for each of some brake pulses."""
    fired = np.linspace(max(period - _ROOM, task.single.left), period + _ROOM, fine * _GRID[0]).tolist()
    widths = np.linspace(LEAST_OF_OWN * task.width, task.widest, fine * _GRID[1]).tolist()
    cells = ways_of([(period, *pair, time, width) for pair in brakes for time in fired for width in widths])
    return cells.take(fits(task, cells))


def _best(task: Task, cells: Ways, more: int = 1) -> Ways:
    """Return the best ways that begin at some cells."""
    if not cells.size:
        return cells
    off = largest_of(seconds(task, cells))
    starts: list[int] = []
    counts: dict[tuple[float, float], list[float]] = {}
    for place in np.argsort(off, kind="stable").tolist():
        if not off[place] <= _FAR:
            break
        pair = float(cells.delay[place]), float(cells.brake[place])
        others = counts.setdefault(pair, [])
        if len(others) < more * _STARTS and all(abs(cells.fired[place] - time) > _APART for time in others):
            others.append(float(cells.fired[place]))
            starts.append(place)
    return _kept(task, solved(task, cells.take(np.array(starts, dtype=np.int64))))


def _kept(task: Task, ways: Ways) -> Ways:
    """Return the best of some ways that are solved, the best one first."""
    ways = _distinct(ways._replace(cost=costs(task, ways)))
    best = np.argsort(ways.cost, kind="stable")[:_KEPT]
    return ways.take(best[np.isfinite(ways.cost[best])])


def _distinct(ways: Ways) -> Ways:
    """Leave out those that lead to the same pulses as one before."""
    kept: list[int] = []
    for place, (delay, brake, fired) in enumerate(zip(ways.delay, ways.brake, ways.fired, strict=True)):
        same = (ways.delay[kept] == delay) & (ways.brake[kept] == brake)
        if not (same & (np.abs(ways.fired[kept] - fired) <= _SAME)).any():
            kept.append(place)
    return ways.take(np.array(kept, dtype=np.int64))


def _path(ways: Ways, groups: Sequence[IntArray]) -> IntArray:
    """Choose one of each group so that the sum of the costs and of the changes of way is least.

    Between two times a table is interpolated where the way is the same.
    """
    if not groups:
        return np.zeros(0, np.int64)
    cost = np.minimum(ways.cost, _HOPELESS)
    # A quarter more of the limits is worth more where little is left of them.
    cost = cost + np.where(cost > 1.0, 2.0 * (cost - 1.0), 0.0)
    late = ways.fired - ways.period
    total = cost[groups[0]]
    steps = []
    for before, here in itertools.pairwise(groups):
        differ = (
            (ways.delay[before][:, np.newaxis] != ways.delay[here])
            | (ways.brake[before][:, np.newaxis] != ways.brake[here])
            | (np.abs(late[before][:, np.newaxis] - late[here]) > JUMP)
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
