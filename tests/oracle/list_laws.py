"""Forces, contacts and stops of the oracle for lists, one class a law; SI units throughout."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Spring:
    """Force preload - stiffness (x - position) - cubic (x - position)³."""

    stiffness: float = 0.0
    preload: float = 0.0
    position: float = 0.0
    cubic: float = 0.0
    name: str = "spring"

    def force(self, x: float, _v: float) -> float:
        """Force, N."""
        d = x - self.position
        return self.preload - self.stiffness * d - self.cubic * d**3


@dataclass(frozen=True)
class Damping:
    """Force -coefficient v."""

    coefficient: float
    name: str = "damping"

    def force(self, _x: float, v: float) -> float:
        """Force, N."""
        return -self.coefficient * v


@dataclass(frozen=True)
class Constant:
    """Force of constant size, positive toward larger x."""

    size: float
    name: str = "constant"

    def force(self, _x: float, _v: float) -> float:
        """Force, N."""
        return self.size


def gravity(mass: float, angle: float, g: float = 9.80665) -> Constant:
    """Gravity along x: -mass g sin(angle), with the angle between x and the horizontal in rad."""
    return Constant(-mass * g * math.sin(angle), "gravity")


@dataclass(frozen=True)
class Piece:
    """Force constant + slope s + amplitude sin(rate s + phase) for start <= t < end, with s = t - start."""

    start: float = 0.0
    end: float = math.inf
    constant: float = 0.0
    slope: float = 0.0
    amplitude: float = 0.0
    rate: float = 0.0
    phase: float = 0.0

    def force(self, t: float) -> float:
        """Force of the analytic formula, N, whether or not t lies within the piece."""
        s = t - self.start
        return self.constant + self.slope * s + self.amplitude * math.sin(self.rate * s + self.phase)


@dataclass(frozen=True)
class Drive:
    """Sum of pieces; zero elsewhere."""

    pieces: tuple[Piece, ...]
    name: str = "drive"


@dataclass(frozen=True)
class Friction:
    """Coulomb friction with a kinetic force and a static force that is not smaller, N."""

    kinetic: float
    static: float
    name: str = "friction"


@dataclass(frozen=True)
class Contact:
    """Compliant contact with force max(0, stiffness d**exponent (1 + loss d') + damping d').

    ``side`` front: d = x - position, pushes toward smaller x; back: d = position - x, pushes toward larger x.
    """

    name: str
    side: str
    position: float
    stiffness: float
    exponent: float = 1.0
    loss: float = 0.0
    damping: float = 0.0

    def push(self, d: Any, rate: Any) -> Any:
        """Force before clipping, N."""
        depth = d if self.exponent.is_integer() else np.maximum(d, 0.0)
        return self.stiffness * depth**self.exponent * (1.0 + self.loss * rate) + self.damping * rate

    def sign(self, d: Any, rate: Any) -> Any:
        """Quantity with the sign of the force before clipping; without `damping`, 1 + loss d'."""
        return self.push(d, rate) if self.damping else 1.0 + self.loss * rate

    def stored(self, d: float) -> float:
        """Energy stored at an indentation, J."""
        return float(self.stiffness * max(d, 0.0) ** (self.exponent + 1.0) / (self.exponent + 1.0))


@dataclass(frozen=True)
class Stop:
    """Rigid stop: at ``position`` a velocity v toward it becomes -restitution v."""

    name: str
    side: str
    position: float
    restitution: float


@dataclass(frozen=True)
class System:
    """Mass, lists of forces and contacts, and the scales of displacement [m] and velocity [m/s] of errors."""

    mass: float
    forces: tuple[Spring | Damping | Constant, ...] = ()
    drives: tuple[Drive, ...] = ()
    friction: tuple[Friction, ...] = ()
    contacts: tuple[Contact, ...] = ()
    stops: tuple[Stop, ...] = ()
    length: float = 1e-3
    speed: float = 1.0
