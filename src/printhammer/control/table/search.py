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
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.compensation import JUMP
from printhammer.control.table.ways import (
    LEAST_OF_OWN,
    Ways,
    brake_from,
    costs,
    fits,
    largest_of,
    seconds,
    solved,
    together,
    ways_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from printhammer.control.table.polish import Work
    from printhammer.support.arrays import FloatArray

SPACING: Final = 30e-6
"""Between the times at which all ways are looked for; between them those of the neighbours are tried, s."""

BAD: Final = 0.75
"""Cost from which on more ways are looked for."""

_ROOM: Final = 100e-6
_FIRED: Final = 12
_WIDTHS: Final = 8
_FINE: Final = 3
_DELAY: Final = 45e-6
_BRAKES: Final = (0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0)
_APART: Final = 30e-6
_STARTS: Final = 2
_FAR: Final = 8.0
_KEPT: Final = 5
_ENOUGH: Final = 0.6
_HOPELESS: Final = 20.0
_CLOSE: Final = 8e-6
_LATER: Final = (-22e-6, -8e-6, 8e-6, 22e-6)
_WIDER: Final = (0.75, 0.9, 1.0, 1.15, 1.35)
_LEAST_BRAKE: Final = 0.05
_SWITCH: Final = 0.15
_ROUNDING: Final = 1e-12


def chosen(
    work: Work, periods: FloatArray, *, brake: bool, told: Callable[[], None]
) -> tuple[FloatArray, Ways]:
    """Choose a way for each of some times after a dot.

    Parameters
    ----------
    work : Work
        What the table is to be like.
    periods : array
        Times from slot to slot, s, ascending.
    brake : bool
        Whether brake pulses may be used.
    told : callable
        Called after each step of the work.

    Returns
    -------
    periods : array
        Those at which there is a way at all.
    ways : Ways
        One for each of these.
    """
    nodes = spaced(periods, SPACING)
    known = []
    for node in nodes:
        known.append(searched(work, node, brake=brake))
        told()
    tried = []
    for period in periods.tolist():
        place = int(np.searchsorted(nodes, period))
        near = known[max(0, place - 1) : place + (2 if nodes[place] == period else 1)]
        tried.append(_distinct(together([ways_of([]), *(one.at(period) for one in near)])))
    groups = _valued(work, tried)
    told()
    if brake:
        _look_closely(work, periods, groups, told)
    there = [group for group in groups if group.size]
    every = together([ways_of([]), *there])
    ends = np.cumsum([group.size for group in there])
    found = every.some(_path(every, np.split(np.arange(every.size), ends[:-1]) if there else []))
    return found.period, found


def spaced(periods: FloatArray, spacing: float) -> list[float]:
    """Return some of the times, the first and the last one among them."""
    nodes: list[float] = []
    for period in periods.tolist():
        if not nodes or period >= nodes[-1] + spacing or period == float(periods[-1]):
            nodes.append(period)
    return nodes


def _valued(work: Work, tried: Sequence[Ways]) -> list[Ways]:
    """Solve several groups of ways together, and keep those of each group that make dots."""
    every = solved(work, together([ways_of([]), *tried]))
    every = replace(every, cost=costs(work, every))
    ends = np.cumsum([one.size for one in tried])
    groups = [every.some(slice(end - one.size, end)) for end, one in zip(ends.tolist(), tried, strict=True)]
    return [group.some(np.isfinite(group.cost)) for group in groups]


def _look_closely(work: Work, periods: FloatArray, groups: list[Ways], told: Callable[[], None]) -> None:
    """Look for more ways, with brake pulses between those tried before, where the best is not good enough.

    Parameters
    ----------
    work : Work
        What the table is to be like.
    periods : array
        Times from slot to slot, s.
    groups : list of Ways
        The ways of each of these that are known; added to.
    told : callable
        Called after each step of the work.
    """
    bad = [row for row, group in enumerate(groups) if not group.cost.min(initial=np.inf) <= BAD]
    # Where not even the neighbours have a way that is any good, there is none.
    hope = [row for row in bad if groups[row].cost.min(initial=np.inf) <= _FAR]
    nodes = spaced(periods[hope], _CLOSE)
    own: Any = work.pulse
    begin = brake_from(work)
    found = []
    for node in nodes:
        row = int(np.searchsorted(periods, node))
        best = groups[row].some(groups[row].brake > 0.0)
        best = best.some(np.argsort(best.cost, kind="stable")[:_KEPT])
        cells = [
            (
                node,
                max(begin, delay + later),
                min(max(brake * wider, _LEAST_BRAKE * own.width), work.widest),
                fired,
                width,
            )
            for delay, brake, fired, width in zip(
                best.delay.tolist(),
                best.brake.tolist(),
                best.fired.tolist(),
                best.width.tolist(),
                strict=True,
            )
            for later in _LATER
            for wider in _WIDER
        ]
        found.append(_kept(work, solved(work, ways_of(cells))))
        told()
    tried = []
    for row in hope:
        near = [
            one.at(float(periods[row]))
            for node, one in zip(nodes, found, strict=True)
            if abs(node - periods[row]) <= _CLOSE
        ]
        tried.append(_distinct(together([ways_of([]), *near])))
    for row, group in zip(hope, _valued(work, tried), strict=True):
        groups[row] = together([groups[row], group])


def searched(work: Work, period: float, *, brake: bool) -> Ways:
    """Look for all ways to make a dot a time after another one, s, and keep the best, the best one first.

    Parameters
    ----------
    work : Work
        What the table is to be like.
    period : float
        From slot to slot, s.
    brake : bool
        Whether to look for ways with a brake pulse where those without are not good enough.
    """
    plain = _best(work, _grid(work, period, [(0.0, 0.0)], _FINE), _FINE)
    if not brake or (plain.size and plain.cost[0] <= _ENOUGH):
        return plain
    own: Any = work.pulse
    begin = brake_from(work)
    delays = np.arange(begin, max(begin, period) + _ROUNDING, _DELAY)
    pairs = [(delay, part * own.width) for delay in delays.tolist() for part in _BRAKES]
    with_one = _best(work, _grid(work, period, pairs))
    return together([plain, with_one])


def _grid(work: Work, period: float, brakes: Sequence[tuple[float, float]], fine: int = 1) -> Ways:
    """Return cells of firing times and widths for each of some brake pulses."""
    own: Any = work.pulse
    fired = np.linspace(max(period - _ROOM, work.single.left), period + _ROOM, fine * _FIRED).tolist()
    widths = np.linspace(LEAST_OF_OWN * own.width, work.widest, fine * _WIDTHS).tolist()
    cells = ways_of([(period, *pair, time, width) for pair in brakes for time in fired for width in widths])
    return cells.some(fits(work, cells))


def _best(work: Work, cells: Ways, more: int = 1) -> Ways:
    """Return the best ways that begin at some cells."""
    if not cells.size:
        return cells
    off = largest_of(seconds(work, work.hammers[0], cells))
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
    return _kept(work, solved(work, cells.some(np.array(starts, dtype=np.int64))))


def _kept(work: Work, found: Ways) -> Ways:
    """Return the best of some ways that are solved, the best one first."""
    found = _distinct(replace(found, cost=costs(work, found)))
    best = np.argsort(found.cost, kind="stable")[:_KEPT]
    return found.some(best[np.isfinite(found.cost[best])])


def _distinct(ways: Ways) -> Ways:
    """Leave out those that lead to the same pulses as one before."""
    kept: list[int] = []
    for place in range(ways.size):
        same = [
            other
            for other in kept
            if ways.delay[other] == ways.delay[place]
            and ways.brake[other] == ways.brake[place]
            and abs(ways.fired[other] - ways.fired[place]) <= 1e-6
        ]
        if not same:
            kept.append(place)
    return ways.some(np.array(kept, dtype=np.int64))


def _path(ways: Ways, groups: Sequence[npt.NDArray[np.int64]]) -> npt.NDArray[np.int64]:
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
