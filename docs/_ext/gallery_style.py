"""The gallery: order of the examples, style of the figures, and collection of the figures of an example."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cycler import cycler

from printhammer.figures.elements import style

ORDER = (
    "single_pulse",
    "two_pulses",
    "fast_train",
    "frequency_map",
    "printed_line",
    "print_quality",
    "strobe",
    "exponents",
    "orbits",
    "continuation",
    "sweep",
    "backstops",
    "damping_materials",
    "energy_ledger",
    "behind_a_rail",
    "brake_pulse",
    "compensation_table",
    "least_work",
    "feedback",
    "sensitivities",
    "inch_pound_file",
    "measured_magnet",
    "laboratory",
    "measured_constants",
    "single_shot_fit",
    "bouncing_ball",
    "tufillaro_ball",
    "impact_oscillator",
    "shaw_holmes",
    "resonant_grazing",
    "grazing_at_resonance",
    "tung_shaw",
    "duffing",
    "rocking_block",
    "impact_pair",
    "own_part",
)
"""Names of the examples in teaching order."""

STYLE = {
    **style.RC,
    "axes.prop_cycle": cycler(color=(style.BLUE, style.ORANGE, style.GREEN, style.YELLOW, style.MUTED)),
    "figure.constrained_layout.use": True,
    "figure.figsize": (style.WIDTH, 4.2),
    "legend.fontsize": style.SMALL,
    "legend.frameon": False,
    "savefig.dpi": 160,
}
"""Matplotlib style of the program's figures, also for figures that an example draws itself."""


class TeachingOrder:
    """Sort key of the examples; an example that is not in `ORDER` is an error."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __call__(self, filename: str) -> int:
        """Return the index of an example in `ORDER`."""
        return ORDER.index(Path(filename).stem)

    def __repr__(self) -> str:
        return "<TeachingOrder>"


def plain_style(_conf: dict[str, Any], _filename: str) -> None:
    """Set the style of all figures before an example runs."""
    import matplotlib as mpl

    mpl.use("agg")
    mpl.rcdefaults()
    mpl.rcParams.update(STYLE)


def figures(_block: Any, variables: dict[str, Any], conf: dict[str, Any]) -> str:
    """Save the figures of a code block: figures of pyplot, and figures that a plot function returns.

    Parameters
    ----------
    _block, variables, conf
        Arguments that sphinx-gallery passes to a scraper.

    Returns
    -------
    str
        reStructuredText that shows the figures.
    """
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure
    from sphinx_gallery.scrapers import figure_rst

    made: list[Figure] = [plt.figure(number) for number in plt.get_fignums()]
    seen = variables["example_globals"].setdefault("__figures_seen__", [])
    for value in list(variables["example_globals"].values()):
        if isinstance(value, Figure) and value not in made and value not in seen:
            made.append(value)
    paths = []
    for figure, path in zip(made, variables["image_path_iterator"], strict=False):
        figure.savefig(path)
        seen.append(figure)
        paths.append(path)
    plt.close("all")
    return str(figure_rst(paths, conf["src_dir"], "; ".join(_title(figure) for figure in made)))


def _title(figure: Any) -> str:
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    return titles[0] if titles else "Picture of this example"
