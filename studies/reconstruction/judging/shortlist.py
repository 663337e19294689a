"""Evaluation of the claims for the best candidates of a search; later steps read its log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims import claims
from printhammer.claims.verdicts import printed_verdicts
from studies.reconstruction.judging.judged import FIGURE_11, STATED, row_of, text_of
from studies.reconstruction.judging.log import joined, key_of, mend, read_judged
from studies.reconstruction.lines import append

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from concurrent.futures import Executor
    from pathlib import Path

APART: Final = 0.01  # Smallest distance of candidates of a shortlist, as a fraction of a variable's range

DIGITS: Final = 6  # Significant digits of the constants that are judged and shipped

_TOGETHER: Final = 8


def shortlist(rows: Sequence[dict[str, Any]], count: int, apart: float = APART) -> list[dict[str, Any]]:
    """Return the best candidates of a log that are not close to each other.

    Any two returned candidates differ in at least one variable by `apart` times its range.
    """
    chosen: list[dict[str, Any]] = []
    points = np.empty((0, 0))
    for row in sorted((row for row in rows if row["constants"]), key=lambda row: float(row["total"])):
        point = np.array(row["point"])
        if not chosen or bool((np.abs(points - point).max(axis=1) >= apart).all()):
            chosen.append(row)
            points = np.vstack([points, point]) if points.size else point[np.newaxis]
            if len(chosen) == count:
                break
    return chosen


def rounded(constants: Mapping[str, float]) -> dict[str, float]:
    """Round constants to the significant digits of a hammer file."""
    return {key: float(f"{value:.{DIGITS}g}") for key, value in constants.items()}


def _judge(task: tuple[dict[str, float], tuple[str, ...], bool]) -> dict[str, Any]:
    constants, names, panels = task
    return row_of(constants, names, panels=panels)


def judge_candidates(
    every: Iterable[dict[str, float]],
    path: Path,
    *,
    names: Sequence[str] = STATED,
    pool: Executor | None = None,
    tell: Callable[[int, int, dict[str, Any]], None] | None = None,
) -> list[dict[str, Any]]:
    """Judge candidates and append them to a log; candidates already logged are not judged again.

    `every` lists the constants of the candidates, SI, by key of a hammer file. In addition to Fig. 11, the
    claims in `names` are judged, by default the stated claims. `tell` is called with the
    number of judged candidates, the total and the row. The rows of these candidates are returned; see
    `judged.row_of`.
    """
    wanted = [dict(constants) for constants in every]
    known = {key_of(row["constants"]): row for row in read_judged(path)}
    mend(path)
    tasks = []
    for key, constants in {key_of(candidate): candidate for candidate in wanted}.items():
        there = known[key]["verdicts"] if key in known else {}
        missing = tuple(name for name in names if name not in there and name != FIGURE_11)
        if missing or FIGURE_11 not in there:
            tasks.append((constants, missing, FIGURE_11 not in there))
    for start in range(0, len(tasks), _TOGETHER):
        some = tasks[start : start + _TOGETHER]
        rows = map(_judge, some) if pool is None else pool.map(_judge, some)
        for done, row in enumerate(rows, start + 1):
            append(path, text_of(row))
            key = key_of(row["constants"])
            known[key] = joined(known.get(key), row)
            if tell is not None:
                tell(done, len(tasks), row)
    return [known[key_of(constants)] for constants in wanted]


def standing(row: dict[str, Any]) -> tuple[float, int]:
    """Return the rank of a judged candidate: number of claims that hold, and of stated claims among them.

    A panel of Fig. 11 counts as a twelfth of a claim; claims of kind "typical" do not count.
    """
    kinds = {name: claim.kind for name, claim in claims().items()}
    holding = [
        name
        for name, holds in row["verdicts"].items()
        if holds and name != FIGURE_11 and kinds[name] != "typical"
    ]
    panels = int(row["panels"] or 0) / len(printed_verdicts())
    return len(holding) + panels, sum(kinds[name] == "stated" for name in holding)
