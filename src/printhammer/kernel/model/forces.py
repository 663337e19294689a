"""Force sum, equation (2), in each mode: plain scalar functions of the bound laws.

The constants of the hammer are in one array, see :mod:`printhammer.kernel.model.layout`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import inlined
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    DAMPING,
    INVERSE_MASS,
    MAGNET,
    PACK,
    POSITION,
    SPRING,
)
from printhammer.kernel.model.modes import LOADING, RELOADING, UNLOADING

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import magnetising_current
    from printhammer.kernel.model.laws import (
        FORCE_DRIVE,
        HAS_CIRCUIT,
        HAS_DAMPING,
        HAS_PACK,
        backstop_elastic,
        backstop_viscous,
        damping_force,
        magnet_force,
        pack_loading,
        pack_unloading,
        spring_force,
    )
    from printhammer.kernel.model.pulses import Drive, drive_value

    Hammer = Any


@inlined
def value_at(t: float, x: float, hammer: Hammer, drive: Drive) -> float:
    """Return the value of the drive, or the current [A] of a coil circuit."""
    if HAS_CIRCUIT:
        return magnetising_current(x, drive[1], hammer, drive[0])
    return drive_value(t, drive)


@inlined
def undamped_force(t: float, x: float, hammer: Hammer, drive: Drive) -> float:
    """Return the sum of magnet, spring and drive force [N]."""
    value = value_at(t, x, hammer, drive)
    if FORCE_DRIVE:
        return magnet_force(hammer[MAGNET:], x, 0.0) + spring_force(hammer[SPRING:PACK], x) + value
    return magnet_force(hammer[MAGNET:], x, value) + spring_force(hammer[SPRING:PACK], x)


@inlined
def field_force(t: float, x: float, v: float, hammer: Hammer, drive: Drive) -> float:
    """Return the sum of magnet, spring, damping and drive force [N]: equations (3) and (4)."""
    if HAS_DAMPING:
        return undamped_force(t, x, hammer, drive) + damping_force(hammer[DAMPING:SPRING], v)
    return undamped_force(t, x, hammer, drive)


@inlined
def pack_force(x: float, v: float, mode: int, memory: float, hammer: Hammer) -> float:
    """Return the force of the pack [N] on the branch of `mode`: equation (5)."""
    if mode == LOADING:
        return pack_loading(hammer[PACK:BACKSTOP_PART], x, v)
    if mode in (UNLOADING, RELOADING):
        return pack_unloading(hammer[PACK:BACKSTOP_PART], x, v, memory)
    return 0.0


@inlined
def acceleration(
    t: float, x: float, v: float, mode: int, memory: float, hammer: Hammer, drive: Drive
) -> float:
    """Return the acceleration [m/s^2] off the backstop: equation (1)."""
    force = field_force(t, x, v, hammer, drive)
    if HAS_PACK:
        force += pack_force(x, v, mode, memory, hammer)
    return float(force * hammer[INVERSE_MASS])


@inlined
def backstop_acceleration(t: float, w: float, v: float, hammer: Hammer, drive: Drive) -> float:
    """Return the acceleration [m/s^2] at compression ``w**2`` [m] of the backstop: (1), (6) and (7)."""
    force = field_force(t, hammer[POSITION] - w * w, v, hammer, drive)
    force += backstop_elastic(hammer[BACKSTOP_PART:MAGNET], w) + backstop_viscous(
        hammer[BACKSTOP_PART:MAGNET], w, v
    )
    return float(force * hammer[INVERSE_MASS])
