"""Judged candidates as hammers that may be members of the family."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.results import Declared, part
from studies.reconstruction.judging.judged import STATED
from studies.reconstruction.judging.log import Key, joined, key_of, read_judged

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

LEAST_PANELS: Final = 8
"""Number of verdicts of Fig. 11, of twelve, that a member of the family has as printed at least."""


class Logged(Declared):
    """A hammer of a log."""

    constants: Mapping[str, float] = part("key of a hammer file to value, SI")
    verdicts: Mapping[str, bool] = part("claim to whether it holds, as far as it was judged")
    panels: int | None = part("verdicts of Fig. 11 that are as printed")
    source: str = part("file, and place in it")

    @property
    def promising(self) -> bool:
        """Whether nothing in the log speaks against it as a member of the family."""
        enough = self.panels is not None and self.panels >= LEAST_PANELS
        return enough and all(self.verdicts.get(name, True) for name in STATED)


def read_logs(paths: Iterable[str | Path]) -> list[Logged]:
    """Read logs of judged candidates, see `reconstruction.judging.log`, in the order of the files.

    A hammer that was judged several times, in whatever files, comes once, with all verdicts on it, the last
    of each claim.

    Raises
    ------
    InputError
        A file cannot be read, is no such log, or has no candidates.
    """
    hammers: dict[Key, tuple[dict[str, Any], str]] = {}
    for path in map(Path, paths):
        for number, row in enumerate(read_judged(path, some=True), 1):
            key = key_of(row["constants"])
            before, source = hammers.get(key, (None, f"{path}, candidate {number}"))
            hammers[key] = joined(before, row), source
    return [
        Logged(
            {key: float(value) for key, value in row["constants"].items()},
            row["verdicts"],
            row.get("panels"),
            source,
        )
        for row, source in hammers.values()
    ]
