"""The brake pulse: catch the armature on its way back, so that it lands on the backstop and stays there.

The bucking current that releases the armature slows it down when it returns; Fig. 6 of F. Hendriks, *Bounce
and Chaotic Motion in Impact Print Hammers* (1983), calls that a quenched response. A pulse that is fired at
the right time after a dot, and has the right width, leaves next to nothing of the rebounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table_drive import of_width, with_brake
from printhammer.drive import PulseTrain
from printhammer.ensemble import Ensemble
from printhammer.equilibrium import rest_state

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.table_single import Single
    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray
    from printhammer.waveforms import Waveform

LATE: Final = 12.5e-6
"""By how much a dot may be early or late, s, without the brake pulse doing harm."""

_SAMPLE: Final = 4e-6
_DELAY: Final = 5e-6
_WIDTHS: Final = 40


@dataclass(frozen=True)
class Brake:
    """A brake pulse.

    Attributes
    ----------
    delay : float
        From the firing of a pulse from rest to the brake pulse, s.
    width : float
        Its width, s.
    unrest : float
        Integral of the distance from rest, from the time on at which the armature would hit the backstop
        without a brake pulse, in parts of that without one; the worst of the hammers.
    """

    delay: float
    width: float
    unrest: float


def best_brake(
    hammers: Sequence[Hammer], pulse: Waveform, widest: float, single: Single, **options: Any
) -> Brake | None:
    """Search for the brake pulse after which the hammer is at rest soonest.

    The best one of all is of no use: it ends as the armature lands, and where that is a little early, fires
    it again. What counts here is the worst of pulses that are a little early, late, wide or narrow.

    Parameters
    ----------
    hammers : sequence of Hammer
        Hammers that it is to serve; the worst counts.
    pulse : Waveform
        The pulse that prints, fired from rest.
    widest : float
        Largest width, s.
    single : Single
        What the pulse does.
    **options
        Tolerance and threads.

    Returns
    -------
    Brake or None
        None where no brake pulse does better than none.
    """
    from scipy.ndimage import maximum_filter

    delays = np.arange(single.left, single.returned, _DELAY)
    widths = np.linspace(0.0, widest, _WIDTHS + 1)[1:]
    cells = [(delay, width) for delay in delays.tolist() for width in widths.tolist()]
    without = float(_unrest(hammers, pulse, [(single.left, 0.0)], single, **options)[0])
    unrest = _unrest(hammers, pulse, cells, single, **options).reshape(delays.size, widths.size)
    around = 2 * round(LATE / _DELAY) + 1
    worst = maximum_filter(unrest, size=(around, 3), mode="nearest")
    place = np.unravel_index(int(np.argmin(worst)), worst.shape)
    if not worst[place] < without:
        return None
    return Brake(float(delays[place[0]]), float(widths[place[1]]), float(unrest[place] / without))


def _unrest(
    hammers: Sequence[Hammer],
    pulse: Waveform,
    cells: Sequence[tuple[float, float]],
    single: Single,
    *,
    tolerance: float,
    threads: int | None,
) -> FloatArray:
    """Return the largest of the integrals of |x - rest|, m s, over the hammers; infinite with another dot."""
    drives = [
        PulseTrain(with_brake(pulse, of_width(pulse, width) if width else None, delay))
        for delay, width in cells
    ]
    times = np.arange(single.returned, single.settled, _SAMPLE)
    worst = np.zeros(len(cells))
    for hammer in hammers:
        result = Ensemble(hammer, drives, float(times[-1]), tolerance=tolerance).run(
            dots=True, times=times, threads=threads
        )
        dots, x = result.dots, result.x
        assert dots is not None
        assert x is not None
        away = np.abs(x - rest_state(hammer)).sum(axis=1, dtype=np.float64) * _SAMPLE
        good = result.ok & (dots.extra_contacts[:, 0] == 0)
        worst = np.maximum(worst, np.where(good, away, np.inf))
    return worst
