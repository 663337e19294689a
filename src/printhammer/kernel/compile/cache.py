"""Disk cache of machine code and lowered modules, and the messages shown during compilation.

The cache folder is the first writable one of: NUMBA_CACHE_DIR, `__pycache__` in the kernel package, the
user's numba cache folder, and a temporary folder of the user. Cache problems never stop the program: cached
code is also read from read-only folders; code whose file is missing, truncated, damaged or made for another
machine is compiled again, even if no folder is writable or the disk is full.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from contextlib import contextmanager, nullcontext, suppress
from functools import cached_property
from pathlib import Path
from time import thread_time
from typing import TYPE_CHECKING, Final

from printhammer.kernel.compile import records

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

listeners: set[Callable[[str], None]] = set()
"""Functions called with a message before compilation, and when a cache folder cannot be used."""

watchers: set[Callable[[bool], None]] = set()
"""Functions called with True when a compilation starts, and with False when it has ended or failed."""

_NAME = "printhammer"
_USER = f"{_NAME}-{os.getuid() if hasattr(os, 'getuid') else os.environ.get('USERNAME', 'user')}"
_WANTED = "NUMBA_CACHE_DIR"
_OTHER = f"{_WANTED} names another folder"
_MARK: Final = b"printhammer 1\n"
"""First bytes of every cache file; the SHA-256 digest of the payload and the payload follow."""
_said: set[str] = set()


def _say(sentence: str) -> None:
    for listener in tuple(listeners):
        listener(sentence)


def say_once(sentence: str) -> None:
    """Pass a message to all listeners, at most once per process."""
    if sentence not in _said:
        _said.add(sentence)
        _say(sentence)


def _temporary_folder() -> Path:
    return Path(tempfile.gettempdir()) / _USER


def _user_folder() -> Path:
    """Return the user's numba cache folder, following the convention of the operating system."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "numba" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "numba"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "numba"


def _folders() -> Iterator[Path]:
    """Yield the possible cache folders, the preferred folder first."""
    if wanted := os.environ.get(_WANTED):
        yield Path(wanted) / _NAME
    yield Path(__file__).parents[1] / "__pycache__"
    with suppress(RuntimeError):
        # RuntimeError: the user has no home folder.
        yield _user_folder() / _NAME
    yield _temporary_folder()


def _is_safe(folder: Path) -> bool:
    """Whether only the user can write to a cache folder; assumed for all but the temporary folder."""
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


def _content(path: Path) -> bytes | None:
    """Return the payload of a cache file; None if the file is missing, truncated or damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    head = len(_MARK) + hashlib.sha256().digest_size
    payload = content[head:]
    return payload if content == sealed(payload) else None


def sealed(payload: bytes) -> bytes:
    """Return the content of a cache file: `_MARK`, the SHA-256 digest of the payload, and the payload."""
    return _MARK + hashlib.sha256(payload).digest() + payload


def _write(path: Path, payload: bytes) -> None:
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        draft.write_bytes(sealed(payload))
        draft.replace(path)
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold the lock of a cache file while its content is computed; no lock if the system supports none."""
    lock = path.with_name(f".{path.name}.lock")
    handle = -1
    try:
        import fcntl

        while handle < 0:
            handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o600)
            fcntl.flock(handle, fcntl.LOCK_EX)
            # The previous owner has deleted the lock file, so another process may hold a new file: retry.
            if os.fstat(handle).st_nlink == 0:
                os.close(handle)
                handle = -1
    except (ImportError, OSError):
        # Without a lock, two processes may make the same content; the last process replaces the file.
        pass
    try:
        yield
    finally:
        if handle >= 0:
            with suppress(OSError):
                lock.unlink()
            os.close(handle)


class File:
    """File of the disk cache, named after the digest of its sources.

    The file is looked up in the folders up to and including the first writable folder, and is written to that
    folder. Read and write errors never stop the program: the content is then created again.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    @cached_property
    def _written(self) -> Path | None:
        """Folder to which the file is written; None if no folder is writable."""
        return next((folder for folder in _folders() if _can_be_written(folder)), None)

    @cached_property
    def _read(self) -> list[Path]:
        folders: list[Path] = []
        for folder in _folders():
            if folder == self._written:
                return [*folders, folder]
            if folder.is_dir() and _is_safe(folder):
                folders.append(folder)
        return folders

    @property
    def can_be_kept(self) -> bool:
        """Whether the file can be cached, i.e. whether a cache folder is writable."""
        return self._written is not None

    def read(self) -> bytes | None:
        """Return the cached content; None if the file is missing or damaged in all folders."""
        contents = (_content(folder / self.name) for folder in self._read)
        return next((content for content in contents if content is not None), None)

    def exists(self) -> bool:
        """Whether an undamaged copy of the content is in the disk cache."""
        return self.read() is not None

    def keep(self, content: bytes) -> None:
        """Write the content to the cache; report a write error once per process."""
        if self._written is None:
            return
        try:
            _write(self._written / self.name, content)
        except OSError as error:
            say_once(f"{self._written}: machine code cannot be kept ({error.strerror or error}); {_OTHER}")

    def get(self, make: Callable[[], bytes]) -> bytes:
        """Return the cached content; if missing, create the content and write it to the cache."""
        content = self.read()
        if content is None:
            with self._alone():
                content = self.read()
                if content is None:
                    content = make()
                    self.keep(content)
        return content

    def _alone(self) -> AbstractContextManager[None]:
        """Return a context manager that locks the file, or does nothing if no folder is writable."""
        return nullcontext() if self._written is None else _alone(self._written / self.name)


class Code(File):
    """Cached machine code of an entry point, compiled on first use.

    `kind` is the name of the code in the records of compile times; `label` describes the laws in messages.
    `is_lowered` returns whether all modules of the code are already lowered, as in a wheel. `shipped` is the
    path of the machine code in the wheel; the file may be missing. `circuit` states whether the hammer has a
    coil circuit.
    """

    def __init__(
        self,
        name: str,
        kind: str,
        label: str,
        is_lowered: Callable[[], bool],
        shipped: Path,
        circuit: bool = False,
    ) -> None:
        super().__init__(name)
        self.kind, self.label, self._is_lowered = kind, label, is_lowered
        self.shipped, self._circuit = shipped, circuit
        self.with_it: tuple[Code, ...] = ()
        """Machine code that is often needed next; announced in the same message."""
        self.is_begun = False

    def read(self) -> bytes | None:
        """Return the machine code from the wheel or the disk cache; None if it has to be compiled."""
        return _content(self.shipped) or super().read()

    def get(self, make: Callable[[], bytes]) -> bytes:
        """Return the machine code; compile the code if it is neither shipped nor cached.

        A compilation is announced to the listeners, and its duration is recorded.
        """
        code = self.read()
        if code is not None:
            return code
        work = self.work
        if listeners:
            self._announce()
        self.is_begun = True
        for watcher in tuple(watchers):
            watcher(True)
        try:
            return super().get(lambda: self._noted(work, make))
        finally:
            for watcher in tuple(watchers):
                watcher(False)

    @property
    def work(self) -> str:
        """Kind of compilation in the records of compile times, such as "runs", with suffixes for variants."""
        variants = {records.CIRCUIT: self._circuit, records.LOWERED: not self._is_lowered()}
        return ", ".join([self.kind, *(name for name, holds in variants.items() if holds)])

    def _noted(self, work: str, make: Callable[[], bytes]) -> bytes:
        """Compile the machine code with `make`; record the compile time under the kind `work`."""
        begun = thread_time()
        code = make()
        if self._written is not None:
            with suppress(OSError):
                records.note(self._written, work, thread_time() - begun)
        return code

    def _announce(self) -> None:
        """Report the code about to be compiled, the expected time, and code that may be compiled next."""
        folders = self._read
        for folder in folders:
            if reason := records.mismatch(folder):
                say_once(f"{folder}: the machine code there {reason}; it is made anew")
        seconds = records.expected(folders, self.work)
        later = [other for other in self.with_it if not (other.is_begun or other.exists())]
        rest = sum(records.expected(folders, other.work) for other in later)
        more = f", then at most {rest:.0f} s for {', '.join(other.kind for other in later)}" if later else ""
        what = f"{self.kind} ({self.label})"
        place = "" if self.place in _said else f"; {self.place}"
        _said.add(self.place)
        _say(f"compiling {what}: about {seconds:.0f} s{more}{place}")

    @property
    def place(self) -> str:
        """Phrase for messages that states where the machine code is cached."""
        if self._written is None:
            return f"kept nowhere, since no folder for it can be written to; {_OTHER}"
        wanted, folder = next(_folders()), self._written
        if os.environ.get(_WANTED) and folder != wanted:
            return f"once, kept in {folder}, since {wanted} cannot be written to"
        if folder == _temporary_folder():
            return f"once, kept in {folder}, since no other folder can be written to; {_OTHER}"
        return "once, kept on disk"
