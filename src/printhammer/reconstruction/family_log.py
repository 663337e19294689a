"""The log of a search, read as candidates for the family.

A log is a file of JSON lines, one for each hammer that the search has judged, with `constants` (key of a
hammer file to value, SI), `verdicts` (claim to true or false) and `panels` (how many verdicts of Fig. 11 are
as printed, null where that was not asked). Lines without `constants` say something else and are left out.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.claims.definition import claims
from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

LEAST_PANELS: Final = 8
"""Number of verdicts of Fig. 11, of twelve, that a member of the family has as printed at least."""

FIGURE_11: Final = "poincare"
"""Name of the claim that all twelve are; members need not satisfy it."""


@dataclass(frozen=True)
class Logged:
    """A hammer of a log.

    Attributes
    ----------
    constants : mapping
        Key of a hammer file to value, SI.
    verdicts : mapping
        Claim to whether it holds, as far as the search asked.
    panels : int or None
        Verdicts of Fig. 11 that are as printed.
    source : str
        File and line.
    """

    constants: Mapping[str, float]
    verdicts: Mapping[str, bool]
    panels: int | None
    source: str

    @property
    def promising(self) -> bool:
        """Whether nothing in the log speaks against it as a member of the family."""
        enough = self.panels is not None and self.panels >= LEAST_PANELS
        return enough and all(self.verdicts.get(name, True) for name in stated())


def stated() -> list[str]:
    """List the claims of kind "stated" that every member of the family satisfies."""
    return [name for name, claim in claims().items() if claim.kind == "stated" and name != FIGURE_11]


def read_logs(paths: Iterable[str | Path]) -> list[Logged]:
    """Read the logs of searches.

    Parameters
    ----------
    paths : iterable of path
        Files of JSON lines.

    Returns
    -------
    list of Logged
        In the order of the files; of hammers with equal constants the last.

    Raises
    ------
    InputError
        A file cannot be read, or a line is not what is described at the head of this module. A last line
        that breaks off is left out: the search is still writing, or was stopped.
    """
    found: dict[tuple[tuple[str, float], ...], Logged] = {}
    for path in map(Path, paths):
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{path}: the log cannot be read ({reason})") from None
        lines = text.split("\n")
        for number, line in enumerate(lines, 1):
            where = f"{path}, line {number}"
            if not line.strip():
                continue
            try:
                row = json.loads(line)
            except ValueError:
                if number == len(lines):
                    continue
                raise InputError(f"{where}: expected a JSON object, not {line[:40]!r}") from None
            if not isinstance(row, dict):
                raise InputError(f"{where}: expected a JSON object, not {line[:40]!r}")
            if "constants" in row:
                logged = _logged(row, where)
                found.pop(key := tuple(sorted(logged.constants.items())), None)
                found[key] = logged
    return list(found.values())


def _logged(row: Mapping[str, Any], where: str) -> Logged:
    constants, verdicts, panels = row["constants"], row.get("verdicts", {}), row.get("panels")
    if not isinstance(constants, dict) or not constants:
        raise InputError(
            f"{where}: constants = {constants!r}, expected keys of a hammer file with values in SI"
        )
    for key, value in constants.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{where}: constants.{key} = {value!r}, expected a finite number in SI")
    if not isinstance(verdicts, dict):
        raise InputError(f"{where}: verdicts = {verdicts!r}, expected claims with true or false")
    for name, holds in verdicts.items():
        if name not in claims():
            raise InputError(f"{where}: verdicts.{name} is not known, expected the name of a claim")
        if not isinstance(holds, bool):
            raise InputError(f"{where}: verdicts.{name} = {holds!r}, expected true or false")
    if panels is not None and (isinstance(panels, bool) or not isinstance(panels, int)):
        raise InputError(f"{where}: panels = {panels!r}, expected a whole number or null")
    return Logged({key: float(value) for key, value in constants.items()}, verdicts, panels, where)
