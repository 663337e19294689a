"""Predictions: claims that hold for hammers of a search that used only the stated claims."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.claims import claims
from studies.reconstruction.judging.judged import FIGURE_11, STATED

if TYPE_CHECKING:
    from collections.abc import Sequence


def predictions(rows: Sequence[dict[str, Any]], seed: int, candidates: int) -> dict[str, Any]:
    """Count the hammers for which each "shape" claim holds; return the contents of `predictions.json`.

    `rows` are judged candidates of a search that used only the stated claims; only candidates for which all
    stated claims outside Fig. 11 hold are counted. `seed` identifies the search; `candidates` is the number
    of candidates that the search evaluated.
    """
    kept = [row for row in rows if all(row["verdicts"].get(name) for name in STATED)]
    counts: dict[str, dict[str, Any]] = {}
    for name, claim in claims().items():
        judged = [row["verdicts"][name] for row in kept if name in row["verdicts"]]
        if claim.kind == "shape" or name == FIGURE_11:
            counts[name] = {"kind": claim.kind, "measured": len(judged), "holds": sum(map(bool, judged))}
    return {
        "format": 1,
        "seed": seed,
        "candidates": candidates,
        "hammers": len(kept),
        "stated_held": list(STATED),
        "claims": counts,
    }
