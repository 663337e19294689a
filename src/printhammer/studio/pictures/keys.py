"""Cache keys of the pictures of a state: a picture is computed again only if its key changes."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.studio.states.state import State

KEYS: Final[dict[str, Callable[[State], Any]]] = {
    "map": attrgetter("hammer", "text", "constants", "waveform", "slots", "overlap", "low", "high"),
    "line": attrgetter("hammer", "text", "constants", "waveform", "rate", "line"),
    "strobe": attrgetter("hammer", "text", "constants", "waveform", "rate", "overlap"),
}
"""Function that returns the cache key of a view for a state, by view."""


def kernel_key(state: State) -> tuple[Any, ...]:
    """Return a key that identifies the machine code needed to simulate a state.

    Raises
    ------
    InputError
        The state has no valid hammer or drive.
    """
    hammer, fired = state.changed, state.fired
    laws = tuple(sorted((section, type(part).__name__) for section, part in hammer.parts.items()))
    return laws, fired.shape, fired.quantity, state.overlap
