"""The errors that printhammer raises on purpose."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Self


class PrinthammerError(Exception):
    """Base of every error that printhammer raises on purpose."""


class InputError(PrinthammerError, ValueError):
    """Input from outside that cannot be used.

    The message is one sentence that names the file, the key, the value and what was expected. The command
    line prints it and ends with status 2. The attributes hold the same for programs; None where the message
    has no such part.

    Parameters
    ----------
    message : str
        The fault, with file, key and value.
    file, key, value : optional
        The attributes.
    expected : str, optional
        What was expected; it ends the message.

    Attributes
    ----------
    file : str or None
        Path of the file, or name of the object, that holds the key.
    key : str or None
        Name of the argument, option, entry or column.
    value : object
        The value that cannot be used.
    expected : str or None
        What was expected instead.
    """

    def __init__(
        self,
        message: str,
        *,
        file: object = None,
        key: str | None = None,
        value: object = None,
        expected: object = None,
    ) -> None:
        super().__init__(message if expected is None else f"{message}, expected {expected}")
        self.file = None if file is None else str(file)
        self.key, self.value = key, value
        self.expected = None if expected is None else str(expected)

    @classmethod
    def of(
        cls,
        key: str,
        value: object,
        expected: object,
        *,
        file: object = None,
        written: str | None = None,
        unit: str = "",
        said: str = ", expected",
    ) -> Self:
        """Compose the message of a value that is not as expected.

        Parameters
        ----------
        key, value, expected, file
            The attributes.
        written : str, optional
            Text of the value in the message, by default its `repr`.
        unit : str
            Unit of the value in the message.
        said : str
            Words between the value and what was expected.
        """
        where = "" if file is None else f"{file}: "
        text = repr(value) if written is None else written
        text += unit and f" {unit}"
        error = cls(f"{where}{key} = {text}{said} {expected}", file=file, key=key, value=value)
        error.expected = str(expected)
        return error

    def within(self, where: object, *, file: object = None, key: str | None = None) -> InputError:
        """Return the error with words before its message, and its place in its fields.

        Parameters
        ----------
        where : object
            What stands before the message. It is the file where neither file nor key is given.
        file, key : optional
            The file and the key that the words name; before the file and the key of this error.
        """
        file = where if file is None and key is None else file
        files = [str(part) for part in (file, self.file) if part is not None]
        keys = [part for part in (key, self.key) if part is not None]
        place, key = ": ".join(files) or None, ".".join(keys) or None
        error = InputError(f"{where}: {self}", file=place, key=key, value=self.value)
        error.expected = self.expected
        return error


@contextmanager
def located(where: object, *, file: object = None, key: str | None = None) -> Iterator[None]:
    """Begin the message of an `InputError` with where it comes from, such as a file or a key."""
    try:
        yield
    except InputError as error:
        raise error.within(where, file=file, key=key) from None


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
        f"{needs}, which the extra printhammer[{extra}] installs: pip install 'printhammer[{extra}]'",
        key=extra,
    )
