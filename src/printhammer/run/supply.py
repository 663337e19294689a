"""Supply and coil of a voltage drive: the circuit for the kernel, and its validation."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.base import Supply, Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model import layout
from printhammer.parts import absent
from printhammer.parts.coil import Winding
from printhammer.run.plain.posing import (
    Coil,
    falling_place,
    linkage_scale,
    main_inductance,
    main_linkage,
    sustained_current,
)
from printhammer.support.arrays import FloatArray


def waveforms_of(drive: Drive) -> tuple[Waveform, ...]:
    """Return the distinct waveforms that a drive fires."""
    fired = getattr(drive, "waveforms", None) or (drive.waveform,)
    return tuple(dict.fromkeys(fired))


def supply_of(drive: Drive) -> Supply:
    """Return the supply of a voltage drive; all of its waveforms share one supply."""
    supplies = {waveform.supply() for waveform in waveforms_of(drive)}
    if len(supplies) > 1:
        raise InputError(
            "the waveforms of the drive are on different supplies", key="waveforms", expected="one supply"
        )
    return supplies.pop()


def winding_of(hammer: Hammer) -> Winding:
    """Return the winding of a voltage-driven hammer.

    Raises
    ------
    InputError
        The hammer has no coil, its resistance is not stated, or the magnet's law has no flux linkage.
    """
    coil = hammer.coil
    if not isinstance(coil, Winding) or coil.resistance is None:
        raise InputError(
            f"{hammer.path}: coil.resistance is missing",
            file=hammer.path,
            key="coil.resistance",
            expected="the resistance of the coil that the voltage drives",
        )
    if coil.back_emf and hammer.magnet is not None and not hammer.magnet.has_linkage:
        raise InputError(
            f"{hammer.path}: the magnet law {hammer.magnet.law!r} links no flux",
            file=hammer.path,
            key="magnet",
            expected="a law with a flux linkage, or coil.back_emf = false",
        )
    return coil


def coil_of(hammer: Hammer) -> Coil:
    """Return the coil of a voltage-driven hammer: its law functions and packed constants."""
    winding = winding_of(hammer)
    return Coil(
        _law(hammer, "magnet_linkage"),
        _law(hammer, "magnet_inductance"),
        np.array(() if hammer.magnet is None else hammer.magnet.packed(hammer.origin)),
        hammer.magnet is not None and winding.back_emf,
        winding.inductance,
        winding.leakage or 0.0,
        winding.warm_resistance,
    )


def linkage(hammer: Hammer, x: float, current: float) -> float:
    """Return the flux linkage [Wb] of the main flux path of a coil at a displacement [m] and current [A]."""
    return main_linkage(x, current, coil_of(hammer))


def inductance(hammer: Hammer, x: float, current: float) -> float:
    """Return the differential inductance [H] of the main flux path of a coil, at x [m] and a current [A]."""
    return main_inductance(x, current, coil_of(hammer))


def emf(hammer: Hammer, x: float, current: float) -> float:
    """Return the derivative of the flux linkage of the main flux path with respect to displacement, Wb/m.

    The derivative is the back-EMF divided by the velocity; 0 if the coil has no back-EMF.
    """
    if hammer.magnet is None or not winding_of(hammer).back_emf:
        return 0.0
    law = _law(hammer, "magnet_emf")
    return float(law(np.array(hammer.magnet.packed(hammer.origin)), x, current))


def current_of(hammer: Hammer, x: float, linkage: float, main: float) -> float:
    """Return the coil current [A] from the flux linkages [Wb] of the coil and of its main flux path."""
    coil = winding_of(hammer)
    if coil.turn_resistance:
        return (linkage - main) / (coil.leakage or 0.0)
    if hammer.magnet is None or not coil.back_emf:
        return linkage / coil.inductance
    law = _law(hammer, "magnet_current")
    return float(law(np.array(hammer.magnet.packed(hammer.origin)), x, linkage, coil.inductance))


def _law(hammer: Hammer, name: str) -> Any:
    module = import_module(hammer.magnet.module) if hammer.magnet is not None else absent
    return getattr(module, name, None) or getattr(absent, name)


def typical_current(hammer: Hammer, drive: Drive) -> float:
    """Return the largest current that a voltage drive can sustain in the coil, A."""
    coil = coil_of(hammer)
    largest = 0.0
    for waveform in waveforms_of(drive):
        series, voltage = getattr(waveform, "series", 0.0), waveform.peak
        resistance = coil.resistance + series
        upper = getattr(waveform, "upper", math.nan)
        limited, current = sustained_current(voltage, series, waveform.support, upper, hammer.origin, coil)
        hold = getattr(waveform, "hold_upper", None)
        if hold is not None and hold > current:
            raise InputError.of(
                "hold_upper",
                hold,
                (
                    f"less than {current:.4g} A, the most that {voltage:g} V drives through {resistance:.4g}"
                    " ohm"
                ),
                written=f"{hold:g}",
                unit="A",
            )
        largest = max(largest, limited)
    return largest or 1.0


def current_scale(hammer: Hammer, drive: Drive) -> float:
    """Return the scale that normalises differences of the coil current [A]; 1 without a voltage drive."""
    return typical_current(hammer, drive) if drive.quantity == "voltage" else 1.0


def take_supply(constants: FloatArray, hammer: Hammer, drive: Drive) -> None:
    """Write the supply, and the scales of current and flux linkage, into the kernel's parameter array.

    Raises
    ------
    InputError
        The hammer has no coil circuit that a voltage could drive, or its flux linkage does not increase with
        the current.
    """
    supply = supply_of(drive)
    current = typical_current(hammer, drive)
    check_linkage(hammer, current)
    constants[layout.DIODE : layout.DIODE + 6] = supply
    constants[layout.CURRENT_SCALE] = current
    constants[layout.LINKAGE_SCALE] = linkage_scale(hammer.origin, current, coil_of(hammer))


def check_linkage(hammer: Hammer, current: float) -> None:
    """Check that the flux linkage increases with the coil current, up to `current` [A], at all positions."""
    coil = coil_of(hammer)
    ends = [place for place in (hammer.front, hammer.platen) if place is not None]
    x, slope = falling_place(hammer.origin, max([*ends, hammer.origin]), current, coil)
    if math.isfinite(x):
        least = coil.inductance - slope
        raise InputError.of(
            "coil.inductance",
            coil.inductance,
            f"more than {least:.4g} H, so that the flux linkage rises with the current at x = {x:.4g} m",
            file=hammer.path,
            written=f"{coil.inductance:g}",
            unit="H",
        )
