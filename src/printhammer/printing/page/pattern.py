"""Patterns: which wire is to make a dot in which slot of which print line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.page import matrix_font
from printhammer.printing.page.lettering import COLUMNS, lettered
from printhammer.printing.page.pattern_file import read_pattern, write_pattern
from printhammer.results import Declared, column, part

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.support.arrays import BoolArray

MOST_WIRES: Final = 1000
MOST_CELLS: Final = 50_000_000
"""Wires of a head and cells of a pattern above which it is refused."""

_TITLE: Final = 60


class Pattern(Declared):
    """The dots that are wanted.

    Raises
    ------
    InputError
        The array is of another shape, too large, or wants no dot at all.
    """

    name: str = part("what it is")
    dots: BoolArray = column(
        "1",
        "True where a dot is wanted",
        "line wire slot",
        more="lines and wires from the top, slots from the left, each one column of dots; read-only",
    )

    def __post_init__(self) -> None:
        dots = np.array(self.dots, dtype=np.bool_)
        if dots.ndim == 2:
            dots = dots[np.newaxis]
        if dots.ndim != 3 or not 1 <= dots.shape[1] <= MOST_WIRES or dots.size > MOST_CELLS:
            raise InputError(
                f"pattern {self.name!r}: an array of shape {np.shape(self.dots)}, expected print lines, up to"
                f" {MOST_WIRES} wires and slots, {MOST_CELLS} cells at most"
            )
        if not dots.any():
            raise InputError(f"pattern {self.name!r}: no dot is wanted, expected at least one")
        dots.flags.writeable = False
        object.__setattr__(self, "dots", dots)

    @classmethod
    def from_text(
        cls,
        text: str,
        wires: int = matrix_font.WIRES,
        *,
        font: str | Path | None = None,
        columns: int = COLUMNS,
    ) -> Self:
        """Set a text in dots.

        Parameters
        ----------
        text : str
            What to print; line ends in it stay.
        wires : int, optional
            Number of wires.
        font : path, optional
            A TrueType font; by default the built-in font for 9 wires, of
            `printhammer.printing.page.matrix_font`, and DejaVu Sans Mono for others.
        columns : int, optional
            Most characters of a print line.

        Raises
        ------
        InputError
            No text, characters that the font lacks, a font that cannot be read.
        """
        if not 1 <= wires <= MOST_WIRES:
            raise InputError(f"wires = {wires}, expected 1 to {MOST_WIRES}")
        title = " ".join(text.split())
        short = title if len(title) <= _TITLE else f"{title[: _TITLE - 1]}…"
        return cls(short, lettered(text, wires, font, columns))

    @classmethod
    def load(cls, path: str | Path, wires: int | None = None) -> Self:
        """Read a pattern file (.toml) or a bitmap (.png, .pbm, .bmp).

        The format is described in `printhammer.printing.page.pattern_file`.

        Parameters
        ----------
        path : path
            The file.
        wires : int, optional
            Number of wires: for a bitmap 9 by default; a pattern file states it, and then it has to be that.

        Raises
        ------
        InputError
            The file cannot be read, or is no such file.
        """
        return cls(*read_pattern(path, wires))

    def save(self, path: str | Path) -> None:
        """Write a pattern file (.toml) or a bitmap (.png, .pbm, .bmp), whole or not at all.

        Raises
        ------
        InputError
            The name ends in none of these, or the file cannot be written.
        """
        write_pattern(path, self.name, self.dots)

    @property
    def lines(self) -> int:
        """Number of print lines."""
        return int(self.dots.shape[0])

    @property
    def wires(self) -> int:
        """Number of wires."""
        return int(self.dots.shape[1])

    @property
    def slots(self) -> int:
        """Number of slots of a print line."""
        return int(self.dots.shape[2])

    @property
    def wanted(self) -> int:
        """Number of dots."""
        return int(self.dots.sum())

    def __eq__(self, other: Any) -> bool:
        if not isinstance(other, Pattern):
            return NotImplemented
        return self.name == other.name and np.array_equal(self.dots, other.dots)

    def __hash__(self) -> int:
        return hash((self.name, self.dots.shape, self.dots.tobytes()))
