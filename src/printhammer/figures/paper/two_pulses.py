"""Figure 6: the response to two pulses, at two delays of the second."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from printhammer.errors import InputError
from printhammer.figures.elements.curves import fired, shown_until
from printhammer.figures.elements.timeline import timeline
from printhammer.units import from_si

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer

DELAYS: Final = (660e-6, 700e-6)
"""Delays of the second pulse in the paper's Fig. 6, s."""


def two_pulses(
    hammer: Hammer, *, delays: Sequence[float] = DELAYS, duration: float | str | None = None
) -> Figure:
    """Draw Fig. 6: the motion under two pulses, for each delay of the second.

    Parameters
    ----------
    hammer : Hammer
        Any hammer with a waveform.
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
        raise InputError(f"delays = {list(delays)} s, expected one to three positive numbers")
    motions = [fired(hammer, (0.0, delay), duration) for delay in delays]
    until = max(motion.end if duration is not None else shown_until(motion) for motion in motions)
    labels = [f"second pulse at {_text(delay)}" for delay in delays]
    return timeline(motions, until, labels=labels, show_firings=True)


def _text(delay: float) -> str:
    unit, sign = ("us", "µs") if delay < 1e-3 else ("ms", "ms")
    return f"{from_si(delay, 's', unit):.4g} {sign}"
