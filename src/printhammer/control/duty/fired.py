"""Heat of one dot of a hammer: what its standard waveform leaves in the coil."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.control.duty.heat import DotHeat
from printhammer.errors import InputError
from printhammer.parts.coil.winding import REFERENCE

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


def heat_of(hammer: Hammer) -> DotHeat:
    """Return the heat of one dot of a hammer over the temperature of its winding.

    Raises
    ------
    InputError
        The hammer has no resistance of the coil, or its waveform is a force.
    """
    from printhammer.drive.trains import PulseTrain
    from printhammer.run.coil_work import squared_current

    if hammer.coil_resistance is None:
        raise InputError(f"{hammer.path}: coil.resistance is missing, expected it for the heat of a dot")
    waveform = hammer.waveform
    if waveform is None or waveform.quantity != "current":
        raise InputError(f"{hammer.path}: expected a [waveform] of current for the heat of a dot")
    fired = PulseTrain(waveform, at=[0.0])
    squared = squared_current(fired, 0.0, waveform.support)
    return DotHeat((REFERENCE,), (hammer.coil_resistance * squared,), "current")
