"""Rows: objects of one declared class, as a tuple and as a table."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, SupportsIndex, TypeVar, overload

import numpy as np
import numpy.typing as npt

from printhammer.results.declare import Declared, cell, columns_of, shortened
from printhammer.results.files import write_csv, write_parquet
from printhammer.support.html import html_table

if TYPE_CHECKING:
    import pandas as pd

_T = TypeVar("_T", bound=Declared)


class Rows(tuple[_T, ...]):
    """Tuple of objects of one declared class, such as dots, shown as a table.

    Indexing by name yields a column: ``motion.dots["flight_time"]`` is an array, with NaN for None.
    """

    kind: type[_T]

    def __new__(cls, rows: Iterable[_T], kind: type[_T]) -> Self:
        """Create the tuple from its rows and the class of the rows."""
        made = super().__new__(cls, rows)
        made.kind = kind
        return made

    def __getnewargs__(self) -> tuple[tuple[_T, ...], type[_T]]:
        return tuple(self), self.kind

    @overload
    def __getitem__(self, index: SupportsIndex) -> _T: ...
    @overload
    def __getitem__(self, index: slice) -> Rows[_T]: ...
    @overload
    def __getitem__(self, index: str) -> npt.NDArray[Any]: ...
    def __getitem__(self, index: SupportsIndex | slice | str) -> _T | Rows[_T] | npt.NDArray[Any]:
        """Return a row by index, rows by slice, or a column by name.

        Raises
        ------
        KeyError
            The class of the rows has no such column.
        """
        if isinstance(index, str):
            if index not in self._heads:
                raise KeyError(f"{index!r}: expected one of {', '.join(self._heads)}")
            values = [getattr(row, index) for row in self]
            return np.array(values, dtype=None if None not in values else np.float64)
        if isinstance(index, slice):
            return Rows(super().__getitem__(index), self.kind)
        return super().__getitem__(index)

    @property
    def _heads(self) -> dict[str, str]:
        """Headings of the columns, such as "t_in [s]", by attribute name."""
        return {name: note.heading(name) for name, note in columns_of(self.kind).items()}

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table in SI, with units in the headings."""
        import pandas as pd

        table = pd.DataFrame([asdict(row) for row in self], columns=list(self._heads))
        return table.rename(columns=self._heads)

    def save(self, path: Path) -> None:
        """Write the table as Parquet for the ending .parquet, else as CSV; errors as for `write_file`."""
        (write_parquet if path.suffix.lower() == ".parquet" else write_csv)(self.to_dataframe(), path)

    def _cells(self) -> list[list[str]]:
        return [[cell(getattr(row, name)) for name in self._heads] for row in self]

    def __repr__(self) -> str:
        heads = list(self._heads.values())
        rows = [heads, *shortened(self._cells())]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join(
            "  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)) for row in rows
        )

    def _repr_html_(self) -> str:
        """Return the HTML repr: the table, with long tables shortened."""
        return html_table(shortened(self._cells()), list(self._heads.values()))
