"""HTML tables for notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Final

_MOST_LETTERS: Final = 80
"""Largest number of characters shown of a cell; arbitrary, about a line of a notebook."""


def html_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """Return an HTML table of rows below a heading; long cells are truncated."""
    head = f"<thead><tr>{''.join(f'<th>{escape(name)}</th>' for name in heads)}</tr></thead>" if heads else ""
    cells = ("".join(f"<td>{escape(_cut(cell))}</td>" for cell in row) for row in rows)
    return f"<table>{head}{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def titled(title: str, *parts: str) -> str:
    """Join HTML blocks below a title in bold type."""
    return f"<div><b>{escape(title)}</b>{''.join(parts)}</div>"


def _cut(text: str) -> str:
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."
