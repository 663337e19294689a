"""What switches the coil: the hammer's own pulse, or a fast switch on a higher rail."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from printhammer.control.widths import of_width
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import nominal, pulse_of, single_pulses
from printhammer.run.ensemble import DISPLAY_TOLERANCE

if TYPE_CHECKING:
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer

Driver = Literal["own", "switch", "bridge"]
DRIVERS: Final = get_args(Driver)
"""The hammer's own pulse, with the rise of its supply; a fast unipolar switch, whose current rises as fast as
that of the hammer falls; an H-bridge, which switches off against the reversed rail."""

# Time constant of the decay against the reversed rail, in parts of that of the rise: the current falls as
# 2 exp(-t) - 1 and is zero at ln 2; an exponential of this constant has the same charge.
_REVERSED: Final = 1.0 - float(np.log(2.0))

_EDGE: Final = 20e-6  # Time constant of a switch where the waveform of the hammer has no decay, s
_LEAST_EDGE: Final = 1e-6  # Least time constant of a switch, s
_GRID: Final = 33  # Number of widths that are tried at a time
_ROUNDS: Final = 7  # How often: each time between two neighbours of the one before


def checked_driver(driver: str) -> Driver:
    """Return a driver by its name.

    Raises
    ------
    InputError
        There is none of that name.
    """
    if driver not in DRIVERS:
        raise InputError(f"driver = {driver!r}, expected {', '.join(DRIVERS[:-1])} or {DRIVERS[-1]}")
    return driver  # type: ignore[return-value]


def driven_by(hammer: Hammer, driver: str, largest: float) -> Hammer:
    """Return a hammer with the pulse of a driver, of a width at which the dot is as hard as before.

    `largest` is the current of a switch or a bridge, A.

    Raises
    ------
    InputError
        The driver is not known, the waveform of the hammer is a force, or no width makes such a dot.
    """
    if checked_driver(driver) == "own":
        return hammer
    own: Any = pulse_of(hammer)
    if own.quantity != "current":
        raise InputError(
            f"{hammer.path}: the waveform is a {own.quantity}, expected a current, or driver = 'own'"
        )
    edge = max(float(getattr(own, "decay", _EDGE)), _LEAST_EDGE)
    force = nominal(hammer, tolerance=DISPLAY_TOLERANCE).force
    decay = edge * (_REVERSED if driver == "bridge" else 1.0)
    shape = Rectangle(amplitude=largest, width=edge, rise=edge, decay=decay)
    return of_force(hammer, shape, force, 0.5 * edge, 2.0 * float(getattr(own, "width", own.support)))


def of_force(hammer: Hammer, pulse: Waveform, force: float, low: float, high: float) -> Hammer:
    """Return a hammer fired by a pulse of such a width, between two, s, that the dot has a force, N.

    Raises
    ------
    InputError
        There is none.
    """
    for _ in range(_ROUNDS):
        widths = np.linspace(low, high, _GRID).tolist()
        pulses = [of_width(pulse, width) for width in widths]
        dots = single_pulses([hammer] * _GRID, pulses, tolerance=DISPLAY_TOLERANCE)
        hard = [dot is not None and dot.force >= force for dot in dots]
        if hard[0] or not any(hard):
            raise InputError(
                f"{hammer.path}: no width of the pulse makes a dot of {force:.4g} N, expected another"
                " largest_current, or a hammer nearer to its design"
            )
        first = hard.index(True)
        low, high = widths[first - 1], widths[first]
    return with_pulse(hammer, of_width(pulse, high))


def with_pulse(hammer: Hammer, pulse: Waveform) -> Hammer:
    """Return a hammer that is fired by another pulse."""
    constants = {key: value for key, value in dict(pulse).items() if key != "quantity"}
    return hammer.replace("waveform", {"shape": pulse.shape, **constants}, source="of the driver")
