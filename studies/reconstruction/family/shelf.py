"""Cache of judged hammers on disk, kept until the family is complete."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from printhammer import __version__
from studies.reconstruction.lines import append, read_object, read_text

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.hammer.hammer import Hammer


class Shelf:
    """Judged hammers, one JSON line each, keyed by their fingerprint and the version of the program.

    The file need not exist. An incomplete last line, left when the program was killed, is ignored.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._judged: dict[str, dict[str, Any]] = {}
        for line in read_text(path).split("\n"):
            row = read_object(line) or {}
            if (
                row.get("version") == __version__
                and isinstance(row.get("fingerprint"), str)
                and "judged" in row
            ):
                self._judged[row["fingerprint"]] = row["judged"]

    def get(self, hammer: Hammer) -> dict[str, Any] | None:
        """Return the stored results for a hammer; None for a hammer that is not stored."""
        return self._judged.get(hammer.fingerprint)

    def put(self, hammer: Hammer, judged: dict[str, Any]) -> None:
        """Store the results for a hammer.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        self._judged[hammer.fingerprint] = judged
        row = {"version": __version__, "fingerprint": hammer.fingerprint, "judged": judged}
        append(self._path, "\n" + json.dumps(row))

    def remove(self) -> None:
        """Remove the file."""
        with suppress(OSError):
            self._path.unlink()
