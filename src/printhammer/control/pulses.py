"""Pulses with changed widths, and the peak and decay of their coil currents.

The current of a voltage-driven coil depends on the motion, so the hammer is simulated; other currents are
known in advance.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.base import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.support.arrays import FloatArray

LARGEST_CURRENT: Final = 2.0  # Default current limit of a print hammer, A: the range of the paper's Fig. 2
WIDEST: Final = 2.0  # Largest width of a pulse, as a multiple of the hammer's own; arbitrary
# Fraction of the current limit reserved for the tail of a brake pulse; arbitrary
MARGIN: Final = 1e-3
_SAMPLES: Final = 4001  # Number of samples of a simulated current; arbitrary
_SPAN: Final = 2.0  # Length of the first simulation, in pulse widths; arbitrary
_DOUBLINGS: Final = 6  # Iteration limit of the doublings of the simulated time; arbitrary


def current_bound(hammer: Hammer, largest: float | str | None = None, key: str = "largest_current") -> float:
    """Return the current limit, A: `largest` if stated, by default the limit of the hammer.

    The default limit is 2 A or, if larger, the peak current of the hammer's own pulse at the largest
    width, rounded up to 0.1 A. `key` is the name of the argument in error messages.
    """
    if largest is not None:
        return read_positive(largest, "A", key)
    pulse: Any = hammer.waveform
    if pulse is None or pulse.quantity == "force":
        return LARGEST_CURRENT
    width = getattr(pulse, "width", None)
    if pulse.replaces and isinstance(width, float):
        pulse = of_width(pulse, WIDEST * width)
    return max(LARGEST_CURRENT, math.ceil(10.0 * peak_current(hammer, pulse) / (1.0 - MARGIN)) / 10.0)


def peak_current(hammer: Hammer, pulse: Waveform) -> float:
    """Return the largest current of a pulse fired from rest, A."""
    if pulse.quantity != "voltage":
        return pulse.peak
    return float(_course(hammer, pulse, _SPAN)[1].max())


def fading_current(hammer: Hammer, pulse: Waveform, share: float) -> float:
    """Return the decay time [s] from the end of a driver's pulse to `share` times the peak current."""
    own: Any = pulse
    for doubling in range(_DOUBLINGS):
        times, current = _course(hammer, pulse, _SPAN * 2.0**doubling)
        faded = (times >= own.width) & (current <= share * current.max())
        if faded.any():
            return float(times[int(np.argmax(faded))] - own.width)
    raise InputError(
        (f"{hammer.path}: the current lasts {_SPAN * 2.0**_DOUBLINGS:g} times the width of the pulse"),
        file=hammer.path,
        key="waveform",
        expected="a driver whose current decays sooner",
    )


def _course(hammer: Hammer, pulse: Waveform, span: float) -> tuple[FloatArray, FloatArray]:
    """Simulate a pulse from rest; return times [s] and absolute currents [A], for `span` pulse widths."""
    own: Any = pulse
    end = span * own.width
    times = np.linspace(0.0, end, _SAMPLES)
    motion = simulate(hammer, PulseTrain(pulse), duration=end, times=times, tolerance=DISPLAY_TOLERANCE)
    return times[: motion.current.size], np.abs(motion.current)


def of_width(pulse: Waveform, width: float) -> Waveform:
    """Return a copy of a pulse with the width `width` [s]."""
    kind: Any = type(pulse)
    return kind(**{**dict(pulse), "width": width})  # type: ignore[no-any-return]


def widest(
    pulse: Waveform,
    bound: float,
    low: float,
    high: float,
    halvings: int,
    peak: Callable[[Waveform], float] = lambda pulse: pulse.peak,
) -> float:
    """Bisect for the largest pulse width [s] at which the peak current stays within a bound [A].

    The search covers the widths from `low` to `high` [s], in `halvings` bisections. The bound is assumed to
    hold at `low`, which is returned if the bound holds at no larger width. `peak` maps a pulse to its largest
    current, A.
    """
    if peak(of_width(pulse, high)) <= bound:
        return high
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if peak(of_width(pulse, middle)) <= bound else (low, middle)
    return low


def steepest_rise(waveform: Waveform) -> float:
    """Return the steepest slope of a waveform while it moves away from zero, A/s; infinite for a jump."""
    edges = waveform.segments()[:, 0]
    value = waveform.value(np.minimum(edges, np.nextafter(waveform.support, 0.0)))
    before = waveform.value(np.nextafter(edges, -np.inf))
    jumps = np.abs(value) - np.abs(before)
    if jumps[:-1].max() > 1e-6 * waveform.peak:
        return math.inf
    fine = np.concatenate([np.linspace(low, high, 257)[:-1] for low, high in itertools.pairwise(edges)])
    step = 1e-6 * float(np.diff(edges).min())
    slopes = (np.abs(waveform.value(fine + step)) - np.abs(waveform.value(fine))) / step
    return float(slopes.max())
