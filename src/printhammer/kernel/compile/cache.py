"""Where machine code is kept, and what is said while it is made.

Machine code lies in a folder: that of NUMBA_CACHE_DIR, `__pycache__` beside the kernel, numba's folder of the
user, or a temporary one of the user. In a container there may be none that can be written to, the disk may be
full, a file cut short, a folder copied from another machine. None of this is a reason not to run: what can
only be read is read, what cannot be kept or does not fit is made again.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import stat
import sys
import tempfile
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from time import thread_time
from typing import TYPE_CHECKING, Any

from numba.core import caching, config
from numba.misc import appdirs

from printhammer.kernel.compile import records

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# Numba's own types are not complete.
_config: Any = config
_caching: Any = caching
_user_folder: Any = appdirs.user_cache_dir

listeners: set[Callable[[str], None]] = set()
"""Called with a sentence before machine code is made, and where its folder is of no use."""

_NAME = "printhammer"
_USER = f"{_NAME}-{os.getuid() if hasattr(os, 'getuid') else os.environ.get('USERNAME', 'user')}"
_OTHER = "NUMBA_CACHE_DIR names another folder"
_said: set[str] = set()


def _say(sentence: str) -> None:
    for listener in tuple(listeners):
        listener(sentence)


def _say_once(sentence: str) -> None:
    if sentence not in _said:
        _said.add(sentence)
        _say(sentence)


def keep(function: Any, kind: str = "", label: str = "") -> Any:
    """Have a compiled function's machine code kept on disk, where that can be; return the function.

    `kind` is the kind of code in the records, and `label` says what it computes, for who waits for it.
    """
    # Plain Python where NUMBA_DISABLE_JIT is set.
    if hasattr(function, "py_func"):
        function._cache = Cache(function.py_func, kind, label)
    return function


def _temporary_folder() -> Path:
    return Path(tempfile.gettempdir()) / _USER


def _folders() -> Iterator[Path]:
    """Return where machine code may be, the folder that is wanted most first."""
    if _config.CACHE_DIR:
        yield Path(_config.CACHE_DIR) / _NAME
    yield Path(__file__).parents[1] / "__pycache__"
    yield Path(_user_folder("numba", appauthor=False)) / _NAME
    yield _temporary_folder()


def _is_safe(folder: Path) -> bool:
    """Tell whether nobody else can have put code, which would be run, into the temporary folder."""
    if folder != _temporary_folder():
        return True
    try:
        entry = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(entry.st_mode) and not (
        hasattr(os, "getuid") and (entry.st_uid != os.getuid() or entry.st_mode & 0o022)
    )


def _can_be_written(folder: Path) -> bool:
    try:
        if folder == _temporary_folder():
            folder.mkdir(mode=0o700, exist_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return _is_safe(folder)
    except OSError:
        return False


class _Locator(_caching._SourceFileBackedLocatorMixin, _caching._CacheLocator):  # type: ignore[misc]
    """Keeps machine code in one folder, whichever place the program is in: it can be copied."""

    def __init__(self, function: Any, folder: Path) -> None:
        self._py_file = inspect.getfile(function)
        self._lineno = function.__code__.co_firstlineno
        self._folder = folder

    def get_cache_path(self) -> str:
        return str(self._folder)


class _Results(_caching.CompileResultCacheImpl):  # type: ignore[misc]
    """Turns what was compiled into the content of files, and back."""

    def __init__(self, function: Any, folder: Path) -> None:
        self._locator = _Locator(function, folder)
        self._lineno = self._locator._lineno
        name = f"{Path(self._locator._py_file).stem}.{function.__qualname__}"
        self._filename_base = self.get_filename_base(name, getattr(sys, "abiflags", ""))


class _Files(_caching.IndexDataCacheFile):  # type: ignore[misc]
    """An index and files of machine code, each named after what it is for.

    Numba counts them: two processes that compile for different processors at once would take the same number.
    """

    def save(self, key: Any, data: Any) -> None:
        name = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:12], 16))
        self._save_data(name, data)
        entries = self._load_index()
        entries[key] = name
        self._save_index(entries)


class _Folder(_caching.FunctionCache):  # type: ignore[misc]
    """The machine code of one function in one folder."""

    def __init__(self, function: Any, folder: Path) -> None:
        self.folder = folder
        self._py_func = function
        self._name = repr(function)
        self._impl = _Results(function, folder)
        self._cache_path = str(folder)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)
        self.enable()

    def holds(self, target: Any) -> bool:
        """Tell whether there is machine code of the function for this processor."""
        try:
            entries = self._cache_file._load_index()
        except Exception:  # noqa: BLE001 - what unpickling a file cut short raises is not known
            return False
        return any(key[1] == target.codegen().magic_tuple() for key in entries)


class Cache(_caching._Cache):  # type: ignore[misc]
    """The machine code of a function on disk; trouble with its files is never that of who calls it.

    It is read from the folders that can only be read, up to the first one that can be written to, and kept
    in that one.
    """

    def __init__(self, function: Any, kind: str, label: str) -> None:
        self._function = function
        self.kind, self.label = kind, label
        self.with_it: tuple[Cache, ...] = ()
        """What is often needed after it."""
        self._begun = 0.0
        self._enabled = True

    @cached_property
    def _written(self) -> _Folder | None:
        folders = (folder for folder in _folders() if _can_be_written(folder))
        return next((_Folder(self._function, folder) for folder in folders), None)

    @cached_property
    def _read(self) -> list[_Folder]:
        folders: list[_Folder] = []
        for folder in _folders():
            if self._written is not None and folder == self._written.folder:
                return [*folders, self._written]
            if folder.is_dir() and _is_safe(folder):
                folders.append(_Folder(self._function, folder))
        return folders

    @property
    def cache_path(self) -> str | None:
        """The folder that machine code goes to; None if no folder can be written to."""
        return None if self._written is None else self._written.cache_path

    def enable(self) -> None:
        """Use the files."""
        self._enabled = True

    def disable(self) -> None:
        """Use no files."""
        self._enabled = False

    def flush(self) -> None:
        """Forget the machine code in the folder that can be written to."""
        if self._written is not None:
            self._try(self._written.flush)

    def holds(self, target: Any) -> bool:
        """Tell whether machine code of the function is on disk, for this processor and these versions."""
        return any(folder.holds(target) for folder in self._read)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return machine code that is kept; None, and say what comes, where there is none that fits."""
        for folder in self._read if self._enabled else ():
            try:
                result = folder.load_overload(sig, target_context)
            except Exception:  # noqa: BLE001 - what unpickling a file cut short raises is not known
                if folder is self._written:
                    self.flush()
            else:
                if result is not None:
                    return result
        if listeners:
            self._tell(target_context)
        self._begun = thread_time()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, and how long it took; say once in this process where it cannot be."""
        seconds = thread_time() - self._begun
        if self._written is None or not self._enabled:
            return
        self._try(self._written.save_overload, sig, data)
        if self.kind:
            with suppress(OSError):
                records.note(self._written.folder, self.kind, seconds)

    def _try(self, write: Callable[..., None], *arguments: Any) -> None:
        try:
            write(*arguments)
        except OSError as error:
            _say_once(f"{self.cache_path}: machine code cannot be kept ({error.strerror or error}); {_OTHER}")

    def _tell(self, target: Any) -> None:
        """Say what is about to be compiled, how long that takes, and what may follow."""
        folders = [folder.folder for folder in self._read]
        for folder in folders:
            if reason := records.mismatch(folder):
                _say_once(f"{folder}: the machine code there {reason}; it is made anew")
        seconds = records.expected(folders, self.kind)
        later = [other for other in self.with_it if not (other._begun or other.holds(target))]
        rest = sum(records.expected(folders, other.kind) for other in later)
        more = f", then at most {rest:.0f} s for {', '.join(other.kind for other in later)}" if later else ""
        what = f"{self.kind} ({self.label})"
        place = "" if self.place in _said else f"; {self.place}"
        _said.add(self.place)
        _say(f"compiling {what}: about {seconds:.0f} s{more}{place}")

    @property
    def place(self) -> str:
        """Where the machine code is kept, in a few words."""
        if self._written is None:
            return f"kept nowhere, since no folder for it can be written to; {_OTHER}"
        wanted, folder = next(_folders()), self._written.folder
        if _config.CACHE_DIR and folder != wanted:
            return f"once, kept in {folder}, since {wanted} cannot be written to"
        if folder == _temporary_folder():
            return f"once, kept in {folder}, since no other folder can be written to; {_OTHER}"
        return "once, kept on disk"
