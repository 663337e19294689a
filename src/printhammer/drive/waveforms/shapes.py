"""Shapes of a current or force pulse.

The paper gives no formula for its current pulse. The four shapes in this module are those of common hammer
drivers: a half sine, a rectangle whose current rises and decays with the time constant L/R of a coil, a
trapezoid, and a measured record. `SHAPES` maps the name in a file to the class.
"""

from __future__ import annotations

import math
from typing import ClassVar, Final, Self

from printhammer.drive.segments import EXPONENTIAL, POLYNOMIAL, SINE, table
from printhammer.drive.waveforms.base import DECAY_TIMES, QUANTITY_UNITS, QuantityName, Waveform
from printhammer.drive.waveforms.chain import Chain
from printhammer.drive.waveforms.drivers import DRIVERS, Switched
from printhammer.drive.waveforms.sampled import Sampled
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import quantity

__all__ = [
    "DECAY_TIMES",
    "QUANTITY_UNITS",
    "SHAPES",
    "Chain",
    "HalfSine",
    "QuantityName",
    "Rectangle",
    "Sampled",
    "Sine",
    "Switched",
    "Trapezoid",
    "Waveform",
]


def _rate(time_constant: float) -> float:
    """Return 1 / time constant; infinite for a time constant that is zero or too small to divide by."""
    return 1.0 / time_constant if time_constant > 1e-300 else math.inf


class _Pulse(Waveform):
    """Base class of pulses with an amplitude."""

    amplitude: float = quantity("A", "I", "amplitude of the pulse", also=("N", "V"))

    def scaled(self, factor: float) -> Self:
        """Return a copy with its amplitude scaled by `factor`."""
        return type(self)(**{**self.model_dump(), "amplitude": self.amplitude * factor})


class HalfSine(_Pulse):
    """Half sine: amplitude sin(pi tau / width) for 0 <= tau < width."""

    shape: ClassVar[str] = "half-sine"
    width: float = quantity("s", "tw", "duration of the half sine", gt=0.0)

    def segments(self) -> FloatArray:
        """Return the segment table: one half sine."""
        return table([(0.0, SINE, 0.0, self.amplitude, math.pi / self.width, 0.0)], self.width)


class Rectangle(_Pulse):
    """Rectangle with exponential rise and decay: the current of a coil that is switched on and off.

    I(tau) = amplitude (1 - exp(-tau / rise)) for 0 <= tau < width, then I(width) exp(-(tau - width) / decay),
    and zero from `DECAY_TIMES` decay constants after the width on, where 1e-12 of the current is left. A rise
    or decay of 0 is a sharp edge.
    """

    shape: ClassVar[str] = "rectangle"
    width: float = quantity("s", "tw", "time for which the coil is switched on", gt=0.0)
    rise: float = quantity("s", "tr", "time constant of the rise", ge=0.0)
    decay: float = quantity("s", "td", "time constant of the decay", ge=0.0)

    def segments(self) -> FloatArray:
        """Return the segment table: rise, decay."""
        up, down = _rate(self.rise), _rate(self.decay)
        if math.isinf(up):
            reached = self.amplitude
            rows = [(0.0, POLYNOMIAL, self.amplitude, 0.0, 0.0, 0.0)]
        else:
            reached = -self.amplitude * math.expm1(-self.width * up)
            rows = [(0.0, EXPONENTIAL, self.amplitude, -self.amplitude, up, 0.0)]
        if math.isinf(down):
            return table(rows, self.width)
        rows.append((self.width, EXPONENTIAL, 0.0, reached, down, 0.0))
        return table(rows, self.width + DECAY_TIMES * self.decay)


class Trapezoid(_Pulse):
    """Trapezoid: straight rise, flat top of the given width, straight fall; 0 is a sharp edge."""

    shape: ClassVar[str] = "trapezoid"
    rise: float = quantity("s", "tr", "duration of the rise", ge=0.0)
    width: float = quantity("s", "tw", "duration of the flat top", gt=0.0)
    fall: float = quantity("s", "tf", "duration of the fall", ge=0.0)

    def segments(self) -> FloatArray:
        """Return the segment table: rise, top, fall."""
        up, down = _rate(self.rise), _rate(self.fall)
        rows = []
        top = 0.0 if math.isinf(up) else self.rise
        if top > 0.0:
            rows.append((0.0, POLYNOMIAL, 0.0, self.amplitude * up, 0.0, 0.0))
        rows.append((top, POLYNOMIAL, self.amplitude, 0.0, 0.0, 0.0))
        end = top + self.width
        if math.isfinite(down):
            rows.append((end, POLYNOMIAL, self.amplitude, -self.amplitude * down, 0.0, 0.0))
            end += self.fall
        return table(rows, end)


class Sine(_Pulse):
    """Endless sine wave, amplitude sin(2 pi frequency tau + phase) from tau = 0 on, for a periodic drive."""

    shape: ClassVar[str] = "sine"
    frequency: float = quantity("Hz", "f", "frequency", gt=0.0)
    phase: float = quantity("rad", "phi", "phase at the start", default=0.0)

    def segments(self) -> FloatArray:
        """Return the segment table: one segment without end."""
        return table([(0.0, SINE, 0.0, self.amplitude, 2.0 * math.pi * self.frequency, self.phase)], math.inf)


_PULSES: Final[tuple[type[Waveform], ...]] = (HalfSine, Rectangle, Trapezoid, Sampled)

SHAPES: Final[dict[str, type[Waveform]]] = {shape.shape: shape for shape in (*_PULSES, *DRIVERS)}
"""Waveform class of each shape name."""
