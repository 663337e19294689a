"""Log of judged candidates: one JSON line each, as returned by `judged.row_of`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.claims.judging import claims
from printhammer.errors import InputError
from printhammer.support.constants import shown
from studies.reconstruction.judging.judged import text_of
from studies.reconstruction.lines import append, read_object, read_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

Key = tuple[tuple[str, float], ...]


def key_of(constants: Mapping[str, float]) -> Key:
    """Return a hashable key for the constants of a candidate."""
    return tuple(sorted(constants.items()))


def read_judged(path: Path, *, some: bool = False) -> list[dict[str, Any]]:
    """Return the candidates of a log (`judged.row_of`), in the order in which they first occur.

    A candidate judged more than once is returned once with all its verdicts; the last verdict on each claim
    counts. An incomplete last line, written when the program was stopped, is ignored. A missing file counts
    as an empty file.

    Raises
    ------
    InputError
        The file cannot be read or is not a log of judged candidates; or the log is empty, and `some` is set.
    """
    candidates: dict[Key, dict[str, Any]] = {}
    for number, line in enumerate(read_text(path).split("\n")[:-1], 1):
        row = _row(line, f"{path}, line {number}")
        key = key_of(row["constants"])
        candidates[key] = joined(candidates.get(key), row)
    if some and not candidates:
        raise InputError(f"{path}: expected judged candidates, and there are none")
    return list(candidates.values())


def joined(before: dict[str, Any] | None, row: dict[str, Any]) -> dict[str, Any]:
    """Return a row, supplemented by the verdicts of an earlier row of the same candidate."""
    if before is None:
        return row
    both = {**before, **{name: value for name, value in row.items() if value is not None}}
    for name in ("verdicts", "values"):
        both[name] = {**before[name], **row[name]}
    return both


def mend(path: Path) -> None:
    """Remove an incomplete last line from a log, so that rows can be appended.

    Raises
    ------
    InputError
        The file cannot be written, or its last line is not the beginning of a judged candidate.
    """
    whole, newline, rest = read_text(path).rpartition("\n")
    if not rest:
        return
    begin = text_of({"constants": {}})[: len(rest)].partition("}")[0]
    if not rest.startswith(begin):
        raise InputError(f"{path}: expected a log of judged candidates, its last line is {shown(rest)}")
    append(path, "", kept=whole + newline)


def _row(line: str, where: str) -> dict[str, Any]:
    row = read_object(line)
    if row is None:
        raise InputError(f"{where}: expected a judged candidate as a JSON object, not {line[:40]!r}")
    constants = row.get("constants")
    if not isinstance(constants, dict) or not constants:
        raise InputError(
            f"{where}: constants = {shown(constants)}, expected the constants of a judged candidate"
        )
    for key, value in constants.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{where}: constants.{key} = {shown(value)}, expected a finite number in SI")
    for name in ("verdicts", "values"):
        if not isinstance(row.get(name), dict):
            raise InputError(
                f"{where}: {name} = {shown(row.get(name))}, expected those of a judged candidate"
            )
        if unknown := next((claim for claim in row[name] if claim not in claims()), None):
            raise InputError(f"{where}: {name}.{unknown} is not known, expected the name of a claim")
    for name, holds in row["verdicts"].items():
        if not isinstance(holds, bool):
            raise InputError(f"{where}: verdicts.{name} = {shown(holds)}, expected true or false")
    panels = row.get("panels")
    if panels is not None and (isinstance(panels, bool) or not isinstance(panels, int)):
        raise InputError(f"{where}: panels = {shown(panels)}, expected a whole number or null")
    return row
