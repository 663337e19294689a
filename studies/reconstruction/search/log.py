"""Log of a search: a heading line, then one line for each candidate, in the order of evaluation."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.support.constants import shown
from studies.reconstruction.lines import append, read_object, read_text
from studies.reconstruction.search.evaluation import AIMS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from printhammer.support.arrays import FloatArray

_HEADING: Final = {"aim", "seed"}
_CANDIDATE: Final = {"point", "total", "constants"}


def read_search(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read the log of a search; return its heading and its candidates.

    Raises
    ------
    InputError
        The file cannot be read, or is not the log of a search.
    """
    rows = []
    for number, line in enumerate(read_text(path, "log", required=True).split("\n")[:-1], 1):
        row = read_object(line)
        wanted = _HEADING if number == 1 else _CANDIDATE
        if row is None or not wanted <= set(row):
            what = "the heading" if number == 1 else "a candidate"
            raise InputError(
                f"{path}, line {number}: expected {what} of the log of a search, not {line[:40]!r}"
            )
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: expected the log of a search, and there is nothing")
    aim, seed = rows[0]["aim"], rows[0]["seed"]
    if aim not in AIMS:
        raise InputError(f"{path}, line 1: aim = {shown(aim)}, expected one of {', '.join(AIMS)}")
    if isinstance(seed, bool) or not isinstance(seed, int):
        raise InputError(f"{path}, line 1: seed = {shown(seed)}, expected a whole number")
    return rows[0], rows[1:]


class Log:
    """Log of a search on disk, new or resumed: JSON lines, the first of which defines the search.

    An incomplete last line, written when the search was stopped, is removed.

    Raises
    ------
    InputError
        The file cannot be read or written, is not a log, or is the log of another search.
    """

    def __init__(self, path: Path, heading: dict[str, Any]) -> None:
        self.path = path
        self._rows: list[dict[str, Any]] = []
        first = json.dumps(heading)
        text = read_text(path, "log")
        if first.startswith(text):
            # The file is empty, or the search was stopped while writing the heading.
            append(path, first + "\n", "log", kept="")
            return
        whole, _, broken = text.rpartition("\n")
        try:
            rows = [json.loads(line) for line in whole.split("\n")]
        except json.JSONDecodeError as error:
            raise InputError(f"{path}: expected JSON lines of a search ({error})") from None
        if not all(isinstance(row, dict) for row in rows):
            raise InputError(f"{path}: expected JSON lines of a search, each an object")
        for key, value in heading.items():
            if rows[0].get(key) != value:
                before, wanted = (shown(json.dumps(v), quotes=False) for v in (rows[0].get(key), value))
                raise InputError(f"{path}: the log of another search: {key} = {before}, expected {wanted}")
        if broken:
            append(path, "", "log", kept=whole + "\n")
        self._rows = rows[1:]

    def append(self, rows: Sequence[dict[str, Any]]) -> None:
        """Append candidates."""
        if rows:
            self._rows += rows
            append(self.path, "".join(json.dumps(row) + "\n" for row in rows), "log")

    def known(self, place: int, points: Sequence[FloatArray]) -> list[dict[str, Any]]:
        """Return the logged candidates from index `place` on, at most one for each of `points`.

        Raises
        ------
        InputError
            The logged candidates do not belong to the points that the search evaluates.
        """
        there = self._rows[place : place + len(points)]
        for number, (row, point) in enumerate(zip(there, points, strict=False), place + 1):
            if not np.array_equal(row.get("point", ()), point):
                raise InputError(f"{self.path}: candidate {number} is not the one of this search")
        return there
