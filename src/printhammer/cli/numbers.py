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


def rates_between(text: str, name: str, *, most: int) -> list[float]:
    """Read two rates and how many they and those between them are, such as '1.2 kHz, 1.4 kHz, 41'.

    Returns
    -------
    list of float
        Ascending, Hz, with equal steps.

    Raises
    ------
    InputError
        It is something else, the second rate is not the higher one, or there are less than 2 or too many.
    """
    import numpy as np

    from printhammer.printing.dots.nominal import rate_of

    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3:
        raise InputError(f"{name} {text!r}: expected two rates and a number, such as '1.2 kHz, 1.4 kHz, 41'")
    low, high, count = rate_of(parts[0], name), rate_of(parts[1], name), whole(parts[2], name)
    if not low < high or count is None or not 2 <= count <= most:
        raise InputError(f"{name} {text!r}: expected the lower rate first, and a number from 2 to {most}")
    return [float(rate) for rate in np.linspace(low, high, count)]
