"""Measured displacement records at several firing rates, from CSV files.

Two tables are understood, each with its units in the heading, SI or any other:

- one row for each sample: the columns ``rate [Hz],time [us],displacement [um]``, in any order;
- one row for each time: ``time [us]``, then a column for each rate, such as ``500 Hz [um],1.2 kHz [um]``.

Times count from the first firing. Rows may come in any order, and every rate may have times of its own. An
empty cell, or nan, is a gap. Blank lines and lines that begin with # are passed over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.results import Declared, column, scalar
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.sheets import read_sheet, split_heading
from printhammer.units import parse, to_si

_SI: Final = {"rate": "Hz", "time": "s", "displacement": "m"}
_HEADINGS: Final = (
    "'rate [Hz],time [us],displacement [um]', or 'time [us]' and a column such as '500 Hz [um]' for each rate"
)
_GAPS: Final = ("", "nan", "na")


class RateRecord(Declared):
    """Samples at one rate."""

    rate: float = scalar("Hz", "firing rate")
    times: FloatArray = column("s", "times from the first firing, ascending", "sample")
    displacement: FloatArray = column("m", "displacement", "sample", more="NaN for a gap")


@dataclass(frozen=True)
class Cells:
    """A CSV file: cells of the heading, numbers of the lines, and rows of cells."""

    what: str
    heading: list[str]
    lines: IntArray
    rows: list[list[str]]

    def column(self, index: int, si: str, unit: str, *, gaps: bool = False) -> FloatArray:
        """Return a column in SI.

        Raises
        ------
        InputError
            The unit is of another dimension, or a cell is no finite number, nor an allowed gap.
        """
        name = self.heading[index]
        with located(f"{self.what}: column {name!r}", file=self.what, key=name):
            factor = to_si(1.0, unit, si)
        values = np.empty(len(self.rows))
        for k, row in enumerate(self.rows):
            text = row[index].strip()
            if gaps and text.lower() in _GAPS:
                values[k] = math.nan
                continue
            try:
                values[k] = float(text)
            except ValueError:
                values[k] = math.nan
            if not math.isfinite(values[k]):
                raise InputError(
                    f"{self.what}: line {self.lines[k]}, column {name!r}: {text!r} is expected to be a finite"
                    " number",
                    file=self.what,
                    key=name,
                    value=text,
                )
        return values * factor


def read_records(path: Path) -> list[RateRecord]:
    """Read the records of a CSV file, by rising rate.

    Raises
    ------
    InputError
        The file cannot be read, its heading is not one of the two, a cell is no number, or a time is given
        twice for one rate.
    """
    cells = _cells(path)
    names = [_named(cells.what, cell) for cell in cells.heading]
    if sorted(name for name, _unit in names) == sorted(_SI):
        records = _one_row_a_sample(cells, dict(names))
    else:
        records = _one_column_a_rate(cells, names)
    return sorted(records, key=lambda record: record.rate)


def checked(
    what: str, rate: float, times: FloatArray, displacement: FloatArray, places: Sequence[str]
) -> RateRecord:
    """Return a record, of samples in SI in any order, with its samples in order of time.

    Messages name the file, `what`, and where each sample stands, its entry in `places`.

    Raises
    ------
    InputError
        The rate is not positive, a time is given twice, or fewer than two displacements are known.
    """
    if not (math.isfinite(rate) and rate > 0.0):
        raise InputError(
            f"{what}: {places[0]}: rate {rate:.9g} Hz is expected to be greater than 0 Hz",
            file=what,
            key="rate",
            value=rate,
        )
    order = np.argsort(times, kind="stable")
    at, x = times[order], displacement[order]
    twice = np.flatnonzero(np.diff(at) == 0.0)
    if twice.size:
        first, second = (places[order[twice[0] + k]] for k in (0, 1))
        raise InputError(
            f"{what}: {second}: time {at[twice[0]]:.9g} s at {rate:.9g} Hz is given before, in {first}",
            file=what,
            key="time",
            expected="one displacement for each time",
        )
    known = int(np.isfinite(x).sum())
    if known < 2:
        raise InputError(
            f"{what}: {known} displacements at {rate:.9g} Hz", file=what, key="rate", expected="at least 2"
        )
    return RateRecord(rate, at, x)


def _one_row_a_sample(cells: Cells, units: dict[str, str]) -> list[RateRecord]:
    index = {_named(cells.what, cell)[0]: k for k, cell in enumerate(cells.heading)}
    rate, time, x = (
        cells.column(index[name], si, units[name], gaps=name == "displacement") for name, si in _SI.items()
    )
    records = []
    for value in np.unique(rate):
        rows = np.flatnonzero(rate == value)
        places = [f"line {line}" for line in cells.lines[rows]]
        records.append(checked(cells.what, float(value), time[rows], x[rows], places))
    return records


def _one_column_a_rate(cells: Cells, names: list[tuple[str, str]]) -> list[RateRecord]:
    columns = [k for k, (name, _unit) in enumerate(names) if name == "time"]
    if len(columns) != 1 or len(names) < 2:
        raise InputError(
            f"{cells.what}: columns {', '.join(map(repr, cells.heading))}",
            file=cells.what,
            key="columns",
            expected=_HEADINGS,
        )
    times = cells.column(columns[0], "s", names[columns[0]][1])
    records: dict[float, RateRecord] = {}
    for k, (name, unit) in enumerate(names):
        if k == columns[0]:
            continue
        if name in _SI:
            raise InputError(
                f"{cells.what}: columns {', '.join(map(repr, cells.heading))}",
                file=cells.what,
                key="columns",
                expected=_HEADINGS,
            )
        try:
            rate = parse(name, "Hz")
        except InputError as error:
            raise InputError(
                f"{cells.what}: column {cells.heading[k]!r}: {error}; expected {_HEADINGS}",
                file=cells.what,
                key=cells.heading[k],
                value=name,
            ) from None
        if rate in records:
            raise InputError(
                f"{cells.what}: column {cells.heading[k]!r}: the rate {rate:.9g} Hz has two columns",
                file=cells.what,
                key=cells.heading[k],
            )
        places = [f"line {line}, column {cells.heading[k]!r}" for line in cells.lines]
        x = cells.column(k, "m", unit, gaps=True)
        records[rate] = checked(cells.what, rate, times, x, places)
    return list(records.values())


def _named(what: str, cell: str) -> tuple[str, str]:
    """Split the cell of a heading into its name and its unit."""
    name, unit = split_heading(cell)
    if not unit:
        raise InputError(
            f"{what}: column {cell!r} is expected to carry its unit, such as 'time [us]'", file=what, key=cell
        )
    return (name.lower() if name.lower() in _SI else name), unit


def _cells(path: Path) -> Cells:
    what = str(path)
    rows = read_sheet(path, "the measured map").rows
    if len(rows) < 2:
        raise InputError(
            f"{what}: {len(rows)} rows",
            file=what,
            key="rows",
            expected=f"the heading {_HEADINGS}, and samples",
        )
    heading = [cell.strip() for cell in rows[0][1]]
    for line, row in rows[1:]:
        if len(row) != len(heading):
            raise InputError(
                f"{what}: line {line} has {len(row)} cells",
                file=what,
                key=f"line {line}",
                expected=f"{len(heading)}",
            )
    lines = np.array([line for line, _row in rows[1:]], dtype=np.int64)
    return Cells(what, heading, lines, [row for _line, row in rows[1:]])
