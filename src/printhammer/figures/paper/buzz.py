"""Figure 7: buzz printing, a train that prints while the armature stays clear of the backstop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.elements.curves import fired, shown_until
from printhammer.figures.elements.marks import beside
from printhammer.figures.elements.scales import scale
from printhammer.figures.elements.style import INK, in_style
from printhammer.figures.elements.timeline import timeline
from printhammer.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.buzz import BuzzSearch, BuzzTrain
    from printhammer.run.motion import Motion


def buzz(hammer: Hammer, *, search: BuzzSearch | None = None, duration: float | str | None = None) -> Figure:
    """Draw Fig. 7: the train that `find_buzz_train` finds, or its best attempt, saying so.

    The numbers at the dots that count are peak forces in units of that of a single pulse.

    Parameters
    ----------
    hammer : Hammer
        Any hammer with waveform, pack and backstop.
    search : BuzzSearch, optional
        Result of a search made before.
    duration : float or str, optional
        Time shown, s, or text with a unit; by default until the armature has settled.

    Raises
    ------
    InputError
        The hammer has no waveform, pack, backstop or rest state.
    """
    from printhammer.printing.dots.buzz import find_buzz_train

    search = find_buzz_train(hammer) if search is None else search
    train = search.best
    motion = fired(hammer, train.times if train is not None else (0.0,), duration)
    until = motion.end if duration is not None else shown_until(motion)
    remarks = [] if search.train is not None else [f"No buzz printing: {search.reason}."]
    if train is not None and train.count:
        remarks.append(f"{train.touches_text}.")
    heading = _heading(train) if train is not None else "a single pulse"
    figure = timeline([motion], until, heading=heading, show_firings=True, remarks=remarks)
    if train is not None:
        with in_style():
            _number(figure, motion, train, until)
    return figure


def _heading(train: BuzzTrain) -> str:
    interval = f"{from_si(train.interval, 's', 'us'):.3g} µs"
    if train.kind == "uniform":
        how = f"{len(train.times)} pulses, one every {interval}"
    else:
        how = f"{len(train.times)} pulses, each {interval} after leaving the pack"
    force = f"{train.weakest:.2f} to {max(train.forces):.2f}" if train.count > 1 else f"{train.weakest:.2f}"
    dots = "1 dot" if train.count == 1 else f"{train.count} dots"
    return (
        f"{how}: {dots} of {force} of the single-pulse force" if train.count else f"{how}: no dot that counts"
    )


def _number(figure: Figure, motion: Motion, train: BuzzTrain, until: float) -> None:
    """Write the relative peak force at each dot that counts."""
    panel = figure.axes[0]
    time, way = scale("time", until), scale("displacement", float(max(motion.maxima[1], default=0.0)))
    forces = dict(enumerate(train.forces, train.first))
    for contact in motion.contacts:
        force = forces.get(contact.firing) if contact.firing is not None else None
        if contact.surface != "pack" or contact.extra or force is None or contact.t_peak > until:
            continue
        peak = float(time.shown(contact.t_peak)), float(way.shown(motion.at(contact.t_peak)[0][0]))
        beside(panel, f"{force:.2f}", peak, (0, 3), "center bottom", color=INK)
