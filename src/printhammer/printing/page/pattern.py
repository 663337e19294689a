"""Dot patterns: masks of the requested dots by print line, wire and slot, and pattern files.

Patterns are read from and written to TOML or bitmap files.

A pattern file has four keys, all of them required::

    format = 1
    name = "two letters"
    wires = 9
    rows = [
      ".###...#...#.",
      "#...#..#...#.",
      ...
    ]

Each row is one wire, each character one slot: ``#`` for a dot, ``.`` for an empty slot. All rows have
the same length, and their number is a multiple of `wires`: print line after print line, wires from the top.

In a bitmap every pixel is a slot of a wire; dark, opaque pixels are dots. Missing pixel rows of the last
print line are empty.
"""

from __future__ import annotations

import json
import tomllib
from io import BytesIO
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.dots import lettering
from printhammer.printing.dots.lettering import COLUMNS, lettered
from printhammer.results import Declared, column, part
from printhammer.support.arrays import BoolArray
from printhammer.support.constants import shown
from printhammer.support.files import read_text, write_file

FORMAT: Final = 1  # Version of the pattern file format

BITMAPS: Final = {".png": "PNG", ".pbm": "PPM", ".bmp": "BMP"}
"""File suffixes of bitmaps."""
SUFFIXES: Final = (".toml", *BITMAPS)
"""File suffixes of all pattern files, bitmaps included."""

_KEYS: Final = ("format", "name", "wires", "rows")
_DOT, _EMPTY = "#", "."
_MOST_PIXELS: Final = 50_000_000  # Largest number of pixels of a bitmap; arbitrary, bounds the memory


def read_pattern(path: str | Path, wires: int | None = None) -> tuple[str, BoolArray]:
    """Read a pattern file; return its name and its dots, shape (lines, wires, slots).

    The name of a bitmap is the file name without its suffix.
    """
    source = Path(path)
    suffix = source.suffix.lower()
    if suffix in BITMAPS:
        return source.stem, _bitmap(source, lettering.WIRES if wires is None else wires)
    if suffix != ".toml":
        raise InputError(f"{source}: expected a name that ends in one of {', '.join(SUFFIXES)}", file=source)
    name, dots = pattern_from_toml(read_text(source, "the pattern file"), str(source))
    if wires is not None and wires != dots.shape[1]:
        raise InputError.of("wires", dots.shape[1], wires, file=source, written=str(dots.shape[1]))
    return name, dots


def pattern_from_toml(text: str, source: str = "pattern") -> tuple[str, BoolArray]:
    """Parse the text of a pattern file; return the name of the pattern and its dots.

    `source` is the name of the file in error messages.
    """
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: expected TOML ({' '.join(str(error).split())})", file=source) from None
    for key in data:
        if key not in _KEYS:
            odd = key if key.isprintable() else shown(key)
            raise InputError(
                f"{source}: {odd} is not known", file=source, key=odd, expected=f"{', '.join(_KEYS)}"
            )
    for key in _KEYS:
        if key not in data:
            raise InputError(f"{source}: {key} is missing", file=source, key=key)
    if data["format"] != FORMAT or isinstance(data["format"], bool | float):
        raise InputError.of("format", data["format"], FORMAT, file=source, written=shown(data["format"]))
    name, wires, rows = data["name"], data["wires"], data["rows"]
    if not isinstance(name, str) or not name.strip():
        raise InputError.of("name", name, "a name", file=source, written=shown(name))
    if not isinstance(wires, int) or isinstance(wires, bool) or wires < 1:
        raise InputError.of("wires", wires, "a whole number from 1 on", file=source, written=shown(wires))
    if not isinstance(rows, list) or not rows or not all(isinstance(row, str) for row in rows):
        raise InputError.of(
            "rows", rows, f"a list of rows of '{_DOT}' and '{_EMPTY}'", file=source, written=shown(rows)
        )
    return name, _parse_rows(rows, wires, source)


def _parse_rows(rows: list[str], wires: int, source: str) -> BoolArray:
    """Parse text rows of '#' and '.' into a mask of dots, shape (lines, wires, slots)."""
    if len(rows) % wires:
        raise InputError(
            f"{source}: rows has {len(rows)} rows",
            file=source,
            key="rows",
            expected=f"a multiple of wires = {wires}",
        )
    for number, row in enumerate(rows, 1):
        odd = [mark for mark in row if mark not in (_DOT, _EMPTY)]
        if odd:
            raise InputError(
                f"{source}: rows: {odd[0]!r} in row {number}",
                file=source,
                key="rows",
                expected=f"'{_DOT}' and '{_EMPTY}'",
            )
        if len(row) != len(rows[0]):
            raise InputError(
                f"{source}: rows: row {number} has {len(row)} slots",
                file=source,
                key="rows",
                expected=f"{len(rows[0])} as the first",
            )
    dots = np.array([[mark == _DOT for mark in row] for row in rows], np.bool_)
    return dots.reshape(-1, wires, len(rows[0]))


def _bitmap(path: Path, wires: int) -> BoolArray:
    from PIL import Image

    if wires < 1:
        raise InputError.of("wires", wires, "1 or more", written=str(wires))
    try:
        with Image.open(path, formats=sorted(set(BITMAPS.values()))) as image:
            if image.width * image.height > _MOST_PIXELS:
                raise InputError(
                    f"{path}: {image.width} x {image.height} pixels",
                    file=path,
                    key="pixels",
                    expected=f"at most {_MOST_PIXELS}",
                )
            pixels = np.asarray(image.convert("LA"))
    except (OSError, ValueError, SyntaxError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None)
        why = f" ({reason})" if reason else ""
        raise InputError(f"{path}: expected a bitmap that can be read{why}", file=path) from None
    dark = (pixels[:, :, 0] < 128) & (pixels[:, :, 1] >= 128)
    lines = -(-len(dark) // wires)
    dots = np.zeros((lines * wires, dark.shape[1]), np.bool_)
    dots[: len(dark)] = dark
    return dots.reshape(lines, wires, -1)


def pattern_toml(name: str, dots: BoolArray) -> str:
    """Render a pattern as the text of a pattern file; parsing the text restores name and dots."""
    _lines, wires, slots = dots.shape
    marks = np.where(dots.reshape(-1, slots), _DOT, _EMPTY)
    rows = "\n".join(f'  "{"".join(row)}",' for row in marks.tolist())
    title = json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")
    return f"format = {FORMAT}\nname = {title}\nwires = {wires}\nrows = [\n{rows}\n]\n"


def write_pattern(path: str | Path, name: str, dots: BoolArray) -> None:
    """Write a pattern file or a bitmap; see `Pattern.save`."""
    target = Path(path)
    suffix = target.suffix.lower()
    content: Any
    if suffix == ".toml":
        content = pattern_toml(name, dots)
    elif suffix in BITMAPS:
        from PIL import Image

        buffer = BytesIO()
        white = ~dots.reshape(-1, dots.shape[2])
        Image.fromarray(white).save(buffer, format=BITMAPS[suffix])
        content = buffer.getvalue()
    else:
        raise InputError(f"{target}: expected a name that ends in one of {', '.join(SUFFIXES)}", file=target)
    write_file(target, content)


MOST_WIRES: Final = 1000
"""Largest number of wires of a head; arbitrary."""
MOST_CELLS: Final = 50_000_000
"""Largest number of cells of a pattern; arbitrary."""

_TITLE: Final = 60  # Largest length of a title in a picture; arbitrary


class Pattern(Declared):
    """Requested dots of a page, by print line, wire and slot.

    Raises
    ------
    InputError
        The array has the wrong shape, is too large, or contains no dot.
    """

    name: str = part("name of the pattern")
    dots: BoolArray = column(
        "1",
        "mask of the requested dots",
        "line wire slot",
        more="lines and wires from the top, slots from the left, each slot one column of dots; read-only",
    )

    def __post_init__(self) -> None:
        dots = np.array(self.dots, dtype=np.bool_)
        if dots.ndim == 2:
            dots = dots[np.newaxis]
        if dots.ndim != 3 or not 1 <= dots.shape[1] <= MOST_WIRES or dots.size > MOST_CELLS:
            raise InputError(
                f"pattern {self.name!r}: an array of shape {np.shape(self.dots)}",
                key="dots",
                expected=f"print lines, up to {MOST_WIRES} wires and slots, {MOST_CELLS} cells at most",
            )
        if not dots.any():
            raise InputError(
                f"pattern {self.name!r}: no dot is requested", key="dots", expected="at least one"
            )
        dots.flags.writeable = False
        object.__setattr__(self, "dots", dots)

    @classmethod
    def from_text(
        cls,
        text: str,
        wires: int = lettering.WIRES,
        *,
        font: str | Path | None = None,
        columns: int = COLUMNS,
    ) -> Self:
        """Convert a text to a dot pattern.

        Parameters
        ----------
        text : str
            Text to print; line ends are kept.
        wires : int, optional
            Number of wires.
        font : path, optional
            Path of a TrueType font; by default the built-in font of `printhammer.printing.dots.lettering` for
            9 wires, and DejaVu Sans Mono for other numbers of wires.
        columns : int, optional
            Largest number of characters in a print line.

        Raises
        ------
        InputError
            The text is empty, the font lacks a character, or the font file cannot be read.
        """
        if not 1 <= wires <= MOST_WIRES:
            raise InputError.of("wires", wires, f"1 to {MOST_WIRES}", written=str(wires))
        title = " ".join(text.split())
        short = title if len(title) <= _TITLE else f"{title[: _TITLE - 1]}…"
        return cls(short, lettered(text, wires, font, columns))

    @classmethod
    def load(cls, path: str | Path, wires: int | None = None) -> Self:
        """Read a pattern file (.toml) or a bitmap (.png, .pbm, .bmp).

        The format is described in `printhammer.printing.page.pattern`.

        Parameters
        ----------
        path : path
            Path of the file.
        wires : int, optional
            Number of wires. For a bitmap, 9 by default; a pattern file states its own number, which must
            match.
        """
        return cls(*read_pattern(path, wires))

    def save(self, path: str | Path) -> None:
        """Write a pattern file (.toml) or a bitmap (.png, .pbm, .bmp); the file is replaced atomically."""
        write_pattern(path, self.name, self.dots)

    @property
    def lines(self) -> int:
        """Number of print lines."""
        return int(self.dots.shape[0])

    @property
    def wires(self) -> int:
        """Number of wires of the head."""
        return int(self.dots.shape[1])

    @property
    def slots(self) -> int:
        """Number of slots of a print line."""
        return int(self.dots.shape[2])

    @property
    def wanted(self) -> int:
        """Number of requested dots, summed over all lines and wires."""
        return int(self.dots.sum())

    def __eq__(self, other: Any) -> bool:
        if not isinstance(other, Pattern):
            return NotImplemented
        return self.name == other.name and np.array_equal(self.dots, other.dots)

    def __hash__(self) -> int:
        return hash((self.name, self.dots.shape, self.dots.tobytes()))
