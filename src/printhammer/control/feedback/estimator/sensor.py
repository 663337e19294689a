"""A sensor that sees the hammer: position with noise, quantised, and late.

Samples are taken at whole multiples of the interval. The noise of a sample depends on the seed, on the run
and on the number of the sample only, so that a closed loop is the same to the bit whatever is run beside it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError
from printhammer.results import Declared, part, scalar
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    Words = npt.NDArray[np.uint64]


# Least standard deviation that a sample counts with, in parts of the way from backstop to pack
_LEAST_ERROR: Final = 1e-4
# Part of an interval by which a sample may lie beyond a boundary, so that no rounding decides
_SLACK: Final = 1e-6


class Samples(NamedTuple):
    """What a sensor shows of some runs: arrays of shape (M, N), one row a run.

    Times of the samples, s; displacements that are shown, m, 0 for samples that are not used; whether they
    are used; and the standard deviation of a sample, m.
    """

    times: FloatArray
    shown: FloatArray
    used: BoolArray
    error: float

    def take(self, which: Any) -> Samples:
        """Return some of the rows or columns."""
        return Samples(self.times[which], self.shown[which], self.used[which], self.error)


class PositionSensor(Declared):
    """A position sensor."""

    noise: float = part(
        "standard deviation of a sample, in parts of the way from backstop to pack; normal, white",
        default=0.01,
    )
    delay: float = scalar("s", "from the instant of a sample until it can be used", default=20e-6)
    interval: float = scalar("s", "between samples", default=2e-6)
    step: float = part(
        "quantisation, in parts of the way from backstop to pack; 0 for none", default=2.0**-10
    )
    seed: int = part("of the noise", default=0)

    def __post_init__(self) -> None:
        for name, unit in (("noise", ""), ("delay", " s"), ("interval", " s"), ("step", "")):
            value = getattr(self, name)
            least = "above" if name == "interval" else "not below"
            if not (math.isfinite(value) and value >= 0.0 and (value > 0.0 or name != "interval")):
                raise InputError(
                    f"sensor: {name} = {value!r}{unit} is expected to be a number {least} 0", key="sensor"
                )
        if type(self.seed) is not int or self.seed < 0:
            raise InputError.of(
                "seed", self.seed, "a whole number not below 0", file="sensor", said=" is expected to be"
            )

    @property
    def error(self) -> float:
        """Standard deviation of a sample, in parts of the way from backstop to pack."""
        return max(float(np.hypot(self.noise, self.step / np.sqrt(12.0))), _LEAST_ERROR)

    def count(self, time: float) -> int:
        """Return the number of samples within a time, s; at least one."""
        return max(1, round(time / self.interval))

    def numbers(self, since: FloatArray, until: FloatArray, most: int) -> IntArray:
        """Return the numbers of the latest samples in some spans of time (M,), s, shape (M, most).

        `until` is the instant at which the samples are needed: what is in by then was taken the delay before.
        The numbers ascend; -1 in front where there are fewer.
        """
        last = np.floor((until - self.delay) / self.interval + _SLACK).astype(np.int64)
        first = np.ceil(since / self.interval - _SLACK).astype(np.int64)
        latest = last[:, np.newaxis] - np.arange(most - 1, -1, -1)
        return np.where(latest >= np.maximum(first, 0)[:, np.newaxis], latest, -1)

    def read(self, x: FloatArray, numbers: IntArray, runs: Words, stroke: float) -> FloatArray:
        """Return what the sensor shows of true displacements (M, N), m, at samples of some numbers (M, N).

        `runs` (M,) are the keys of the noise, one a run; `stroke` is the way from backstop to pack.
        """
        shown = x + self.noise * stroke * normal(self.seed, runs[:, np.newaxis], numbers)
        if self.step > 0.0:
            quantum = self.step * stroke
            shown = quantum * np.round(shown / quantum)
        return shown


def normal(seed: int, runs: Words, numbers: IntArray) -> FloatArray:
    """Return normally distributed numbers that depend on seed, run and number only.

    The bits are those of the generator splitmix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014), whose
    state is made of the three; the distribution comes from its inverse.
    """
    from scipy.special import ndtri

    state = _mixed(np.uint64(seed % 2**64) + np.zeros(1, np.uint64))
    state = _mixed(state ^ runs)
    state = _mixed(state ^ numbers.astype(np.uint64))
    # The middle of one of 2**53 equal intervals, so that neither 0 nor 1 occurs.
    share = ((state >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    return np.asarray(ndtri(share))


def run_key(slots: tuple[int, ...], rate: float) -> int:
    """Return the key by which the noise of a pattern at a rate differs from that of others."""
    import hashlib

    text = f"{rate!r} {slots!r}".encode()
    return int.from_bytes(hashlib.sha256(text).digest()[:8], "little")


def _mixed(state: Words) -> Words:
    with np.errstate(over="ignore"):
        state = state + np.uint64(0x9E3779B97F4A7C15)
        state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return state ^ (state >> np.uint64(31))
