"""What sensors make of a quantity: noise, resolution, a zero offset, and readings that are wrong altogether.

    reading = resolution * round((true + offset + noise) / resolution)

The noise is white and normal. A limited bandwidth acts before all this, see `printhammer.identify.lowpass`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.drive.input import read_number
from printhammer.errors import InputError
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.support.arrays import FloatArray, IntArray

FULL_SCALE: Final = "of full scale"
READING: Final = "of reading"

_WRONG: Final = 0.1
"""Standard deviation of what is added to a wrong reading, of full scale."""


@dataclass(frozen=True)
class Amount:
    """A size in SI, or a share of the full scale or of the reading."""

    size: float = 0.0
    """SI, or the share."""
    of: str = ""
    """Empty for SI, "of full scale", which is the largest true value, or "of reading"."""

    @classmethod
    def read(cls, text: str | float, si: str, name: str, *, signed: bool = False) -> Amount:
        """Read a quantity such as "0.2 um", "0.5 %" (of full scale) or "1 % of reading", or a number in SI.

        Raises
        ------
        InputError
            It is none, of another dimension, or negative.
        """
        of = ""
        if isinstance(text, str) and "%" in text:
            share, _percent, tail = text.partition("%")
            of = tail.strip() or FULL_SCALE
            if of not in (FULL_SCALE, READING):
                raise InputError(f"{name}: {text!r}, expected nothing, {FULL_SCALE!r} or {READING!r} after %")
            size = read_number(f"{share.strip()} %", "1", name)
        else:
            size = read_number(text, si, name)
        if size < 0.0 and not signed:
            raise InputError(f"{name} = {text!r} is expected to be 0 or more")
        return cls(size, of)

    def at(self, true: FloatArray) -> FloatArray:
        """Return the size at each true value, SI, shape of `true`."""
        if self.of == READING:
            return self.size * np.abs(true)
        return np.full(true.shape, self.size * (full_scale(true) if self.of else 1.0))


class Channel(Declared):
    """One quantity as it is read."""

    noise: Amount = part("standard deviation of white, normal noise", default_factory=Amount)
    resolution: Amount = part("step of the readings; 0 for none", default_factory=Amount)
    offset: Amount = part("what is read at zero", default_factory=Amount)

    def __post_init__(self) -> None:
        if self.resolution.of == READING:
            raise InputError(f"a resolution {READING} is given, expected one in steps of the same size")

    def readings(self, true: FloatArray, normal: FloatArray) -> FloatArray:
        """Return what is read of true values, SI, with standard normal numbers for the noise, shape (n,)."""
        shown = true + self.offset.at(true) + self.noise.at(true) * normal
        return self.rounded(shown, true)

    def rounded(self, shown: FloatArray, true: FloatArray) -> FloatArray:
        """Return readings in whole steps of the resolution, with the full scale of `true`."""
        step = self.step(full_scale(true))
        return np.rint(shown / step) * step if step > 0.0 else shown

    def step(self, full: float) -> float:
        """Return the step of the readings, SI, for a full scale, SI.

        A share of the full scale is rounded down to 1, 2 or 5 times a power of ten, as instruments have it.
        """
        if not self.resolution.of:
            return self.resolution.size
        size = self.resolution.size * full
        if not size > 0.0:
            return 0.0
        power = math.floor(math.log10(size))
        digit = max(digit for digit in (1, 2, 5) if digit <= max(size / 10.0**power, 1.0))
        return float(f"{digit}e{power}")

    def described(self, si: str, unit: str, full: float) -> str:
        """Return noise, resolution and offset as text in a unit, for a full scale, SI."""
        from printhammer.units import from_si

        def absolute(size: float) -> str:
            return f"{from_si(size, si, unit):.6g} {unit}"

        def amount(given: Amount) -> str:
            if not given.of:
                return absolute(given.size)
            share = f"{100.0 * given.size:.6g} % {given.of}"
            return share if given.of == READING else f"{absolute(given.size * full)} ({share})"

        step = absolute(self.step(full)) if self.step(full) else "none"
        return f"noise {amount(self.noise)}, resolution {step}, offset {amount(self.offset)}"


@dataclass(frozen=True)
class Sensor:
    """The sensors of one bench."""

    channels: Mapping[str, Channel]
    """By quantity: "displacement", "indentation", "current", "force", "impact speed", "rebound speed"."""
    sampling_rate: float | None = None
    """Of records, Hz; None on a bench without records."""
    bandwidth: float | None = None
    """-3 dB frequency of a first-order low-pass before the sampling of records, Hz; None for none."""
    outliers: float = 0.0
    """Share of the rows whose measured quantity is wrong."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))
        for name, frequency in (("sampling_rate", self.sampling_rate), ("bandwidth", self.bandwidth)):
            if frequency is not None and not (frequency > 0.0 and math.isfinite(frequency)):
                raise InputError(f"{name} = {frequency!r} is expected to be more than 0 Hz")
        if not 0.0 <= self.outliers <= 0.5:
            raise InputError(f"outliers = {self.outliers!r} is expected to be a share from 0 to 0.5")

    def exact(self) -> Sensor:
        """Return sensors without errors: no noise, resolution, offset, bandwidth or outliers."""
        return replace(
            self, channels={name: Channel() for name in self.channels}, bandwidth=None, outliers=0.0
        )


def full_scale(true: FloatArray) -> float:
    """Return the largest true value without its sign, SI."""
    return float(np.abs(true).max()) if true.size else 0.0


def wrong_rows(share: float, true: FloatArray, rng: np.random.Generator) -> tuple[IntArray, FloatArray]:
    """Draw which readings, a share of all, are wrong, ascending, and by how much.

    Errors are normal, a tenth of the full scale of what is there, SI.
    """
    count = int(share * len(true) + 0.5)
    rows = np.sort(rng.permutation(len(true))[:count])
    return rows.astype(np.int64), _WRONG * full_scale(true) * rng.standard_normal(count)
