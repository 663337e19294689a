"""Law functions of an absent part: no force, no energy, no memory.

These functions also stand in for functions that the module of a part omits.
"""

from __future__ import annotations

import math
from typing import Any

MEMORY = False
RIGID_FRONT = False
RIGID = False
LEVELS = False
VISCOUS = False
FRICTION = False


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return 0 N, the magnetic force: the hammer has no magnet."""
    return 0.0


def magnet_energy(c: Any, x: float) -> float:
    """Return 0 J, the magnetic energy: the hammer has no magnet."""
    return 0.0


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return 0 Wb, the flux linkage of the magnet: the hammer has no magnet."""
    return 0.0


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return 0 Wb/m, the derivative of the flux linkage with respect to displacement: no magnet."""
    return 0.0


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return 0 H, the derivative of the magnet's flux linkage with respect to current: no magnet."""
    return 0.0


def magnet_current(c: Any, x: float, linkage: float, inductance: float) -> float:
    """Return linkage / inductance, the current [A] of a coil in a hammer without a magnet."""
    return linkage / inductance


def spring_force(c: Any, x: float) -> float:
    """Return 0 N, the spring force: the hammer has no spring."""
    return 0.0


def spring_energy(c: Any, x: float) -> float:
    """Return 0 J, the spring energy: the hammer has no spring."""
    return 0.0


def spring_level(c: Any, k: float) -> float:
    """Return infinity as the position of kink `k`: the spring force has no kink."""
    return math.inf


def spring_viscous(c: Any, x: float, v: float) -> float:
    """Return 0 N, the dissipative force: the spring is elastic."""
    return 0.0


def spring_switch(c: Any, v: float) -> float:
    """Return 1, which never changes sign: the dissipative force has no kink."""
    return 1.0


def pack_loading(c: Any, x: float, v: float) -> float:
    """Return 0 N, the loading force: the hammer has no pack."""
    return 0.0


def pack_memory(c: Any, peak: float) -> float:
    """Return 0: a pack without memory stores no state at a local maximum of displacement, `peak`."""
    return 0.0


def pack_unloading(c: Any, x: float, v: float, q: float) -> float:
    """Return 0 N, the unloading force: the hammer has no pack."""
    return 0.0


def pack_switch(c: Any, x: float, v: float) -> float:
    """Return 1, which never changes sign: the pack law has no kink inside a contact."""
    return 1.0


def pack_rebound(c: Any, v_in: float) -> float:
    """Return -v_in, the velocity [m/s] after a rebound from a perfectly elastic surface."""
    return -v_in


def damping_force(c: Any, v: float) -> float:
    """Return 0 N, the damping force: the hammer has no damping."""
    return 0.0


def friction_force(c: Any, k: float) -> float:
    """Return 0 N, the friction force: the hammer has no dry friction."""
    return 0.0


def backstop_elastic(c: Any, w: float) -> float:
    """Return 0 N, the elastic force: the hammer has no backstop."""
    return 0.0


def backstop_viscous(c: Any, w: float, v: float) -> float:
    """Return 0 N, the viscous force of the backstop: the hammer has no backstop."""
    return 0.0


def backstop_energy(c: Any, w: float) -> float:
    """Return 0 J, the elastic energy: the hammer has no backstop."""
    return 0.0


def backstop_switch(c: Any, w: float, v: float) -> float:
    """Return 1, which never changes sign: the backstop law has no kink inside a contact."""
    return 1.0


def backstop_rebound(c: Any, v_in: float) -> float:
    """Return -v_in, the velocity [m/s] after a rebound from a perfectly elastic surface."""
    return -v_in


def magnet_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants of a magnet law without a packing function to `c`; return their count.

    The constants are the values `q` of the part except the last two, which are the displacement range.
    """
    for k in range(len(q) - 2):
        c[k] = q[k]
    return max(len(q) - 2, 0)


def magnet_domain(q: Any, ends: Any) -> None:
    """Write the displacement range [m] of a magnet law without a domain function to `ends`.

    The range is the last two of the values `q` of the part; with fewer than two values it is unlimited.
    """
    ends[0], ends[1] = -math.inf, math.inf
    if len(q) > 1:
        ends[0], ends[1] = q[len(q) - 2], q[len(q) - 1]


def spring_domain(q: Any, ends: Any) -> None:
    """Leave the displacement range `ends` as it is: the law of the spring holds everywhere."""


def _copy(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants of a law without a packing function to `c`; return their count.

    The constants are the values `q` of the part, unchanged.
    """
    for k in range(len(q)):
        c[k] = q[k]
    return len(q)


spring_packed = pack_packed = backstop_packed = damping_packed = _copy
