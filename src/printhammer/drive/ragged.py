"""Rows of unequal length, one after the other in one array: firing times, strobe times, dots of many runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.support.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Ragged:
    """Rows of unequal length.

    Attributes
    ----------
    values : array, shape (all, ...)
        The entries of all rows, one row after the other.
    starts : int array, shape (rows + 1,)
        Where each row begins in it, and the end of all.
    """

    values: npt.NDArray[Any]
    starts: IntArray

    @classmethod
    def of(cls, rows: Sequence[npt.NDArray[Any]]) -> Self:
        """Put rows one after the other."""
        counts = np.array([len(row) for row in rows], dtype=np.int64)
        return cls(np.concatenate(rows) if rows else np.zeros(0), starts_of(counts))

    @classmethod
    def even(cls, table: npt.NDArray[Any]) -> Self:
        """Take the rows of a table, shape (rows, columns)."""
        rows, columns = table.shape
        return cls(table.ravel(), columns * np.arange(rows + 1, dtype=np.int64))

    @classmethod
    def sorted_by(cls, keys: npt.NDArray[Any]) -> Self:
        """Return the places of equal keys, a row for each key, by rising keys."""
        _, counts = np.unique(keys, return_counts=True)
        return cls(np.argsort(keys, kind="stable"), starts_of(counts))

    @classmethod
    def empty(cls, rows: int) -> Self:
        """Make so many rows with nothing in them."""
        return cls(np.zeros(0), np.zeros(rows + 1, np.int64))

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.starts) - 1

    def __getitem__(self, row: int) -> npt.NDArray[Any]:
        """Return a row, by its number; negative ones count from the end."""
        place = range(len(self))[row]
        return self.values[self.starts[place] : self.starts[place + 1]]

    @property
    def counts(self) -> IntArray:
        """Lengths of the rows, shape (rows,)."""
        return np.diff(self.starts)

    @property
    def longest(self) -> int:
        """Length of the longest row; 0 where there is none."""
        return int(self.counts.max(initial=0))

    @property
    def last(self) -> FloatArray:
        """Last entry of each row, none of which is empty."""
        return self.values[self.starts[1:] - 1]

    def places(self, rows: IntArray) -> IntArray:
        """Return where the entries of some rows are in `values`, one row after the other."""
        counts = self.counts[rows]
        starts = starts_of(counts)
        return np.arange(starts[-1]) + np.repeat(self.starts[rows] - starts[:-1], counts)

    def take(self, rows: IntArray) -> Self:
        """Return some of the rows, by their numbers."""
        return type(self)(self.values[self.places(rows)], starts_of(self.counts[rows]))

    def filled(self, columns: int | None = None) -> npt.NDArray[Any]:
        """Return a table, shape (rows, columns, ...), filled up with NaN; by default it fits."""
        counts, width = self.counts, self.longest if columns is None else columns
        shape = (len(self), width, *self.values.shape[1:])
        if (counts == width).all():
            return self.values.reshape(shape)
        table = np.full(shape, np.nan)
        column = np.arange(len(self.values)) - np.repeat(self.starts[:-1], counts)
        table[np.repeat(np.arange(len(self)), counts), column] = self.values
        return table


def starts_of(counts: IntArray) -> IntArray:
    """Return where rows of so many entries begin, and the end of all."""
    starts = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=starts[1:])
    return starts
