"""Base class of results, with Dataset, table, files and repr derived from the declared fields.

A result class is a frozen dataclass whose fields declare their units and meanings:

>>> class Drop(Result, rows="fall"):
...     '''Falls of a stone.'''
...
...     hammer: Hammer = part("the hammer")
...     height: FloatArray = coordinate("m", "height of the fall", "fall")
...     time: FloatArray = column("s", "time of the fall", "fall", more="nan where it did not land")
...     tolerance: float = scalar("1", "error allowed in one step")

Dataset, table, files, docstring and HTML repr are generated from the declarations.
`printhammer.figures.plots` registers the plot function of a class by the name of the class. A class overrides
`entries` for units that depend on the instance and for arrays that are not fields, and `notes` for further
attributes.

`stacked` combines results of one class along a new dimension.

`Rows` is a tuple of objects of one declared class, with a table view.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import Field, asdict, dataclass, replace
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, SupportsIndex, TypeVar, dataclass_transform, overload

import numpy as np
import numpy.typing as npt

from printhammer.results import files
from printhammer.results.declare import (
    Column,
    Declared,
    cell,
    column,
    columns_of,
    coordinate,
    extent,
    part,
    public_names,
    scalar,
    shortened,
    span,
    with_attributes,
)
from printhammer.results.files import write_csv, write_parquet
from printhammer.results.provenance import provenance
from printhammer.results.summary import Cells, Facts, Summary, worded
from printhammer.support.html import html_table, titled

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

Entries = dict[str, tuple[Column, Any]]

RESULTS: dict[str, type[Result]] = {}
"""Imported result classes, by class name."""


@dataclass_transform(
    frozen_default=True, eq_default=False, field_specifiers=(column, coordinate, scalar, part)
)
class Result:
    """Result of a computation; subclasses are frozen dataclasses.

    The class statement accepts `rows`, the dimensions of the table separated by spaces, the last varying
    fastest (by default those of the first column); `endings`, the file endings that `save` accepts (by
    default `printhammer.results.ENDINGS`); and ``fields=False`` for a class with its own constructor, whose
    columns are all derived properties.
    """

    ENDINGS: ClassVar[tuple[str, ...]] = files.ENDINGS
    ROWS: ClassVar[tuple[str, ...]] = ()
    COLUMNS: ClassVar[dict[str, Column]] = {}

    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(
        cls, *, rows: str = "", endings: tuple[str, ...] = (), fields: bool = True, **options: Any
    ) -> None:
        super().__init_subclass__(**options)
        if rows:
            cls.ROWS = tuple(rows.split())
        if endings:
            cls.ENDINGS = endings
        RESULTS[cls.__name__] = cls
        if fields:
            dataclass(frozen=True, eq=False, repr=False)(cls)
        cls.COLUMNS = columns_of(cls)
        if "summary" in vars(cls):
            cls.summary = _worded(cls.summary)  # type: ignore[method-assign]
        if fields:
            cls.__doc__ = with_attributes(cls.__doc__ or "", cls, cls.COLUMNS)

    @property
    def title(self) -> str:
        """One-line title of the result."""
        return type(self).__name__

    @property
    def strike(self) -> str:
        """Noun for the result of a pulse, such as "closing"; "dot" unless the hammer file states a noun."""
        hammer = getattr(self, "hammer", None) or getattr(getattr(self, "regime", None), "hammer", None)
        return str(getattr(hammer, "strike", "dot"))

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance: fingerprints, versions, tolerance; see `results.provenance`.

        The provenance is composed of the attributes `hammer`, `drive`, `regime` and so on, as far as the
        result has them.
        """
        regime = getattr(self, "regime", None)
        known: dict[str, Any] = {}
        if regime is not None:
            known = {name: getattr(regime, name) for name in ("hammer", "overlap", "period")}
            known["waveform"] = regime.fired
        for name in ("hammer", "drive", "waveform", "overlap", "period", "scheme", "tolerance", "status"):
            value = getattr(self, name, None)
            # A result of many runs has one status per run, which does not belong to the provenance.
            if value is not None and np.ndim(value) == 0:
                known[name] = value
        return provenance(**known)

    def entries(self) -> Entries:
        """Return the columns and coordinates with their values, by name in the Dataset.

        A class overrides the method if its units depend on the instance, or if some of its arrays are not
        fields.
        """
        return {
            note.name: (note, getattr(self, name))
            for name, note in self.COLUMNS.items()
            if note.kind in ("column", "coordinate")
        }

    def notes(self) -> Mapping[str, Any]:
        """Return attributes of the Dataset besides title, scalars and provenance."""
        return {}

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the Dataset: title, scalars, notes and provenance, without None values."""
        scalars = {
            note.name: getattr(self, name) for name, note in self.COLUMNS.items() if note.kind == "scalar"
        }
        known = {
            "title": self.title,
            "result": type(self).__name__,
            **scalars,
            **self.notes(),
            **self.provenance,
        }
        return {
            key: int(value) if isinstance(value, bool) else value
            for key, value in known.items()
            if value is not None
        }

    def to_dataset(self) -> xr.Dataset:
        """Return the result as a Dataset with units, meanings and provenance."""
        return files.dataset_of(self.entries(), self.attributes)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the result as a table: columns such as "x [m]", codes by name, provenance in `attrs`."""
        entries = sorted(self.entries().items(), key=lambda entry: entry[1][0].kind != "coordinate")
        dims = self.ROWS or next(note.dims for _name, (note, _values) in entries if note.kind == "column")
        columns = {
            note.heading(name): (note.dims, named_codes(np.asarray(values), note))
            for name, (note, values) in entries
            if note.dims and set(note.dims) <= set(dims)
        }
        return files.frame(columns, dims, files.plain(self.attributes))

    def save(self, path: str | Path) -> None:
        """Write the result atomically, in a format chosen by the file ending.

        `printhammer.results.reopen` reads the file; `printhammer.results.files` describes the formats.

        Raises
        ------
        InputError
            The name ends in none of `ENDINGS`, the file cannot be written, or a package that the format needs
            is missing; an existing file is kept.
        """
        files.save(path, self.to_dataset, self.to_dataframe, self.ENDINGS)

    def plot(self, **options: Any) -> Figure:
        """Draw the result; with an interactive backend, `pyplot.show` shows the figure.

        Options are passed to the plot function that `printhammer.figures.plots` registers for the class;
        `picture` selects an alternative figure.
        """
        # Imported by name, so that the physics does not depend on the figures.
        figure: Figure = import_module("printhammer.figures.plots").plot(self, **options)
        return figure

    def summary(self) -> Summary:
        """Summarise the result; by default the range and meaning of each declared column.

        The terminal, `print` and the notebook show the summary. Classes override the method and write "dot";
        the noun is then replaced by the `strike` of the hammer.
        """
        rows = []
        for name, note in self.COLUMNS.items():
            if note.kind == "part":
                continue
            value = getattr(self, name)
            said = span(value) if np.ndim(value) else cell(value)
            unit = "" if note.unit in ("", "1") or not said else f" {note.unit}"
            rows.append((note.name, f"{said}{unit}{', ' if said else ''}{note.meaning}"))
        return Summary([Facts(rows)])

    def cells(self, name: str, heading: str = "", format: str = "") -> Cells:
        """Return a declared column as a column of a summary table, with its unit; see `results.Cells`."""
        note = self.COLUMNS[name]
        unit = {"degC": "°C", "1": ""}.get(note.unit, note.unit)
        return Cells(heading or name.replace("_", " "), np.ravel(getattr(self, name)), unit, format)

    def __repr__(self) -> str:
        return f"{worded(self.title, self.strike)}\n{self.summary().text()}"

    def _repr_html_(self) -> str:
        """Return the HTML repr: title, summary, and collapsible lists of columns and attributes."""
        columns = [
            (note.heading(name), extent(values), ", ".join(note.dims), span(values), meaning)
            for name, (note, values) in self.entries().items()
            for meaning in [worded(note.meaning, self.strike)]
        ]
        attributes = [(key, str(value)) for key, value in files.plain(self.attributes).items()]
        heads = ("", "shape", "dimensions", "values", "meaning")
        return titled(
            worded(self.title, self.strike),
            self.summary()._repr_html_(),
            f"<details><summary>columns</summary>{html_table(columns, heads)}</details>",
            f"<details><summary>attributes</summary>{html_table(attributes)}</details>",
        )

    def __dir__(self) -> list[str]:
        """Return the names offered for tab completion: public fields, properties and methods."""
        return public_names(super().__dir__())


def _worded(summary: Callable[..., Summary]) -> Callable[..., Summary]:
    """Decorate `summary`: replace "dot" with the hammer's noun for the result of a pulse."""

    @wraps(summary)
    def said(self: Result, *args: Any, **options: Any) -> Summary:
        return summary(self, *args, **options).worded(self.strike)

    return said


def named_codes(values: np.ndarray[Any, Any], note: Column) -> np.ndarray[Any, Any]:
    """Return the names that a column declares for its integer codes; "" for codes without a name.

    `note` is the declaration of the column. If it declares no names, the codes are returned.
    """
    if not note.codes:
        return values
    names = np.array([*note.codes, ""])
    return names[np.where((values >= 0) & (values < len(note.codes)), values, len(note.codes))]


def stacked(results: Sequence[Result], dim: str, kind: type[Result]) -> Entries:
    """Stack the arrays of results along a new dimension; ragged arrays are padded with NaN, -1 or "".

    Parameters
    ----------
    results : sequence of Result
        Results of one class, or an empty sequence.
    dim : str
        Name of the new dimension, which is the first dimension of every array.
    kind : type
        Class of the results, which declares the arrays if `results` is empty.

    Returns
    -------
    dict
        Entries in the form of `Result.entries`. Coordinates are not stacked: the longest
        coordinate of each name is used.
    """
    declared = (note for note in kind.COLUMNS.values() if note.kind in ("column", "coordinate"))
    none: Entries = {note.name: (note, np.zeros((0,) * len(note.dims))) for note in declared}
    every = [result.entries() for result in results]
    entries: Entries = {}
    for name, (note, nothing) in (every[0] if every else none).items():
        arrays = [np.asarray(entry[name][1], dtype=note.dtype) for entry in every]
        if note.kind == "coordinate":
            entries[name] = (note, max(arrays, key=len, default=nothing))
            continue
        entries[name] = (replace(note, dims=(dim, *note.dims)), _filled_up(arrays, len(note.dims)))
    return entries


def _filled_up(arrays: list[Any], dims: int) -> Any:
    if not arrays:
        return np.zeros((0,) * (dims + 1))
    shape = [max(array.shape[axis] for array in arrays) for axis in range(dims)]
    dtype = np.result_type(*arrays)
    nothing: Any = {"U": "", "i": -1, "b": False}.get(dtype.kind, np.nan)
    table: Any = np.full((len(arrays), *shape), nothing, dtype=dtype)
    for k, array in enumerate(arrays):
        table[(k, *(slice(length) for length in array.shape))] = array
    return table


_T = TypeVar("_T", bound=Declared)


class Rows(tuple[_T, ...]):
    """Tuple of objects of one declared class, such as dots, shown as a table.

    Indexing by name yields a column: ``motion.dots["flight_time"]`` is an array, with NaN for None.
    """

    kind: type[_T]

    def __new__(cls, rows: Iterable[_T], kind: type[_T]) -> Self:
        """Create a tuple of objects of the class `kind` from an iterable of such objects."""
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
        """Column headings, such as "t_in [s]", by attribute name."""
        return {name: note.heading(name) for name, note in columns_of(self.kind).items()}

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table in SI, with units in the headings."""
        import pandas as pd

        table = pd.DataFrame([asdict(row) for row in self], columns=list(self._heads))
        return table.rename(columns=self._heads)

    def save(self, path: str | Path) -> None:
        """Write the table as Parquet for the ending .parquet, else as CSV; errors as for `write_file`."""
        path = Path(path)
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
