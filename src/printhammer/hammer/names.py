"""Names of constants, common to files, edits, sweeps, regimes, derivatives, tolerances and controls.

=====================  ========================================================================
name                   meaning
=====================  ========================================================================
``mass``               constant of the hammer, not of a part
``pack.stiffness``     constant of a part, spelled as in a hammer file
``waveform.width``     constant of the fired pulse: the waveform of the hammer or of the drive
``period``, ``rate``   time between firings and firings per second, of a train or of a force
``drive.amplitude``    constant of a sinusoidal force, as is ``drive.phase``
=====================  ========================================================================

The unit, meaning and bounds of a constant are declared once, with its part or waveform
(`printhammer.support.constants.quantity`), and looked up here. `range_of` returns the range of a constant on
a control, and whether its scale is linear or logarithmic.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Final

from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError, nearest
from printhammer.hammer.file import SELECTORS, UNSAID, Body, model_of
from printhammer.hammer.hammer import Hammer
from printhammer.support.constants import Quantity, quantities, shown

PERIOD: Final = "period"
RATE: Final = "rate"
WAVEFORM: Final = "waveform."
DRIVE: Final = "drive."

TIMING: Final = {
    PERIOD: Quantity("s", "T", "time between firings", gt=0.0),
    RATE: Quantity("Hz", "f", "firing rate", gt=0.0),
}
"""Declarations of the time between firings and the firing rate of a pulse train, by name."""

FORCE: Final = {
    "amplitude": Quantity("N", "F", "amplitude of the force"),
    "frequency": Quantity("Hz", "f", "frequency of the force", gt=0.0),
    "phase": Quantity("rad", "phi", "phase of the force"),
}
"""Declarations of the constants of a sinusoidal force, by name."""

PLACES: Final = ("platen", "pack.front", "backstop.position")
"""Constants that are positions on the axis of the armature, such as "backstop.position"."""

_ZERO: Final = {"m": 100e-6, "s": 500e-6, "kg": 1e-3, "N": 10.0}
"""Upper end of the slider range of a zero constant, by SI unit; arbitrary, typical of print hammers."""


@dataclass(frozen=True)
class Range:
    """Range of a constant on a slider."""

    low: float
    """Lower end of the range, SI."""
    high: float
    """Upper end of the range, SI."""
    logarithmic: bool
    """Whether the scale of the slider is logarithmic, so that equal steps are equal factors."""


def range_of(hammer: Hammer, name: str, factor: float = 10.0) -> Range:
    """Return the slider range of a constant, around its value in a hammer.

    Positions vary by half the distance from backstop to platen in either direction; other constants range
    from 1 / `factor` to `factor` times their value, but a coefficient of restitution only up to 1. A constant
    that is zero has a typical range for its unit. These rules are arbitrary.
    """
    constant = hammer.constants[name]
    value = constant.si
    if name in PLACES:
        places = [place for place in (hammer.position, hammer.front, hammer.platen) if place is not None]
        reach = 0.5 * (max(places) - min(places)) or _ZERO["m"]
        return Range(value - reach, value + reach, logarithmic=False)
    if value == 0.0:
        return Range(0.0, _ZERO.get(constant.si_unit, 1.0), logarithmic=False)
    low, high = sorted((value / factor, value * factor))
    if name.rpartition(".")[2] == "restitution":
        high = min(high, 1.0)
    return Range(low, high, logarithmic=low > 0.0)


def quantity_of(hammer: Hammer, name: str) -> Quantity | None:
    """Return the declaration of a constant of a hammer; None if the hammer has no such constant."""
    section, _, field = name.rpartition(".")
    if not section:
        return quantities(Body).get(field)
    kinds: dict[str, str] = {**UNSAID, **{role: part.law for role, part in hammer.parts.items()}}
    if hammer.waveform is not None:
        kinds["waveform"] = hammer.waveform.shape
    if section not in kinds or section not in SELECTORS:
        return None
    note = quantities(model_of(section, kinds[section])).get(field)
    if note is not None and section == "waveform" and hammer.waveform is not None:
        return in_unit_of_drive(note, hammer.waveform.unit)
    return note


def quantities_of(waveform: Waveform) -> dict[str, Quantity]:
    """Return the declarations of a waveform's constants, by name, with the unit of its amplitude."""
    return {name: in_unit_of_drive(note, waveform.unit) for name, note in quantities(type(waveform)).items()}


def in_unit_of_drive(note: Quantity, unit: str) -> Quantity:
    """Return a declaration, restricted to `unit` if it allows several units, such as A and N."""
    return replace(note, si=unit, also=()) if note.also else note


def unknown(name: str, known: Collection[str], where: str = "") -> InputError:
    """Return the error for an unknown constant; the message suggests the nearest of the known names."""
    file, _, key = where.rpartition(": ")
    return InputError(
        f"{where or 'constant'} = {shown(name)} is not known",
        file=file or None,
        key=key or "constant",
        value=name,
        expected=f"{nearest(name, known)}",
    )
