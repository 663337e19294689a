"""Names of constants: one vocabulary for files, edits, sweeps, regimes, derivatives, tolerances and controls.

===================== ====================================================================================
name                  what it is
===================== ====================================================================================
``mass``              a number of the hammer itself
``pack.stiffness``    a constant of a part, spelled as in a hammer file
``waveform.width``    a constant of the pulse that is fired: the hammer's own, or that of the drive
``period``, ``rate``  time between firings and firings per second, of a train or of a force
``drive.amplitude``   of an endless force, as is ``drive.phase``
===================== ====================================================================================

What a constant is measured in, what it means and where it may lie is declared once, with its part or waveform
(`printhammer.support.constants.quantity`); here it is looked up. The range in which a control moves it, and
whether evenly or by factors, is that of `range_of`.
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
"""Period and rate of a train."""

FORCE: Final = {
    "amplitude": Quantity("N", "F", "amplitude of the force"),
    "frequency": Quantity("Hz", "f", "frequency of the force", gt=0.0),
    "phase": Quantity("rad", "phi", "phase of the force"),
}
"""Constants of a sinusoidal force."""

PLACES: Final = ("platen", "pack.front", "backstop.position")
"""Constants that are places on the axis of the armature."""

_ZERO: Final = {"m": 100e-6, "s": 500e-6, "kg": 1e-3, "N": 10.0}
"""How far a constant that is zero may rise, by its SI unit: about what is met in impact print hammers."""


@dataclass(frozen=True)
class Range:
    """Where a control moves a constant."""

    low: float
    high: float
    """Its ends, SI."""
    logarithmic: bool
    """Whether equal steps are equal factors."""


def range_of(hammer: Hammer, name: str, factor: float = 10.0) -> Range:
    """Return the range of a constant of a hammer file about the value that it has in a hammer.

    The ranges are ours, wide enough for every hammer of the paper and narrow enough to be met with a slider.
    Places on the axis move by half the way from backstop to platen; other constants by a factor up and down,
    a coefficient of restitution up to 1; what is zero has a range of its dimension.
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
    """Return what a hammer file says of a constant; None if the hammer can have none of that name."""
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
    """Return what is known of the constants of a waveform, amplitudes in the unit of what it drives."""
    return {name: in_unit_of_drive(note, waveform.unit) for name, note in quantities(type(waveform)).items()}


def in_unit_of_drive(note: Quantity, unit: str) -> Quantity:
    """Return what is known of a constant that may be a current or a force, as the one that it is."""
    return replace(note, si=unit, also=()) if note.also else note


def unknown(name: str, known: Collection[str], where: str = "") -> InputError:
    """Return the error that says that a constant is not known, with the nearest name or all of them."""
    file, _, key = where.rpartition(": ")
    return InputError(
        f"{where or 'constant'} = {shown(name)} is not known",
        file=file or None,
        key=key or "constant",
        value=name,
        expected=f"{nearest(name, known)}",
    )
