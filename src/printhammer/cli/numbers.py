"""Numbers on the command line, refused in one sentence like every other input."""

from __future__ import annotations

from printhammer.errors import InputError


def whole(text: str | None, name: str) -> int | None:
    """Read a whole number; None stays None.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        return None if text is None else int(text)
    except ValueError:
        raise InputError(f"{name} = {text!r}: expected a whole number") from None


def number(text: str | None, name: str) -> float | None:
    """Read a number; None stays None.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        return None if text is None else float(text)
    except ValueError:
        raise InputError(f"{name} = {text!r}: expected a number") from None
