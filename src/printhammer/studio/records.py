"""Measured curves from oscilloscopes and spreadsheets: time, and the quantities of `QUANTITIES`.

Tables are read by `printhammer.support.tables`. If heading and unit do not identify the quantity of a column,
the page asks the user for it. Times before the firing, which is at time 0, are kept.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from printhammer.errors import InputError
from printhammer.studio.bounds import LARGEST_CURRENT, LARGEST_VOLTAGE, LONGEST_TIME, MOST_SAMPLES
from printhammer.support.tables.columns import Columns, Source
from printhammer.support.tables.layout import Table, layout_of
from printhammer.support.tables.marks import is_number
from printhammer.support.tables.names import Heading
from printhammer.support.tables.readings import quantities_of, readings_of
from printhammer.support.tables.text import with_line_ends
from printhammer.units import split

QUANTITIES: Final = {"time": "s", "displacement": "m", "current": "A", "force": "N", "voltage": "V"}
"""Quantities of a column, with their SI units."""

_CURVES: Final = {name: si for name, si in QUANTITIES.items() if name != "time"}

MOST_COLUMNS: Final = 16
"""Largest number of columns of a table."""


class Column(NamedTuple):
    """Column of a table: its heading and, if identified, its quantity."""

    name: str
    unit: str
    quantity: str
    first: list[str]


class Record(NamedTuple):
    """Curves over a common time, SI, thinned evenly to at most `MOST_SAMPLES`."""

    times: np.ndarray[Any, Any]
    curves: dict[str, np.ndarray[Any, Any]]


def read_record(text: str, where: str, told: list[tuple[str, str]] | None = None) -> Record | list[Column]:
    """Read a table of measured curves.

    Parameters
    ----------
    text : str
        The table.
    where : str
        Name of the table in error messages.
    told : list of tuple, optional
        Quantity of each column, from `QUANTITIES` or empty, and its unit, or the value of the number 1, such
        as "10 A"; by default from the heading.

    Returns
    -------
    Record or list of Column
        The curves; or the columns, if the page has to ask the user for their quantities.

    Raises
    ------
    InputError
        The text is not a table of measured curves.
    """
    table = layout_of(with_line_ends(text.removeprefix("\ufeff")), where)
    if not any(is_number(cell.strip()) for row in table.rows[:1] for cell in row):
        raise InputError(
            f"{where}: expected columns of numbers below a heading such as 'time [us],current [A]'",
            file=where,
            key="heading",
        )
    if len(table.columns) > MOST_COLUMNS:
        raise InputError(
            f"{where}: {len(table.columns)} columns",
            file=where,
            key="columns",
            expected=f"at most {MOST_COLUMNS}",
        )
    known = quantities_of(table, QUANTITIES)
    if told is None:
        columns = [
            Column(name, unit, quantity, [cell.strip() for cell in cells])
            for (name, unit), quantity, *cells in zip(table.columns, known, *_filled(table), strict=True)
        ]
        unclear = any(column.quantity and not column.unit for column in columns)
        timed = "time" in known or table.clock is not None
        if unclear or not timed or not set(known) - {"time", ""}:
            return columns
    else:
        if len(told) != len(known):
            raise InputError(
                f"{where}: {len(known)} columns",
                file=where,
                key="columns",
                expected=f"as many answers, not {len(told)}",
            )
        known = [quantity for quantity, _unit in told]
        names = [heading.name for heading in table.columns]
        table = replace(
            table, columns=[Heading(name, unit) for name, (_, unit) in zip(names, told, strict=True)]
        )
    return _checked(_record(table, known), where)


def _filled(table: Table) -> list[list[str]]:
    """Return the first three rows of a table, padded with empty cells to the number of columns."""
    width = len(table.columns)
    return [[*row[:width], *[""] * (width - len(row))] for row in table.rows[:3]]


def _record(table: Table, known: list[str]) -> Record:
    """Return the curves of a table with known columns."""
    where = table.where
    for quantity in QUANTITIES:
        if known.count(quantity) > 1:
            raise InputError(
                f"{where}: {known.count(quantity)} columns of {quantity}",
                file=where,
                key=quantity,
                expected="one",
            )
    if not set(known) - {"time", ""}:
        raise InputError(
            f"{where}: expected a column of time and one of displacement, current, force or voltage",
            file=where,
            key="time",
        )
    sources, headings = {}, list(table.columns)
    for place, quantity in enumerate(known):
        if not quantity:
            continue
        name, unit = headings[place]
        sources[quantity] = Source(place + 1)
        if unit[:1].isdigit() or unit[:1] in {"-", "+", "."}:
            # The unit of the heading is an amount, such as "10 A": the value of a cell with the number 1.
            factor, unit = split(unit, QUANTITIES[quantity])
            sources[quantity] = Source(place + 1, factor, unit)
            headings[place] = Heading(name)
    table = replace(table, columns=headings)
    readings = readings_of(table, {"time": "s"}, optional=_CURVES, columns=Columns(sources, where=where))
    readings.check_times()
    times = readings.values.pop("time")
    for name in {"current", "force", "voltage"} & set(readings.values):
        readings.check_before(times, name)
    keep = np.unique(np.linspace(0, len(times) - 1, min(len(times), MOST_SAMPLES)).astype(int))
    return Record(times[keep], {name: values[keep] for name, values in readings.values.items()})


def _checked(record: Record, where: str) -> Record:
    """Return a record after checking that its drive, if any, can be fired."""
    for name in {"current", "force", "voltage"} & set(record.curves):
        last, peak = float(record.times[-1]), float(np.abs(record.curves[name]).max())
        if last > LONGEST_TIME:
            raise InputError(
                f"{where}: a {name} of {last:g} s",
                file=where,
                key=name,
                expected=f"at most {LONGEST_TIME:g} s",
            )
        most = LARGEST_VOLTAGE if name == "voltage" else LARGEST_CURRENT
        if peak > most:
            unit = QUANTITIES[name]
            raise InputError(
                f"{where}: a {name} of {peak:g} {unit}",
                file=where,
                key=name,
                expected=f"at most {most:g} {unit}",
            )
    return record
