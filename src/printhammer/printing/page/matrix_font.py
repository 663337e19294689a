"""The built-in font: dots on nine wires, drawn for this program, every printable character of ASCII.

Characters have five full columns and are six apart, ten to the inch on a column pitch of 1/60 in. Every
column is a slot in which a wire may be fired, so that level strokes are printed at the full rate of slots;
there are no half-dot columns.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.support.arrays import BoolArray

NAME: Final = "nine-wire"
WIRES: Final = 9
ADVANCE: Final = 6
"""Columns from one character to the next."""

_COLUMNS: Final = 5
_STEP: Final = 7
_DOT: Final = "#"


@cache
def glyphs() -> Mapping[str, BoolArray]:
    """Return the dots of every character of the font: arrays (9, 6), wires from the top by columns."""
    text = (files("printhammer.printing.page") / "fonts" / "nine-wire.txt").read_text("utf-8")
    drawn = {" ": np.zeros((WIRES, ADVANCE), np.bool_)}
    # Blank lines part the groups; the first one says what the file is.
    for group in text.split("\n\n")[1:]:
        heading, *rows = group.strip("\n").split("\n")
        for start in range(0, len(heading), _STEP):
            dots = np.zeros((WIRES, ADVANCE), np.bool_)
            cut = [[mark == _DOT for mark in row[start : start + _COLUMNS]] for row in rows]
            dots[:, :_COLUMNS] = cut
            drawn[heading[start]] = dots
    for dots in drawn.values():
        dots.flags.writeable = False
    return drawn
