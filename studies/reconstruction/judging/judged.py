"""Evaluation of the claims for candidates; slow claims only if their verdict can still matter."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from printhammer.chaos import strobes
from printhammer.claims import Context, claims, judge
from printhammer.claims.verdicts import panel_name, printed_verdicts
from printhammer.run.problem import TOLERANCE
from studies.reconstruction.search.space import hammer_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from printhammer.hammer.hammer import Hammer

FIGURE_11: Final = "poincare"
SLOW: Final = ("map_sensitivity", "no_period_doubling_cascade")
"""Claims that may take minutes for a hammer unlike that of the paper."""

STATED: Final = tuple(
    name for name, claim in claims().items() if claim.kind == "stated" and name != FIGURE_11
)
"""Claims of kind "stated" outside Fig. 11."""


def plain_panels(hammer: Hammer, tolerance: float = TOLERANCE) -> dict[str, tuple[str, str]]:
    """Return the computed and the printed verdict of each panel of Fig. 11, by strobe time.

    The panels are judged at the given constants only. The claim on Fig. 11 also requires that the verdicts
    stay the same under small changes of constants and tolerance; if a verdict here differs, the claim fails
    anyway.
    """
    printed = printed_verdicts()
    periods = list(printed)
    strobed = strobes(hammer, periods, points=1, threads=1, tolerance=tolerance)
    return {
        panel_name(period): ("" if strobe.verdict is None else strobe.verdict.name, printed[period])
        for period, strobe in zip(periods, strobed, strict=True)
    }


def row_of(constants: Mapping[str, float], names: Iterable[str], *, panels: bool = True) -> dict[str, Any]:
    """Judge a candidate (constants, SI) by the named claims, and by Fig. 11 if `panels` is set.

    The claim on Fig. 11, with all its perturbations, is judged only if all panels are as printed without
    perturbations. The row has `constants`, `verdicts` (claim to true or false), `values` (claim to the
    measured values of the quantities that have a band), and, with Fig. 11, `panels` and `panel_verdicts`.
    """
    hammer = hammer_of(constants)
    context = Context(hammer)
    row: dict[str, Any] = {"constants": dict(constants), "verdicts": {}, "values": {}, "panels": None}
    known = claims()
    for name in names:
        if name != FIGURE_11:
            result = judge(context, known[name])
            row["verdicts"][name] = result.verdict == "holds"
            row["values"][name] = {
                key: (result.value or {}).get(key) for key in known[name].band if result.value is not None
            }
    if panels:
        verdicts = plain_panels(hammer)
        right = sum(name == printed for name, printed in verdicts.values())
        row["panels"] = right
        row["panel_verdicts"] = {panel: name for panel, (name, _printed) in verdicts.items()}
        whole = right == len(verdicts) and judge(context, known[FIGURE_11]).verdict == "holds"
        row["verdicts"][FIGURE_11] = whole
    return row


def text_of(row: Mapping[str, Any]) -> str:
    """Format a row as a line of the log of judged candidates."""
    return json.dumps(row, default=float) + "\n"
