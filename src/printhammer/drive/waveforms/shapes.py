"""Shapes of a current or force pulse, and chains of pulses.

The paper gives no formula for its current pulse. The four shapes in this module occur in common hammer
drivers: a half sine, a rectangle whose current rises and decays with the time constant L/R of a coil, a
trapezoid, and a measured record. `SHAPES` maps the name in a file to the class.

A `Chain` is composed of consecutive waveforms, such as a print pulse and a later brake pulse.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final, Self

import numpy as np
from pydantic import model_validator

from printhammer.drive import tables
from printhammer.drive.input import read_number
from printhammer.drive.segments import evaluate, largest, table
from printhammer.drive.tables import DECAY_TIMES
from printhammer.drive.waveforms.base import QUANTITY_UNITS, QuantityName, Supply, Waveform
from printhammer.drive.waveforms.drivers import DRIVERS, Switched
from printhammer.drive.waveforms.sampled import Sampled
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import quantity

TAIL: Final = 1e-3  # Arbitrary
"""Largest remainder of a decaying waveform that the next waveform may cut off, relative to the peak."""

_SAMPLES: Final = 257  # Samples of the remaining waveform; arbitrary
_ROUNDING: Final = 1e-14  # Relative difference between times that counts as rounding; arbitrary


class Chain(Waveform):
    """Several consecutive waveforms in one firing, each at an offset, with a zero drive in between.

    `parts` are pairs of an offset (a number in s or a string with a unit) and a waveform, in ascending order
    of offset; all waveforms are currents, or all are forces. A waveform may begin once the preceding waveform
    has ended or decayed to the fraction `TAIL` of its peak; the remainder is cut off. The time of an edge is
    the rounded sum of the offset and the time of the edge within its waveform.
    """

    shape: ClassVar[str] = "chain"
    parts: tuple[tuple[float, Waveform], ...]

    @model_validator(mode="before")
    @classmethod
    def _read_parts(cls, data: Any) -> Any:
        """Validate the waveforms one by one; the chain has the driven quantity of its waveforms."""
        if not isinstance(data, dict) or "parts" not in data:
            return data
        parts = _validate(data["parts"])
        driven = parts[0][1].quantity
        if data.get("quantity", driven) != driven:
            raise InputError.of("quantity", data["quantity"], f"that of the parts, {driven!r}")
        return {**data, "parts": parts, "quantity": driven}

    @property
    def replaces(self) -> bool:
        """Whether the waveforms belong to a coil driver, whose latest firing replaces earlier firings."""
        return self.parts[0][1].replaces

    @property
    def support(self) -> float:
        """Time from the firing to the end of the last waveform, s; the current in a coil may last longer."""
        offset, last = self.parts[-1]
        return offset + last.support

    def supply(self) -> Supply:
        """Return the supply of the first waveform of the chain."""
        return self.parts[0][1].supply()

    def segments(self) -> FloatArray:
        """Return the segment tables of the waveforms in sequence, with zeros in between."""
        rows: list[list[float]] = []
        for offset, part in self.parts:
            own = part.segments().tolist()
            while rows and offset <= rows[-1][0]:
                # The remainder of the preceding waveform is cut off here.
                rows.pop()
            rows += [[offset + start, *rest] for start, *rest in own]
        return table(rows[:-1], rows[-1][0])

    def scaled(self, factor: float) -> Self:
        """Return a copy with all waveforms scaled by `factor`."""
        return type(self)(parts=tuple((offset, part.scaled(factor)) for offset, part in self.parts))


def _validate(parts: object) -> tuple[tuple[float, Waveform], ...]:
    """Validate offsets [s] and waveforms; no waveform may begin before the preceding one is over."""
    try:
        pairs = [tuple(pair) for pair in parts]  # type: ignore[attr-defined]
    except TypeError:
        pairs = []
    if not pairs or any(len(pair) != 2 for pair in pairs):
        raise InputError.of("parts", parts, "pairs of an offset and a waveform")
    checked: list[tuple[float, Waveform]] = []
    for number, (begin, waveform) in enumerate(pairs):
        if not isinstance(waveform, Waveform):
            raise InputError(f"parts[{number}]: {waveform!r}", expected="a waveform", key=f"parts[{number}]")
        if waveform.quantity != pairs[0][1].quantity:
            raise InputError(
                f"parts[{number}] is a {waveform.quantity}",
                key=f"parts[{number}]",
                expected=f"a {pairs[0][1].quantity} like the first",
            )
        if not math.isfinite(waveform.support):
            raise InputError(
                f"parts[{number}] is a {waveform.shape}",
                key=f"parts[{number}]",
                expected="a waveform that ends",
            )
        offset = _offset(begin, number)
        if not (_is_over(*checked[-1], offset) if checked else offset >= 0.0):
            sooner = f"parts[{number - 1}] is over" if checked else "the firing"
            raise InputError(
                f"parts[{number}] begins at {offset:.9g} s",
                key=f"parts[{number}]",
                value=offset,
                expected=f"a time not before {sooner}",
            )
        checked.append((offset, waveform))
    return tuple(checked)


def _is_over(begun: float, waveform: Waveform, time: float) -> bool:
    """Whether a waveform begun at `begun` [s] has ended or decayed to `TAIL` of its peak by `time` [s]."""
    segments = waveform.segments()
    # A driver's circuit carries current after the supply is off.
    end = waveform.support
    # Rounding may place the end slightly after the beginning of the next waveform.
    if time >= begun + end or math.isclose(time, begun + end, rel_tol=_ROUNDING):
        return True
    if time <= begun or waveform.replaces:
        return False
    edges, tau = segments[:, 0], time - begun
    times = np.concatenate([np.linspace(tau, end, _SAMPLES), edges[edges > tau]])
    return bool(np.abs(evaluate(segments, times)).max() <= TAIL * largest(segments))


def _offset(written: object, number: int) -> float:
    """Parse the offset of waveform `number` of a chain: a number in s, or a string with a unit."""
    if isinstance(written, str):
        return read_number(written, "s", f"parts[{number}]")
    if isinstance(written, bool) or not isinstance(written, float | int) or not math.isfinite(written):
        raise InputError(
            f"parts[{number}]: offset {written!r}",
            expected="a finite number in s",
            key=f"parts[{number}]",
        )
    return float(written)


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
    """Trapezoid: straight rise, flat top, straight fall; a rise or fall time of 0 is a sharp edge."""

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
