"""The errors that printhammer raises on purpose."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager


class PrinthammerError(Exception):
    """Base of every error that printhammer raises on purpose."""


class InputError(PrinthammerError, ValueError):
    """Input from outside that cannot be used.

    The message is one sentence that names the file, the key, the value and what was expected. The command
    line prints it and ends with status 2.
    """


@contextmanager
def located(where: str) -> Iterator[None]:
    """Begin the message of an `InputError` with where it comes from, such as a file or a key."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def nearest(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the known name that comes closest to one, in quotes, for a message.

    Where none comes close, `otherwise`, by default all of them.
    """
    from difflib import get_close_matches

    names = list(known)
    close = get_close_matches(name, names, 1)
    return repr(close[0]) if close else otherwise or f"one of {', '.join(names)}"


def missing_extra(needs: str, extra: str) -> InputError:
    """Return the error that says what is not installed, such as "a store needs zarr", and how to get it."""
    return InputError(
        f"{needs}, which the extra printhammer[{extra}] installs: pip install 'printhammer[{extra}]'"
    )
