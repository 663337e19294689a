"""Reading logs of judged candidates as possible members of the family."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.results import Declared, part
from studies.reconstruction.judging.judged import STATED
from studies.reconstruction.judging.log import Key, joined, key_of, read_judged

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

LEAST_PANELS: Final = 8
"""Smallest number of the twelve panels of Fig. 11 that a member of the family must classify as printed."""


class Logged(Declared):
    """Judged hammer, read from a log."""

    constants: Mapping[str, float] = part("values of the constants, SI, by key of a hammer file")
    verdicts: Mapping[str, bool] = part("whether each judged claim holds, by name of the claim")
    panels: int | None = part("number of panels of Fig. 11 classified as printed; None if not judged")
    source: str = part("file and line of the log")

    @property
    def promising(self) -> bool:
        """Whether no judged stated claim fails and `LEAST_PANELS` panels of Fig. 11 are as printed."""
        enough = self.panels is not None and self.panels >= LEAST_PANELS
        return enough and all(self.verdicts.get(name, True) for name in STATED)


def read_logs(paths: Iterable[str | Path]) -> list[Logged]:
    """Read logs of judged candidates (`reconstruction.judging.log`), in the order of the files.

    A hammer judged several times, also in different files, is returned once with all its verdicts; the last
    verdict on each claim counts.

    Raises
    ------
    InputError
        A file cannot be read, is not a log of judged candidates, or contains no candidates.
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
