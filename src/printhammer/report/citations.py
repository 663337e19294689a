"""Which figures of the paper a claim is about."""

from __future__ import annotations

import re
from typing import Final

CITATION: Final = re.compile(r"Figs?\. (?:[\d, and]*\d)")
"""Where a source names figures."""

SECTIONS: Final = {"Poincaré plots": 11}
"""Sections of the paper that are about one figure."""


def cited_figures(source: str) -> set[int]:
    """Return the numbers of the figures that a source of a claim names or is about."""
    named = {int(number) for number in re.findall(r"\d+", " ".join(CITATION.findall(source)))}
    return named | ({SECTIONS[source]} if source in SECTIONS else set())
