"""Figures of the paper and of any motion, one function each, for any hammer.

>>> from printhammer.figures import FIGURES, save
>>> figure = FIGURES[3].draw(hammer)
>>> save(figure, "build", "figure3")

matplotlib is imported on drawing, not by this module.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from printhammer.figures.elements.save import FORMATS, save
from printhammer.hammer.hammer import Hammer

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "FORMATS", "PaperFigure", "save"]


@dataclass(frozen=True)
class PaperFigure:
    """Figure of the paper: number, title, caption, and the function that draws it."""

    number: int
    """Number of the figure in the paper."""
    place: str
    """Drawing function, as "module.function" within `printhammer.figures.paper`."""
    title: str
    """Short title of the figure."""
    caption: str
    """Caption that describes the figure in one or two sentences."""

    @property
    def function(self) -> Callable[..., Figure]:
        """Function that draws the figure for a hammer and options."""
        module, _, name = self.place.partition(".")
        function: Callable[..., Figure] = getattr(import_module(f"{__name__}.paper.{module}"), name)
        return function

    def draw(self, hammer: Hammer, **options: Any) -> Figure:
        """Draw the figure for a hammer.

        Raises
        ------
        InputError
            The hammer lacks a part that the figure needs, or an option is invalid.
        """
        return self.function(hammer, **options)


FIGURES: Final[dict[int, PaperFigure]] = {
    entry.number: entry
    for entry in (
        PaperFigure(
            2,
            "forces.statics",
            "Magnetic force and spring force",
            "Net magnetic force against displacement at coil currents of 0, 0.5, 1, 1.5 and 2 A, the spring"
            " force and its reflection (dashed). Double lines: backstop, front of the ribbon and paper pack,"
            " platen.",
        ),
        PaperFigure(
            3,
            "motion.single_pulse",
            "A single pulse: motion",
            "Displacement of the armature after a single current pulse, and the current.",
        ),
        PaperFigure(
            4,
            "forces.total_force",
            "A single pulse: total force",
            "Total force on the armature after a single current pulse; tinted where it touches pack or"
            " backstop.",
        ),
        PaperFigure(
            5,
            "forces.force_loops",
            "A single pulse: force and displacement",
            "Total force against displacement over one cycle. Clockwise loops are energy given to the"
            " armature, counter-clockwise loops energy lost; the inset shows the loops of settle-out.",
        ),
        PaperFigure(
            6,
            "motion.two_pulses",
            "Two pulses",
            "The response to a second pulse 660 and 700 µs after the first: quenched, or caught on the rise.",
        ),
        PaperFigure(
            7,
            "motion.buzz",
            "Buzz printing",
            "A train of the same waveform, found by search, that prints while the armature stays clear of the"
            " backstop; numbers are peak forces relative to a single pulse.",
        ),
        PaperFigure(
            8,
            "maps.surface",
            "Nine pulses: displacement against time and rate",
            "Displacement under nine pulses at gradually rising rates, one curve for each rate; nearer curves"
            " hide farther curves. Blue: inside the ribbon and paper pack.",
        ),
        PaperFigure(
            9,
            "maps.frequency_map",
            "Nine pulses: frequency-time map",
            "Displacement under nine pulses in colours, at more rates. Thin lines are firings, orange lost"
            " dots; backstop, pack and platen are marked on the scale.",
        ),
        PaperFigure(
            10,
            "forces.phase_plane",
            "A single pulse: phase plane",
            "Velocity against displacement after a single current pulse; arrows point to later times.",
        ),
        PaperFigure(
            11,
            "poincare.poincare",
            "Poincaré plots",
            "Displacement and velocity at the first 200 firings of trains, a panel for each strobe time,"
            " with the classification of firings 1001 to 2000, and with the paper's if different. Vertical"
            " line: backstop; orange circles: the last points of a train with a period of up to 8 firings.",
        ),
    )
}
"""Figures of the paper by number."""
