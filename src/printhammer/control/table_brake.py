"""The brake pulse: what a current does to the armature on its way back from a dot.

The bucking current that releases the armature slows it down when it returns; Fig. 6 of F. Hendriks, *Bounce
and Chaotic Motion in Impact Print Hammers* (1983), calls that a quenched response. Where a dot cannot be made
well at its time because the armature falls back from a rebound just then, a pulse before changes the rebound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table_drive import fading, of_width, with_brake
from printhammer.drive_sequence import PulseSequence
from printhammer.ensemble import Ensemble
from printhammer.waveform_chain import TAIL

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.table_polish import Work
    from printhammer.segments import FloatArray
    from printhammer.waveforms import Waveform

LATE: Final = 6e-6
"""By how much the first dot may be early or late, s."""

HARD: Final = 0.015
"""By how much the pulse of the first dot may be wide or narrow, in parts of its width."""

BRAKES: Final = 3
"""Number of brake pulses from which a search begins."""

_DELAYS: Final = 9
_BRAKES: Final = 8
_FIRED: Final = 11
_ROOM: Final = 50e-6
_WIDTHS: Final = 6
_LEAST: Final = 0.8
_CANDIDATES: Final = 120
_WAIT: Final = 1e-3
_FIRST: Final = ((0.0, 0.0), (LATE, 0.0), (-LATE, 0.0), (0.0, HARD), (0.0, -HARD))


@dataclass(frozen=True)
class Braked:
    """A brake pulse and the dot after it, times from the slot of the dot before, s.

    Attributes
    ----------
    delay, brake : float
        Beginning and width of the brake pulse.
    fired, width : float
        Of the dot after it.
    off : float
        Worst deviation, in parts of the limits, over first dots that are a little off themselves.
    """

    delay: float
    brake: float
    fired: float
    width: float
    off: float


def brakes(work: Work, period: float) -> list[Braked]:
    """Search for a brake pulse with which a dot is well made one period after another.

    The best one for a perfect first dot may be of no use: a brake pulse that ends just as the armature lands
    fires it again where it lands a little early. So what counts is the worst over first dots that are early,
    late, hard or soft.

    Parameters
    ----------
    work : Work
        What the table is to be like.
    period : float
        From slot to slot, s.

    Returns
    -------
    list of Braked
        The best of different brake pulses, at most `BRAKES`; none where no brake pulse fits between the dots,
        or none leads to a dot.
    """
    own: Any = work.pulse
    single, fade = work.single, fading(work.pulse)
    # A chain asks that the print pulse is over; twice as well, since it may be a little wider.
    over = own.width * (1.0 + HARD) + LATE + fading(own, 0.5 * TAIL)
    earliest = max(single.left, over)
    cells = [
        (delay, brake, fired, width)
        for delay in np.linspace(earliest, max(earliest, single.returned), _DELAYS).tolist()
        for brake in np.linspace(0.0, work.widest, _BRAKES + 1)[1:].tolist()
        for fired in np.linspace(period - _ROOM, period + _ROOM, _FIRED).tolist()
        for width in np.linspace(_LEAST * own.width, work.widest, _WIDTHS).tolist()
        if delay + brake + fade <= fired
    ]
    if not cells:
        return []
    off = _off(work, period, cells, _FIRST[:1])
    best = np.argsort(off, kind="stable")[:_CANDIDATES]
    best = best[np.isfinite(off[best])]
    if not best.size:
        return []
    chosen = [cells[k] for k in best]
    worst = _off(work, period, chosen, _FIRST)
    found: list[Braked] = []
    for place in np.argsort(worst, kind="stable").tolist():
        delay, brake, fired, width = chosen[place]
        if not np.isfinite(worst[place]) or len(found) == BRAKES:
            break
        if all((one.delay, one.brake) != (delay, brake) for one in found):
            found.append(Braked(delay, brake, fired, width, float(worst[place])))
    return found


def _off(
    work: Work,
    period: float,
    cells: Sequence[tuple[float, float, float, float]],
    firsts: Sequence[tuple[float, float]],
) -> FloatArray:
    """Return the worst deviation of the second dot over several first ones; infinite for a lost dot."""
    own: Any = work.pulse
    nominal = work.single.nominal
    firsts_of: dict[tuple[float, float, float, float], Waveform] = {}
    seconds: dict[float, Waveform] = {}
    drives = []
    # The run begins a little before the first slot, at which a first dot may be early.
    begin = LATE
    for delay, brake, fired, width in cells:
        if width not in seconds:
            seconds[width] = of_width(own, width)
        for late, hard in firsts:
            key = (late, hard, delay, brake)
            if key not in firsts_of:
                pulse = of_width(own, own.width * (1.0 + hard))
                firsts_of[key] = with_brake(pulse, of_width(own, brake), delay - late)
            waveforms = [firsts_of[key], seconds[width]]
            drives.append(PulseSequence(waveforms, at=[begin + late, begin + fired]))
    ends = np.array([float(drive.times[-1]) for drive in drives]) + _WAIT
    worst = np.zeros(len(drives))
    for hammer in work.hammers:
        result = Ensemble(hammer, drives, ends, tolerance=work.tolerance).run(dots=True, threads=work.threads)
        dots = result.dots
        assert dots is not None
        good = result.ok & dots.struck.all(axis=1) & (dots.extra_contacts == 0).all(axis=1)
        force = np.abs(dots.peak_force[:, 1] / nominal.force - 1.0) / work.limits.force
        touched = dots.fired_at[:, 1] + dots.flight_time[:, 1]
        arrival = np.abs(touched - (begin + period + nominal.flight_time)) / work.limits.arrival
        worst = np.maximum(worst, np.where(good, np.maximum(force, arrival), np.inf))
    return np.asarray(worst.reshape(len(cells), len(firsts)).max(axis=1))
