"""What the verbs show: tables that are declared column by column, and facts, a row each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.markup import escape
from rich.table import Column as TableColumn
from rich.table import Table

from printhammer.cli.options import Units, shown, unit

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

Row = TypeVar("Row")

STATUS_STYLES: Final = {
    "stated": "green",
    "datasheet": "green",
    "derived": "cyan",
    "reconstructed": "yellow",
    "assumed": "magenta",
}


@dataclass(frozen=True)
class Column(Generic[Row]):
    """A column of a table."""

    heading: str
    value: Callable[[Row], Any]
    """Returns of a row a number in SI, None or NaN if there is none, or text with markup."""
    kind: str = ""
    """Kind of quantity, such as "time", which is shown in a unit of the system that is asked for."""
    unit: str = ""
    """Unit in the heading of numbers that are shown as they are."""
    format: str = ""
    """How numbers without kind are written."""
    left: bool = False
    """Whether the cells stand to the left."""

    def head(self, units: Units) -> str:
        """Return the heading, with the unit below."""
        sign = unit(self.kind, units) if self.kind else self.unit
        return f"{self.heading}\n\\[{sign}]" if sign else self.heading

    def cell(self, row: Row, units: Units) -> str:
        """Return the text of a cell."""
        value = self.value(row)
        if value is None or (isinstance(value, float) and math.isnan(value)):
            return "–"
        return shown(value, self.kind, units) if self.kind else format(value, self.format)


class Sheet(Table):
    """A table that a terminal too narrow for it shows in parts, so that no digit is cut off.

    The parts stand one below the other, and each begins with the first column. Columns to the right are
    numbers, which are never broken; texts to the left are, between words.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the parts, with an empty line between them."""
        for number, columns in enumerate(self._parts(console, options.max_width)):
            part = copy(self)
            part.columns = [replace(column, _index=place) for place, column in enumerate(columns)]
            if number:
                part.title = None
                yield ""
            yield from Table.__rich_console__(part, console, options)

    def _parts(self, console: Console, width: int) -> list[list[TableColumn]]:
        if not self.columns:
            return [[]]
        first, *others = self.columns
        parts, room = [[first]], width - self._least(console, first)
        for column in others:
            room -= 2 + self._least(console, column)
            if room < 0 and len(parts[-1]) > 1:
                parts.append([first])
                room = width - self._least(console, first) - 2 - self._least(console, column)
            parts[-1].append(column)
        return parts

    def _least(self, console: Console, column: TableColumn) -> int:
        """Return the least width of a column: of its longest number, or of its longest word."""
        texts = [console.render_str(text) for text in (column.header, *column.cells) if isinstance(text, str)]
        lines = [line for text in texts for line in text.plain.split(None if not column.no_wrap else "\n")]
        return max(map(cell_len, lines), default=0)


def table(
    columns: Sequence[Column[Row]],
    rows: Iterable[Row],
    units: Units = Units.SI,
    title: str | None = None,
    most: int | None = None,
) -> Table:
    """Return a table without frame; of more than `most` rows the first and the last."""
    made = Sheet(box=None, pad_edge=False, title=title, title_justify="left", title_style="bold")
    for column in columns:
        made.add_column(
            column.head(units),
            justify="left" if column.left else "right",
            header_style="bold",
            vertical="bottom",
            no_wrap=not column.left,
            overflow="fold",
        )
    cells = [[column.cell(row, units) for column in columns] for row in rows]
    hidden = 0 if most is None else len(cells) - most
    if most is not None and hidden > 0:
        half = most // 2
        cells[half : len(cells) - half] = [["…"] * (len(columns) - 1) + [f"[dim]{hidden} more[/dim]"]]
    for row in cells:
        made.add_row(*row)
    return made


def facts(rows: Iterable[tuple[str, str | None]], title: str = "") -> Table:
    """Return names and what there is to say of them, a row each; what is None is left out."""
    made = Table(box=None, pad_edge=False, show_header=bool(title))
    made.add_column(title, style="dim", header_style="bold", overflow="fold")
    made.add_column(overflow="fold")
    for name, said in rows:
        if said is not None:
            made.add_row(name, said)
    return made


def repeated(name: str, sentences: Iterable[str]) -> list[tuple[str, str | None]]:
    """Return facts of which only the first is named."""
    return [("" if row else name, sentence) for row, sentence in enumerate(sentences)]


def coloured(good: bool, said: object, otherwise: str = "yellow") -> str:
    """Return text in green, or in another colour where something is not good; rich markup."""
    style = "green" if good else otherwise
    return f"[{style}]{said}[/{style}]"


def multiplier(value: complex) -> str:
    """Return a Floquet multiplier as text; without an imaginary part where it has none."""
    real = f"{value.real:+.4g}"
    return real if value.imag == 0.0 else f"{real}{value.imag:+.4g}i"


def train_line(shape: str, quantity: str, overlap: str, period: float | None = None) -> str:
    """Say how a hammer is fired: the shape of its pulses, how often, and what overlapping ones do."""
    every = "" if period is None else f" every {period:.9g} s"
    return escape(f"{shape} {quantity}{every}, overlap {overlap}")


def heading(hammer: Hammer) -> str:
    """Return the name of a hammer and how much of it is known, in one line; rich markup."""
    return f"[bold]{escape(hammer.name)}[/bold]  {honesty(hammer)}"


def honesty(hammer: Hammer) -> str:
    """Say in one line how much of a hammer is known; rich markup."""
    counts: dict[str, int] = {}
    for constant in hammer.constants.values():
        counts[constant.status] = counts.get(constant.status, 0) + 1
    known = ", ".join(
        f"[{style}]{counts[status]} {status}[/{style}]"
        for status, style in STATUS_STYLES.items()
        if status in counts
    )
    what = "a reconstruction: " if counts.get("reconstructed") else ""
    return f"{what}{known}" if known else "no constants"
