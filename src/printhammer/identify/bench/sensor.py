"""Sensor errors: noise, resolution, zero offset, and gross errors.

    reading = resolution * round((true + offset + noise) / resolution)

The noise is white and normal. A limited bandwidth acts first; see `printhammer.identify.lowpass`. Users
describe sensors by text with units, per quantity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray, IntArray

FULL_SCALE: Final = "of full scale"
READING: Final = "of reading"

_WRONG: Final = 0.1
"""Standard deviation of a gross error, as a fraction of full scale; arbitrary."""


@dataclass(frozen=True)
class Amount:
    """Size of a sensor error: in SI units, or as a fraction of full scale or of the reading."""

    size: float = 0.0
    """Size in SI units, or as a fraction if `of` is not empty."""
    of: str = ""
    """Reference of the fraction: "of full scale" (the largest true value) or "of reading"; else empty."""

    @classmethod
    def read(cls, text: str | float, si: str, name: str, *, signed: bool = False) -> Amount:
        """Parse an error size: "0.2 um", "0.5 %" (of full scale), "1 % of reading", or a number in SI.

        Negative sizes are accepted only if `signed`; `name` is the name of the setting in error messages.
        """
        of = ""
        if isinstance(text, str) and "%" in text:
            share, _percent, tail = text.partition("%")
            of = tail.strip() or FULL_SCALE
            if of not in (FULL_SCALE, READING):
                raise InputError(
                    f"{name}: {text!r}", key=name, expected=f"nothing, {FULL_SCALE!r} or {READING!r} after %"
                )
            size = read_number(f"{share.strip()} %", "1", name)
        else:
            size = read_number(text, si, name)
        if size < 0.0 and not signed:
            raise InputError.of(name, text, "0 or more")
        return cls(size, of)

    def at(self, true: FloatArray) -> FloatArray:
        """Evaluate the error size at each true value, SI; same shape as `true`."""
        if self.of == READING:
            return self.size * np.abs(true)
        return np.full(true.shape, self.size * (full_scale(true) if self.of else 1.0))


class Channel(Declared):
    """Sensor errors of one quantity."""

    noise: Amount = part("standard deviation of the noise; white, normal", default_factory=Amount)
    resolution: Amount = part("step of the readings; 0 for none", default_factory=Amount)
    offset: Amount = part("zero offset", default_factory=Amount)

    def __post_init__(self) -> None:
        if self.resolution.of == READING:
            raise InputError(
                f"a resolution {READING}",
                key="resolution",
                expected="a resolution with a constant step",
            )

    def readings(self, true: FloatArray, normal: FloatArray) -> FloatArray:
        """Simulate sensor readings, SI, from true values and standard normal random numbers, shape (n,)."""
        shown = true + self.offset.at(true) + self.noise.at(true) * normal
        return self.rounded(shown, true)

    def rounded(self, shown: FloatArray, true: FloatArray) -> FloatArray:
        """Round readings to whole quantisation steps; the true values `true` determine the full scale."""
        step = self.step(full_scale(true))
        return np.rint(shown / step) * step if step > 0.0 else shown

    def step(self, full: float) -> float:
        """Return the quantisation step of the readings, SI, at a given full scale, SI.

        A fraction of full scale is rounded down to 1, 2 or 5 times a power of ten, as is usual for
        instruments.
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
        """Describe noise, resolution and offset in words, in the given unit; `full` is the full scale, SI."""
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
    """Sensors of one test bench, with their errors."""

    channels: Mapping[str, Channel]
    """Errors of each quantity: displacement, indentation, current, force, impact speed or rebound speed."""
    sampling_rate: float | None = None
    """Sampling rate of records, Hz; None for a bench without records."""
    bandwidth: float | None = None
    """-3 dB frequency of a first-order low-pass before sampling, Hz; None for no limit."""
    outliers: float = 0.0
    """Fraction of rows whose measured quantity has a gross error."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))
        for name, frequency in (("sampling_rate", self.sampling_rate), ("bandwidth", self.bandwidth)):
            if frequency is not None and not (frequency > 0.0 and math.isfinite(frequency)):
                raise InputError.of(name, frequency, "more than 0 Hz")
        if not 0.0 <= self.outliers <= 0.5:
            raise InputError.of("outliers", self.outliers, "a fraction from 0 to 0.5")

    def exact(self) -> Sensor:
        """Return a copy without errors: no noise, resolution, offset, bandwidth limit or outliers."""
        return replace(
            self, channels={name: Channel() for name in self.channels}, bandwidth=None, outliers=0.0
        )


def full_scale(true: FloatArray) -> float:
    """Return the full scale of a sensor: the largest absolute true value, SI."""
    return float(np.abs(true).max()) if true.size else 0.0


def wrong_rows(share: float, true: FloatArray, rng: np.random.Generator) -> tuple[IntArray, FloatArray]:
    """Draw the indices of the rows with gross errors, ascending, and their gross errors, SI.

    `share` is the fraction of rows with gross errors; `true` are the true values, which determine the full
    scale. The gross errors are normally distributed, with a standard deviation of a tenth of the full scale.
    """
    count = int(share * len(true) + 0.5)
    rows = np.sort(rng.permutation(len(true))[:count])
    return rows.astype(np.int64), _WRONG * full_scale(true) * rng.standard_normal(count)


NONE: Final = "none"
"""Text for an unlimited bandwidth."""

PARTS: Final = ("noise", "resolution", "offset")
"""Names of the error settings of a measured quantity."""

_OTHERS: Final = ("exact", "sampling_rate", "bandwidth", "outliers")


def adjusted(sensor: Sensor, settings: Mapping[str, Any], units: Mapping[str, str]) -> Sensor:
    """Return a copy of a sensor with changed settings; `units` are the SI units of the quantities.

    The settings are:

    - "noise", "resolution" and "offset": the size of the error by quantity, such as {"force": "0.5 %"};
    - "sampling_rate" and "bandwidth": "100 kHz" or a number in Hz, "none" for no limit;
    - "outliers": fraction of rows with a gross error, "2 %" or 0.02;
    - "exact": True to start from a sensor without errors.

    Raises
    ------
    InputError
        A setting or quantity is unknown, or a value is invalid.
    """
    for name in settings:
        if name not in (*PARTS, *_OTHERS):
            raise InputError(
                f"the sensor setting {name!r} is not known",
                key="sensor",
                expected=f"one of {', '.join((*PARTS, *_OTHERS))}",
            )
    if settings.get("exact"):
        sensor = sensor.exact()
    channels = dict(sensor.channels)
    for role in PARTS:
        for name, written in _quantities(role, settings.get(role)).items():
            if name not in channels:
                known = ", ".join(channels)
                raise InputError(
                    f"{role}: the quantity {name!r} is not measured", key=role, expected=f"one of {known}"
                )
            amount = Amount.read(written, units[name], f"{role} of {name}", signed=role == "offset")
            channels[name] = replace(channels[name], **{role: amount})
    changes: dict[str, Any] = {"channels": channels}
    for name, read in _READ.items():
        if settings.get(name) is not None:
            changes[name] = read(settings[name], name)
    if sensor.sampling_rate is None and any(changes.get(name) for name in ("sampling_rate", "bandwidth")):
        raise InputError("sampling rate or bandwidth", key="rate", expected="this setting for records only")
    return replace(sensor, **changes)


def applicable(sensor: Sensor, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Select the settings that apply to a sensor; sampling rate and bandwidth apply only to records."""
    kept = dict(settings)
    for role in PARTS:
        if role in kept:
            amounts = _quantities(role, kept[role])
            kept[role] = {name: value for name, value in amounts.items() if name in sensor.channels}
    if sensor.sampling_rate is None:
        kept = {name: value for name, value in kept.items() if name not in ("sampling_rate", "bandwidth")}
    return kept


def by_quantity(texts: list[str], setting: str, quantities: Mapping[str, str]) -> dict[str, str]:
    """Parse settings such as "force=0.5 %", or "0.2 um" for all quantities of that dimension.

    Return the text of the error size by quantity. `quantities` contains the SI unit of each quantity, and
    `setting` is the name of the setting in error messages, such as "noise".

    Raises
    ------
    InputError
        A quantity is unknown or set twice, or no quantity has the dimension.
    """
    amounts: dict[str, str] = {}
    for text in texts:
        name, equals, amount = text.partition("=")
        name = " ".join(name.lower().split())
        names = [name] if equals else _of_dimension(text, setting, quantities)
        for quantity in names:
            if quantity not in quantities:
                known = ", ".join(quantities)
                raise InputError(
                    f"{setting} {text!r}: the quantity {quantity!r} is not known",
                    key=setting,
                    value=text,
                    expected=f"one of {known}",
                )
            if quantity in amounts:
                raise InputError(
                    f"{setting} {text!r}: {quantity} occurs twice",
                    key=setting,
                    value=text,
                    expected="each quantity once",
                )
            amounts[quantity] = amount.strip() if equals else text.strip()
    return amounts


def _of_dimension(text: str, setting: str, quantities: Mapping[str, str]) -> list[str]:
    from printhammer.units import parse

    names = []
    for name, si in quantities.items():
        with suppress(InputError):
            parse(text, si)
            names.append(name)
    if not names:
        such = next(iter(quantities))
        raise InputError(
            f"{setting} {text!r}: expected an amount such as '{such}=0.5 %', or a number with the unit of"
            f" {' or '.join(quantities)}",
            key=setting,
            value=text,
        )
    return names


def _quantities(setting: str, amounts: Any) -> Mapping[str, Any]:
    if amounts is None:
        return {}
    if not isinstance(amounts, Mapping):
        raise InputError.of(setting, amounts, "amounts by quantity, such as {'force': '0.5 %'}")
    return amounts


def _frequency(value: Any, name: str) -> float | None:
    if isinstance(value, str) and value.strip().lower() == NONE:
        return None
    return read_positive(value, "Hz", name)


def _share(value: Any, name: str) -> float:
    share = read_number(value, "1", name)
    if not (0.0 <= share <= 0.5 and math.isfinite(share)):
        raise InputError.of(name, value, "a fraction from 0 to 50 %")
    return share


_READ: Final[dict[str, Callable[[Any, str], float | None]]] = {
    "sampling_rate": lambda value, name: read_positive(value, "Hz", name),
    "bandwidth": _frequency,
    "outliers": _share,
}
