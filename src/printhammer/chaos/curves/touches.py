"""Orbits from one touch of a surface to the next: grazings, and what bounces off a rigid backstop.

The section is put at the touch: there the displacement is that of the surface, b, and unknown are the phase s
of the drive and the velocity v. Without velocity the touch is a grazing,

    G((b, 0); s, p, r) = (b, 0),

two equations for s and p by r. An orbit that leaves a rigid backstop with the velocity v, and comes back
after its firings with w, obeys G((b, v); s, p, r) = (b, w), v = -e w, and with the derivative M of that way

    f = 0,   J = S M,   S = [[-e, 0], [(a_out + e a_in) / w, -e]],

S being the saltation matrix of the impact with the accelerations on both sides of it. A rigid backstop bends
the strobe map of a fixed section by a square root at a grazing, and S is infinite there; here all is smooth,
also w f, and v may pass through 0. To that end the motion close to the touch is computed without the surface.
Where an impact meets a fixed section its state jumps, which does not happen here.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.chaos.continuation.family import cyclic
from printhammer.chaos.continuation.fixed_points import MapValue
from printhammer.chaos.continuation.flights import Flight, fly
from printhammer.chaos.curves.systems import GRAZING, SPACING, Place, Plane
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.chaos.continuation.family import Surface
    from printhammer.support.arrays import FloatArray

_PHASES: Final = 0.2
"""Part of the period that counts as much as half a width of the window."""
_IN_TRACE: Final = {"fold": -1.0, "period doubling": 1.0, "Neimark-Sacker": 0.0}
"""f as a function of trace and determinant of J: the factor of the trace; the rest is 1 + det, or det - 1."""


def _flight(
    plane: Plane, surface: Surface, phase: float, speed: float, first: float, second: float
) -> Flight:
    return fly(plane.at(first, second), surface, phase, speed, plane.firings, plane.tolerance)


class GrazingSystem:
    """Orbits that touch a surface with no velocity: phase of the touch and first constant."""

    def __init__(self, plane: Plane, surface: Surface) -> None:
        self.plane, self.kind, self.surface = plane, GRAZING, surface
        self.scales = np.array([_PHASES, *plane.scales[2:]])

    def at(self, phase: float, first: float, second: float) -> tuple[Place, FloatArray] | str:
        """Return the orbit that leaves a touch, and by how far it misses the next one; text where it ends.

        In scales of the state; InputError where the constants are not possible.
        """
        flight = _flight(self.plane, self.surface, phase, 0.0, first, second)
        if flight.trouble:
            return flight.trouble
        at, contacts = np.array([flight.surface, 0.0]), cyclic(flight.contacts)
        place = Place(
            first, second, at, phase % 1.0, flight.jacobian, contacts, acceleration=flight.accelerations[0]
        )
        return place, (flight.end - at) / self.plane.scales[:2]

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Return the map of phase and first constant at a value of the second one."""
        steps, point = SPACING * self.scales, np.append(whole, other)
        missed = []
        for phase, first, second in [point, *(point + step for step in np.diag(steps))]:
            try:
                value = self.at(float(phase), float(first), float(second))
            except InputError as error:
                return MapValue.none(2, str(error))
            if isinstance(value, str):
                return MapValue.none(2, value)
            missed.append(value)
        (place, miss), *beside = missed
        widths = self.scales[:2]
        slopes = [(near[1] - miss) / step for near, step in zip(beside, steps, strict=True)]
        return MapValue(
            whole + miss * widths,
            np.eye(2) + np.column_stack(slopes[:2]) * widths[:, np.newaxis],
            slopes[2] * widths,
            place.contacts,
            extra=replace(place, slope=slopes[1] * self.plane.scales[:2]),
            monodromy=place.jacobian,
        )


class ImpactSystem:
    """As `MultiplierSystem`, of orbits that bounce off a rigid backstop: phase and velocity there instead."""

    def __init__(self, plane: Plane, kind: str) -> None:
        self.plane, self.kind = plane, kind
        self.scales = np.array([_PHASES, *plane.scales[1:]])

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Return the map of phase and velocity after the impact, and of the first constant."""
        moves, point = SPACING * self.scales, np.append(whole, other)
        try:
            flights = [
                _flight(self.plane, "backstop", *map(float, at))
                for at in [point, *(point + move for move in np.diag(moves))]
            ]
        except InputError as error:
            return MapValue.none(3, str(error))
        for flight in flights:
            if flight.trouble:
                return MapValue.none(3, flight.trouble)
        speeds = whole[1] + moves[1] * np.array([0.0, 0.0, 1.0, 0.0, 0.0])
        misses = [self._miss(flight, speed) for flight, speed in zip(flights, speeds, strict=True)]
        slopes = [(near - misses[0]) / move for near, move in zip(misses[1:], moves, strict=True)]
        here = flights[0]
        jacobian, determinant = _monodromy(here)
        known = np.diag([-self._sign, -self._sign * determinant]) if self._sign else jacobian
        contacts = cyclic((*here.contacts, "backstop"))
        state = np.array([here.surface, whole[1]])
        place = Place(float(whole[2]), other, state, float(whole[0]) % 1.0, jacobian, contacts)
        return MapValue(
            whole + misses[0],
            np.eye(3) + np.column_stack(slopes[:3]),
            slopes[3],
            contacts,
            extra=replace(place, jacobian=known if whole[1] == 0.0 else jacobian),
            monodromy=known,
        )

    @property
    def _sign(self) -> float:
        """Minus the multiplier that is known along the curve; 0 without one."""
        return _IN_TRACE[self.kind]

    def _miss(self, flight: Flight, speed: float) -> FloatArray:
        """Return by how far an orbit misses the next impact and the bifurcation, scaled as the unknowns."""
        matrix, e, w = flight.jacobian, flight.rebound, float(flight.end[1])
        determinant = e * e * float(np.linalg.det(matrix))
        trace, rest = self._sign, determinant + (1.0 if self._sign else -1.0)
        turned = -e * float(np.trace(matrix))
        jump = (flight.accelerations[0] + e * flight.accelerations[1]) * float(matrix[0, 1])
        test = w * (rest + trace * turned) + trace * jump
        way, fast = self.plane.scales[:2]
        misses = [(flight.end[0] - flight.surface) / way, (-e * w - speed) / fast, test / fast]
        return np.asarray(misses * self.scales[:3])


def _monodromy(flight: Flight) -> tuple[FloatArray, float]:
    """Return the derivative from one impact to behind the next, and its determinant."""
    e, w = flight.rebound, float(flight.end[1])
    jump = flight.accelerations[0] + e * flight.accelerations[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        saltation = np.array([[-e, 0.0], [np.divide(jump, w), -e]])
    return saltation @ flight.jacobian, e * e * float(np.linalg.det(flight.jacobian))
