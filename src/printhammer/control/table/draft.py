"""Draft of a compensation table, whose entries are evaluated and improved history by history.

Entries of short histories are solved first: in a pattern, their dots precede dots with longer histories.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import (
    COLUMNS,
    REST,
    History,
    Settings,
    entries_of,
    histories,
    histories_of,
    number_of,
    pattern_of,
    plain,
    pulses_of,
    sequence,
    shared_numbers,
)
from printhammer.control.table.task import Task
from printhammer.control.table.ways import LONGEST_STEP, solve
from printhammer.derivatives.rows import MORE, row_multipliers
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    Cells = Sequence[tuple[int, History]]
    """Table entries as pairs of rate index and history."""

VALUES: Final = (*COLUMNS, "deviation")  # Names of a table's arrays
# Length of the row of dots that precedes a history in the dense patterns; arbitrary
_DENSE: Final = 6


@dataclass(frozen=True)
class Draft:
    """A table under construction, at slot rates `rates` [Hz].

    `values`, shape (5, rates, entries), contains advance, width, brake delay, brake width and deviation of
    each entry; see `VALUES`.
    """

    task: Task
    rates: FloatArray
    values: FloatArray

    @property
    def timing(self) -> FloatArray:
        """Advance and width of all entries, s, shape (2, rates, entries); a view of `values`."""
        return self.values[:2]

    @property
    def brakes(self) -> FloatArray:
        """Delay and width of the brake pulses, s, shape (2, rates, entries); a view of `values`."""
        return self.values[2:4]

    @property
    def deviation(self) -> FloatArray:
        """Deviation of each entry as a fraction of the limits, shape (rates, entries); a view of `values`."""
        return np.asarray(self.values[4])

    @property
    def worst(self) -> FloatArray:
        """Largest deviation of an entry at each rate, as a fraction of the limits, shape (rates,)."""
        return np.asarray(self.deviation.max(axis=1))

    def rows(self, which: IntArray) -> Draft:
        """Return a copy that contains only the rates with the indices `which`."""
        return Draft(self.task, self.rates[which], self.values[:, which])

    def table(self) -> CompensationTable:
        """Convert the draft to a compensation table."""
        task = self.task
        shared = shared_numbers(task.gaps, task.reach)
        return CompensationTable(
            hammer=task.hammers[0].name,
            fingerprint=task.hammers[0].fingerprint,
            rates=self.rates,
            gaps=task.gaps,
            reach=task.reach,
            largest_current=task.largest,
            **dict(zip(VALUES, self.values[:, :, shared], strict=True)),
            multiplier=np.full((self.rates.size, shared.size), np.nan),
        )

    def places(self, cells: Cells) -> tuple[IntArray, IntArray]:
        """Return the row and column indices of entries, each given as a rate index and a history."""
        columns = [number_of(history, self.task.reach) for _row, history in cells]
        return np.array([row for row, _history in cells], np.int64), np.array(columns, np.int64)

    def judge(self, level: Sequence[History] | None = None) -> None:
        """Evaluate and store the deviations of all entries, or of the entries with the histories `level`.

        If all entries are evaluated, the deviation of a history of equal gaps becomes infinite where
        deviations grow from dot to dot in a long row with such gaps.
        """
        lengths = range(1, self.task.gaps + 1)
        levels = [histories_of_length(self.task, n) for n in lengths] if level is None else [level]
        for same in levels:
            cells = [(row, history) for row in range(self.rates.size) for history in same]
            places = self.places(cells)
            off = self.last_dots(cells, self.timing[:, *places].T, np.zeros((1, 2)), whole=True)
            size = off.max(axis=(1, 2))
            self.deviation[places] = np.where(np.isnan(size), np.inf, size)
        if level is None:
            self._judge_rows()

    def _judge_rows(self) -> None:
        """Set the deviation of histories of equal gaps to infinity where the row of dots is unstable."""
        task = self.task
        known: dict[tuple[float, float, float], Waveform] = {}
        cells = [
            (row, (gap,) * task.gaps)
            for row, rate in enumerate(self.rates.tolist())
            for gap in range(1, task.reach + 1)
            if gap / rate <= task.single.settled
        ]
        drives = []
        first = task.gaps + 1  # Index of the dot after the first dot with the full history of the row
        for row, history in cells:
            settings, gap = Settings(*self.values[:4, row]), history[0]
            slots = range(0, gap * (first + MORE), gap)
            pulses = pulses_of(settings, task.gaps, task.reach, slots, float(self.rates[row]))
            drives.append(sequence(pulses, task.pulse, known))
        growth = row_multipliers([task.hammers[0]] * len(cells), drives, task.effort, firing=first)
        if cells:
            rows, columns = self.places([cells[k] for k in np.flatnonzero(~(np.abs(growth) < 1.0)).tolist()])
            self.deviation[rows, columns] = np.inf

    def last_dots(
        self,
        cells: Cells,
        values: FloatArray,
        shifts: FloatArray,
        *,
        dense: bool = True,
        whole: bool = False,
    ) -> FloatArray:
        """Simulate patterns that end with given entries; return the deviations of their last dots.

        `cells` are the entries, each a rate index and a history. `values`, shape (cells, 2), are advance and
        width of the last dots, s, and `shifts`, shape (shifts, 2), are trial changes of both. With `dense`,
        each entry is evaluated in several patterns, see `gaps_before`; an entry with fewer patterns than
        another repeats its first pattern. With `whole`, the result is the largest deviation of all dots of a
        pattern that share the history of the last dot. The result, shape (cells, shifts, deviations), is a
        fraction of the limits; the last axis runs over hammers, patterns, force and arrival. NaN marks a lost
        dot or a pattern with extra contacts.
        """
        task = self.task
        gaps = [gaps_before(history, task.reach) if dense else [()] for _row, history in cells]
        most = max(map(len, gaps))
        drives: list[Drive] = []
        due: list[FloatArray] = []
        alike: list[BoolArray] = []
        known: dict[tuple[float, float, float], Waveform] = {}
        for (row, history), value, before in zip(cells, values, gaps, strict=True):
            settings, rate = Settings(*self.values[:4, row]), float(self.rates[row])
            patterns = [pattern_of(plain(history), more) for more in before]
            patterns += [patterns[0]] * (most - len(patterns))
            for shift in shifts:
                for slots in patterns:
                    pulses = pulses_of(settings, task.gaps, task.reach, slots, rate)
                    advance, pulses.width[-1] = value + shift
                    pulses.fired[-1] = pulses.due[-1] - advance
                    pulses.offset[-1] += advance - pulses.advance[-1]
                    drives.append(sequence(pulses, task.pulse, known))
                    due.append(pulses.due)
                    numbers = histories_of(slots, task.gaps, task.reach)[:-1]
                    alike.append(numbers == numbers[-1])
        ends = np.array([times[-1] for times in due]) + task.single.nominal.flight_time
        slots_of_all = np.full((len(drives), max(map(len, due))), np.nan)
        asked = np.zeros(slots_of_all.shape, np.bool_)
        for place, (times, same) in enumerate(zip(due, alike, strict=True)):
            slots_of_all[place, : len(times)] = times
            asked[place, : len(times)] = same
        last = np.arange(len(drives)), [len(times) - 1 for times in due]
        deviations = []
        for hammer in task.hammers:
            off, crowded = task.deviations(hammer, drives, slots_of_all, ends)
            off = np.where(asked[:, :, np.newaxis], np.abs(off), 0.0).max(axis=1) if whole else off[last]
            off[crowded.any(axis=1)] = np.nan
            deviations.append(off.reshape(len(cells), len(shifts), most, 2))
        return np.concatenate(deviations, axis=2).reshape(len(cells), len(shifts), -1)


def blank(task: Task, rates: FloatArray) -> Draft:
    """Return a draft with all entries zero, for rates in Hz."""
    return Draft(task, rates, np.zeros((len(VALUES), rates.size, entries_of(task.gaps, task.reach))))


def histories_of_length(task: Task, known: int) -> list[History]:
    """List the histories with exactly `known` gaps before rest."""
    every = histories(task.gaps, task.reach)
    return [history for history in every if task.gaps - history.count(REST) == known]


def gaps_before(history: History, reach: int) -> list[tuple[int, ...]]:
    """Return the gap sequences that precede a history in its test patterns; the first is empty."""
    late = (reach + 1,)
    if REST in history:
        return [(), late]
    row = (1,) * _DENSE
    return [(), late, (*row, reach), (*row, *late), (reach, 1, reach, 1)]


GOOD: Final = 1e-4
"""Deviation, as a fraction of the limits, below which an entry is not improved further; arbitrary."""
LEAST_OF_WIDEST: Final = 0.3  # Smallest width, as a fraction of the largest; arbitrary
# Deviation, as a fraction of the limits, above which an entry is refitted to all its patterns; arbitrary
ROUGH: Final = 0.2
_STEP: Final = 0.5e-6  # Step of the finite differences, s; arbitrary


def polish(draft: Draft) -> None:
    """Improve all entries of a draft in place; the entry from rest is not changed.

    The draft must contain an initial guess for every history of one gap.
    """
    task = draft.task
    for known in range(1, task.gaps + 1):
        level = histories_of_length(task, known)
        for history in level if known > 1 else []:
            parent = (*history[: known - 1], *[REST] * (task.gaps - known + 1))
            guess = draft.values[:4, :, number_of(parent, task.reach)]
            draft.values[:4, :, number_of(history, task.reach)] = guess
        _polish_level(draft, level)
    # Entries of shorter histories may have changed since the other entries were evaluated.
    draft.judge()
    task.report()


def _polish_level(draft: Draft, level: Sequence[History]) -> None:
    """Improve the entries of several histories at all rates, by two least-squares fits.

    The first fit is to the shortest pattern that ends with the history of the entry; if all earlier dots meet
    their targets, the entry then fits every pattern. Entries with a large remaining deviation are fitted to
    all their patterns, and the new fit is kept only where it is better.
    """
    settled = draft.task.single.settled
    cells = [
        (row, history)
        for row, rate in enumerate(draft.rates.tolist())
        for history in level
        if history[0] / rate <= settled
    ]
    _solve(draft, cells, dense=False)
    draft.judge(level)
    if not cells:
        return
    rows, columns = draft.places(cells)
    rough = [cells[k] for k in np.flatnonzero(draft.deviation[rows, columns] > ROUGH).tolist()]
    if not rough:
        return
    before = draft.values.copy()
    _solve(draft, rough, dense=True)
    draft.judge(level)
    rows, columns = draft.places(rough)
    worse = ~(draft.deviation[rows, columns] < before[4, rows, columns])
    draft.values[:, rows[worse], columns[worse]] = before[:, rows[worse], columns[worse]]


def _solve(draft: Draft, cells: Cells, *, dense: bool) -> None:
    if not cells:
        return
    task = draft.task
    rows, columns = draft.places(cells)
    gap = np.array([history[0] for _row, history in cells]) / draft.rates[rows]
    first = task.earliest(*draft.brakes[:, rows, columns])

    def measure(now: FloatArray, active: IntArray, shifts: FloatArray) -> FloatArray:
        # Earlier dots of the pattern may have the same history.
        draft.timing[:, rows, columns] = now.T
        off = draft.last_dots([cells[k] for k in active.tolist()], now[active], shifts, dense=dense)
        task.report()
        return off

    def bounded(now: FloatArray, active: IntArray, stepped: BoolArray) -> None:
        on = active[stepped]
        now[on, 0] = np.clip(now[on, 0], -task.latest(now[on, 1]), gap[on] - first[on])

    draft.timing[:, rows, columns] = solve(
        measure,
        draft.timing[:, rows, columns].T,
        steps=(_STEP * task.scale, _STEP * task.scale),
        good=GOOD,
        least=LEAST_OF_WIDEST * task.widest,
        most=task.widest,
        bounded=bounded,
        longest=LONGEST_STEP * task.scale,
    ).T
