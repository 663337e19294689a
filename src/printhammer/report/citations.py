"""Which figures of the paper a claim is about, and the way to them."""

from __future__ import annotations

import re
from typing import Any, Final

CITATION: Final = re.compile(r"Figs?\. (?:[\d, and]*\d)")
"""Where a source names figures."""

SECTIONS: Final = {"Poincaré plots": 11}
"""Sections of the paper that are about one figure."""


def cited_figures(source: str) -> set[int]:
    """Return the numbers of the figures that a source of a claim names or is about."""
    named = {int(number) for number in re.findall(r"\d+", " ".join(CITATION.findall(source)))}
    return named | ({SECTIONS[source]} if source in SECTIONS else set())


def linked_source(source: str, drawn: set[int]) -> Any:
    """Return a source as HTML, the numbers of drawn figures linked."""
    from markupsafe import Markup, escape

    def link(match: re.Match[str]) -> str:
        number = match[0]
        return f'<a href="#figure-{number}">{number}</a>' if int(number) in drawn else number

    text = str(escape(source))
    text = CITATION.sub(lambda citation: re.sub(r"\d+", link, citation[0]), text)
    number = SECTIONS.get(source)
    if number in drawn:
        text += f' (<a href="#figure-{number}">Fig. {number}</a>)'
    return Markup(text)
