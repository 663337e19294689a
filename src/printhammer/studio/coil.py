"""Coil constants that a hammer file does not specify: the temperature, or all constants of the winding.

A hammer whose file states no resistance is driven by a current. If the user selects a voltage driver for such
a hammer, winding and rail are chosen such that the current rises to about the same peak in the same time.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, Final

from printhammer.drive.waveforms.drivers import Rail
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import Range, range_of
from printhammer.parts.coil import REFERENCE, Winding
from printhammer.parts.spring.terms import TERMS
from printhammer.run.supply import inductance
from printhammer.studio.bounds import SPAN
from printhammer.studio.terms import span_of_term
from printhammer.support.constants import Constant, quantities

_SOURCE: Final = "not in the hammer file; assumed where a voltage drives the coil"

_RESISTANCE: Final = 28.6
"""Resistance of a coil if the hammer file states none, ohm; arbitrary."""

_LAST: Final = 1.19
"""Ratio of the time constant of coil and magnet to the pulse width; arbitrary."""

_REACH: Final = 1.0 / (1.0 - math.exp(-1.0 / _LAST))
"""Ratio of the rail voltage to resistance times peak current, for an exponential rise of the current."""

_PULSE: Final = (1.97, 177e-6)
"""Default peak, A, and width, s, of a current pulse, from the hammer `hendriks-1983`."""

TEMPERATURES: Final = Range(-40.0, 180.0, logarithmic=False)
"""Slider range of the winding temperature, degC."""


def has_rail(hammer: Hammer) -> bool:
    """Whether a voltage can drive the coil: the flux linkage of the magnet is known."""
    return hammer.magnet is not None and hammer.magnet.has_linkage


@lru_cache(maxsize=16)
def open_constants(hammer: Hammer) -> dict[str, tuple[Constant, Range]]:
    """Return the coil constants that the page adds to a hammer, and their slider ranges, by dotted key."""
    if not has_rail(hammer):
        return {}
    values: dict[str, float] = {"temperature": REFERENCE}
    if hammer.coil is None or getattr(hammer.coil, "resistance", None) is None:
        values |= {"resistance": _RESISTANCE, "inductance": _inductance(hammer)}
    known: dict[str, tuple[Constant, Range]] = {}
    for name, value in values.items():
        if (key := f"coil.{name}") in hammer.constants:
            continue
        note, number = quantities(Winding)[name], float(f"{value:.3g}")
        constant = Constant(
            key, number, note.si, number, "assumed", _SOURCE, note.meaning, note.symbol, note.si
        )
        about = Range(number / 10.0, number * 10.0, logarithmic=True)
        known[key] = constant, TEMPERATURES if note.si == "degC" else about
    return known


def span_of(hammer: Hammer, constant: Constant) -> Range | None:
    """Return the slider range of a constant of a hammer; None for a constant without a slider.

    Constants of the waveform have no slider: the pulse editor changes them.
    """
    section = constant.key.partition(".")[0]
    if section == "waveform":
        return None
    if section in TERMS:
        return span_of_term(hammer, constant.key)
    if constant.si_unit == "degC" and TEMPERATURES.low <= constant.si <= TEMPERATURES.high:
        return TEMPERATURES
    return range_of(hammer, constant.key, SPAN)


def rail_of(hammer: Hammer) -> dict[str, Any] | None:
    """Build the default rail driver of a hammer; None if no voltage can drive the coil."""
    if not has_rail(hammer):
        return None
    current, width = _pulse(hammer)
    resistance = getattr(hammer.coil, "resistance", None) or _RESISTANCE
    # With this resistor the current decays about as fast as it rises.
    voltage, decay = (float(f"{value:.3g}") for value in (_REACH * resistance * current, 5.56 * resistance))
    return Rail(voltage=voltage, width=width, decay_resistance=decay).model_dump()


def _inductance(hammer: Hammer) -> float:
    """Return the coil inductance [H] for which the time constant at rest is `_LAST` pulse widths."""
    current, width = _pulse(hammer)
    whole = _LAST * width * _RESISTANCE
    wound = hammer.replace("coil", {"resistance": _RESISTANCE, "inductance": whole})
    return 2.0 * whole - inductance(wound, hammer.origin, current / 2.0)


def _pulse(hammer: Hammer) -> tuple[float, float]:
    """Return peak [A] and width [s] of a hammer's nominal current pulse; without such a pulse, `_PULSE`."""
    waveform = hammer.waveform
    width = getattr(waveform, "width", None)
    if waveform is None or waveform.quantity != "current" or width is None:
        return _PULSE
    return waveform.peak, float(width)
