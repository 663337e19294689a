"""Total force on the armature, equation (2) of the paper, in each mode, composed of the force laws.

Equation numbers refer to F. Hendriks, IBM J. Res. Develop. 27 (1983). `hammer` is the parameter array of
:mod:`printhammer.kernel.model.layout`.
"""

from __future__ import annotations

import math
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
from printhammer.kernel.model.modes import (
    HELD_LOADING,
    HELD_UNLOADING,
    LOADING,
    RELOADING,
    RESTING,
    RESTING_FRONT,
    UNLOADING,
)

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import magnetising_current
    from printhammer.kernel.model.laws import (
        FORCE_DRIVE,
        FRICTION,
        HAS_CIRCUIT,
        HAS_DAMPING,
        HAS_PACK,
        MEMORY,
        RIGID_FRONT,
        VISCOUS,
        backstop_elastic,
        backstop_viscous,
        damping_force,
        friction_force,
        magnet_force,
        pack_loading,
        pack_unloading,
        spring_force,
        spring_viscous,
    )
    from printhammer.kernel.model.pulses import Drive, drive_value

    Hammer = Any


@inlined
def value_at(t: float, x: float, hammer: Hammer, drive: Drive) -> float:
    """Return the value of the drive at time `t` [s], A or N; with a circuit, the magnetising current [A]."""
    if HAS_CIRCUIT:
        return magnetising_current(x, drive[1], hammer, drive[0])
    return drive_value(t, drive)


@inlined
def undamped_force(t: float, x: float, hammer: Hammer, drive: Drive) -> float:
    """Return the sum of magnet, spring and drive force [N], without damping and contact forces."""
    value = value_at(t, x, hammer, drive)
    if FORCE_DRIVE:
        return magnet_force(hammer[MAGNET:], x, 0.0) + spring_force(hammer[SPRING:PACK], x) + value
    return magnet_force(hammer[MAGNET:], x, value) + spring_force(hammer[SPRING:PACK], x)


@inlined
def viscous_force(x: float, v: float, hammer: Hammer) -> float:
    """Return the sum of the damping force and of the dissipative force of the spring [N]."""
    if VISCOUS:
        return damping_force(hammer[DAMPING:SPRING], v) + spring_viscous(hammer[SPRING:PACK], x, v)
    return damping_force(hammer[DAMPING:SPRING], v)


@inlined
def field_force(t: float, x: float, v: float, hammer: Hammer, drive: Drive) -> float:
    """Return the sum of magnet, spring, damping and drive force [N]; equations (3) and (4) of the paper."""
    if HAS_DAMPING:
        return undamped_force(t, x, hammer, drive) + viscous_force(x, v, hammer)
    return undamped_force(t, x, hammer, drive)


@inlined
def slip(mode: int, memory: float) -> float:
    """Return the direction in which the armature slides under dry friction, 1 or -1; 0 at rest.

    The direction is constant within a step, so that friction is smooth even if the step extends beyond a
    reversal. Except inside a pack with memory, the direction is stored in `memory`.
    """
    if mode >= RESTING:
        return 0.0
    if MEMORY and mode in (LOADING, RELOADING):
        return 1.0
    return -1.0 if mode == UNLOADING else memory


@inlined
def friction(mode: int, memory: float, hammer: Hammer) -> float:
    """Return the dry friction force on the moving armature [N].

    The value is 0 at rest, where the friction force balances the other forces.
    """
    return -slip(mode, memory) * friction_force(hammer[DAMPING:SPRING], 0.0)


@inlined
def hold_limit(hammer: Hammer) -> float:
    """Return the largest acceleration [m/s^2], due to all other forces, that static friction can balance."""
    return float(friction_force(hammer[DAMPING:SPRING], 1.0) * hammer[INVERSE_MASS])


@inlined
def is_on_stop(mode: int) -> bool:
    """Whether the armature is at rest on a rigid surface, pressed against it by the other forces."""
    return mode == RESTING or (RIGID_FRONT and mode == RESTING_FRONT)


@inlined
def least_at_rest(mode: int, held: float) -> float:
    """Return the lower limit of the friction-free acceleration [m/s^2] for an armature to stay at rest.

    The friction-free acceleration is the force without friction, divided by the mass. `held` is the largest
    such acceleration that friction can balance or that the run treats as zero.
    """
    return -math.inf if mode == RESTING else -held


@inlined
def most_at_rest(mode: int, held: float) -> float:
    """Return the upper limit of the friction-free acceleration [m/s^2] for an armature to stay at rest.

    `held` is as for `least_at_rest`.
    """
    if RIGID_FRONT and mode == RESTING_FRONT:
        return math.inf
    return held


@inlined
def pack_force(x: float, v: float, mode: int, memory: float, hammer: Hammer) -> float:
    """Return the pack force [N] in `mode`, equation (5) of the paper; 0 in a mode outside the pack."""
    if mode == LOADING or (FRICTION and mode == HELD_LOADING):
        return pack_loading(hammer[PACK:BACKSTOP_PART], x, v)
    if mode in (UNLOADING, RELOADING) or (FRICTION and mode == HELD_UNLOADING):
        return pack_unloading(hammer[PACK:BACKSTOP_PART], x, v, memory)
    return 0.0


@inlined
def acceleration(
    t: float, x: float, v: float, mode: int, memory: float, hammer: Hammer, drive: Drive
) -> float:
    """Return the acceleration of the armature off the backstop [m/s^2], from equation (1) of the paper."""
    force = field_force(t, x, v, hammer, drive)
    if HAS_PACK:
        force += pack_force(x, v, mode, memory, hammer)
    if FRICTION:
        force += friction(mode, memory, hammer)
    return float(force * hammer[INVERSE_MASS])


@inlined
def backstop_acceleration(t: float, w: float, v: float, hammer: Hammer, drive: Drive) -> float:
    """Return the acceleration [m/s^2] at backstop compression ``w**2`` [m]; equations (1), (6) and (7)."""
    force = field_force(t, hammer[POSITION] - w * w, v, hammer, drive)
    force += backstop_elastic(hammer[BACKSTOP_PART:MAGNET], w) + backstop_viscous(
        hammer[BACKSTOP_PART:MAGNET], w, v
    )
    return float(force * hammer[INVERSE_MASS])
