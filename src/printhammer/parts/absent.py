"""Absent part: no force, no energy, no memory.

These functions also replace those that the module of a part omits.
"""

from __future__ import annotations

from typing import Any

MEMORY = False
RIGID = False


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the force of no magnet, 0 N."""
    return 0.0


def magnet_energy(c: Any, x: float) -> float:
    """Return the potential energy of no magnet, 0 J."""
    return 0.0


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return the flux linkage of no magnet, 0 Wb."""
    return 0.0


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return the slope of the flux linkage of no magnet with displacement, 0 Wb/m."""
    return 0.0


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return the slope of the flux linkage of no magnet with current, 0 H."""
    return 0.0


def magnet_current(c: Any, x: float, linkage: float, inductance: float) -> float:
    """Return the current of a coil without a magnet, linkage / inductance in A."""
    return linkage / inductance


def spring_force(c: Any, x: float) -> float:
    """Return the force of no spring, 0 N."""
    return 0.0


def spring_energy(c: Any, x: float) -> float:
    """Return the potential energy of no spring, 0 J."""
    return 0.0


def pack_loading(c: Any, x: float, v: float) -> float:
    """Return the force of no pack, 0 N."""
    return 0.0


def pack_memory(c: Any, peak: float) -> float:
    """Return the memory of a pack without memory, 0."""
    return 0.0


def pack_unloading(c: Any, x: float, v: float, q: float) -> float:
    """Return the force of no pack, 0 N."""
    return 0.0


def pack_switch(c: Any, x: float, v: float) -> float:
    """Return 1: the law has no kink inside a contact."""
    return 1.0


def damping_force(c: Any, v: float) -> float:
    """Return the force of no damping, 0 N."""
    return 0.0


def backstop_elastic(c: Any, w: float) -> float:
    """Return the elastic force of no backstop, 0 N."""
    return 0.0


def backstop_viscous(c: Any, w: float, v: float) -> float:
    """Return the viscoelastic force of no backstop, 0 N."""
    return 0.0


def backstop_energy(c: Any, w: float) -> float:
    """Return the elastic energy of no backstop, 0 J."""
    return 0.0


def backstop_switch(c: Any, w: float, v: float) -> float:
    """Return 1: the law has no kink inside a contact."""
    return 1.0


def backstop_rebound(c: Any, v_in: float) -> float:
    """Return the rebound velocity of a perfectly elastic surface, -v_in in m/s."""
    return -v_in
