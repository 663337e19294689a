"""What the studio sets of a coil that a hammer file leaves open: its temperature, or the whole winding.

A hammer whose file states no resistance is driven by a current. Where a driver by voltage is chosen for it,
the winding is one behind whose rail the current comes out about as before.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive.waveforms.drivers import Rail
from printhammer.hammer.names import Range, range_of
from printhammer.support.constants import Constant, quantities

if TYPE_CHECKING:
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer

_SOURCE: Final = "not in the file of the hammer; taken where a voltage drives the coil"

_RESISTANCE: Final = 28.6
"""Resistance of a coil of which none is known, ohm."""

_REACH: Final = 1.775
"""Voltage of the rail in that of the peak current at the resistance."""

_LAST: Final = 1.287
"""Time constant of the coil in the width of the pulse."""

_PULSE: Final = (1.97, 177e-6)
"""Current, A, and width, s, of a pulse of which neither is known."""


def has_rail(hammer: Hammer) -> bool:
    """Whether a voltage may drive the coil: the flux linkage of the magnet is known."""
    return hammer.magnet is not None and hammer.magnet.has_linkage


@lru_cache(maxsize=16)
def open_constants(hammer: Hammer) -> dict[str, tuple[Constant, Range]]:
    """Return the constants of the coil that a hammer file leaves open and a control sets, by dotted key."""
    if not has_rail(hammer):
        return {}
    from printhammer.parts.coil import REFERENCE, Winding

    values: dict[str, float] = {"temperature": REFERENCE}
    if hammer.coil is None or getattr(hammer.coil, "resistance", None) is None:
        _, width = _pulse(hammer)
        values |= {"resistance": _RESISTANCE, "inductance": _LAST * width * _RESISTANCE}
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
"""Where a control moves the temperature of a winding, degC."""


def span_of(hammer: Hammer, key: str, factor: float) -> Range | None:
    """Return where a constant may lie, also one that the file leaves open; None where there is none such."""
    if key.startswith("waveform."):
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
    """Return the rail that a hammer is first driven by, where that is not its own; None where none can."""
    if not has_rail(hammer):
        return None
    current, width = _pulse(hammer)
    resistance = getattr(hammer.coil, "resistance", None) or _RESISTANCE
    # Through a resistor the current ends about as fast as it began.
    voltage, decay = (float(f"{value:.3g}") for value in (_REACH * resistance * current, 5.56 * resistance))
    return Rail(voltage=voltage, width=width, decay_resistance=decay).model_dump()


def by_voltage(waveform: Waveform | None) -> bool:
    """Whether a waveform is a voltage across the coil."""
    return waveform is not None and waveform.quantity == "voltage"


def _pulse(hammer: Hammer) -> tuple[float, float]:
    """Return peak and width of the current that a hammer is fired with."""
    waveform = hammer.waveform
    width = getattr(waveform, "width", None)
    if waveform is None or waveform.quantity != "current" or width is None:
        return _PULSE
    return waveform.peak, float(width)
