"""Jobs that a session sends to its workers, and the questions that a page may ask."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from printhammer.studio.states.state import State


ASKED: Final = ("curves", "dots", "exponent", "verdict")
"""Kinds of question that a page may ask about a state that it does not display."""


class Order(NamedTuple):
    """Job for a worker: views of one state to compute, or one question to answer."""

    role: str
    """Role of the job: "curves", "map" or "detail"; "asked" for a question, whose kind is the only view."""
    serial: int
    state: State
    views: tuple[str, ...]
    """Names of the views to compute."""
    outdated: dict[str, str]
    """Reasons why displayed views do not show this state yet, by view."""
