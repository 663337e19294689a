"""Hammers that a studio offers by name: shipped hammers, and the hammer with which it was opened."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

Told = tuple[dict[str, Any], list[str]]
"""Valid entries of a state, and one sentence for each invalid entry."""

DEFAULT: Final = "hendriks-1983"
"""Name of the hammer that a studio page displays by default."""


class Shelf:
    """Hammers by name, never by path; `start` is the state of a page whose link contains none.

    Parameters
    ----------
    guest : Hammer, optional
        Hammer that the studio opens with; it may replace a shipped one of the same name.
    """

    def __init__(self, guest: Hammer | None = None) -> None:
        self.guest = guest
        self.start: Told = ({}, [])

    @property
    def names(self) -> list[str]:
        """Names of all hammers; the hammer with which the studio was opened comes first."""
        from printhammer.hammer.hammer import shipped

        others = sorted(shipped(), key=lambda name: (name != DEFAULT, name))
        if self.guest is None:
            return others
        return [self.guest.name, *(name for name in others if name != self.guest.name)]

    def is_guest(self, name: str) -> bool:
        """Whether a name is that of the hammer that the studio opened with."""
        return self.guest is not None and name == self.guest.name

    def is_shipped(self, name: str) -> bool:
        """Whether the hammer with a given name is an unmodified shipped hammer."""
        from printhammer.hammer.hammer import shipped

        return name in shipped() and self.hammer(name).fingerprint == _shipped(name).fingerprint

    def hammer(self, name: str) -> Hammer:
        """Return the hammer with a given name.

        Raises
        ------
        InputError
            The studio offers no hammer with this name.
        """
        if self.guest is not None and name == self.guest.name:
            return self.guest
        if name not in self.names:
            raise InputError.of("hammer", name, f"one of {', '.join(self.names)}")
        return _shipped(name)


@lru_cache(maxsize=16)
def _shipped(name: str) -> Hammer:
    from printhammer.hammer.hammer import load

    return load(name)
