"""Bifurcations of codimension one as fixed points of extended maps, for continuation in two parameters.

An orbit of the strobe map G with two parameters p and r loses its stability where

    G(u, p, r) = u,   f(J(u, p, r)) = 0,   f = det(J - I), det(J + I) or det(J) - 1.

These are the fixed points of the map (u, p) -> (G, p + f) with the parameter r. The unknowns are the state u
at the section and the parameter p, and the curve is followed by `printhammer.chaos.continuation.arclength`
(Yu. A. Kuznetsov, *Elements of Applied Bifurcation Theory*, Springer 2004, section 10.3).

Grazings, and orbits with impacts on a rigid backstop, use the touch as the section.

*Section at a touch.*

At the touch the displacement is that of the surface, b; the unknowns are the phase s of the drive and the
velocity v. A touch with zero velocity is a grazing,

    G((b, 0); s, p, r) = (b, 0),

two equations for s and p as functions of r. An orbit that leaves a rigid backstop with the velocity v, and
returns after its firings with the velocity w, obeys G((b, v); s, p, r) = (b, w), v = -e w, and, with the
derivative M of this map

    f = 0,   J = S M,   S = [[-e, 0], [(a_out + e a_in) / w, -e]],

where S is the saltation matrix of the impact with the accelerations on both sides of it. With a fixed
section, a rigid backstop gives the strobe map a square-root singularity at a grazing, where S is infinite,
and the state jumps where an impact meets the section. With the section at the touch, all functions including
w f are smooth, and v may pass through 0, because the motion close to the touch is computed without the
surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.branch_points import doubling_test, fold_test, torus_test
from printhammer.chaos.continuation.family import Surface, cyclic
from printhammer.chaos.continuation.fixed_points import MapValue, Node
from printhammer.chaos.continuation.flights import Flight, fly
from printhammer.chaos.strobe.map import Image, image_of
from printhammer.errors import InputError
from printhammer.hammer.names import PERIOD, RATE
from printhammer.results import Declared, part
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

TESTS: Final[dict[str, Callable[[FloatArray], float]]] = {
    "fold": fold_test,
    "period doubling": doubling_test,
    "Neimark-Sacker": torus_test,
}
"""Test functions of the monodromy matrix, by the kind of bifurcation."""

GRAZING: Final = "grazing"
KINDS: Final = (*TESTS, GRAZING)
"""Kinds of bifurcation that can be continued in two parameters."""

SPACING: Final = 1e-6  # Arbitrary
"""Scaled step size of finite differences, whose errors affect only the convergence of Newton's method."""
_PARTS: Final = 5.0  # Arbitrary
"""Ratio of the range of a parameter to its scale; states are scaled by the half-widths of the window."""


@dataclass(frozen=True)
class Plane:
    """Plane of two parameters of a regime: names and ranges, period of the orbit in firings, tolerance."""

    regime: Regime
    names: tuple[str, str]
    bounds: tuple[tuple[float, float], tuple[float, float]]
    firings: int
    tolerance: float

    @cached_property
    def scales(self) -> FloatArray:
        """Scales of displacement, velocity and both parameters, shape (4,)."""
        widths = [(high - low) / _PARTS for low, high in self.bounds]
        return np.array([*self.regime.window.half_widths, *widths])

    def at(self, first: float, second: float) -> Regime:
        """Return the regime at a point of the parameter plane; raise InputError for invalid values."""
        return self.regime.with_(self.names[1], float(second)).with_(self.names[0], float(first))


def check_two(first: str, second: str) -> None:
    """Raise InputError if two parameters are the same, or one is the rate and the other the period."""
    if second == first or {first, second} == {PERIOD, RATE}:
        raise InputError.of("second", second, f"another constant than that of the branch, {first}")


class CurvePoint(Declared):
    """Point of a bifurcation curve in the plane of two parameters, with the orbit at this point."""

    first: float = part("value of the first parameter, SI")
    second: float = part("value of the second parameter, SI")
    state: FloatArray = part("displacement [m] and velocity [m/s] at the section, shape (2,)")
    phase: float = part("phase of the section, as a fraction of the period from the firing on")
    jacobian: FloatArray = part("derivative of the strobe map, shape (2, 2)")
    contacts: str = part("sequence of the contacts, P and B")
    slope: FloatArray | None = part(
        "derivative of the state after the firings with respect to the first parameter", default=None
    )
    acceleration: float = part(
        "acceleration at the touch of a grazing, m/s^2; NaN for other kinds", default=math.nan
    )

    @property
    def multipliers(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues of the derivative of the strobe map, the larger absolute value first, shape (2,)."""
        values = np.linalg.eigvals(self.jacobian).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]


class MultiplierSystem:
    """Extended map of an orbit with a critical multiplier; unknowns are the state and the first parameter."""

    def __init__(self, plane: Plane, kind: str) -> None:
        self.plane, self.kind, self.test = plane, kind, TESTS[kind]
        self.scales = plane.scales

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Evaluate the extended map on `whole` at the value `other` of the second parameter.

        `whole` contains the displacement [m], the velocity [m/s] and the value of the first parameter.
        """
        plane, scales = self.plane, self.scales
        moves = SPACING * scales
        point = np.append(whole, other)
        values: list[Image] = []
        try:
            same = plane.at(point[2], point[3])
            regimes = [same, same, same, plane.at(point[2] + moves[2], point[3])]
            regimes.append(plane.at(point[2], point[3] + moves[3]))
        except InputError as error:
            return MapValue.none(3, str(error))
        points = [point, *(point + move for move in np.diag(moves))]
        for row, (regime, (*state, _first, _second)) in enumerate(zip(regimes, points, strict=True)):
            end = image_of(regime, np.array(state), plane.firings, plane.tolerance, contacts=row == 0)
            if not end.ok or not np.isfinite(end.jacobian).all():
                return MapValue.none(3, "no derivative" if end.ok else end.status)
            values.append(end)
        here, *beside = values
        tests = [float(scales[2]) * self.test(end.jacobian) for end in values]
        across = [(near.state - here.state) / move for near, move in zip(beside, moves, strict=True)]
        slopes = [(test - tests[0]) / move for test, move in zip(tests[1:], moves, strict=True)]
        matrix = np.zeros((3, 3))
        matrix[:2] = np.column_stack([here.jacobian, across[2]])
        matrix[2] = slopes[:3]
        matrix[2, 2] += 1.0
        contacts = cyclic(surface for surface, _ in here.contacts)
        return MapValue(
            np.append(here.state, whole[2] + tests[0]),
            matrix,
            np.append(across[3], slopes[3]),
            contacts,
            extra=CurvePoint(
                float(whole[2]),
                other,
                whole[:2].copy(),
                plane.regime.phase,
                here.jacobian,
                contacts,
                across[2],
            ),
            monodromy=here.jacobian,
        )


def curve_point_of(node: Node) -> CurvePoint:
    """Return the point of the bifurcation curve that a fixed point of an extended map represents."""
    place: CurvePoint = node.value.extra
    return place


_PHASES: Final = 0.2
"""Scale of the phase of a touch, as a fraction of the period; arbitrary."""
_IN_TRACE: Final = {"fold": -1.0, "period doubling": 1.0, "Neimark-Sacker": 0.0}
"""Coefficient c of the test function f = 1 + det J + c tr J by definition; Neimark-Sacker: f = det J - 1."""


def _flights(plane: Plane, surface: Surface, points: Iterable[FloatArray]) -> Iterator[Flight]:
    """Compute a flight for each point: drive phase, speed [m/s], first parameter, second parameter."""
    # Most neighbours of a point have its parameters, and share its regime.
    at = cache(plane.at)
    for phase, speed, first, second in points:
        regime = at(float(first), float(second))
        yield fly(regime, surface, float(phase), float(speed), plane.firings, plane.tolerance)


class GrazingSystem:
    """Extended system for an orbit that grazes a surface; unknowns: touch phase, first parameter."""

    def __init__(self, plane: Plane, surface: Surface) -> None:
        self.plane, self.kind, self.surface = plane, GRAZING, surface
        self.scales = np.array([_PHASES, *plane.scales[2:]])

    def at(self, phase: float, first: float, second: float) -> tuple[CurvePoint, FloatArray] | str:
        """Compute the orbit that starts at a grazing of the surface, and its closing error at the next touch.

        The closing error is the difference of the states at start and end, in units of the state scales. If
        the run ends early, the reason is returned as text. Raises InputError for invalid parameters.
        """
        (flight,) = _flights(self.plane, self.surface, [np.array([phase, 0.0, first, second])])
        if flight.trouble:
            return flight.trouble
        at, contacts = np.array([flight.surface, 0.0]), cyclic(flight.contacts)
        place = CurvePoint(
            first, second, at, phase % 1.0, flight.jacobian, contacts, acceleration=flight.accelerations[0]
        )
        return place, (flight.end - at) / self.plane.scales[:2]

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Evaluate the extended map on `whole` at the value `other` of the second parameter.

        `whole` contains the phase of the touch and the value of the first parameter.
        """
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
    """Extended system for an orbit with rigid impacts and a critical multiplier.

    Unknowns: phase of the impact, velocity after the impact, first parameter.
    """

    def __init__(self, plane: Plane, kind: str) -> None:
        self.plane, self.kind = plane, kind
        self.scales = np.array([_PHASES, *plane.scales[1:]])

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Evaluate the extended map on `whole` at the value `other` of the second parameter.

        `whole` contains the phase of the impact, the velocity after it [m/s], and the value of the first
        parameter.
        """
        moves, point = SPACING * self.scales, np.append(whole, other)
        try:
            flights = list(
                _flights(self.plane, "backstop", [point, *(point + move for move in np.diag(moves))])
            )
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
        place = CurvePoint(float(whole[2]), other, state, float(whole[0]) % 1.0, jacobian, contacts)
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
        """Coefficient of tr J in the test function: minus the critical multiplier; 0 for Neimark-Sacker."""
        return _IN_TRACE[self.kind]

    def _miss(self, flight: Flight, speed: float) -> FloatArray:
        """Compute the three scaled residuals of a flight that starts at an impact with the velocity `speed`.

        The residuals are the deviation of the displacement at the next impact from the position of the
        surface, the deviation of the velocity after that impact from `speed`, and the test function.
        """
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
    """Compute the monodromy matrix between post-impact states of successive impacts, and its determinant."""
    e, w = flight.rebound, float(flight.end[1])
    jump = flight.accelerations[0] + e * flight.accelerations[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        saltation = np.array([[-e, 0.0], [np.divide(jump, w), -e]])
    return saltation @ flight.jacobian, e * e * float(np.linalg.det(flight.jacobian))
