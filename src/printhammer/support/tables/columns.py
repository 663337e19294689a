"""Declarations of table columns, in a text or in a TOML file next to the table.

``time=1, current=2*-10 A/V, displacement=3*50 um/V+120 um, delay(current)=2 us``: columns are counted from 1.
The factor converts the number in the table to the quantity; if the table states a unit for the column, the
factor is per that unit. An offset is added after multiplication. A delay is the time by which a column lags
behind the time column. Times of evenly spaced samples are ``time=-1 ms + 20 us``: first time and step.

The file beside ``trace.csv`` is ``trace.csv.toml``::

    [columns]
    time = "1"
    current = "2*-10 A/V"

    [delay]
    current = "20 us"
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from printhammer.errors import InputError, located
from printhammer.support.files import read_text
from printhammer.support.tables.layout import Clock
from printhammer.units import factor_of, is_unit_of, parse

_NUMBER: Final = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_ENTRY: Final = re.compile(
    r"\s*(delay\s*\(\s*(?P<late>[^()]+?)\s*\)|(?P<name>[^=()]+?))\s*=\s*(?P<value>.*?)\s*"
)
_COLUMN: Final = re.compile(
    rf"(?P<place>\d+)\s*(?:\*\s*(?P<factor>{_NUMBER})\s*(?P<unit>[^+=-]*?)\s*)?"
    rf"(?:(?P<sign>[+-])\s*(?P<offset>[^\s+-][^+=]*))?"
)
_EVEN: Final = re.compile(
    rf"(?P<start>{_NUMBER}\s*[^\d\s+-][^+]*?)\s*\+\s*(?P<step>{_NUMBER}\s*[^\d\s+-][^+]*)"
)
EXAMPLE: Final = "'time=1, current=2*-10 A/V, delay(current)=2 us'"


@dataclass(frozen=True)
class Source:
    """Source of a quantity: a column of the table, and the conversion of its numbers."""

    place: int
    """Number of the column in the table, counted from 1."""
    factor: float = 1.0
    """Factor by which a number in the table is multiplied to obtain the quantity, in `unit`."""
    unit: str = ""
    """Unit of the factor, such as "A/V" or "A"; empty where the factor is a pure number."""
    offset: str = ""
    """Offset added after multiplication, with its unit; empty for no offset."""

    def scale(self, own: str, si: str) -> float:
        """Compute the factor that converts table numbers to SI; `own` is the unit that the table states.

        Raises
        ------
        InputError
            The unit of the factor does not convert the unit of the table to a unit of the quantity.
        """
        if not self.unit and not own:
            raise InputError(
                f"column {self.place} has no unit",
                expected=f"a factor, such as --columns '...={self.place}*1 {si}'",
            )
        if not self.unit:
            if not is_unit_of(own, si):
                raise InputError(
                    f"column {self.place} is in {own}",
                    value=own,
                    expected=f"a factor per {own}, such as {self.place}*{self.factor:g} {si}/{own}",
                )
            return self.factor * factor_of(own, si)
        if is_unit_of(self.unit, si):
            if own:
                bare = f"{self.place} alone, or " if is_unit_of(own, si) else ""
                raise InputError(
                    f"column {self.place} is in {own}, and {self.unit} is not a unit per {own}",
                    value=self.unit,
                    expected=f"{bare}{self.place}*{self.factor:g} {self.unit}/{own}",
                )
            return self.factor * factor_of(self.unit, si)
        above, _slash, below = self.unit.rpartition("/")
        each = factor_of(above.strip() or self.unit, si)
        return self.factor * each * (factor_of(own, below.strip()) if own else 1.0)


@dataclass(frozen=True)
class Columns:
    """Declared columns of a table, by quantity."""

    sources: dict[str, Source]
    clock: Clock | None = None
    """Times of evenly sampled rows; None if a column holds the times."""
    delays: dict[str, float] = field(default_factory=dict)
    """Delay of each quantity relative to the time column, s."""
    where: str = "--columns"
    """Name of the declaration, for error messages."""


def read_columns(text: str, where: str = "--columns") -> Columns:
    """Parse a declaration of columns; `where` names the declaration in messages.

    Raises
    ------
    InputError
        An entry is invalid, or a quantity is repeated.
    """
    sources: dict[str, Source] = {}
    delays: dict[str, float] = {}
    clock = None
    seen: set[str] = set()
    for entry in text.split(","):
        match = _ENTRY.fullmatch(entry)
        if match is None:
            raise InputError.of(where, entry.strip(), f"entries such as {EXAMPLE}")
        name, value = " ".join((match["late"] or match["name"]).split()), match["value"]
        # A rate, such as "1.2 kHz", is the name of a column of a measured map.
        name = name if name[0].isdigit() else name.lower()
        key = f"delay({name})" if match["late"] else name
        if key in seen:
            raise InputError(f"{where}: {key} occurs twice", key=key, file=where, expected="once")
        seen.add(key)
        column, even = _COLUMN.fullmatch(value), _EVEN.fullmatch(value)
        if match["late"]:
            with located(f"{where}: {key}", file=where, key=key):
                delays[name] = parse(value, "s")
        elif column and int(column["place"]) > 0:
            offset = f"{column['sign']}{column['offset'].strip()}" if column["sign"] else ""
            sources[name] = Source(
                int(column["place"]), float(column["factor"] or 1.0), (column["unit"] or "").strip(), offset
            )
        elif name == "time" and even:
            with located(f"{where}: time", file=where, key="time"):
                clock = Clock(parse(even["start"], "s"), parse(even["step"], "s"))
        else:
            raise InputError.of(
                name,
                value,
                "a start and a step, such as '-1 ms + 20 us', or a column, counted from 1"
                if name == "time"
                else "a column, counted from 1, such as '2*-10 A/V + 0.1 A'",
                file=where,
            )
    return Columns(sources, clock, delays, where)


def columns_beside(path: Path) -> Columns | None:
    """Read the declaration of columns in the TOML file beside a table; None if there is no such file.

    Raises
    ------
    InputError
        The file cannot be read, or contains anything but a table [columns] and optionally [delay].
    """
    beside = path.with_name(f"{path.name}.toml")
    try:
        if not beside.is_file():
            return None
    except OSError:
        return None
    where = str(beside)
    try:
        content = tomllib.loads(read_text(beside, "the file that declares the columns"))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: expected TOML ({' '.join(str(error).split())})", file=where) from None
    entries = []
    for table, written in (("columns", "{}={}"), ("delay", "delay({})={}")):
        values = content.pop(table, {})
        if not isinstance(values, Mapping) or not all(isinstance(value, str) for value in values.values()):
            raise InputError.of(table, values, "a table of texts such as current = '2*-10 A/V'", file=where)
        entries += [written.format(name, value) for name, value in values.items()]
    if content or not entries:
        raise InputError(
            f"{where}: {', '.join(content) or 'no table'}",
            file=where,
            key="columns",
            expected="[columns]",
        )
    return read_columns(", ".join(entries), where)
