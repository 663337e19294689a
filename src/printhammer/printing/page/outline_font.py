"""TrueType fonts as dots: characters rasterised to the wires of a head.

The size is the largest at which all printable characters of ASCII, and those of the text, fit on the wires.
Dots are as far apart across as wires are, and a dot is set where the outline covers the middle of its cell,
hinted by the font.
"""

from __future__ import annotations

import math
import string
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

    from printhammer.support.arrays import BoolArray

_STANDARD: Final = "mpl-data/fonts/ttf/DejaVuSansMono.ttf"
_ASCII: Final = string.digits + string.ascii_letters + string.punctuation
_LARGER: Final = 2
"""Size from which on the one that fits is looked for, in wires."""


def standard_font() -> Path:
    """Return the font used where the built-in one has too few wires: DejaVu Sans Mono, of matplotlib."""
    # Found without importing matplotlib, which takes a while.
    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent / _STANDARD


class OutlineFont:
    """A TrueType or OpenType font at the size at which ASCII and a text fit a number of wires.

    Raises
    ------
    InputError
        The file is no font, or its characters do not fit even at the least size.
    """

    def __init__(self, path: str | Path, wires: int, text: str = "") -> None:
        self.path = Path(path)
        self.wires = wires
        self.name = self.path.stem
        _opened(self.path, 1)
        marks = {*_ASCII, *text} - set(self.missing("".join({*_ASCII, *text})))
        self._font, self._base = _fitted(self.path, wires, "".join(sorted(marks)))

    def missing(self, text: str) -> list[str]:
        """Return the characters that the font lacks, each once, in the order in which they come."""
        known = _characters(self.path)
        return [mark for mark in dict.fromkeys(text) if ord(mark) not in known]

    def glyph(self, mark: str) -> BoolArray:
        """Return the dots of one character, wires from the top by columns; at least one column."""
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
        what = "a TrueType font" if path.is_file() else "a TrueType font file that is there"
        raise InputError(f"{path}: expected {what}") from None


@lru_cache(maxsize=16)
def _fitted(path: Path, wires: int, marks: str) -> tuple[FreeTypeFont, int]:
    """Return the font at the largest size that fits, and the wires above the base line."""
    for size in range(_LARGER * wires, 0, -1):
        font = _opened(path, size)
        boxes = [font.getbbox(mark, mode="1", anchor="ls") for mark in marks]
        up = max(0, *(math.ceil(-box[1]) for box in boxes))
        down = max(0, *(math.ceil(box[3]) for box in boxes))
        if up + down <= wires:
            return font, up
    raise InputError(f"{path}: {wires} wires are too few for this font, expected more")


@lru_cache(maxsize=16)
def _characters(path: Path) -> frozenset[int]:
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(path)).get_charmap())
