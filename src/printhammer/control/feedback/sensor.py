"""A position sensor with noise, quantisation and delay.

Samples are taken at integer multiples of the interval. The noise of a sample depends only on the seed, the
run and the index of the sample, so the results of a closed loop do not depend, to the last bit, on the other
runs of the ensemble.
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


# Smallest standard deviation assigned to a sample, as a fraction of the stroke; arbitrary
_LEAST_ERROR: Final = 1e-4
# Tolerance of a sample time at a boundary, as a fraction of the interval, against rounding; arbitrary
_SLACK: Final = 1e-6


class Samples(NamedTuple):
    """Sensor readings of several runs: arrays of shape (M, N), one row per run.

    `times` are the sample times, s, `shown` the displacements read, m (0 for unused samples), `used` is the
    mask of the used samples, and `error` the standard deviation of a sample, m.
    """

    times: FloatArray
    shown: FloatArray
    used: BoolArray
    error: float

    def take(self, which: Any) -> Samples:
        """Return a copy with the runs (rows) and samples (columns) that the array index `which` selects."""
        return Samples(self.times[which], self.shown[which], self.used[which], self.error)


class PositionSensor(Declared):
    """A position sensor with white noise, delay and quantisation."""

    noise: float = part(
        "standard deviation of the normal white noise of a sample, as a fraction of the stroke",
        default=0.01,
    )
    delay: float = scalar("s", "delay from the sampling time until the sample is available", default=20e-6)
    interval: float = scalar("s", "sampling interval", default=2e-6)
    step: float = part("quantisation step, as a fraction of the stroke; 0 for none", default=2.0**-10)
    seed: int = part("seed of the random number generator of the noise", default=0)

    def __post_init__(self) -> None:
        for name, unit in (("noise", ""), ("delay", " s"), ("interval", " s"), ("step", "")):
            value = getattr(self, name)
            least = "above" if name == "interval" else "not below"
            if not (math.isfinite(value) and value >= 0.0 and (value > 0.0 or name != "interval")):
                raise InputError(
                    f"sensor: {name} = {value!r}{unit}", expected=f"a number {least} 0", key="sensor"
                )
        if type(self.seed) is not int or self.seed < 0:
            raise InputError.of("seed", self.seed, "a whole number not below 0", file="sensor")

    @property
    def error(self) -> float:
        """Standard deviation of a sample, as a fraction of the stroke, quantisation included."""
        return max(float(np.hypot(self.noise, self.step / np.sqrt(12.0))), _LEAST_ERROR)

    def count(self, time: float) -> int:
        """Return the number of samples in a time span [s]; at least 1."""
        return max(1, round(time / self.interval))

    def numbers(self, since: FloatArray, until: FloatArray, most: int) -> IntArray:
        """Return the indices of each run's latest samples from `since` to `until` [s], shape (M, most).

        `until` is the time at which the samples are needed, so the latest sample is one delay older. The
        indices ascend, padded with -1 at the front.
        """
        last = np.floor((until - self.delay) / self.interval + _SLACK).astype(np.int64)
        first = np.ceil(since / self.interval - _SLACK).astype(np.int64)
        latest = last[:, np.newaxis] - np.arange(most - 1, -1, -1)
        return np.where(latest >= np.maximum(first, 0)[:, np.newaxis], latest, -1)

    def read(self, x: FloatArray, numbers: IntArray, runs: Words, stroke: float) -> FloatArray:
        """Return the sensor readings [m] of true displacements `x` [m] at sample indices, shape (M, N).

        `runs`, shape (M,), are the noise keys of the runs; `stroke` is the distance from backstop to pack, m.
        """
        shown = x + self.noise * stroke * normal(self.seed, runs[:, np.newaxis], numbers)
        if self.step > 0.0:
            quantum = self.step * stroke
            shown = quantum * np.round(shown / quantum)
        return shown


def normal(seed: int, runs: Words, numbers: IntArray) -> FloatArray:
    """Return normally distributed pseudo-random numbers, each a pure function of seed, run and sample index.

    The bits come from the generator splitmix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014), whose state
    combines the three arguments; the inverse normal distribution maps them to normal numbers.
    """
    from scipy.special import ndtri

    state = _mixed(np.uint64(seed % 2**64) + np.zeros(1, np.uint64))
    state = _mixed(state ^ runs)
    state = _mixed(state ^ numbers.astype(np.uint64))
    # The midpoint of one of 2**53 equal intervals, so that 0 and 1 do not occur.
    share = ((state >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    return np.asarray(ndtri(share))


def run_key(slots: tuple[int, ...], rate: float) -> int:
    """Return the noise key of a run: a hash of its dot pattern and slot rate."""
    import hashlib

    text = f"{rate!r} {slots!r}".encode()
    return int.from_bytes(hashlib.sha256(text).digest()[:8], "little")


def _mixed(state: Words) -> Words:
    with np.errstate(over="ignore"):
        state = state + np.uint64(0x9E3779B97F4A7C15)
        state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return state ^ (state >> np.uint64(31))
