"""Collection of the hammers that a studio page offers, by name."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer, load, shipped

DEFAULT: Final = "hendriks-1983"
"""Name of the hammer that a studio page displays by default."""

_load: Final = lru_cache(maxsize=32)(load)


class Shelf:
    """Hammers of a studio page, in display order; the page opens with the first hammer.

    Parameters
    ----------
    *own : Hammer
        Hammers that come first; each may replace a shipped hammer of the same name.
    only : bool, optional
        Whether to omit the shipped hammers; without `own`, all shipped hammers are included.

    Raises
    ------
    InputError
        Two different hammers among `own` have the same name.
    """

    def __init__(self, *own: Hammer, only: bool = False) -> None:
        self.own: dict[str, Hammer] = {}
        for hammer in own:
            if self.own.setdefault(hammer.name, hammer).fingerprint != hammer.fingerprint:
                raise InputError(
                    f"two different hammers are named '{hammer.name}'",
                    key="name",
                    value=hammer.name,
                    expected="a name for each hammer of a page",
                )
        others = () if only and own else sorted(shipped(), key=lambda name: (name != DEFAULT, name))
        self.names: Final = list(dict.fromkeys([*self.own, *others]))
        """Names of all hammers."""

    def is_shipped(self, name: str) -> bool:
        """Whether the hammer with the name `name` is an unmodified shipped hammer."""
        return name in shipped() and self.hammer(name).fingerprint == _load(name).fingerprint

    def hammer(self, name: str) -> Hammer:
        """Return the hammer with the name `name`."""
        return self.own.get(name) or _load(name)
