"""A current probe and its errors: offset, gain, delay, bandwidth and resolution, declared or fitted.

    shown(t) = gain * lowpass(i)(t - delay) + offset,   in steps of the resolution

An error is exact, known with a standard deviation ("1 % +- 0.5 %"), or free ("fit").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.identify.lowpass import time_constant
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray, IntArray

FIT: Final = "fit"
"""Setting of a probe error that is fitted."""

NOMINAL: Final = {"offset": 0.0, "gain": 1.0, "delay": 0.0, "time constant": 0.0}
"""Errors of an ideal probe, SI."""

UNITS: Final = {"offset": "A", "gain": "1", "delay": "s", "time constant": "s"}

SIGNS: Final = {
    "offset": "the current has a constant error, like that of a probe offset: state or fit the offset",
    "gain": "the current has a scale error, like that of a probe gain: state or fit the gain",
    "delay": "the current is shifted in time, as by a probe delay: state or fit the delay",
    "time constant": "the current is too smooth, as by a limited probe bandwidth: state or fit the bandwidth",
}
"""Advice for each undeclared probe error that a record reveals, by name of the error."""

_WIDEST: Final = 0.2
"""Upper bound of a fitted time constant, as a fraction of the length of the longest record."""


class ProbeError(Declared):
    """Probe error with its standard deviation."""

    name: str = part("offset, gain, delay or time constant")
    value: float = part("value, SI")
    deviation: float = part("standard deviation, SI; 0 if exact, infinite if free")

    @property
    def is_fitted(self) -> bool:
        """Whether the probe error is a parameter of the fit, not an exact constant."""
        return self.deviation > 0.0

    @property
    def key(self) -> str:
        """Key of the probe error in a fit result, such as "probe.gain"."""
        return f"probe.{self.name.replace(' ', '_')}"

    @property
    def text(self) -> str:
        """Value with its unit, and with its standard deviation unless exact."""
        unit = UNITS[self.name]
        return f"{self.value!r} {unit}" + (f" +- {self.deviation:.3g} {unit}" if self.deviation else "")


def read_probe(settings: Mapping[str, float | str | None], step: float) -> list[ProbeError]:
    """Parse the declared errors of a probe; `step` is the sampling interval, s.

    Settings are "offset", A, "gain", "delay", s, and "bandwidth", Hz: a number or a text with a unit, a value
    with its standard deviation such as "0 us +- 5 us", or "fit". None stands for an undeclared error.
    """
    errors = []
    for name, written in settings.items():
        if written is None:
            continue
        if name not in _SI:
            raise InputError.of("probe", name, f"one of {', '.join(_SI)}")
        value, deviation = _read(name, written)
        if name == "bandwidth":
            if math.isinf(deviation):
                errors.append(ProbeError("time constant", step, deviation))
                continue
            tau = time_constant(value)
            errors.append(ProbeError("time constant", tau, tau * deviation / value))
        else:
            errors.append(ProbeError(name, value, deviation))
    return errors


_SI: Final = {"offset": "A", "gain": "1", "delay": "s", "bandwidth": "Hz"}


def _read(name: str, written: float | str) -> tuple[float, float]:
    if isinstance(written, str) and written.strip() == FIT:
        return NOMINAL.get(name, math.nan), math.inf
    deviation = 0.0
    if isinstance(written, str):
        written, mark, error = (each.strip() for each in written.replace("±", "+-").partition("+-"))
        if mark:
            deviation = abs(read_number(error, _SI[name], f"the standard deviation of {name}"))
    read = read_positive if name in ("bandwidth", "gain") else read_number
    return read(written, _SI[name], name), deviation


def bounds_of(error: ProbeError, longest: float) -> tuple[float, float]:
    """Return the bounds of a probe error, SI, for records of a given duration, s."""
    if error.name == "gain":
        return 0.1 * error.value, 10.0 * error.value
    if error.name == "time constant":
        return 1e-3 * error.value, _WIDEST * longest
    reach = 0.5 * longest if error.name == "delay" else math.inf
    return error.value - reach, error.value + reach


def resolution_of(values: FloatArray) -> float:
    """Return the quantisation step of readings; 0 if they are not quantised, or if too few values repeat."""
    levels = np.unique(values)
    if len(levels) < 3 or len(levels) == len(values):
        return 0.0
    step = float(np.diff(levels).min())
    counts = (levels - levels[0]) / step
    return step if float(np.abs(counts - np.rint(counts)).max()) < _WHOLE else 0.0


_WHOLE: Final = 0.02
"""Largest deviation from multiples of the resolution, as a fraction of the step; allows for file rounding."""


def plateaus(fitted: FloatArray, series: IntArray, step: float) -> IntArray:
    """Return the plateau index of each row: consecutive rows with equal rounded fitted values share one."""
    code = np.rint(fitted / step)
    begins = (np.diff(code) != 0.0) | (np.diff(series) != 0)
    return np.concatenate([[0], np.cumsum(begins)]).astype(np.int64)
