"""Pareto front of judged hammers: panels of Fig. 11 against all other claims."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.claims.judging import claims
from printhammer.errors import InputError
from printhammer.results import Result, column, coordinate, scalar
from studies.reconstruction.judging.judged import FIGURE_11, STATED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from printhammer.support.arrays import BoolArray, IntArray


class Front(Result):
    """Judged hammers, with the number of panels of Fig. 11 and the number of other claims that hold."""

    candidate: IntArray = coordinate(
        "1", "number of the judged hammer", "hammer", more="in the order of the logs, the first is number 1"
    )
    panels: IntArray = column("1", "number of the twelve panels of Fig. 11 classified as printed", "hammer")
    others: IntArray = column("1", "number of other claims that hold", "hammer")
    stated: BoolArray = column("1", "whether all other stated claims hold", "hammer")
    buzzes: BoolArray = column("1", "whether the hammer prints in buzz mode", "hammer")
    on_front: BoolArray = column(
        "1", "whether no other hammer has as many panels and as many other claims, and more of one", "hammer"
    )
    core_time: float = scalar("s", "computation time of the searches on one core")

    @property
    def title(self) -> str:
        """Title of the front: number of judged hammers, and number of hammers on the front."""
        return f"{len(self.panels)} judged hammers, {int(self.on_front.sum())} on the front"

    def plot(self, **options: Any) -> Figure:
        """Draw the front; see `studies.reconstruction.figures.front`."""
        from studies.reconstruction.figures.front import plot

        return plot(self, **options)


def front(rows: Sequence[dict[str, Any]], core_time: float = 0.0) -> Front:
    """Return the Pareto front of judged candidates; see `judged.row_of`.

    Candidates for which a claim has not been judged are left out; `core_time` is in s.

    Raises
    ------
    InputError
        No candidate has been judged by all claims.
    """
    known = [name for name in claims() if name != FIGURE_11]
    complete = [
        (number, row)
        for number, row in enumerate(rows, 1)
        if row["panels"] is not None and all(name in row["verdicts"] for name in known)
    ]
    if not complete:
        raise InputError("judged candidates: expected some on which every claim was judged, --every-claim")
    panels = np.array([int(row["panels"]) for _, row in complete])
    others = np.array([sum(bool(row["verdicts"][name]) for name in known) for _, row in complete])
    at_least = (panels >= panels[:, np.newaxis]) & (others >= others[:, np.newaxis])
    more = (panels > panels[:, np.newaxis]) | (others > others[:, np.newaxis])
    return Front(
        candidate=np.array([number for number, _ in complete]),
        panels=panels,
        others=others,
        stated=np.array([all(row["verdicts"][name] for name in STATED) for _, row in complete]),
        buzzes=np.array([bool(row["verdicts"]["buzz_printing"]) for _, row in complete]),
        on_front=np.asarray(~(at_least & more).any(axis=1)),
        core_time=core_time,
    )
