"""Shipping: the hammer file of the best judged candidate, and the data on the search for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.claims import JudgedClaim, claims, judge_all
from printhammer.units import from_si
from studies.reconstruction.judging.shortlist import standing
from studies.reconstruction.search.candidates import TOLERANCE
from studies.reconstruction.search.space import BEYOND, CURRENT, PRINT_FORCE, hammer_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from printhammer.hammer.hammer import Hammer

TITLE: Final = "The stored-energy print hammer of Hendriks (1983), reconstructed"
NOTE: Final = """\
The paper prints no constants; only its geometry is stated, in the captions of its figures. All other
constants are reconstructed: a search found constants with which the model satisfies the claims of the paper.
Other constants do so about as well, see the family. A reconstructed constant is not a measurement.
"""


def gauge() -> str:
    """Describe, in a sentence, how the two scales that the motion does not determine were fixed."""
    pounds = from_si(PRINT_FORCE, "N", "lbf")
    return (
        "Mass and all forces scale together without a change of the motion, and so do the current and 1 / Bm:"
        f" the dot of a single pulse is given the {pounds:.0f} lb that the paper calls typical, and the"
        f" largest current of a pulse {CURRENT:g} A, the middle of the range of its Fig. 2, or what it takes"
        f" for the current that would undo the field of the magnet to be {BEYOND:g} times the largest of that"
        " figure. Only the typical claims depend on the first, and on the second only the one about the range"
        " of currents, and how fast a burst that range allows."
    )


def best_of(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the best judged candidate (see `standing`), which becomes the shipped hammer."""
    return max(rows, key=standing)


def shipped_hammer(constants: Mapping[str, float], name: str) -> Hammer:
    """Return the shipped hammer, with title and note."""
    return hammer_of(constants, name=name, title=TITLE, note=NOTE)


def search_json(
    hammer: Hammer,
    rows: Sequence[dict[str, Any]],
    *,
    searches: Sequence[Mapping[str, Any]],
    core_hours: float,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Build the contents of `search.json`: the search, and the best hammer for each claim that fails.

    `hammer` is the shipped hammer, `rows` are judged candidates. For each search, `aim`, `seed` and the
    number of `candidates` are stored. `progress` is called with the name of each claim before it is judged.
    """
    results = judge_all(hammer, progress=progress)
    held = {result.claim.name for result in results if result.verdict == "holds"}
    return {
        "format": 1,
        "shipped": hammer.fingerprint,
        "searches": [{key: search[key] for key in ("aim", "seed", "candidates")} for search in searches],
        "core_hours": round(core_hours, 2),
        "tolerance": TOLERANCE,
        "waveform": "" if hammer.waveform is None else hammer.waveform.shape,
        "gauge": gauge(),
        "failing": {
            result.claim.name: _failing(result, rows, held) for result in results if result.verdict != "holds"
        },
    }


def _failing(result: JudgedClaim, rows: Sequence[dict[str, Any]], held: set[str]) -> dict[str, Any]:
    name = result.claim.name
    there = [row for row in rows if row["verdicts"].get(name)]
    entry: dict[str, Any] = {
        "value": {key: (result.value or {}).get(key) for key in result.claim.band},
        "why": result.detail,
        "best": None,
    }
    if name == "poincare":
        there = [row for row in rows if row["panels"] is not None]
        there = sorted(there, key=lambda row: -row["panels"])[:1]
    if there:
        best = max(there, key=standing)
        costs = [other for other in claims() if other in held and best["verdicts"].get(other) is False]
        value = best["values"].get(name) or {}
        if name == "poincare":
            value = {"panels_as_printed": best["panels"], "verdicts": list(best["panel_verdicts"].values())}
        entry["best"] = {
            "value": value,
            "holds": bool(best["verdicts"].get(name)),
            "constants": best["constants"],
            "costs": costs,
        }
    return entry
