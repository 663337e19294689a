"""Result: what every result of a computation can do, from what its class says of its fields.

>>> class Drop(Result, rows="fall"):
...     '''Falls of a stone.'''
...
...     hammer: Hammer = part("the hammer")
...     height: FloatArray = coordinate("m", "height of the fall", "fall")
...     time: FloatArray = column("s", "time of the fall", "fall", more="nan where it did not land")
...     tolerance: float = scalar("1", "error allowed in one step")

makes a frozen dataclass whose Dataset, table, files, docstring and HTML repr follow from the declaration, and
whose picture `printhammer.figures.plots` knows by the name of the class. Units that depend on the instance,
and arrays that are no fields, come from a class's own `entries`; further attributes from its `notes`.

Many results of one class as one: their arrays stacked along a new dimension.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, dataclass_transform

import numpy as np

from printhammer.results import files
from printhammer.results.declare import (
    Column,
    cell,
    column,
    columns_of,
    coordinate,
    extent,
    html_table,
    part,
    public_names,
    scalar,
    span,
    titled,
    with_attributes,
)
from printhammer.results.provenance import provenance
from printhammer.results.summary import Cells, Facts, Summary

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    Entries = dict[str, tuple[Column, Any]]

RESULTS: dict[str, type[Result]] = {}
"""All classes of results that were imported, by name."""


@dataclass_transform(
    frozen_default=True, eq_default=False, field_specifiers=(column, coordinate, scalar, part)
)
class Result:
    """A result of a computation; a class that derives from it is a frozen dataclass.

    The class statement may say more: `rows`, the dimensions of the table with spaces between them, the last
    varying fastest (by default those of the first column); `endings`, those of the files that `save` writes
    (by default all of `printhammer.results.ENDINGS`); and ``fields=False`` for a class with a constructor of
    its own, all of whose columns are derived properties.
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
        if fields:
            cls.__doc__ = with_attributes(cls.__doc__ or "", cls, cls.COLUMNS)

    @property
    def title(self) -> str:
        """One line that says what the result is."""
        return type(self).__name__

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the result comes from: fingerprints, versions, tolerance; see `results.provenance`.

        From the attributes `hammer`, `drive`, `regime` and so on, where the result has them.
        """
        regime = getattr(self, "regime", None)
        known: dict[str, Any] = {}
        if regime is not None:
            known = {name: getattr(regime, name) for name in ("hammer", "overlap", "period")}
            known["waveform"] = regime.fired
        for name in ("hammer", "drive", "waveform", "overlap", "period", "scheme", "tolerance", "status"):
            value = getattr(self, name, None)
            # Of many runs, such as those of a chart, each has its own.
            if value is not None and np.ndim(value) == 0:
                known[name] = value
        return provenance(**known)

    def entries(self) -> Entries:
        """Return the columns and coordinates with their values, by their names in the Dataset.

        A class overrides it where units depend on the instance, or arrays are no fields.
        """
        return {
            note.name: (note, getattr(self, name))
            for name, note in self.COLUMNS.items()
            if note.kind in ("column", "coordinate")
        }

    def notes(self) -> Mapping[str, Any]:
        """Return what the attributes of the Dataset say beyond title, scalars and provenance."""
        return {}

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the Dataset: title, scalars, notes and provenance; what is None is left out."""
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
        """Return the result as a Dataset, with units and meanings, and provenance in its attributes."""
        return files.dataset_of(self.entries(), self.attributes)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the result as a table, columns such as "x [m]", codes by name; provenance in `attrs`."""
        entries = sorted(self.entries().items(), key=lambda entry: entry[1][0].kind != "coordinate")
        dims = self.ROWS or next(note.dims for _name, (note, _values) in entries if note.kind == "column")
        columns = {
            note.heading(name): (note.dims, named_codes(np.asarray(values), note))
            for name, (note, values) in entries
            if note.dims and set(note.dims) <= set(dims)
        }
        return files.frame(columns, dims, files.plain(self.attributes))

    def save(self, path: str | Path) -> None:
        """Write the result, by the ending of the name; whole or not at all.

        `printhammer.results.reopen` opens it again; see `printhammer.results.files` for what each format
        holds.

        Raises
        ------
        InputError
            The name ends in none of `ENDINGS`, the file cannot be written, or a package is missing that the
            format needs; what was there stays.
        """
        files.save(path, self.to_dataset, self.to_dataframe, self.ENDINGS)

    def plot(self, **options: Any) -> Any:
        """Draw the result; returns a matplotlib figure.

        Options are those of the function that `printhammer.figures.plots` names for the class; `picture` is
        the name of a second picture.
        """
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.plots").plot(self, **options)

    def summary(self) -> Summary:
        """Return what the result says in short, by default of each declared column its range and meaning.

        The terminal, `print` and the notebook show it. A class overrides it where it has more to say.
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
        """Return a declared column as a column of a summary, with its unit; see `results.Cells`."""
        note = self.COLUMNS[name]
        unit = {"degC": "°C", "1": ""}.get(note.unit, note.unit)
        return Cells(heading or name.replace("_", " "), np.ravel(getattr(self, name)), unit, format)

    def __repr__(self) -> str:
        return f"{self.title}\n{self.summary().text()}"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: title and summary, columns and attributes to unfold."""
        columns = [
            (note.heading(name), extent(values), ", ".join(note.dims), span(values), note.meaning)
            for name, (note, values) in self.entries().items()
        ]
        attributes = [(key, str(value)) for key, value in files.plain(self.attributes).items()]
        heads = ("", "shape", "dimensions", "values", "meaning")
        return titled(
            self.title,
            self.summary()._repr_html_(),
            f"<details><summary>columns</summary>{html_table(columns, heads)}</details>",
            f"<details><summary>attributes</summary>{html_table(attributes)}</details>",
        )

    def __dir__(self) -> list[str]:
        """Return what completion shows: public names of fields, properties and methods."""
        return public_names(super().__dir__())


def named_codes(values: np.ndarray[Any, Any], note: Column) -> np.ndarray[Any, Any]:
    """Return codes by name, "" for those without one."""
    if not note.codes:
        return values
    names = np.array([*note.codes, ""])
    return names[np.where((values >= 0) & (values < len(note.codes)), values, len(note.codes))]


def stacked(results: Sequence[Result], dim: str, kind: type[Result]) -> Entries:
    """Return the arrays of results, stacked; ragged ones are filled up with NaN, -1 or no text.

    Parameters
    ----------
    results : sequence of Result
        The results, all of one class; possibly none.
    dim : str
        Name of the new dimension, the first one of every array.
    kind : type
        The class, which alone says what arrays there are where there are no results.

    Returns
    -------
    dict
        As `Result.entries` returns it; of a coordinate the longest is kept as it is.
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
