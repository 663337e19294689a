"""What is judged already, kept on disk until the family is complete."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from printhammer import __version__
from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.hammer.hammer import Hammer


class Shelf:
    """Hammers judged, a JSON line each, by their fingerprint and the version of the program.

    Parameters
    ----------
    path : Path
        The file; it need not exist. A line that breaks off, since the program was killed, is left out.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[str, dict[str, Any]] = {}
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except FileNotFoundError:
            lines = []
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{path}: the file cannot be read ({reason})") from None
        for line in lines:
            with suppress(ValueError, KeyError, TypeError):
                row = json.loads(line)
                if row["version"] == __version__:
                    self._found[row["fingerprint"]] = row["judged"]

    def get(self, hammer: Hammer) -> dict[str, Any] | None:
        """Return what is known of a hammer; None if nothing is."""
        return self._found.get(hammer.fingerprint)

    def put(self, hammer: Hammer, judged: dict[str, Any]) -> None:
        """Keep what was found about a hammer.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        self._found[hammer.fingerprint] = judged
        row = {"version": __version__, "fingerprint": hammer.fingerprint, "judged": judged}
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write("\n" + json.dumps(row))
        except OSError as error:
            raise InputError(f"{self._path}: the file cannot be written ({error.strerror})") from None

    def remove(self) -> None:
        """Remove the file."""
        with suppress(OSError):
            self._path.unlink()
