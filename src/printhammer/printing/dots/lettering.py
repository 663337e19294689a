"""Conversion of text to dots: line breaking and rendering in the built-in font or a TrueType font.

The built-in font has nine wires and all printable ASCII characters; it was drawn for this package. Characters
are five columns wide and six columns apart: ten characters per inch at a column pitch of 1/60 in. Every
column is a slot in which a wire may be fired, so horizontal strokes are printed at the full slot rate; there
are no half-dot columns.

A TrueType font is rasterised to the wires of a head, at the largest size at which all printable ASCII
characters, and those of the text, fit on the wires. The horizontal dot spacing equals the wire spacing, and a
dot is set where the hinted outline covers the centre of its cell.
"""

from __future__ import annotations

import math
import string
import textwrap
from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np
from PIL.ImageFont import FreeTypeFont

from printhammer.errors import InputError
from printhammer.support.arrays import BoolArray

NAME: Final = "nine-wire"
WIRES: Final = 9  # Number of wires of the built-in font, by definition of the font file
ADVANCE: Final = 6
"""Character pitch, by definition of the font: columns between the starts of adjacent characters."""

_COLUMNS: Final = 5  # Number of columns of a character
_STEP: Final = 7  # Number of columns from character to character in the text of the font file
_DOT: Final = "#"


@cache
def glyphs() -> Mapping[str, BoolArray]:
    """Return the dots of each built-in character, shape (wires, columns) = (9, 6), top wire first."""
    text = (files("printhammer.printing.dots") / "fonts" / "nine-wire.txt").read_text("utf-8")
    drawn = {" ": np.zeros((WIRES, ADVANCE), np.bool_)}
    # Blank lines separate the groups; the first group describes the file.
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


_STANDARD: Final = "mpl-data/fonts/ttf/DejaVuSansMono.ttf"
_ASCII: Final = string.digits + string.ascii_letters + string.punctuation
_LARGER: Final = 2
"""Largest font size to try, as a multiple of the number of wires; arbitrary."""


def standard_font() -> Path:
    """Return the path of the default outline font, DejaVu Sans Mono, which ships with Matplotlib."""
    # Located without importing Matplotlib, which is slow.
    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent / _STANDARD


class OutlineFont:
    """A TrueType or OpenType font, sized so that ASCII characters and a given text fit on the wires.

    Raises
    ------
    InputError
        The file is not a font, or its characters do not fit even at the smallest size.
    """

    def __init__(self, path: str | Path, wires: int, text: str = "") -> None:
        self.path = Path(path)
        self.wires = wires
        self.name = self.path.stem
        _opened(self.path, 1)
        marks = {*_ASCII, *text} - set(self.missing("".join({*_ASCII, *text})))
        self._font, self._base = _load_fitted(self.path, wires, "".join(sorted(marks)))

    def missing(self, text: str) -> list[str]:
        """Return the distinct characters of `text` that the font lacks, in order of occurrence."""
        known = _characters(self.path)
        return [mark for mark in dict.fromkeys(text) if ord(mark) not in known]

    def glyph(self, mark: str) -> BoolArray:
        """Return the dots of one character, shape (wires, columns), with wire 0 at the top."""
        from PIL import Image, ImageDraw

        width = max(1, round(self._font.getlength(mark)))
        image = Image.new("1", (width, self.wires), 0)
        ImageDraw.Draw(image).text((0, self._base), mark, fill=1, font=self._font, anchor="ls")
        return np.array(image, dtype=np.bool_)


def _opened(path: Path, size: int) -> FreeTypeFont:
    from PIL import ImageFont

    try:
        return ImageFont.truetype(str(path), size, layout_engine=ImageFont.Layout.BASIC)
    except (OSError, ValueError):
        what = "a TrueType font" if path.is_file() else "a TrueType font file that exists"
        raise InputError(f"{path}: expected {what}", file=path) from None


@lru_cache(maxsize=16)
def _load_fitted(path: Path, wires: int, marks: str) -> tuple[FreeTypeFont, int]:
    """Load a font at the largest size at which the characters `marks` fit on the wires.

    Return the font, and the number of wires above the baseline.
    """
    for size in range(_LARGER * wires, 0, -1):
        font = _opened(path, size)
        boxes = [font.getbbox(mark, mode="1", anchor="ls") for mark in marks]
        up = max(0, *(math.ceil(-box[1]) for box in boxes))
        down = max(0, *(math.ceil(box[3]) for box in boxes))
        if up + down <= wires:
            return font, up
    raise InputError(
        f"{path}: {wires} wires are too few for this font", file=path, key="wires", expected="more"
    )


@lru_cache(maxsize=16)
def _characters(path: Path) -> frozenset[int]:
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(path)).get_charmap())


COLUMNS: Final = 40  # Default number of characters in a print line; arbitrary

_NAMED: Final = 8  # Largest number of missing characters named in a message; arbitrary


def broken(text: str, columns: int = COLUMNS) -> list[str]:
    """Break a text into print lines of at most `columns` characters, between words where possible.

    Line ends and empty lines of the text are kept.
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
    text: str, wires: int = WIRES, font: str | Path | None = None, columns: int = COLUMNS
) -> BoolArray:
    """Convert a text to dots, shape (lines, wires, slots); see `Pattern.from_text`."""
    if columns < 1:
        raise InputError.of("columns", columns, "1 or more characters in a line", written=str(columns))
    if not text.strip():
        raise InputError.of("text", text, "something to print")
    glyph: Callable[[str], BoolArray]
    lines = broken(text, columns)
    if font is None and wires == WIRES:
        known = glyphs()
        name, glyph = NAME, known.__getitem__
        lacking = [mark for mark in dict.fromkeys("".join(lines)) if mark not in known]
    else:
        outlines = OutlineFont(standard_font() if font is None else font, wires, "".join(lines))
        name, glyph = outlines.name, outlines.glyph
        lacking = outlines.missing("".join(lines))
    if lacking:
        some = ", ".join(repr(mark) for mark in lacking[:_NAMED])
        more = f" and {len(lacking) - _NAMED} more" if len(lacking) > _NAMED else ""
        raise InputError(
            f"text: the font {name} has no {some}{more}", key="text", expected="characters that it has"
        )
    dots = {mark: glyph(mark) for mark in set("".join(lines))}
    rows = [[dots[mark] for mark in line] for line in lines]
    wide = max(sum(block.shape[1] for block in row) for row in rows)
    whole = np.zeros((len(rows), wires, wide), np.bool_)
    for line, row in zip(whole, rows, strict=True):
        if row:
            joined = np.hstack(row)
            line[:, : joined.shape[1]] = joined
    return whole
