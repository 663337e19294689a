"""Heat of one dot of a hammer: what its standard waveform leaves in the coil."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.control.duty.heat import DotHeat
from printhammer.errors import InputError
from printhammer.parts.coil.winding import REFERENCE

if TYPE_CHECKING:
    from printhammer.drive.trains import PulseTrain
    from printhammer.hammer.hammer import Hammer

TEMPERATURES: Final = (20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0)
"""Temperatures of the winding at which a hammer with a driver is fired, degC."""

_LEFT: Final = 1e-3  # Current that may be left at the end, in parts of the largest
_DOUBLINGS: Final = 8


def heat_of(hammer: Hammer) -> DotHeat:
    """Return the heat of one dot of a hammer over the temperature of its winding.

    A driver fires it from rest with its coil at `TEMPERATURES`; a current is taken to be kept up whatever the
    resistance.

    Raises
    ------
    InputError
        The hammer has no resistance of the coil, its waveform is a force, or its current does not end.
    """
    from printhammer.drive.trains import PulseTrain
    from printhammer.run.energy.coil_work import squared_current

    waveform: Any = hammer.waveform
    if hammer.coil_resistance is None:
        raise InputError(f"{hammer.path}: coil.resistance is missing, expected it for the heat of a dot")
    if waveform is None or waveform.quantity == "force":
        raise InputError(
            f"{hammer.path}: expected a [waveform] of a voltage or a current for the heat of a dot"
        )
    drive = PulseTrain(waveform, at=[0.0])
    if waveform.quantity == "current":
        heat = hammer.coil_resistance * squared_current(drive, 0.0, waveform.support)
        return DotHeat((REFERENCE,), (heat,), "current")
    heats = [_copper_loss(hammer.replace("coil.temperature", warm), drive) for warm in TEMPERATURES]
    return DotHeat(TEMPERATURES, tuple(heats), "voltage")


def _copper_loss(hammer: Hammer, drive: PulseTrain) -> float:
    """Return the heat of the coil of one firing until its current has ended, J."""
    from printhammer.run.simulate import simulate

    span = 4.0 * drive.waveform.support
    for _ in range(_DOUBLINGS):
        motion = simulate(hammer, drive, duration=span, ledger=True)
        if abs(motion.current[-1]) <= _LEFT * abs(motion.current).max():
            return motion.energy.copper_loss
        span *= 2.0
    raise InputError(
        f"{hammer.path}: the current lasts for ever, expected one that ends for the heat of a dot"
    )
