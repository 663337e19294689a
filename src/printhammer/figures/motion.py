"""Any motion against time: displacement with the places of the hammer, firings, and the drive below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.errors import InputError
from printhammer.figures.elements.timeline import timeline
from printhammer.units import parse

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.run.motion import Motion


def plot(motion: Motion, *, until: float | str | None = None, heading: str = "") -> Figure:
    """Draw a motion: displacement, backstop, pack and platen, firings, and the current or force of the drive.

    Parameters
    ----------
    motion : Motion
        Any motion, also one that stopped early; its message is then shown.
    until : float or str, optional
        End of the time axis, s, or text with a unit; by default the end of the motion.
    heading : str, optional
        What is shown, written above the panel.

    Raises
    ------
    InputError
        `until` is not a positive time.
    """
    end = parse(until, "s") if isinstance(until, str) else until
    if end is None:
        end = motion.end
    if not end > 0.0:
        raise InputError(f"until = {until!r}, expected a positive time (s)")
    return timeline([motion], min(end, motion.end), heading=heading, show_firings=True)
