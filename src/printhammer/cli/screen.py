"""Summaries on the terminal: tables that wrap by columns, lists of facts, and styled text."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.markup import escape
from rich.table import Column as TableColumn
from rich.table import Table

from printhammer.cli.options import Units

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.results.summary import Grid, Summary

Row = TypeVar("Row")

STATUS_STYLES: Final = {
    "stated": "green",
    "datasheet": "green",
    "derived": "cyan",
    "reconstructed": "yellow",
    "assumed": "magenta",
}

STYLES: Final = {
    "good": "green",
    "poor": "yellow",
    "bad": "bold red",
    "strong": "bold",
    "best": "bold green",
}
"""Rich style of each style name used in summaries."""


@dataclass(frozen=True)
class Column(Generic[Row]):
    """Column of a table whose rows are objects; see `printhammer.results.Cells` for arrays."""

    heading: str
    value: Callable[[Row], Any]
    """Function that returns the cell of a row: a number, None or NaN for an empty cell, or styled text."""
    unit: str = ""
    format: str = ""
    left: bool = False
    """Whether the cells are left-aligned."""


class Sheet(Table):
    """Table that is split into blocks of columns on a narrow terminal, so that no digit is cut off.

    The blocks are printed one below the other, each with the first column. Right-aligned columns hold
    numbers, which never wrap; left-aligned columns hold text, which wraps between words.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the blocks of columns, separated by empty lines."""
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
        """Return the smallest width of a column: the length of its longest number or word."""
        texts = [console.render_str(text) for text in (column.header, *column.cells) if isinstance(text, str)]
        lines = [line for text in texts for line in text.plain.split(None if not column.no_wrap else "\n")]
        return max(map(cell_len, lines), default=0)


def table(
    columns: Sequence[Column[Row]],
    rows: Iterable[Row],
    units: Units = Units.SI,
    title: str = "",
    most: int | None = None,
) -> Table:
    """Build a frameless table; a table of more than `most` rows shows its first and last rows only."""
    from printhammer.results.summary import Cells, Grid

    every = list(rows)
    cells = [
        Cells(each.heading, [each.value(row) for row in every], each.unit, each.format, each.left)
        for each in columns
    ]
    return _grid(Grid(cells, title, most), units)


def _grid(grid: Grid, units: Units) -> Table:
    made = Sheet(box=None, pad_edge=False, title=grid.title or None, title_justify="left", title_style="bold")
    for column in grid.columns:
        unit = column.unit_sign(units.value)
        made.add_column(
            f"{column.heading}\n\\[{unit}]" if unit else column.heading,
            justify="left" if column.left else "right",
            header_style="bold",
            vertical="bottom",
            no_wrap=not column.left,
            overflow="fold",
        )
    for row in grid.rows(units.value):
        made.add_row(*(marked(text, units) for text in row))
    return made


def marked(text: str, units: Units = Units.SI) -> str:
    """Convert a text of a summary, in which quantities and styled words are marked, to Rich markup."""
    from printhammer.results.summary import rendered

    def shown(style: str, said: str) -> str:
        return f"[{STYLES.get(style, style)}]{said}[/]"

    return rendered(escape(text), units.value, shown)


def render(summary: Summary, units: Units = Units.SI) -> list[RenderableType]:
    """Convert a summary to Rich renderables, with quantities in a unit system."""
    from printhammer.results.summary import Facts

    parts: list[RenderableType] = []
    for part in summary:
        if isinstance(part, str):
            parts.append(marked(part, units))
        elif isinstance(part, Facts):
            parts.append(facts([(name, marked(said, units)) for name, said in part.known], part.title))
        else:
            parts.append(_grid(part, units))
    return parts


def facts(rows: Iterable[tuple[str, str]], title: str = "") -> Table:
    """Return a two-column table of names and values."""
    made = Table(box=None, pad_edge=False, show_header=bool(title))
    made.add_column(title, style="dim", header_style="bold", overflow="fold")
    made.add_column(overflow="fold")
    for name, said in rows:
        made.add_row(name, said)
    return made


def train_line(shape: str, quantity: str, overlap: str, period: float | None = None) -> str:
    """Return a line that describes a train: pulse shape, period and overlap rule."""
    every = "" if period is None else f" every {period:.9g} s"
    return escape(f"{shape} {quantity}{every}, overlap {overlap}")


def heading(hammer: Hammer) -> str:
    """Return the headline of a hammer: its name and the status of its constants, in Rich markup."""
    return f"[bold]{escape(hammer.name)}[/bold]  {status_counts(hammer)}"


def status_counts(hammer: Hammer) -> str:
    """Return a one-line count of the constants by status, in Rich markup."""
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
