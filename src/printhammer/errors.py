"""Exceptions that printhammer raises deliberately."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Self


class PrinthammerError(Exception):
    """Base class of every exception that printhammer raises deliberately."""


class InputError(PrinthammerError, ValueError):
    """Error for invalid input: a file, an option or an argument.

    The message is one sentence, `<file>: <key> = <value>: expected <what>`. The command line prints the
    message and exits with status 2. The attributes hold the same information for programs; an attribute is
    None if the message lacks it.

    Parameters
    ----------
    message : str
        Description of the error, with file, key and value.
    file, key, value : optional
        Values of the attributes.
    expected : str, optional
        Expectation, appended to the message.

    Attributes
    ----------
    file : str or None
        Path of the file, or name of the object, that holds the key.
    key : str or None
        Name of the argument, option, entry or column.
    value : object
        Invalid value.
    expected : str or None
        Expectation.
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
        super().__init__(message if expected is None else f"{message}: expected {expected}")
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
    ) -> Self:
        """Compose the error for an invalid value from its key, value and expectation.

        Parameters
        ----------
        key, value, expected, file
            Values of the attributes.
        written : str, optional
            Text of the value in the message, by default its `repr`.
        unit : str
            Unit of the value in the message.
        """
        where = "" if file is None else f"{file}: "
        text = repr(value) if written is None else written
        text += unit and f" {unit}"
        return cls(f"{where}{key} = {text}", file=file, key=key, value=value, expected=expected)

    def within(self, where: object, *, file: object = None, key: str | None = None) -> InputError:
        """Return a copy of the error with a location added to its message and attributes.

        Parameters
        ----------
        where : object
            Prefix of the message; also the file, if neither file nor key is passed.
        file, key : optional
            File and key named by the prefix; the key is placed before the key of this error.
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
    """Add a location, such as a file or a key, to any `InputError` raised in the context.

    Arguments as for `InputError.within`.
    """
    try:
        yield
    except InputError as error:
        raise error.within(where, file=file, key=key) from None


def nearest(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the known name closest to a misspelled `name`, in quotes, for a message.

    If no name is close, return `otherwise`, by default a list of all names.
    """
    from difflib import get_close_matches

    names = list(known)
    close = get_close_matches(name, names, 1)
    return repr(close[0]) if close else otherwise or f"one of {', '.join(names)}"


def missing_extra(needs: str, extra: str) -> InputError:
    """Return the error for a missing package that the extra `extra` installs.

    The message begins with `needs`, which names the package and its purpose.
    """
    return InputError(
        f"{needs}, which the extra printhammer[{extra}] installs: pip install 'printhammer[{extra}]'",
        key=extra,
    )
