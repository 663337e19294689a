"""What a worker is told to do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from printhammer.studio.states.state import State


ASKED: Final = ("curves", "dots", "exponent", "verdict")
"""What a page may ask of a state that it does not show."""


class Order(NamedTuple):
    """What a worker is to do."""

    role: str
    """ "curves", "map" or "detail"; "asked" for a question of the kind that is its only view."""
    serial: int
    state: State
    views: tuple[str, ...]
    """Views to be drawn anew, of those that are the matter of the role."""
    outdated: dict[str, str]
    """Why views that the page shows do not belong to this state, by their names."""
