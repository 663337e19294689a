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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table_drive import fading, of_width, with_brake
from printhammer.drive_sequence import PulseSequence
from printhammer.ensemble import Ensemble
from printhammer.waveform_chain import TAIL

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from printhammer.control.table_polish import Work
    from printhammer.drive import Drive
    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray
    from printhammer.waveforms import Waveform

ROW: Final = 8
"""Number of dots of the row that decides."""

SPACING: Final = 30e-6
"""Between the times at which all ways are looked for; between them those of the neighbours are tried, s."""

JUMP: Final = 8e-6
"""Difference of neighbouring advances from which on they belong to different ways, s."""

BAD: Final = 0.75
"""Cost from which on more ways are looked for."""

NOMINAL: Final = 8.0
"""How often the hammer that a table is made for counts, beside those that differ."""

_ROOM: Final = 100e-6
_WIDE: Final = 50e-6
_FIRED: Final = 12
_LEAST_WIDTH: Final = 0.5
_WIDTHS: Final = 8
_FINE: Final = 3
_DELAY: Final = 45e-6
_BRAKES: Final = (0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0)
_APART: Final = 30e-6
_STARTS: Final = 2
_FAR: Final = 8.0
_KEPT: Final = 5
_ENOUGH: Final = 0.6
_ROUNDS: Final = 7
_SOLVED: Final = 1e-3
_STEPS: Final = (1e-6, 0.5e-6)
_LONGEST_STEP: Final = 25e-6
_DAMPING: Final = 0.02
_RIGHT: Final = 0.02
_WRONG: Final = 1.0
_HOPELESS: Final = 20.0
_CLOSE: Final = 8e-6
_LATER: Final = (-22e-6, -8e-6, 8e-6, 22e-6)
_WIDER: Final = (0.75, 0.9, 1.0, 1.15, 1.35)
_LEAST_BRAKE: Final = 0.05
_SWITCH: Final = 0.15
_TAIL: Final = 1e-3
_PIECE: Final = 4096
_ROUNDING: Final = 1e-12


@dataclass(frozen=True)
class Ways:
    """Ways to fire a dot: arrays of shape (ways,), times after the slot of the dot before, s.

    Attributes
    ----------
    period : array
        When the dot is due.
    delay, brake : array
        Beginning and width of the brake pulse; 0 without one.
    fired, width : array
        Firing time and width.
    cost : array
        How far a row of such dots is off, see `costs`; infinite where it is not known.
    """

    period: FloatArray
    delay: FloatArray
    brake: FloatArray
    fired: FloatArray
    width: FloatArray
    cost: FloatArray

    @property
    def size(self) -> int:
        """How many they are."""
        return self.period.size

    def some(self, which: Any) -> Ways:
        """Return some of them."""
        return Ways(*(values[which] for values in self._arrays))

    def at(self, period: float) -> Ways:
        """Return the same for another time, fired as long before or after it."""
        return replace(self, period=np.full(self.size, period), fired=self.fired + (period - self.period))

    @property
    def _arrays(self) -> tuple[FloatArray, ...]:
        return self.period, self.delay, self.brake, self.fired, self.width, self.cost


def together(parts: Sequence[Ways]) -> Ways:
    """Return all of several."""
    every = zip(*(part._arrays for part in parts), strict=True)
    return Ways(*(np.concatenate(arrays) for arrays in every))


def ways_of(cells: Sequence[tuple[float, float, float, float, float]]) -> Ways:
    """Return ways from their period, delay, brake, firing time and width."""
    period, delay, brake, fired, width = np.array(cells, dtype=np.float64).reshape(-1, 5).T
    return Ways(period, delay, brake, fired, width, np.full(period.size, np.inf))


def earliest(work: Work, delay: FloatArray, brake: FloatArray) -> FloatArray:
    """Return how long after the slot of the dot before a dot may be fired first, s.

    By then the armature has left the pack, so that no dot draws on what the pack of the one before gives
    back, and so much of a brake pulse has decayed that the current keeps to its bound.
    """
    return np.asarray(np.where(brake > 0.0, delay + brake + work.wait, work.single.left))


def brake_from(work: Work) -> float:
    """Return how long after the slot of the dot before a brake pulse may begin, s.

    By then the armature has left the pack, and the pulse of the dot has decayed to what a chain may cut off,
    even where it is late or wide by `_WIDE`.
    """
    own: Any = work.pulse
    return float(max(work.single.left, own.width + _WIDE + fading(work.pulse, 0.5 * TAIL)))


def latest(work: Work, width: FloatArray) -> FloatArray:
    """Return how long after its slot a dot of a width may be fired, s, so that a brake pulse may follow."""
    return np.asarray(brake_from(work) - fading(work.pulse, 0.5 * TAIL) - width)


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


def fits(work: Work, ways: Ways) -> npt.NDArray[np.bool_]:
    """Return which ways fire after what comes before, and so that a brake pulse may come after."""
    first, last = earliest(work, ways.delay, ways.brake), ways.period + latest(work, ways.width)
    return np.asarray((ways.fired >= first - _ROUNDING) & (ways.fired <= last + _ROUNDING))


def _grid(work: Work, period: float, brakes: Sequence[tuple[float, float]], fine: int = 1) -> Ways:
    """Return cells of firing times and widths for each of some brake pulses."""
    own: Any = work.pulse
    fired = np.linspace(max(period - _ROOM, work.single.left), period + _ROOM, fine * _FIRED).tolist()
    widths = np.linspace(_LEAST_WIDTH * own.width, work.widest, fine * _WIDTHS).tolist()
    cells = ways_of([(period, *pair, time, width) for pair in brakes for time in fired for width in widths])
    return cells.some(fits(work, cells))


def _best(work: Work, cells: Ways, more: int = 1) -> Ways:
    """Return the best ways that begin at some cells."""
    if not cells.size:
        return cells
    off = _largest(_seconds(work, work.hammers[0], cells))
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


def solved(work: Work, ways: Ways) -> Ways:
    """Return firing times and widths for which the second dot is right, by Newton's method.

    Where there are none, those of the last step that was one for the better.
    """
    if not ways.size:
        return ways
    first = earliest(work, ways.delay, ways.brake)
    now = np.column_stack([ways.fired, ways.width])
    best, best_off = now.copy(), np.full(ways.size, np.inf)
    least = _LEAST_WIDTH * getattr(work.pulse, "width", 0.0)
    for turn in range(_ROUNDS + 1):
        last = ways.period + latest(work, now[:, 1])
        now[:, 0] = np.maximum(np.minimum(now[:, 0], last), first)
        active = np.flatnonzero(best_off > _SOLVED)
        if not active.size:
            break
        shifts = np.array([(0.0, 0.0), (_STEPS[0], 0.0), (0.0, -_STEPS[1])])
        tried = (now[active, np.newaxis] + (shifts if turn < _ROUNDS else shifts[:1])).reshape(-1, 2)
        repeated = ways.some(np.repeat(active, tried.shape[0] // active.size))
        cells = replace(repeated, fired=tried[:, 0], width=tried[:, 1])
        off = _seconds(work, work.hammers[0], cells).reshape(active.size, -1, 2)
        here = off[:, 0]
        size = _largest(here)
        better = size < best_off[active]
        best[active[better]], best_off[active[better]] = now[active[better]], size[better]
        if turn == _ROUNDS:
            break
        slopes = np.stack([(off[:, 1] - here) / _STEPS[0], (off[:, 2] - here) / -_STEPS[1]], axis=2)
        known = np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(here).all(axis=1)
        wide = now[active[known], 1]
        change = _changes(slopes[known], here[known], least - wide, work.widest - wide)
        back = 0.5 * (best[active] - now[active])
        back[known] = np.where(better[known, np.newaxis], change, back[known])
        now[active] += back
    return replace(ways, fired=best[:, 0], width=best[:, 1])


def _changes(slopes: FloatArray, off: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
    """Return changes of firing time and width, s, of Newton's method with bounds on the width.

    Parameters
    ----------
    slopes : array, shape (ways, 2, 2)
        Derivatives of force and arrival after firing time and width, 1/s.
    off : array, shape (ways, 2)
        What they are now.
    least, most : array, shape (ways,)
        Bounds on the change of the width, s.
    """
    turned = slopes.transpose(0, 2, 1)
    # A little of what Levenberg and Marquardt do: a direction in which nothing changes is left alone.
    square = turned @ slopes + (_DAMPING / _LONGEST_STEP) ** 2 * np.eye(2)
    change = -np.linalg.solve(square, turned @ off[:, :, np.newaxis])[:, :, 0]
    wider = np.clip(change[:, 1], least, most)
    along = slopes[:, :, 0]
    rest = off + slopes[:, :, 1] * wider[:, np.newaxis]
    length = np.maximum((along * along).sum(axis=1), np.finfo(np.float64).tiny)
    later = np.where(wider == change[:, 1], change[:, 0], -(along * rest).sum(axis=1) / length)
    change = np.column_stack([later, wider])
    return np.asarray(np.clip(change, -_LONGEST_STEP, _LONGEST_STEP))


def costs(work: Work, ways: Ways) -> FloatArray:
    """Return how far off rows of dots made in some ways are, in parts of the limits.

    That is the largest deviation of any dot of a row of `ROW`, on the hammers that differ a little from the
    one the table is made for; what that one itself does counts `NOMINAL` times. A way that cannot make even
    the second dot right is put behind others. Infinite where a dot is lost, or the pulses do not fit between
    each other.
    """
    found = np.full(ways.size, np.inf)
    every = np.flatnonzero(fits(work, ways))
    for start in range(0, every.size, _PIECE):
        some = every[start : start + _PIECE]
        part = ways.some(some)
        drives = rows_of(work, part, ROW)
        own = _deviations(work, work.hammers[0], part, drives, ROW)
        worst = NOMINAL * _largest(own)
        for hammer in work.spread:
            worst = np.maximum(worst, _largest(_deviations(work, hammer, part, drives, ROW)))
        found[some] = worst + np.where(_largest(own[:, 1]) > _RIGHT, _WRONG, 0.0)
    return found


def rows_of(work: Work, ways: Ways, dots: int) -> list[Drive]:
    """Return drives of rows of dots, one way each, the first dot from rest."""
    own: Any = work.pulse
    known: dict[tuple[float, ...], Waveform] = {}

    def pulse(width: float, brake: float = 0.0, offset: float = 0.0) -> Waveform:
        key = (width, brake, offset) if brake else (width,)
        if key not in known:
            plain = of_width(own, width)
            known[key] = with_brake(plain, of_width(own, brake), offset) if brake else plain
        return known[key]

    drives: list[Drive] = []
    columns = np.column_stack([ways.period, ways.delay, ways.brake, ways.fired, ways.width])
    for period, delay, brake, fired, width in columns.tolist():
        advance = period - fired
        between = [pulse(width, brake, delay + advance)] * (dots - 2) if dots > 2 else []
        pulses = [pulse(own.width, brake, delay), *between, pulse(width)]
        times = [0.0, *((np.arange(1, dots) * period) - advance).tolist()]
        drives.append(PulseSequence(pulses, at=times))
    return drives


def _seconds(work: Work, hammer: Hammer, ways: Ways) -> FloatArray:
    """Return deviations of force and arrival of second dots, in parts of the limits, shape (ways, 2)."""
    found = np.empty((ways.size, 2))
    for start in range(0, ways.size, _PIECE):
        part = ways.some(slice(start, start + _PIECE))
        found[start : start + _PIECE] = _deviations(work, hammer, part, rows_of(work, part, 2), 2)[:, 1]
    return found


def _deviations(work: Work, hammer: Hammer, ways: Ways, drives: Sequence[Drive], count: int) -> FloatArray:
    """Return deviations of force and arrival, in parts of the limits, shape (ways, dots, 2).

    NaN for a lost dot or one with extra contacts.
    """
    nominal = work.single.nominal
    ends = np.array([float(drive.times[-1]) for drive in drives]) + _TAIL
    result = Ensemble(hammer, list(drives), ends, tolerance=work.tolerance).run(
        dots=True, threads=work.threads
    )
    dots = result.dots
    assert dots is not None
    force = (dots.peak_force / nominal.force - 1.0) / work.limits.force
    due = np.arange(count) * ways.period[:, np.newaxis] + nominal.flight_time
    arrival = (dots.fired_at + dots.flight_time - due) / work.limits.arrival
    off = np.stack([force, arrival], axis=2)
    off[(~result.ok)[:, np.newaxis] | ~dots.struck | (dots.extra_contacts > work.limits.extra_contacts)] = (
        np.nan
    )
    return np.asarray(off)


def _largest(off: FloatArray) -> FloatArray:
    """Return the largest deviation of each way; infinite where one is NaN."""
    size = np.abs(off).reshape(off.shape[0], -1).max(axis=1)
    return np.asarray(np.where(np.isnan(size), np.inf, size))


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
