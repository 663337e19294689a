"""What a notebook shows of results and their parts: short tables, HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

MOST_ROWS: Final = 40
"""Rows shown of a table; of more, the first and the last."""

_MOST_LETTERS: Final = 80


def html_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """Return a table; cells are cut to 80 letters."""
    head = f"<thead><tr>{''.join(f'<th>{escape(name)}</th>' for name in heads)}</tr></thead>" if heads else ""
    cells = ("".join(f"<td>{escape(_cut(cell))}</td>" for cell in row) for row in rows)
    return f"<table>{head}{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def titled(title: str, *parts: str) -> str:
    """Return parts of HTML below a title in bold."""
    return f"<div><b>{escape(title)}</b>{''.join(parts)}</div>"


def cell(value: Any) -> str:
    """Return a value as a cell: numbers to six digits, arrays by their shape, None as a dash."""
    if value is None:
        return "-"
    if isinstance(value, np.ndarray):
        return f"array, {extent(value)}"
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)


def extent(values: Any) -> str:
    """Return the shape of an array, such as "3 × 512"."""
    return " × ".join(map(str, np.shape(values)))


def span(values: Any) -> str:
    """Return least and largest of numbers; empty where there are none."""
    array = np.asarray(values)
    if array.dtype.kind not in "fiu":
        return ""
    finite = array[np.isfinite(array)]
    return f"{finite.min():.6g} to {finite.max():.6g}" if finite.size else ""


def shortened(rows: Sequence[Sequence[str]]) -> list[Sequence[str]]:
    """Return at most `MOST_ROWS` rows: of more, the first and the last, and dots between them."""
    if len(rows) <= MOST_ROWS:
        return list(rows)
    half = MOST_ROWS // 2
    return [*rows[:half], ["…"] * len(rows[0]), *rows[-half:]]


def _cut(text: str) -> str:
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."
