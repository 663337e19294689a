"""Shapes of a current or force pulse.

The paper gives no formula for its current pulse. The four shapes in this module are those of common hammer
drivers: a half sine, a rectangle whose current rises and decays with the time constant L/R of a coil, a
trapezoid, and a measured record. `SHAPES` maps the name in a file to the class.
"""

from __future__ import annotations

from typing import ClassVar, Final, Self

from printhammer.drive import tables
from printhammer.drive.tables import DECAY_TIMES
from printhammer.drive.waveforms.base import QUANTITY_UNITS, QuantityName, Waveform
from printhammer.drive.waveforms.chain import Chain
from printhammer.drive.waveforms.drivers import DRIVERS, Switched
from printhammer.drive.waveforms.sampled import Sampled
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


class _Pulse(Waveform):
    """Base class of pulses with an amplitude."""

    amplitude: float = quantity("A", "I", "amplitude of the pulse", also=("N", "V"))

    def scaled(self, factor: float) -> Self:
        """Return a copy with its amplitude scaled by `factor`."""
        return type(self)(**{**self.model_dump(), "amplitude": self.amplitude * factor})


class HalfSine(_Pulse):
    """Half sine: amplitude sin(pi tau / width) for 0 <= tau < width."""

    shape: ClassVar[str] = "half-sine"
    code: ClassVar[int] = tables.HALF_SINE
    width: float = quantity("s", "tw", "duration of the half sine", gt=0.0)


class Rectangle(_Pulse):
    """Rectangle with exponential rise and decay: the current of a coil that is switched on and off.

    I(tau) = amplitude (1 - exp(-tau / rise)) for 0 <= tau < width, then I(width) exp(-(tau - width) / decay),
    and zero later than `DECAY_TIMES` decay constants after the width, when 1e-12 of the current is left. A
    rise or decay of 0 is a sharp edge.
    """

    shape: ClassVar[str] = "rectangle"
    code: ClassVar[int] = tables.RECTANGLE
    width: float = quantity("s", "tw", "time for which the coil is switched on", gt=0.0)
    rise: float = quantity("s", "tr", "time constant of the rise", ge=0.0)
    decay: float = quantity("s", "td", "time constant of the decay", ge=0.0)


class Trapezoid(_Pulse):
    """Trapezoid: straight rise, flat top of the given width, straight fall; 0 is a sharp edge."""

    shape: ClassVar[str] = "trapezoid"
    code: ClassVar[int] = tables.TRAPEZOID
    rise: float = quantity("s", "tr", "duration of the rise", ge=0.0)
    width: float = quantity("s", "tw", "duration of the flat top", gt=0.0)
    fall: float = quantity("s", "tf", "duration of the fall", ge=0.0)


class Sine(_Pulse):
    """Endless sine wave for a periodic drive, amplitude sin(2 pi frequency tau + phase) for tau >= 0."""

    shape: ClassVar[str] = "sine"
    code: ClassVar[int] = tables.SINE_SHAPE
    frequency: float = quantity("Hz", "f", "frequency", gt=0.0)
    phase: float = quantity("rad", "phi", "phase at the start", default=0.0)


_PULSES: Final[tuple[type[Waveform], ...]] = (HalfSine, Rectangle, Trapezoid, Sampled)

SHAPES: Final[dict[str, type[Waveform]]] = {shape.shape: shape for shape in (*_PULSES, *DRIVERS)}
"""Waveform class of each shape name."""
