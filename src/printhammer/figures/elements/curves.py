"""Data for the curves of figures: motions, times, ranges and forces."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np

from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.parts.spring.terms import LinearContact
from printhammer.run.motion import Motion
from printhammer.support.arrays import FloatArray

SETTLED: Final = 0.01
"""Distance from the final position, as a fraction of the range of motion, within which a motion is settled;
arbitrary."""

_POINTS: Final = 2400  # Uniform points of a curve: more than a picture resolves; arbitrary
_PER_PIECE: Final = 60  # Points of a smooth segment; arbitrary


def waveform_of(hammer: Hammer) -> Waveform:
    """Return the standard waveform of a hammer; raise InputError for a hammer without a waveform."""
    if hammer.waveform is None:
        raise InputError(
            f"the hammer {hammer.name!r} has no waveform to fire", key="waveform", expected="a [waveform]"
        )
    return hammer.waveform


def fired(hammer: Hammer, times: Iterable[float] = (0.0,), duration: float | str | None = None) -> Motion:
    """Simulate a hammer whose standard waveform is fired at given times, s.

    The run ends at `duration` [s] or text with a unit; the default is that of `printhammer.simulate`.
    """
    from printhammer.drive.trains import PulseTrain
    from printhammer.run.simulate import simulate

    return simulate(hammer, PulseTrain(waveform_of(hammer), at=list(times)), duration=duration, points=2)


def places(hammer: Hammer) -> dict[str, float]:
    """Return the positions [m] of the backstop, pack, platen and additional contacts of a hammer, by name."""
    own = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
    contacts = {
        key.partition(".")[2]: term.position
        for key, term in hammer.terms.items()
        if isinstance(term, LinearContact)
    }
    return {name: place for name, place in own.items() if place is not None} | contacts


def times_of(motion: Motion, start: float | None = None, end: float | None = None) -> FloatArray:
    """Return the times at which to plot a motion, s: a uniform grid, steps, contacts and extrema."""
    start = motion.start if start is None else max(start, motion.start)
    end = motion.end if end is None else min(end, motion.end)
    steps = motion.step_times
    peaks = np.array([contact.t_peak for contact in motion.contacts])
    pieces = [
        np.linspace(contact.t_in, end if contact.t_out is None else contact.t_out, _PER_PIECE)
        for contact in motion.contacts
        if not contact.initial
    ]
    every = np.concatenate([np.linspace(start, end, _POINTS), steps, peaks, motion.maxima[0], *pieces])
    return np.unique(every[(every >= start) & (every <= end)])


def orbit(motion: Motion, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sample displacement [m] and velocity [m/s] of a motion at `times`.

    At each rigid impact, the state before the impact is inserted, so that the jump is drawn.
    """
    x, v = motion.at(times)
    jumps = [
        (contact.t_in, contact.v_in)
        for contact in motion.contacts
        if contact.surface == "backstop" and contact.peak_force is None and not contact.initial
    ]
    for t, v_in in reversed(jumps):
        row = int(np.searchsorted(times, t))
        if 0 < row < len(times):
            x = np.insert(x, row, x[row])
            v = np.insert(v, row, v_in)
    return x, v


def settled_at(motion: Motion) -> float:
    """Return the time [s] after which the armature stays within `SETTLED` of its final position."""
    times = times_of(motion)
    x, _v = motion.at(times)
    room = SETTLED * float(np.ptp(x))
    away = np.flatnonzero(np.abs(x - x[-1]) > room)
    return float(times[away[-1]]) if away.size else motion.end


def shown_until(motion: Motion) -> float:
    """Return the end [s] of the time axis for a motion that settles, rounded up, with a margin."""
    step = 10.0 ** math.floor(math.log10(motion.end)) / 4.0
    return float(min(motion.end, step * math.ceil(1.1 * settled_at(motion) / step)))


def reach(hammer: Hammer) -> tuple[float, float]:
    """Return the range of displacement for plots of static forces, m.

    Raises
    ------
    InputError
        The hammer has no platen, pack or upper limit of its laws to set the scale, or no stroke.
    """
    from printhammer.hammer.static_force import StaticForce

    low, high = hammer.domain
    end = min(StaticForce(hammer).end, high)
    near = hammer.origin if hammer.position is not None else max(low, min(0.0, end))
    if hammer.platen is None and hammer.pack is None and not math.isfinite(high):
        raise InputError(
            f"the hammer {hammer.name!r} has neither platen nor pack",
            key="pack",
            expected="one to scale the figure",
        )
    if hammer.pack is not None and hammer.front is not None:
        end = max(end, hammer.front + 0.2 * abs(hammer.front - near))
    if not near < end:
        raise InputError(
            f"the hammer {hammer.name!r} has no stroke: from {near:.6g} m to {end:.6g} m", key="stroke"
        )
    room = 0.08 * (end - near)
    return max(low + 1e-3 * room, near - 2.0 * room) if math.isfinite(low) else near - room, min(
        high, end + room
    )


def total_force(motion: Motion, times: FloatArray) -> FloatArray:
    """Return the sum [N] of all forces on the armature at given times [s].

    While a rigid backstop holds the armature, its reaction balances all other forces, and the sum is 0.
    """
    total = motion.forces_at(times)["total"].copy()
    for contact in motion.contacts:
        if contact.surface == "backstop" and contact.peak_force is None:
            end = math.inf if contact.t_out is None else contact.t_out
            total[(times > contact.t_in) & (times < end)] = 0.0
            total[(times == contact.t_in) & contact.initial] = 0.0
    return total
