"""Headings of columns: the name, the unit, and the quantity that the name denotes."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Final, NamedTuple

from printhammer.errors import InputError
from printhammer.units import to_si

ALIASES: Final = {
    "time": ("time", "t", "x-axis", "sec", "second", "seconds", "zeit", "temps"),
    "displacement": ("displacement", "position", "x", "weg"),
    "current": ("current", "i", "strom"),
    "force": ("force", "f", "kraft"),
    "voltage": ("voltage", "u", "spannung", "tension"),
}
"""Quantities by the column names that denote them, in lower case."""

_MEASURED: Final = ("s", "V", "A", "m", "N", "Hz", "m/s", "ohm", "Wb", "H")
_COUNTS: Final = frozenset({"number", "sequence", "samples", "sample", "#", "pts", "points"})
_BRACKETS: Final = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})", re.DOTALL)
_BESIDE: Final = re.compile(r"(.*?)(?:(?:^|\s+)in\s+|\s*/\s*|\s*,\s*|_)([^\s,/_]+)", re.DOTALL)
_NUMBERED: Final = re.compile(r"[A-Za-z]+\d+")  # "A1" and "V2" are names of channels, not powers of units
_CURRENTS: Final = re.compile(r"I\w*\(.+\)")
_VOLTAGES: Final = re.compile(r"V\(.+\)")


class Heading(NamedTuple):
    """Name and unit of a column; each is empty if the heading lacks it."""

    name: str
    unit: str = ""

    @property
    def shown(self) -> str:
        """Heading as text for messages, such as "CH1 [V]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def quantity(self) -> str:
        """Quantity that the name denotes; empty if the name is unknown."""
        name = self.name.lower()
        return next((what for what, names in ALIASES.items() if name in names), "")


def split_heading(cell: str) -> Heading:
    """Split a heading such as "time [us]", "time (us)", "time in us" or "t/us" into name and unit.

    A text in square brackets is always the unit; in any other notation only if the unit is known, so that
    "i(t)" is a name.
    """
    cell = " ".join(cell.split())
    match = _BRACKETS.fullmatch(cell)
    if match:
        name, square, *others = match.groups()
        if square is not None:
            return Heading(name, (unit_of(square) or square).strip())
        unit = unit_of(next(text for text in others if text is not None))
        if unit:
            return Heading(name, unit)
    match = _BESIDE.fullmatch(cell)
    if match and (match[1] or cell.startswith("in ")) and (unit := unit_of(match[2])):
        return Heading(match[1], unit)
    return Heading(cell)


def unit_of(text: str) -> str:
    """Parse a cell such as "(us)", "Volts" or "V DC" as a unit; empty if the cell is no unit."""
    bare = re.sub(r"\s*(DC|AC|dc|ac)$", "", text.strip().strip("()[]{}").strip()) or text.strip()
    if _NUMBERED.fullmatch(bare):
        return ""
    for word in (bare, bare.lower()):
        for si in _MEASURED:
            with suppress(InputError):
                return si if to_si(1.0, word, si) == 1.0 else word
    return ""


def is_unit_row(cells: list[str]) -> bool:
    """Whether the cells of a row are units, counts, or empty, with at least one unit."""
    units = [unit_of(cell) or cell.strip().strip("()").lower() in _COUNTS for cell in cells if cell.strip()]
    return all(units) and any(isinstance(unit, str) for unit in units)


def headings(rows: list[list[str]], width: int, separator: str) -> list[Heading]:
    """Build the headings of columns from a row of names, a row of units, or both."""
    units = [""] * width
    names = rows[-1][:width] if rows else [""] * width
    if rows and is_unit_row(names):
        units = [unit_of(cell) for cell in names]
        names = rows[-2][:width] if len(rows) > 1 else names
    columns = []
    for name, unit in zip(names, units, strict=True):
        split = split_heading(name)
        columns.append(Heading(split.name, unit or split.unit))
    return _of_ltspice(columns) if separator == "\t" else columns


def _of_ltspice(columns: list[Heading]) -> list[Heading]:
    """Add the units that LTspice omits to its headings: "time", "V(out)", "I(L1)"."""
    kinds = [
        "A" if _CURRENTS.fullmatch(name) else "V" if _VOLTAGES.fullmatch(name) else "" for name, _ in columns
    ]
    if columns[0] != Heading("time") or not all(kinds[1:]) or len(columns) < 2:
        return columns
    return [
        Heading("time", "s"),
        *(Heading(c.name, kind) for c, kind in zip(columns[1:], kinds[1:], strict=True)),
    ]
