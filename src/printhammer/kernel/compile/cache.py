"""Where machine code is kept: where numba keeps it, else in a temporary folder of the user, else nowhere.

Numba looks for a folder that can be written to: that of NUMBA_CACHE_DIR, `__pycache__` beside the source, the
cache of the user. In a container there may be none, the disk may be full, or a file cut short. None of this
is a reason not to run: machine code that cannot be kept is made again.
"""

from __future__ import annotations

import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from numba.core import caching, config

if TYPE_CHECKING:
    from collections.abc import Callable

# Numba's own types are not complete.
_config: Any = config
_caching: Any = caching

announce: Callable[[str], None] | None = None
"""Called with one sentence, once, where machine code cannot be written to its folder."""

_USER = f"printhammer-{os.getuid() if hasattr(os, 'getuid') else os.environ.get('USERNAME', 'user')}"
_OTHER = "NUMBA_CACHE_DIR names another folder"


def keep(function: Any) -> Any:
    """Have a compiled function's machine code kept on disk, where that can be; return the function."""
    # Plain Python where NUMBA_DISABLE_JIT is set.
    if hasattr(function, "py_func"):
        # If no folder can be written to, numba's own `NullCache`, which keeps nothing, stays.
        with suppress(RuntimeError, OSError):
            function._cache = _Cache(function.py_func)
    return function


def kept(function: Any) -> str:
    """Say in a few words where the machine code of a compiled function is kept."""
    folder = function.stats.cache_path
    if folder is None:
        return f"kept nowhere, since no folder for it can be written to; {_OTHER}"
    wanted = _config.CACHE_DIR
    if wanted and Path(wanted) not in Path(folder).parents:
        return f"once; kept in {Path(folder).parent}, since {wanted} cannot be written to"
    if Path(folder).parent.name == _USER:
        return f"once; kept in {Path(folder).parent}, since no other folder can be written to; {_OTHER}"
    return "once; kept on disk"


def _temporary_folder() -> Path:
    return Path(tempfile.gettempdir()) / _USER


class _TemporaryLocator(_caching.UserWideCacheLocator):  # type: ignore[misc]
    """Keeps machine code in a temporary folder that belongs to the user alone."""

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(_temporary_folder() / self.get_suitable_cache_subpath(file))

    def ensure_cache_path(self) -> None:
        """Make the folder; OSError if it cannot be made, or is another user's, whose code would be run."""
        folder = _temporary_folder()
        folder.mkdir(mode=0o700, exist_ok=True)
        entry = folder.lstat()
        if not stat.S_ISDIR(entry.st_mode) or (
            hasattr(os, "getuid") and (entry.st_uid != os.getuid() or entry.st_mode & 0o022)
        ):
            raise PermissionError(f"{folder}: expected a folder of this user alone")
        super().ensure_cache_path()


class _Files(_caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes: ClassVar[list[Any]] = [
        *_caching.CompileResultCacheImpl._locator_classes,
        _TemporaryLocator,
    ]


class _Cache(_caching.FunctionCache):  # type: ignore[misc]
    """The cache of a function, whose trouble with files is never that of who calls it."""

    _impl_class = _Files

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return machine code that is kept, None where there is none or its files cannot be read."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 - what unpickling a file cut short raises is not known
            self._try(self.flush)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code; say once in this process where it cannot be."""
        self._try(super().save_overload, sig, data)

    def _try(self, write: Callable[..., None], *arguments: Any) -> None:
        global announce  # noqa: PLW0603
        try:
            write(*arguments)
        except OSError as error:
            if announce is not None:
                reason = error.strerror or error
                announce(f"{self.cache_path}: machine code cannot be kept ({reason}); {_OTHER}")
                announce = None
