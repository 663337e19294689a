"""Batches of pulse trains as flat arrays of firing times, for maps and for statistics over patterns.

`Ragged` stores rows of unequal length in one array: firing times, strobe times, dots of many runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self, SupportsIndex, overload

import numpy as np
import numpy.typing as npt

from printhammer.drive.input import (
    MOST_PULSES,
    PULSES,
    checked_times,
    read_array,
    read_count,
    read_positive,
    read_start,
)
from printhammer.drive.trains import Drive, Overlap, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Ragged:
    """Rows of unequal length, stored in one flat array.

    Attributes
    ----------
    values : array, shape (all, ...)
        Entries of all rows, concatenated.
    starts : int array, shape (rows + 1,)
        Index of each row's first entry in `values`, followed by the total number of entries.
    """

    values: npt.NDArray[Any]
    starts: IntArray

    @classmethod
    def of(cls, rows: Sequence[npt.NDArray[Any]]) -> Self:
        """Create a `Ragged` from a sequence of rows."""
        counts = np.array([len(row) for row in rows], dtype=np.int64)
        return cls(np.concatenate(rows) if rows else np.zeros(0), starts_of(counts))

    @classmethod
    def even(cls, table: npt.NDArray[Any]) -> Self:
        """Create a `Ragged` with rows of equal length from a table, shape (rows, columns)."""
        rows, columns = table.shape
        return cls(table.ravel(), columns * np.arange(rows + 1, dtype=np.int64))

    @classmethod
    def sorted_by(cls, keys: npt.NDArray[Any]) -> Self:
        """Group the indices of `keys` by value: one row per distinct value, in ascending order.

        Each row contains the ascending indices at which `keys` has this value.
        """
        _, counts = np.unique(keys, return_counts=True)
        return cls(np.argsort(keys, kind="stable"), starts_of(counts))

    @classmethod
    def empty(cls, rows: int) -> Self:
        """Create a `Ragged` of `rows` empty rows."""
        return cls(np.zeros(0), np.zeros(rows + 1, np.int64))

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.starts) - 1

    def __getitem__(self, row: int) -> npt.NDArray[Any]:
        """Return a row by index; negative indices count from the end."""
        place = range(len(self))[row]
        return self.values[self.starts[place] : self.starts[place + 1]]

    @property
    def counts(self) -> IntArray:
        """Lengths of the rows, shape (rows,)."""
        return np.diff(self.starts)

    @property
    def longest(self) -> int:
        """Length of the longest row; 0 without rows."""
        return int(self.counts.max(initial=0))

    @property
    def last(self) -> FloatArray:
        """Last entry of each row; no row may be empty."""
        return self.values[self.starts[1:] - 1]

    def places(self, rows: IntArray) -> IntArray:
        """Return the indices in `values` of all entries of the given rows, concatenated."""
        counts = self.counts[rows]
        starts = starts_of(counts)
        return np.arange(starts[-1]) + np.repeat(self.starts[rows] - starts[:-1], counts)

    def take(self, rows: IntArray) -> Self:
        """Return the rows with the given indices."""
        return type(self)(self.values[self.places(rows)], starts_of(self.counts[rows]))

    def filled(self, columns: int | None = None) -> npt.NDArray[Any]:
        """Return the rows as a table, padded with NaN to the length of the longest row, or to `columns`."""
        counts, width = self.counts, self.longest if columns is None else columns
        shape = (len(self), width, *self.values.shape[1:])
        if (counts == width).all():
            return self.values.reshape(shape)
        table = np.full(shape, np.nan)
        column = np.arange(len(self.values)) - np.repeat(self.starts[:-1], counts)
        table[np.repeat(np.arange(len(self)), counts), column] = self.values
        return table


def starts_of(counts: IntArray) -> IntArray:
    """Convert the lengths of rows to the start index of each row, followed by the total length."""
    starts = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=starts[1:])
    return starts


class PulseTrains(Sequence[PulseTrain]):
    """Batch of pulse trains, each with one waveform; efficient if few waveforms are distinct.

    All firing times are in one array, in the form that an ensemble uses; indexing builds a `PulseTrain` on
    demand.

    Parameters
    ----------
    waveform
        Waveform of every firing.
    at
        Firing times of each train, s, ascending.
    overlap
        As for `PulseTrain`.
    """

    def __init__(self, waveform: Waveform, at: Iterable[npt.ArrayLike], overlap: Overlap = "add") -> None:
        firings = Ragged.of([np.atleast_1d(read_array(row, "at", "firing times, s", "s")) for row in at])
        rates = np.full(len(firings), np.nan)
        self._place([PulseTrain(waveform, overlap=overlap)], np.zeros(len(firings), np.int64), firings, rates)
        self._check()

    @classmethod
    def at_rates(
        cls,
        waveform: Waveform,
        rates: npt.ArrayLike,
        pulses: SupportsIndex = PULSES,
        overlap: Overlap = "add",
        start: float | str = 0.0,
    ) -> Self:
        """Create trains of `pulses` firings, one per rate [Hz]; each train begins at time `start` [s]."""
        grid = read_array(rates, "rates", "numbers, Hz", "Hz").reshape(-1)
        steps = np.arange(read_count(pulses, "pulses"), dtype=np.float64)
        with np.errstate(all="ignore"):
            periods = 1.0 / grid
            firings = Ragged.even(read_start(start) + periods[:, np.newaxis] * steps)
        odd = grid[~(np.isfinite(grid) & (grid > 0.0) & np.isfinite(periods))]
        if odd.size:
            read_positive(float(odd[0]), "Hz", "rate")
        result = cls.__new__(cls)
        result._place([PulseTrain(waveform, overlap=overlap)], np.zeros(len(grid), np.int64), firings, grid)
        result._check()
        return result

    @classmethod
    def of_parts(cls, parts: Sequence[PulseTrains]) -> Self:
        """Concatenate one or more batches of pulse trains into one batch."""
        places: dict[tuple[int, str], int] = {}
        pulses: list[PulseTrain] = []
        pulse_of = []
        for part in parts:
            for pulse in part.pulses:
                key = (id(pulse.waveform), pulse.overlap)
                if key not in places:
                    places[key] = len(pulses)
                    pulses.append(pulse)
            own = [places[id(pulse.waveform), pulse.overlap] for pulse in part.pulses]
            pulse_of.append(np.array(own, dtype=np.int64)[part.pulse_of])
        firings = Ragged(
            np.concatenate([part.firings.values for part in parts]),
            starts_of(np.concatenate([part.firings.counts for part in parts])),
        )
        result = cls.__new__(cls)
        rates = np.concatenate([part._rates for part in parts])
        result._place(pulses, np.concatenate(pulse_of), firings, rates)
        return result

    def _place(
        self, pulses: Sequence[PulseTrain], pulse_of: IntArray, firings: Ragged, rates: FloatArray
    ) -> None:
        self._pulses, self._pulse_of, self._firings, self._rates = tuple(pulses), pulse_of, firings, rates
        firings.values.flags.writeable = False

    def _check(self) -> None:
        """Validate the firing times of all trains; raise the `InputError` of the first invalid train."""
        if not len(self):
            raise InputError("trains: the list is empty", key="train", expected="at least one")
        times, starts = self._firings.values, self._firings.starts
        counts = self._firings.counts
        with np.errstate(invalid="ignore"):
            rising = np.diff(times, prepend=-np.inf) > 0.0
        rising[starts[:-1][counts > 0]] = True
        bad = np.flatnonzero(~(rising & np.isfinite(times) & (times >= 0.0)))
        wrong = np.union1d(
            np.searchsorted(starts, bad, side="right") - 1,
            np.flatnonzero((counts == 0) | (counts > MOST_PULSES)),
        )
        if wrong.size:
            checked_times(self._firings[int(wrong[0])])

    @property
    def firings(self) -> Ragged:
        """Firing times of all trains, s, read-only."""
        return self._firings

    @property
    def pulses(self) -> tuple[PulseTrain, ...]:
        """Distinct single pulses, each with the overlap rule of its trains."""
        return self._pulses

    @property
    def pulse_of(self) -> IntArray:
        """Index into `pulses` for each train, shape (trains,)."""
        return self._pulse_of

    def __len__(self) -> int:
        """Return the number of pulse trains."""
        return len(self._firings)

    @overload
    def __getitem__(self, index: int) -> PulseTrain: ...
    @overload
    def __getitem__(self, index: slice) -> Self: ...
    def __getitem__(self, index: int | slice) -> PulseTrain | Self:
        """Return a pulse train by index, or the pulse trains of a slice as a batch."""
        if isinstance(index, slice):
            return self.take(np.arange(len(self))[index])
        place = range(len(self))[index]
        rate = float(self._rates[place])
        pulse = self._pulses[int(self._pulse_of[place])]
        return pulse._with_checked_times(self._firings[place], None if np.isnan(rate) else rate)

    def take(self, which: IntArray) -> Self:
        """Return the pulse trains with the given indices, as a batch."""
        result = type(self).__new__(type(self))
        result._place(self._pulses, self._pulse_of[which], self._firings.take(which), self._rates[which])
        return result

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self)} trains, {self._firings.values.size} firings>"


def firings_of(drives: Sequence[Drive]) -> Ragged:
    """Return the firing times of several drives, s, one row per drive."""
    return drives.firings if isinstance(drives, PulseTrains) else Ragged.of([drive.times for drive in drives])


def joined(parts: Sequence[Sequence[Drive]]) -> Sequence[Drive]:
    """Concatenate sequences of drives; the result is a batch of flat arrays if all sequences are batches."""
    trains = [part for part in parts if isinstance(part, PulseTrains)]
    if not parts or len(trains) < len(parts):
        return [drive for part in parts for drive in part]
    return PulseTrains.of_parts(trains)
