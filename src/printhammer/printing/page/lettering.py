"""Text to dots: broken into print lines, and set in the built-in font or in a TrueType one."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.page import matrix_font
from printhammer.printing.page.outline_font import OutlineFont, standard_font

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from printhammer.support.arrays import BoolArray

COLUMNS: Final = 40  # Characters of a print line by default

_NAMED: Final = 8


def broken(text: str, columns: int = COLUMNS) -> list[str]:
    """Break a text into print lines of some characters at most, between words where there are any.

    Line ends in the text stay, and so do empty lines.
    """
    lines: list[str] = []
    for line in text.splitlines():
        kept = line.rstrip()
        cut = textwrap.wrap(
            kept, columns, replace_whitespace=False, expand_tabs=False, break_on_hyphens=False
        )
        lines += cut if len(kept) > columns else [kept]
    return lines


def lettered(
    text: str, wires: int = matrix_font.WIRES, font: str | Path | None = None, columns: int = COLUMNS
) -> BoolArray:
    """Set a text in dots, shape (lines, wires, slots), as `Pattern.from_text` does."""
    if columns < 1:
        raise InputError(f"columns = {columns}, expected 1 or more characters in a line")
    if not text.strip():
        raise InputError(f"text = {text!r}, expected something to print")
    glyph: Callable[[str], BoolArray]
    lines = broken(text, columns)
    if font is None and wires == matrix_font.WIRES:
        known = matrix_font.glyphs()
        name, glyph = matrix_font.NAME, known.__getitem__
        lacking = [mark for mark in dict.fromkeys("".join(lines)) if mark not in known]
    else:
        outlines = OutlineFont(standard_font() if font is None else font, wires, "".join(lines))
        name, glyph = outlines.name, outlines.glyph
        lacking = outlines.missing("".join(lines))
    if lacking:
        some = ", ".join(repr(mark) for mark in lacking[:_NAMED])
        more = f" and {len(lacking) - _NAMED} more" if len(lacking) > _NAMED else ""
        raise InputError(f"text: the font {name} has no {some}{more}, expected characters that it has")
    dots = {mark: glyph(mark) for mark in set("".join(lines))}
    rows = [[dots[mark] for mark in line] for line in lines]
    wide = max(sum(block.shape[1] for block in row) for row in rows)
    whole = np.zeros((len(rows), wires, wide), np.bool_)
    for line, row in zip(whole, rows, strict=True):
        if row:
            joined = np.hstack(row)
            line[:, : joined.shape[1]] = joined
    return whole
