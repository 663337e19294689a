"""Ways to fire a dot some time after another one: which are right, and what becomes of rows of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.drive import fading, of_width, with_brake
from printhammer.control.table.newton import changes
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.chain import TAIL
from printhammer.run.ensemble import Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.control.table.polish import Work
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

ROW: Final = 8
"""Number of dots of the row that decides."""

NOMINAL: Final = 8.0
"""How often the hammer that a table is made for counts, beside those that differ."""

LEAST_OF_OWN: Final = 0.5
"""Least width, in parts of that of the pulse of the hammer."""

_WIDE: Final = 50e-6
_ROUNDS: Final = 7
_SOLVED: Final = 1e-3
_STEPS: Final = (1e-6, 0.5e-6)
_RIGHT: Final = 0.02
_WRONG: Final = 1.0
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


def fits(work: Work, ways: Ways) -> npt.NDArray[np.bool_]:
    """Return which ways fire after what comes before, and so that a brake pulse may come after."""
    first, last = earliest(work, ways.delay, ways.brake), ways.period + latest(work, ways.width)
    return np.asarray((ways.fired >= first - _ROUNDING) & (ways.fired <= last + _ROUNDING))


def solved(work: Work, ways: Ways) -> Ways:
    """Return firing times and widths for which the second dot is right, by Newton's method.

    Where there are none, those of the last step that was one for the better.
    """
    if not ways.size:
        return ways
    first = earliest(work, ways.delay, ways.brake)
    now = np.column_stack([ways.fired, ways.width])
    best, best_off = now.copy(), np.full(ways.size, np.inf)
    least = LEAST_OF_OWN * getattr(work.pulse, "width", 0.0)
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
        off = seconds(work, work.hammers[0], cells).reshape(active.size, -1, 2)
        here = off[:, 0]
        size = largest_of(here)
        better = size < best_off[active]
        best[active[better]], best_off[active[better]] = now[active[better]], size[better]
        if turn == _ROUNDS:
            break
        slopes = np.stack([(off[:, 1] - here) / _STEPS[0], (off[:, 2] - here) / -_STEPS[1]], axis=2)
        known = np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(here).all(axis=1)
        wide = now[active[known], 1]
        change = changes(slopes[known], here[known], least - wide, work.widest - wide)
        back = 0.5 * (best[active] - now[active])
        back[known] = np.where(better[known, np.newaxis], change, back[known])
        now[active] += back
    return replace(ways, fired=best[:, 0], width=best[:, 1])


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
        worst = NOMINAL * largest_of(own)
        for hammer in work.spread:
            worst = np.maximum(worst, largest_of(_deviations(work, hammer, part, drives, ROW)))
        found[some] = worst + np.where(largest_of(own[:, 1]) > _RIGHT, _WRONG, 0.0)
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


def seconds(work: Work, hammer: Hammer, ways: Ways) -> FloatArray:
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


def largest_of(off: FloatArray) -> FloatArray:
    """Return the largest deviation of each way; infinite where one is NaN."""
    size = np.abs(off).reshape(off.shape[0], -1).max(axis=1)
    return np.asarray(np.where(np.isnan(size), np.inf, size))
