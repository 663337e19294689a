"""Figure 3: displacement against time after a single pulse, the current below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.elements.curves import fired, shown_until
from printhammer.figures.elements.timeline import timeline

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer


def single_pulse(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 3: the motion that a single pulse causes.

    Parameters
    ----------
    hammer : Hammer
        Any hammer with a waveform.
    duration : float or str, optional
        Time shown, s, or text with a unit; by default until the armature has settled, at most 4 ms.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state.
    """
    motion = fired(hammer, duration=duration)
    return timeline([motion], motion.end if duration is not None else shown_until(motion))
