"""The two unit systems in which the command line shows quantities."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray


class Units(StrEnum):
    """Unit system of what is shown."""

    SI = "si"
    INCH = "inch"


# SI unit, then the unit shown and its digits in either system.
_SHOWN: dict[str, tuple[str, tuple[str, str], tuple[str, str]]] = {
    "time": ("s", ("us", ".1f"), ("us", ".1f")),
    "length": ("m", ("um", ".2f"), ("mil", ".3f")),
    "speed": ("m/s", ("m/s", ".3f"), ("in/s", ".1f")),
    "force": ("N", ("N", ".2f"), ("lbf", ".3f")),
    "energy": ("J", ("mJ", ".4f"), ("in lbf", ".5f")),
    "current": ("A", ("A", ".3f"), ("A", ".3f")),
}

_SIGNS = {"us": "µs", "um": "µm", "in lbf": "in·lbf"}


def unit(kind: str, units: Units) -> str:
    """Return the sign of the unit in which a kind of quantity is shown."""
    name = _SHOWN[kind][1 if units is Units.SI else 2][0]
    return _SIGNS.get(name, name)


def shown(value: float | None, kind: str, units: Units) -> str:
    """Return a quantity in SI as text without unit, a dash for None."""
    from printhammer.units import from_si

    if value is None:
        return "–"
    si, *systems = _SHOWN[kind]
    name, digits = systems[0 if units is Units.SI else 1]
    text = format(from_si(value, si, name), digits)
    # No minus before what is rounded to zero.
    return text if any(digit in text for digit in "123456789") else text.removeprefix("-")


def with_unit(value: float | None, kind: str, units: Units) -> str:
    """Return a quantity in SI as text with its unit, a dash for None."""
    return "–" if value is None else f"{shown(value, kind, units)} {unit(kind, units)}"


def range_with_unit(values: FloatArray, kind: str, units: Units) -> str | None:
    """Return the least and the largest of quantities in SI as text with units; None if there are none."""
    if not values.size:
        return None
    return " to ".join(with_unit(float(end), kind, units) for end in (values.min(), values.max()))
