"""Coil constants that a hammer file does not specify: the temperature, or all constants of the winding.

A hammer whose file states no resistance is driven by a current. If the user selects a voltage driver for such
a hammer, winding and rail are chosen such that the current rises to about the same peak in the same time.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive.waveforms.drivers import Rail
from printhammer.hammer.names import Range, range_of
from printhammer.parts.friction import DryFriction
from printhammer.parts.spring.forces import TERMS, Gravity
from printhammer.support.constants import Constant, quantities

if TYPE_CHECKING:
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer

_SOURCE: Final = "not in the hammer file; assumed where a voltage drives the coil"

_RESISTANCE: Final = 28.6
"""Resistance of a coil if the hammer file states none, ohm; arbitrary."""

_LAST: Final = 1.19
"""Ratio of the time constant of coil and magnet to the pulse width; arbitrary."""

_REACH: Final = 1.0 / (1.0 - math.exp(-1.0 / _LAST))
"""Rail voltage divided by R × peak current, where R is the resistance, for exponential rise."""

_PULSE: Final = (1.97, 177e-6)
"""Default peak, A, and width, s, of a current pulse, from the hammer `hendriks-1983`."""


def has_rail(hammer: Hammer) -> bool:
    """Whether a voltage can drive the coil: the flux linkage of the magnet is known."""
    return hammer.magnet is not None and hammer.magnet.has_linkage


@lru_cache(maxsize=16)
def open_constants(hammer: Hammer) -> dict[str, tuple[Constant, Range]]:
    """Return the coil constants that a hammer file does not specify and a control sets, by dotted key."""
    if not has_rail(hammer):
        return {}
    from printhammer.parts.coil import REFERENCE, Winding

    values: dict[str, float] = {"temperature": REFERENCE}
    if hammer.coil is None or getattr(hammer.coil, "resistance", None) is None:
        values |= {"resistance": _RESISTANCE, "inductance": _inductance(hammer)}
    known: dict[str, tuple[Constant, Range]] = {}
    notes = quantities(Winding)
    for name, value in values.items():
        key = f"coil.{name}"
        if key in hammer.constants:
            continue
        note = notes[name]
        number = float(f"{value:.3g}")
        constant = Constant(
            key, number, note.si, number, "assumed", _SOURCE, note.meaning, note.symbol, note.si
        )
        known[key] = constant, _range(constant)
    return known


def _range(constant: Constant) -> Range:
    if constant.si_unit == "degC":
        return TEMPERATURES
    return Range(constant.si / 10.0, constant.si * 10.0, logarithmic=True)


TEMPERATURES: Final = Range(-40.0, 180.0, logarithmic=False)
"""Range of the control of the winding temperature, degC."""


def span_of(hammer: Hammer, key: str, factor: float) -> Range | None:
    """Return the range of the control of a constant; None for a constant without a control.

    Coil constants that the hammer file leaves out have a control, too. If the file lists additional forces or
    contacts, the page receives only their sum with the spring, or with the damping for dry friction: the
    constants of these parts, and the mass if a force is its weight, then have no control.
    """
    section = key.partition(".")[0]
    if section == "waveform" or section in TERMS or (hammer.terms and section == "spring"):
        return None
    if section == "damping" and isinstance(hammer.damping, DryFriction):
        return None
    if key == "mass" and any(isinstance(term, Gravity) for term in hammer.terms.values()):
        return None
    if (further := open_constants(hammer).get(key)) is not None:
        return further[1]
    constant = hammer.constants.get(key)
    if constant is None:
        return None
    if constant.si_unit == "degC" and TEMPERATURES.low <= constant.si <= TEMPERATURES.high:
        return TEMPERATURES
    return range_of(hammer, key, factor)


def rail_of(hammer: Hammer) -> dict[str, Any] | None:
    """Build the default rail driver of a hammer; None if no voltage can drive the coil."""
    if not has_rail(hammer):
        return None
    current, width = _pulse(hammer)
    resistance = getattr(hammer.coil, "resistance", None) or _RESISTANCE
    # With this resistor the current decays about as fast as it rises.
    voltage, decay = (float(f"{value:.3g}") for value in (_REACH * resistance * current, 5.56 * resistance))
    return Rail(voltage=voltage, width=width, decay_resistance=decay).model_dump()


def by_voltage(waveform: Waveform | None) -> bool:
    """Whether a waveform is a voltage across the coil."""
    return waveform is not None and waveform.quantity == "voltage"


def _inductance(hammer: Hammer) -> float:
    """Return the inductance, H, with which coil and magnet at rest have the time constant `_LAST`."""
    from printhammer.run.supply import inductance

    current, width = _pulse(hammer)
    whole = _LAST * width * _RESISTANCE
    wound = hammer.replace("coil", {"resistance": _RESISTANCE, "inductance": whole})
    return 2.0 * whole - inductance(wound, hammer.origin, current / 2.0)


def _pulse(hammer: Hammer) -> tuple[float, float]:
    """Return peak, A, and width, s, of the current pulse of a hammer, or the default `_PULSE`."""
    waveform = hammer.waveform
    width = getattr(waveform, "width", None)
    if waveform is None or waveform.quantity != "current" or width is None:
        return _PULSE
    return waveform.peak, float(width)
