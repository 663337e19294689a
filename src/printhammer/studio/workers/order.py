"""Orders for workers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from printhammer.studio.states.state import State


ASKED: Final = ("curves", "dots", "exponent", "verdict")
"""Questions of a page about a state that it does not show."""


class Order(NamedTuple):
    """Order for a worker."""

    role: str
    """Role: "curves", "map" or "detail"; "asked" for a question, whose kind is the only view."""
    serial: int
    state: State
    views: tuple[str, ...]
    """Views of the role to be drawn again."""
    outdated: dict[str, str]
    """Reasons why displayed views do not belong to this state, by view."""
