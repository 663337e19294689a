"""Figures 3, 6 and 7, and any motion against time.

Figure 3: displacement after a single pulse, the current below.

Figure 6: the response to two pulses, at two delays of the second pulse. Figure 7: buzz printing, a train that
prints while the armature stays clear of the backstop.

`plot` draws any motion against time: displacement, positions of the hammer, firings, and the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements.curves import fired, shown_until
from printhammer.figures.elements.marks import beside
from printhammer.figures.elements.scales import scale
from printhammer.figures.elements.style import INK, in_style
from printhammer.figures.elements.timeline import timeline
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.buzz import BuzzSearch, BuzzTrain
from printhammer.run.motion import Motion
from printhammer.units import from_si, parse


def single_pulse(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 3: displacement and current after a single pulse, by default until the motion settles."""
    motion = fired(hammer, duration=duration)
    return timeline([motion], motion.end if duration is not None else shown_until(motion))


DELAYS: Final = (660e-6, 700e-6)
"""Delays of the second pulse in the paper's Fig. 6, s."""


def two_pulses(
    hammer: Hammer, *, delays: Sequence[float] = DELAYS, duration: float | str | None = None
) -> Figure:
    """Draw Fig. 6: the motions after two pulses, one for each delay of the second pulse.

    Parameters
    ----------
    delays : sequence of float, optional
        Times from the first firing to the second, s; one to three.
    duration : float or str, optional
        Time shown, s, or text with a unit; by default until the armature has settled.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state, or the delays are not one to three positive numbers.
    """
    if not 1 <= len(delays) <= 3 or not all(delay > 0.0 for delay in delays):
        raise InputError.of(
            "delays", list(delays), "one to three positive numbers", written=str(list(delays)), unit="s"
        )
    motions = [fired(hammer, (0.0, delay), duration) for delay in delays]
    until = max(motion.end if duration is not None else shown_until(motion) for motion in motions)
    labels = [f"second pulse at {_text(delay)}" for delay in delays]
    return timeline(motions, until, labels=labels, show_firings=True)


def _text(delay: float) -> str:
    unit, sign = ("us", "µs") if delay < 1e-3 else ("ms", "ms")
    return f"{from_si(delay, 's', unit):.4g} {sign}"


def buzz(hammer: Hammer, *, search: BuzzSearch | None = None, duration: float | str | None = None) -> Figure:
    """Draw Fig. 7: the buzz-printing train found by `find_buzz_train`, or else the best train tried.

    Numbers at the dots are peak forces relative to the single-pulse force.

    Parameters
    ----------
    hammer : Hammer
        Hammer with waveform, pack and backstop.
    search : BuzzSearch, optional
        Result of an earlier search.
    duration : float or str, optional
        Time shown, s, or text with a unit; by default until the armature has settled.
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
        f"{how}: {dots} of {force} of the single-pulse force"
        if train.count
        else f"{how}: no dot in the force range"
    )


def _number(figure: Figure, motion: Motion, train: BuzzTrain, until: float) -> None:
    """Label each dot of a buzz-printing train with its peak force, relative to the single-pulse force."""
    panel = figure.axes[0]
    time, way = scale("time", until), scale("displacement", float(max(motion.maxima[1], default=0.0)))
    forces = dict(enumerate(train.forces, train.first))
    for contact in motion.contacts:
        force = forces.get(contact.firing) if contact.firing is not None else None
        if contact.surface != "pack" or contact.extra or force is None or contact.t_peak > until:
            continue
        peak = float(time.shown(contact.t_peak)), float(way.shown(motion.at(contact.t_peak)[0][0]))
        beside(panel, f"{force:.2f}", peak, (0, 3), "center bottom", color=INK)


def plot(motion: Motion, *, until: float | str | None = None, heading: str = "") -> Figure:
    """Draw a motion: displacement, positions of backstop, pack and platen, firings, and the drive.

    Parameters
    ----------
    motion : Motion
        Motion to draw; if it stopped early, its message is shown.
    until : float or str, optional
        End of the time axis, s, or text with a unit; by default the end of the motion.
    heading : str, optional
        Heading above the panel.
    """
    end = parse(until, "s") if isinstance(until, str) else until
    if end is None:
        end = motion.end
    if not end > 0.0:
        raise InputError.of("until", until, "a positive time (s)")
    return timeline([motion], min(end, motion.end), heading=heading, show_firings=True)
