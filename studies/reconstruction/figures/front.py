"""Figure of the Pareto front: panels of Fig. 11 against the other claims for judged hammers."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from printhammer.figures.elements.style import BLUE, INK, MUTED, ORANGE, SMALL, THIN, foot, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.reconstruction.judging.front import Front

_SIZE: Final = 14.0
"""Area of a mark that represents one hammer, in square points."""


@styled
def plot(front: Front) -> Figure:
    """Draw the number of panels of Fig. 11 against the number of other claims that hold for judged hammers.

    The area of a mark is proportional to the number of hammers. Marks of hammers for which all other stated
    claims hold are filled; the line is the Pareto front.
    """
    from matplotlib.ticker import MaxNLocator

    figure = new_figure(3.8)
    ax = figure.add_subplot()
    for stated, name in ((False, "some other stated claim fails"), (True, "all other stated claims hold")):
        counts = Counter(
            (int(panels), int(others))
            for panels, others, all_hold in zip(front.panels, front.others, front.stated, strict=True)
            if bool(all_hold) == stated
        )
        if counts:
            x, y = zip(*counts, strict=True)
            area = [_SIZE * count**0.5 for count in counts.values()]
            face = BLUE if stated else "none"
            ax.scatter(x, y, s=area, facecolor=face, edgecolor=BLUE, lw=THIN, label=name, zorder=2.0)
    best = sorted({(int(p), int(o)) for p, o in zip(front.panels, front.others, strict=True)})
    corners = [(p, o) for p, o in best if not any(q >= p and r >= o and (q, r) != (p, o) for q, r in best)]
    ring: dict[str, Any] = {"marker": "o", "ms": 9.0, "mfc": "none", "label": "Pareto front"}
    ax.plot(*zip(*corners, strict=True), color=ORANGE, lw=THIN, ds="steps-pre", **ring)
    ax.margins(0.08)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel="Panels of Figure 11 as printed", ylabel="Other claims that hold")
    ax.legend(fontsize=SMALL, frameon=False, loc="lower left", labelcolor=INK)
    ax.grid(color=MUTED, alpha=0.15)
    hours = front.core_time / 3600.0
    foot(figure, f"{len(front.panels)} judged hammers" + (f" · {hours:.1f} core-hours" if hours else ""))
    return figure
