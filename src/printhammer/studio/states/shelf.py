"""The hammers that one studio offers by name: those of the program, and the one that it opened with."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

Told = tuple[dict[str, Any], list[str]]
"""Entries of a state that can be taken, and sentences about those that cannot."""

DEFAULT: Final = "hendriks-1983"
"""Hammer that a studio opens with unless told otherwise."""


class Shelf:
    """Hammers by name, which is never taken for a path; `start` is what a page without a state opens with.

    Parameters
    ----------
    guest : Hammer, optional
        The hammer that the studio opens with; it may stand in the place of one that comes with the program.
    """

    def __init__(self, guest: Hammer | None = None) -> None:
        self.guest = guest
        self.start: Told = ({}, [])

    @property
    def names(self) -> list[str]:
        """Names of all hammers, the one that the studio opens with first."""
        from printhammer.hammer.hammer import shipped

        others = sorted(shipped(), key=lambda name: (name != DEFAULT, name))
        if self.guest is None:
            return others
        return [self.guest.name, *(name for name in others if name != self.guest.name)]

    def is_guest(self, name: str) -> bool:
        """Whether this is the name of the hammer that the studio opened with."""
        return self.guest is not None and name == self.guest.name

    def is_shipped(self, name: str) -> bool:
        """Whether the hammer of this name is one that comes with the program, as it does."""
        from printhammer.hammer.hammer import shipped

        return name in shipped() and self.hammer(name).fingerprint == _shipped(name).fingerprint

    def hammer(self, name: str) -> Hammer:
        """Return a hammer.

        Raises
        ------
        InputError
            It is not offered.
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
