"""Sensors as a user describes them: text with units, by quantity."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.identify.bench.sensor import Amount, Sensor

NONE: Final = "none"
"""What a bandwidth is called that does not limit anything."""

PARTS: Final = ("noise", "resolution", "offset")
"""What every quantity has."""

_OTHERS: Final = ("exact", "sampling_rate", "bandwidth", "outliers")


def adjusted(sensor: Sensor, settings: Mapping[str, Any], units: Mapping[str, str]) -> Sensor:
    """Return a sensor with settings changed; `units` are the SI units of the quantities.

    Settings are "noise", "resolution", "offset": mapping of quantity to amount, such as {"force": "0.5 %"};
    "sampling_rate", "bandwidth": "100 kHz" or a number in Hz, "none" for no limit; "outliers": share, "2 %"
    or 0.02; "exact": True to begin without any error.

    Raises
    ------
    InputError
        A setting or quantity is not known, or the value is not what it should be.
    """
    for name in settings:
        if name not in (*PARTS, *_OTHERS):
            raise InputError(
                f"the sensor setting {name!r} is not known, expected one of {', '.join((*PARTS, *_OTHERS))}"
            )
    if settings.get("exact"):
        sensor = sensor.exact()
    channels = dict(sensor.channels)
    for part in PARTS:
        for name, written in _quantities(part, settings.get(part)).items():
            if name not in channels:
                known = ", ".join(channels)
                raise InputError(f"{part}: the quantity {name!r} is not measured, expected one of {known}")
            amount = Amount.read(written, units[name], f"{part} of {name}", signed=part == "offset")
            channels[name] = replace(channels[name], **{part: amount})
    changes: dict[str, Any] = {"channels": channels}
    for name, read in _READ.items():
        if settings.get(name) is not None:
            changes[name] = read(settings[name], name)
    if sensor.sampling_rate is None and any(changes.get(name) for name in ("sampling_rate", "bandwidth")):
        raise InputError("a sampling rate or bandwidth is given, expected it with a record of a motion only")
    return replace(sensor, **changes)


def applicable(sensor: Sensor, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings that are about what a sensor has: its quantities, and records if it makes them."""
    kept = dict(settings)
    for part in PARTS:
        if part in kept:
            amounts = _quantities(part, kept[part])
            kept[part] = {name: value for name, value in amounts.items() if name in sensor.channels}
    if sensor.sampling_rate is None:
        kept = {name: value for name, value in kept.items() if name not in ("sampling_rate", "bandwidth")}
    return kept


def by_quantity(texts: list[str], part: str, quantities: Mapping[str, str]) -> dict[str, str]:
    """Read settings such as "force=0.5 %" or "0.2 um", which goes to all quantities of its dimension.

    The text of the amount is returned by quantity; `part`, such as "noise", is for messages.

    Raises
    ------
    InputError
        A quantity is not known, given twice, or none has the dimension.
    """
    amounts: dict[str, str] = {}
    for text in texts:
        name, equals, amount = text.partition("=")
        name = " ".join(name.lower().split())
        names = [name] if equals else _of_dimension(text, part, quantities)
        for quantity in names:
            if quantity not in quantities:
                known = ", ".join(quantities)
                raise InputError(
                    f"{part} {text!r}: the quantity {quantity!r} is not known, expected one of {known}"
                )
            if quantity in amounts:
                raise InputError(f"{part} {text!r}: {quantity} is given twice, expected it once")
            amounts[quantity] = amount.strip() if equals else text.strip()
    return amounts


def _of_dimension(text: str, part: str, quantities: Mapping[str, str]) -> list[str]:
    from printhammer.units import parse

    names = []
    for name, si in quantities.items():
        with suppress(InputError):
            parse(text, si)
            names.append(name)
    if not names:
        such = next(iter(quantities))
        raise InputError(
            f"{part} {text!r}: expected an amount such as '{such}=0.5 %', or a number with the unit of"
            f" {' or '.join(quantities)}"
        )
    return names


def _quantities(part: str, amounts: Any) -> Mapping[str, Any]:
    if amounts is None:
        return {}
    if not isinstance(amounts, Mapping):
        raise InputError(f"{part} = {amounts!r}, expected amounts by quantity, such as {{'force': '0.5 %'}}")
    return amounts


def _frequency(value: Any, name: str) -> float | None:
    if isinstance(value, str) and value.strip().lower() == NONE:
        return None
    return read_positive(value, "Hz", name)


def _share(value: Any, name: str) -> float:
    share = read_number(value, "1", name)
    if not (0.0 <= share <= 0.5 and math.isfinite(share)):
        raise InputError(f"{name} = {value!r}, expected a share from 0 to 50 %")
    return share


_READ: Final[dict[str, Callable[[Any, str], float | None]]] = {
    "sampling_rate": lambda value, name: read_positive(value, "Hz", name),
    "bandwidth": _frequency,
    "outliers": _share,
}
