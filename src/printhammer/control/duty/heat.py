"""Heat of one dot in the coil, as a function of the temperature of its winding.

The resistance of copper rises by 0.393 % a kelvin of that at 20 degC. A time on a rail that is long beside
L / R draws less current through a warm winding, and heats it less; a current that a driver keeps up heats it
more; a driver that meters the energy of a dot heats it the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.parts.coil.winding import COPPER, REFERENCE

COLDEST: Final = REFERENCE - 1.0 / COPPER
"""Temperature at which the straight line of the resistance would reach zero, degC."""

FEEDS: Final = ("voltage", "current", "energy")
"""What a driver keeps the same when the coil gets warm."""


@dataclass(frozen=True)
class DotHeat:
    """Heat of one dot over the temperature of the winding."""

    temperature: tuple[float, ...]
    """Temperatures, degC, ascending; one or more."""
    heat: tuple[float, ...]
    """Heat of one dot there, J."""
    feed: str
    """One of `FEEDS`: how the heat goes on outside the temperatures, and between them in proportion to it."""

    def at(self, temperature: float) -> float:
        """Return the heat of one dot at a temperature of the winding, degC; J."""
        shares = [
            heat / _share(self.feed, place) for heat, place in zip(self.heat, self.temperature, strict=True)
        ]
        return float(np.interp(temperature, self.temperature, shares)) * _share(self.feed, temperature)


def dot_heat(heat: float | str, feed: str = "voltage") -> DotHeat:
    """Return the heat of one dot from that at 20 degC of the winding, J, and what its driver keeps the same.

    Raises
    ------
    InputError
        The heat is not positive, or the feed none of `FEEDS`.
    """
    if feed not in FEEDS:
        raise InputError(f"feed = {feed!r}, expected one of {', '.join(FEEDS)}")
    return DotHeat((REFERENCE,), (read_positive(heat, "J", "heat"),), feed)


def read_temperature(value: float | str, name: str) -> float:
    """Read a temperature, degC or text with that unit, at which copper has a resistance.

    Raises
    ------
    InputError
        It is no temperature, or below the one at which the line of the resistance reaches zero.
    """
    temperature = read_number(value, "degC", name)
    if not temperature > COLDEST:
        raise InputError(f"{name} = {value!r} is expected to be more than {COLDEST:.4g} degC")
    return temperature


def _share(feed: str, temperature: float) -> float:
    """Return the heat of one dot in parts of that at 20 degC."""
    warm = 1.0 + COPPER * (temperature - REFERENCE)
    return {"voltage": 1.0 / warm, "current": warm, "energy": 1.0}[feed]
