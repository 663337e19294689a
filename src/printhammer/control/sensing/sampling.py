"""How the current or the voltage of a coil is sampled: noise, rate, bits, and the span of the converter."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from printhammer.errors import InputError
from printhammer.results import Declared, part, scalar

if TYPE_CHECKING:
    from printhammer.run.motion import Motion
    from printhammer.support.arrays import FloatArray

Signal = Literal["current", "voltage"]
SIGNALS: Final = get_args(Signal)
UNITS: Final = {"current": "A", "voltage": "V"}
_MOST_BITS: Final = 24


class Sampling(Declared):
    """A converter that samples the current in a coil, or the voltage across it, from the firing on.

    Raises
    ------
    InputError
        A number is not within its bounds, or the signal is not known.
    """

    signal: Signal = part("what is sampled, current or voltage", default="current")
    noise: float = part("standard deviation of a sample, A or V", default=0.0)
    sampling_rate: float = scalar("Hz", "samples per second", default=1e6)
    bits: int = part("of the converter", default=12)
    full_scale: float | None = part(
        "largest value that is shown, A or V, beside 0 as the least; None for half as much again as the"
        " single pulse shows around its impact",
        default=None,
    )

    def __post_init__(self) -> None:
        if self.signal not in SIGNALS:
            raise InputError(f"signal = {self.signal!r}, expected {' or '.join(SIGNALS)}")
        if not 0.0 <= self.noise < math.inf:
            raise InputError(f"noise = {self.noise!r} is expected to be a number not below 0")
        if not 0.0 < self.sampling_rate < math.inf:
            raise InputError(f"sampling_rate = {self.sampling_rate!r} is expected to be a number above 0")
        if type(self.bits) is not int or not 1 <= self.bits <= _MOST_BITS:
            raise InputError(f"bits = {self.bits!r}, expected a whole number from 1 to {_MOST_BITS}")
        if self.full_scale is not None and not 0.0 < self.full_scale < math.inf:
            raise InputError(f"full_scale = {self.full_scale!r} is expected to be a number above 0")

    @property
    def unit(self) -> str:
        """SI unit of what is sampled."""
        return UNITS[self.signal]

    def scaled_to(self, largest: float) -> Sampling:
        """Return the same with a span, A or V, unless it has one."""
        return self if self.full_scale is not None else replace(self, full_scale=largest)

    @property
    def step(self) -> float:
        """Step of the converter, A or V; not a number before it has a span."""
        return math.nan if self.full_scale is None else self.full_scale / 2.0**self.bits

    @property
    def deviation(self) -> float:
        """Standard deviation of a sample with its rounding, A or V."""
        return math.hypot(self.noise, self.step / math.sqrt(12.0))

    def of(self, motion: Motion) -> FloatArray:
        """Return the true values of what is sampled at the output times of a motion, A or V."""
        values = motion.current if self.signal == "current" else motion.voltage
        return np.asarray(values, np.float64)

    def clipped(self, values: FloatArray) -> FloatArray:
        """Return values as far as the span goes, from 0 on, A or V."""
        span = math.inf if self.full_scale is None else self.full_scale
        return np.clip(values, 0.0, span)

    def read(self, values: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return what is shown of true values, A or V, of any shape."""
        noisy = values + self.noise * rng.standard_normal(values.shape)
        return self.clipped(np.rint(noisy / self.step) * self.step)
