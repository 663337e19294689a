"""Parsing of drive arguments: numbers in SI or strings with a unit, counts, firing times."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable
from typing import Final, SupportsIndex

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError, located
from printhammer.support.arrays import FloatArray

PULSES: Final = 9
"""Default number of firings of a pulse train, as in the bursts of the paper."""

MOST_PULSES: Final = 10_000_000
"""Largest number of firings of a drive; arbitrary, catches typing errors."""

SPACING_UNITS: Final = {"rate": "Hz", "period": "s"}
"""SI unit of each argument that states the spacing of firings, rate or period."""


def read_number(value: float | str, si: str, name: str) -> float:
    """Parse a number in SI or a string with a unit, such as "1.2 kHz"; return the value in SI.

    `si` is the SI unit, and `name` the name of the argument in error messages.

    Raises
    ------
    InputError
        The number is not finite, or the string is not a quantity of the dimension of `si`.
    """
    if isinstance(value, str):
        from printhammer.units import parse

        with located(name, key=name):
            return parse(value, si)
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        what = "a finite number" if si == "1" else f"a finite number in {si} or a string with a unit"
        raise InputError.of(name, value, what)
    return number


def read_positive(value: float | str, si: str, name: str) -> float:
    """Parse a number above 0 whose inverse is finite; errors as for `read_number`."""
    number = read_number(value, si, name)
    if number <= 0.0 or not math.isfinite(1.0 / number):
        unit = "" if si == "1" else f" {si}"
        raise InputError.of(name, value, f"greater than 0{unit}")
    return number


def period_of_rate(rate: float | str) -> float:
    """Parse a rate [Hz] and return its period [s].

    Firing k of a train is at k times its period, so that a rate and its period yield identical firing times.
    """
    return 1.0 / read_positive(rate, "Hz", "rate")


def read_start(value: float | str) -> float:
    """Parse the time of the first firing [s], not negative; errors as for `read_number`."""
    number = read_number(value, "s", "start")
    if number < 0.0:
        raise InputError.of("start", value, "0 s or later")
    return number


def read_count(value: SupportsIndex | None, name: str, least: int = 1) -> int:
    """Parse an integer, such as a number of firings, from `least` to `MOST_PULSES`."""
    try:
        count = least - 1 if value is None or isinstance(value, bool) else operator.index(value)
    except TypeError:
        count = least - 1
    if not least <= count <= MOST_PULSES:
        raise InputError.of(name, value, f"a whole number from {least} to {MOST_PULSES}")
    return count


def read_array(values: npt.ArrayLike, name: str, what: str = "numbers", si: str = "") -> FloatArray:
    """Parse numbers into a new float array of any shape.

    If `si` is a unit, a list may contain strings with units in addition to numbers in SI. Error messages
    state the argument `name` and the expectation `what`.
    """
    if si and isinstance(values, (list, tuple)) and any(isinstance(value, str) for value in values):
        return np.array([read_number(value, si, name) for value in values], dtype=np.float64)
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError.of(name, values, what) from None


def even_times(
    rate: float | str | None, period: float | str | None, count: int
) -> tuple[FloatArray, tuple[str, float], float]:
    """Compute the firing times of a train of constant rate, the first at time 0.

    Returns
    -------
    tuple
        In this order: the firing times [s]; the pair of the name of the passed argument, "rate" or "period",
        and its value in SI; the period [s].
    """
    steps = np.arange(count, dtype=np.float64)
    if rate is not None:
        often = read_positive(rate, "Hz", "rate")
        spacing = period_of_rate(often)
        return steps * spacing, ("rate", often), spacing
    if period is None:
        raise InputError("a train of pulses", key="rate", expected="a rate or a period")
    spacing = read_positive(period, "s", "period")
    return steps * spacing, ("period", spacing), spacing


def read_times(at: Iterable[float | str]) -> FloatArray:
    """Parse firing times: an array of times in s, or a sequence of strings with units."""
    if isinstance(at, np.ndarray) and at.dtype.kind in "fiu":
        return at.astype(np.float64)
    try:
        entries = [] if isinstance(at, str) else list(at)
    except TypeError:
        entries = []
    if not entries:
        raise InputError.of("at", at, "a list of firing times")
    return np.array([read_number(entry, "s", "firing time") for entry in entries], dtype=np.float64)


def checked_times(times: npt.ArrayLike) -> FloatArray:
    """Validate firing times [s]; return a read-only array."""
    result = np.array(times, dtype=np.float64)
    if result.ndim != 1 or not 1 <= result.size <= MOST_PULSES:
        raise InputError(
            f"{result.size} firing times", expected=f"a list of 1 to {MOST_PULSES}", key="firing times"
        )
    if not np.isfinite(result).all():
        raise InputError(f"firing time {result[~np.isfinite(result)][0]}", expected="finite", key="at")
    if result[0] < 0.0:
        raise InputError(f"firing time {result[0]:.9g} s", expected="0 s or later", key="at")
    bad = np.flatnonzero(np.diff(result) <= 0.0)
    if len(bad):
        k = int(bad[0]) + 1
        order = f"{result[k]:.9g} s (firing {k + 1}) follows {result[k - 1]:.9g} s"
        raise InputError(order, key="firing times", expected="strictly increasing firing times")
    result.flags.writeable = False
    return result
