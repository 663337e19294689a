"""Impact sensor of a learner: the time from firing to impact and, optionally, the force, with noise.

A microphone, a piezo element or the coil itself (`printhammer.impact_time`) measures the time; a load cell or
the darkness of the dot indicates the force. The noise depends on seed, unit and run only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from printhammer.errors import InputError
from printhammer.results import Declared, part, scalar
from printhammer.support.arrays import FloatArray


class Readings(NamedTuple):
    """Sensor readings of dots, in the order of their firings; NaN where no impact was detected."""

    time: FloatArray  # Time from firing to impact, s
    force: FloatArray | None  # Peak force, normalised by the nominal force; None if not measured


class ImpactSensor(Declared):
    """Sensor that reads the impact time of each dot and, if `force` is set, the peak force of each dot."""

    noise: float = scalar("s", "standard deviation of the measured impact time", default=5e-6)
    force: float | None = part(
        "relative standard deviation of the measured force; None without a force measurement", default=None
    )
    colour: float = part("correlation of the noise of consecutive dots", default=0.0)
    gain: float = part("relative gain error of times and forces", default=0.0)
    missed: float = part("fraction of impacts that are not detected", default=0.0)
    false: float = part("fraction of impacts that are preceded by a false detection", default=0.0)
    seed: int = part("seed of the random number generator of the noise", default=0)
    delay: float = scalar("s", "constant error of the impact time, unknown to the learner", default=0.0)
    offset: float | None = part(
        "standard deviation over units, s, of the offset that all impact times of a unit have in common; "
        "None if not stated: no offset is simulated, and the learner expects 25 us",
        default=None,
    )

    def __post_init__(self) -> None:
        bounds = {"noise": math.inf, "colour": 1.0, "missed": 1.0, "false": 1.0}
        bounds |= {name: math.inf for name in ("force", "offset") if getattr(self, name) is not None}
        for name, most in bounds.items():
            value = getattr(self, name)
            if not 0.0 <= value < most:
                limit = f" and below {most:g}" if math.isfinite(most) else ""
                raise InputError.of(name, value, f"a number not below 0{limit}", file="sensor")
        if not math.isfinite(self.delay):
            raise InputError.of("delay", self.delay, "a finite number", file="sensor")
        if not (math.isfinite(self.gain) and self.gain > -1.0):
            raise InputError.of("gain", self.gain, "a number above -1", file="sensor")
        if type(self.seed) is not int or self.seed < 0:
            raise InputError.of("seed", self.seed, "a whole number not below 0", file="sensor")

    def read(self, flight: FloatArray, force: FloatArray, unit: int, run: int) -> Readings:
        """Simulate the readings of dots with given true flight times [s] and relative forces, NaN if lost.

        `unit` and `run` are the numbers of unit and run, of which the noise is a function.
        """
        rng = np.random.default_rng((self.seed, unit, run))
        time = (1.0 + self.gain) * flight + self.delay + self.noise * self._noise(rng, flight.size)
        if self.offset:
            time = time + self.offset * np.random.default_rng((self.seed, unit)).standard_normal()
        early = rng.random(flight.size) < self.false
        time = np.where(early, rng.random(flight.size) * np.nan_to_num(flight), time)
        unseen = rng.random(flight.size) < self.missed
        time = np.where(unseen, np.nan, time)
        if self.force is None:
            return Readings(time, None)
        shown = (1.0 + self.gain) * force + self.force * self._noise(rng, force.size)
        return Readings(time, np.where(unseen | early, np.nan, shown))

    def _noise(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Draw noise of standard deviation 1 as a first-order autoregressive process over the dots."""
        white = rng.standard_normal(count)
        if not self.colour:
            return white
        noise = white.copy()
        for k in range(1, count):
            noise[k] = self.colour * noise[k - 1] + math.sqrt(1.0 - self.colour**2) * white[k]
        return noise
