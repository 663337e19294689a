"""The errors that printhammer raises on purpose."""


class PrinthammerError(Exception):
    """Base of every error that printhammer raises on purpose."""


class InputError(PrinthammerError, ValueError):
    """Input from outside that cannot be used.

    The message is one sentence that names the file, the key, the value and what was expected. The command
    line prints it and ends with status 2.
    """
