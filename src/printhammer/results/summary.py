"""Summaries of results: sentences, facts and small tables, with quantities in SI.

The terminal, ``print(result)`` and the notebook render the same summary. The texts contain marks instead of
formatted numbers and colours: `quantity` marks a number with its SI unit, to be converted to the unit system
of the reader when the summary is rendered; `styled` marks words that a terminal shows in colour.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import isnan
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from printhammer.results.declare import shortened
from printhammer.support.html import html_table

System = Literal["si", "inch"]
Style = Literal["good", "poor", "bad", "strong", "best", "dim", "cyan", "magenta"]
FactRow = tuple[str, str | None]

NONE: Final = "–"
"""Text shown in place of a missing quantity, a dash."""

SHOWN: Final[dict[str, dict[str, tuple[str, str]]]] = {
    "s": {"si": ("us", ".1f"), "inch": ("us", ".1f")},
    "m": {"si": ("um", ".2f"), "inch": ("mil", ".3f")},
    "m/s": {"si": ("m/s", ".3f"), "inch": ("in/s", ".1f")},
    "N": {"si": ("N", ".2f"), "inch": ("lbf", ".3f")},
    "J": {"si": ("mJ", ".4f"), "inch": ("in lbf", ".5f")},
    "A": {"si": ("A", ".3f"), "inch": ("A", ".3f")},
}
"""Displayed unit and number format in either unit system, by SI unit."""
LARGE: Final[dict[str, tuple[tuple[float, str, str], ...]]] = {
    "s": ((10.0, "s", ".3f"), (0.01, "ms", ".2f")),
    "m": ((1.0, "m", ".4f"), (0.01, "mm", ".3f")),
    "J": ((1.0, "J", ".4f"),),
}
"""Display units and number formats of large SI quantities: smallest magnitude, unit, format; arbitrary."""
_SIGNS: Final = {"us": "µs", "um": "µm", "in lbf": "in·lbf"}

_DOT: Final = re.compile(r"(?<![-\w])([Dd])ot(?=s?(?![-\w]| matrix))")
_MADE: Final = {"printed": "made", "Printed": "Made", "prints": "makes"}
_PRINTED: Final = re.compile(rf"\b({'|'.join(_MADE)})\b")
_QUANTITY: Final = re.compile("⟦([^ ⟧]*) ([^⟧!]*)(!?)⟧")
_STYLED: Final = re.compile("⟪([a-z]+) ([^⟪⟫]*)⟫")


def quantity(value: float | None, unit: str, *, bare: bool = False) -> str:
    """Mark an SI quantity for conversion to the reader's units; a dash for None; `bare` hides the unit."""
    return NONE if value is None else f"⟦{float(value)!r} {unit}{'!' * bare}⟧"


def interval(values: npt.NDArray[Any], unit: str) -> str | None:
    """Format the range of an SI array as "minimum to maximum", in marked quantities; None if empty."""
    return f"{quantity(values.min(), unit)} to {quantity(values.max(), unit)}" if values.size else None


def styled(style: Style, said: object) -> str:
    """Mark the text `said` with a display style, such as "strong"."""
    return f"⟪{style} {said}⟫"


def judged(good: bool, said: object, otherwise: Style = "poor") -> str:
    """Return the text `said` marked with the style "good" if `good`, else with the style `otherwise`."""
    return styled("good" if good else otherwise, said)


def repeated(name: str, sentences: Iterable[str]) -> list[FactRow]:
    """Return sentences as facts of a summary; only the first fact bears the name `name`."""
    return [("" if row else name, sentence) for row, sentence in enumerate(sentences)]


def multiplier(value: complex) -> str:
    """Format a Floquet multiplier; a real multiplier without an imaginary part."""
    real = f"{value.real:+.4g}"
    return real if value.imag == 0.0 else f"{real}{value.imag:+.4g}i"


def display(unit: str, system: System, largest: float = 0.0) -> tuple[str, str]:
    """Return the display unit and number format of a unit system for SI quantities up to `largest`."""
    ladder = LARGE.get(unit, ()) if system == "si" else ()
    return next(((name, digits) for least, name, digits in ladder if largest >= least), SHOWN[unit][system])


def sign(name: str) -> str:
    """Return the symbol of a display unit."""
    return _SIGNS.get(name, name)


def shown(value: float, unit: str, name: str, digits: str) -> str:
    """Format a quantity, `value` in the SI unit `unit`, as a number in the display unit `name`.

    The text does not contain the unit symbol; `digits` is the format of the number, such as ".3f".
    """
    from printhammer.units import from_si

    text = format(from_si(value, unit, name), digits)
    # Avoid a minus sign in front of a number rounded to zero.
    return text if any(digit in text for digit in "123456789") else text.removeprefix("-")


def rendered(text: str, system: System = "si", style: Callable[[str, str], str] | None = None) -> str:
    """Replace the marks of a text with formatted quantities; `style` renders styled words."""

    def converted(mark: re.Match[str]) -> str:
        value, unit, bare = float(mark[1]), mark[2], mark[3]
        name, digits = display(unit, system, 0.0 if bare else abs(value))
        return shown(value, unit, name, digits) + ("" if bare else f" {sign(name)}")

    with_units = _QUANTITY.sub(converted, text)
    return _STYLED.sub(lambda mark: style(mark[1], mark[2]) if style else mark[2], with_units)


@dataclass(frozen=True)
class Cells:
    """Column of a summary table.

    Numbers with a unit in `SHOWN` and without a format are SI and are converted to the unit system of the
    reader; other cells are shown unchanged, with `unit` in the heading. None and NaN are shown as a dash.
    """

    heading: str
    values: Sequence[Any] | npt.NDArray[Any]
    unit: str = ""
    format: str = ""
    left: bool = False
    """Whether the cells are left-aligned."""

    @property
    def _is_converted(self) -> bool:
        return not self.format and self.unit in SHOWN

    @property
    def _numbers(self) -> Sequence[Any]:
        values = self.values.tolist() if isinstance(self.values, np.ndarray) else self.values
        return [None if isinstance(each, float) and isnan(each) else each for each in values]

    def _display(self, system: System) -> tuple[str, str]:
        """Return the display unit and number format of all numbers of the column."""
        numbers = [abs(each) for each in self._numbers if each is not None and not isinstance(each, str)]
        return display(self.unit, system, max(numbers, default=0.0))

    def unit_sign(self, system: System) -> str:
        """Return the unit for the heading; empty for a pure number or text."""
        return sign(self._display(system)[0]) if self._is_converted else self.unit

    def texts(self, system: System) -> list[str]:
        """Return the texts of the cells, including style marks."""
        units = self._display(system) if self._is_converted else ("", "")
        return [self._text(value, *units) for value in self._numbers]

    def _text(self, value: Any, name: str, digits: str) -> str:
        if value is None:
            return NONE
        if isinstance(value, str):
            return value
        return shown(value, self.unit, name, digits) if self._is_converted else format(value, self.format)


@dataclass(frozen=True)
class Grid:
    """Small table of a summary; a table of more than `most` rows shows its first and last rows only."""

    columns: Sequence[Cells]
    title: str = ""
    most: int | None = None

    def rows(self, system: System) -> list[Sequence[str]]:
        """Return the texts of the cells, as one list per row."""
        rows = list(zip(*(column.texts(system) for column in self.columns), strict=True))
        return shortened(rows, self.most or len(rows))


@dataclass(frozen=True)
class Facts:
    """List of names and values; a fact whose value is None is omitted."""

    rows: Sequence[FactRow]
    title: str = ""

    @property
    def known(self) -> list[tuple[str, str]]:
        """Names and values of the facts whose value is not None."""
        return [(name, said) for name, said in self.rows if said is not None]


class Summary(tuple[str | Facts | Grid, ...]):
    """Summary of a result: sentences, facts and tables, in reading order."""

    __slots__ = ()

    def worded(self, strike: str) -> Summary:
        """Return a copy of the summary with another noun, such as "closing", in place of "dot"."""
        return Summary(worded(each, strike) for each in self)

    def text(self, system: System = "si") -> str:
        """Return the summary as plain text."""
        lines: list[str] = []
        for each in self:
            if isinstance(each, str):
                lines.append(rendered(each, system))
            elif isinstance(each, Facts):
                lines += [each.title] * bool(each.title)
                lines += _align([(name, rendered(said, system)) for name, said in each.known], "<<")
            else:
                heads = [_plain_head(column, system) for column in each.columns]
                cells = [[rendered(text) for text in row] for row in each.rows(system)]
                lines += [each.title] * bool(each.title)
                lines += _align([heads, *cells], "".join("<" if c.left else ">" for c in each.columns))
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Return the HTML repr of the summary."""
        return "".join(_html(each) for each in self if each)


def worded(each: Any, strike: str) -> Any:
    """Replace "dot" and "printed" with words for the noun `strike` in texts, facts, tables and sequences."""
    if strike == "dot":
        return each
    if isinstance(each, str):
        text = _DOT.sub(lambda found: strike.capitalize() if found[1] == "D" else strike, each)
        return _PRINTED.sub(lambda found: _MADE[found[1]], text)
    if isinstance(each, Facts):
        return Facts(worded(each.rows, strike), worded(each.title, strike))
    if isinstance(each, Grid):
        return Grid(worded(each.columns, strike), worded(each.title, strike), each.most)
    if isinstance(each, Cells):
        return replace(each, heading=worded(each.heading, strike), values=worded(each.values, strike))
    return type(each)(worded(part, strike) for part in each) if isinstance(each, list | tuple) else each


def _plain_head(column: Cells, system: System) -> str:
    unit = column.unit_sign(system)
    return column.heading.replace("\n", " ") + (f" [{unit}]" if unit else "")


def _align(rows: Sequence[Sequence[str]], sides: str) -> list[str]:
    """Format rows as lines with aligned columns; `sides` has one character per column, "<" or ">"."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            f"{text:{side}{width}}" for text, side, width in zip(row, sides, widths, strict=True)
        ).rstrip()
        for row in rows
    ]


def _html(each: str | Facts | Grid) -> str:
    if isinstance(each, str):
        return f"<p>{html_table([[rendered(each)]])}</p>" if each.strip() else ""
    if isinstance(each, Facts):
        return html_table([(name, rendered(said)) for name, said in each.known])
    heads = [_plain_head(column, "si") for column in each.columns]
    return html_table([[rendered(text) for text in row] for row in each.rows("si")], heads)
