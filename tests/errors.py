"""Check of errors by their fields, so that no test depends on the wording of a message."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest

from printhammer.errors import InputError

ANY: Final = object()
"""Any value."""


@contextmanager
def refused(
    key: str | None, value: object = ANY, *, file: str | Path | None = None
) -> Iterator[pytest.ExceptionInfo[InputError]]:
    """Expect an `InputError` of one sentence with this key, and with this value and file if given.

    The key is None for a fault of a whole file, or for a value without a key; `file` is the path or the
    end of a path, and may be followed by a line or a column.
    """
    with pytest.raises(InputError) as caught:
        yield caught
    error = caught.value
    assert "\n" not in str(error)
    assert error.key == key, str(error)
    if value is not ANY:
        assert error.value is value or error.value == value, str(error)
    elif key is None:
        assert error.file is not None or error.value is not None, str(error)
    if file is not None:
        assert str(file) in str(error.file), str(error)
