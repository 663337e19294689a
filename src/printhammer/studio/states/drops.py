"""Files that are dropped onto the page: a hammer file, a measured current, a measured displacement."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.studio.bounds import MOST_SAMPLES
from printhammer.studio.frames import frame
from printhammer.studio.states.links import read_file
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import dropped_hammer
from printhammer.support.sheets import sheet_of, split_heading
from printhammer.units import to_si

_COLUMNS: Final = {"displacement": "m", "current": "A", "force": "N"}
_EXPECTED: Final = "'time [us],displacement [um]', 'time [us],current [A]' or 'time [us],force [N]'"


def dropped(serial: int, name: str, text: str, shelf: Shelf | None = None) -> bytes:
    """Return what a dropped file holds: a state, a hammer, or a curve of displacement, current or force.

    Raises
    ------
    InputError
        It is none of these.
    """
    where = name[-80:] or "dropped file"
    if name.lower().endswith(".json"):
        table, notes = read_file(text, where, shelf or Shelf())
        return frame("dropped", serial, what="state", name=where, state=table, notes=notes)
    if name.lower().endswith(".toml"):
        hammer = dropped_hammer(text)
        return frame("dropped", serial, what="hammer", name=hammer.name, text=text)
    what, times, values = read_curve(text, where)
    return frame("dropped", serial, {"t": times, "values": values}, what=what, name=where)


def read_curve(text: str, where: str) -> tuple[str, np.ndarray, np.ndarray]:
    """Read a CSV of time and one other column, units in the heading; lines that begin with # are passed over.

    Returns
    -------
    what : str
        "displacement", "current" or "force".
    times, values : array
        SI, times ascending; thinned evenly to at most `MOST_SAMPLES`.

    Raises
    ------
    InputError
        It is no such table.
    """
    rows = [cells for _line, cells in sheet_of(text, where).rows]
    if not rows:
        raise InputError(f"{where}: the file is empty, expected the heading {_EXPECTED}")
    names, units = zip(*(_heading(cell, where) for cell in rows[0]), strict=True)
    if len(names) != 2 or names[0] != "time" or names[1] not in _COLUMNS:
        raise InputError(f"{where}: columns {', '.join(map(repr, names))}, expected {_EXPECTED}")
    numbers = np.array([_numbers(row, f"{where}: row {k}") for k, row in enumerate(rows[1:], 2)])
    if len(numbers) < 2 or (np.diff(numbers[:, 0]) <= 0.0).any():
        raise InputError(f"{where}: expected at least 2 samples at increasing times")
    keep = np.unique(np.linspace(0, len(numbers) - 1, min(len(numbers), MOST_SAMPLES)).astype(int))
    with located(where):
        factors = to_si(1.0, units[0], "s"), to_si(1.0, units[1], _COLUMNS[names[1]])
    return names[1], numbers[keep, 0] * factors[0], numbers[keep, 1] * factors[1]


def _heading(cell: str, where: str) -> tuple[str, str]:
    name, unit = split_heading(cell)
    if not unit:
        raise InputError(
            f"{where}: heading {cell.strip()!r} is expected to carry a unit, such as 'time [us]'"
        )
    return name.lower(), unit


def _numbers(row: list[str], where: str) -> list[float]:
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = []
    if len(values) != 2 or not all(math.isfinite(value) for value in values):
        raise InputError(f"{where} is expected to hold 2 finite numbers")
    return values
