"""Bifurcations of codimension one as fixed points of larger maps, to be followed in two constants.

An orbit of the strobe map G with two constants p and r loses its stability where

    G(u, p, r) = u,   f(J(u, p, r)) = 0,   f = det(J - I), det(J + I) or det(J) - 1.

These are the fixed points of the map (u, p) -> (G, p + f) with the parameter r: beside the state at the
section the constant p is unknown, and the curve is followed by `printhammer.chaos.continuation.arclength`
(Yu. A. Kuznetsov, *Elements of Applied Bifurcation Theory*, Springer 2004, section 10.3).

Grazings, and orbits that bounce off a rigid backstop, are in `printhammer.chaos.curves.touches`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.chaos.continuation.branch_points import doubling_test, fold_test, torus_test
from printhammer.chaos.continuation.family import cyclic
from printhammer.chaos.continuation.fixed_points import MapValue
from printhammer.chaos.strobe.map import image_of
from printhammer.errors import InputError
from printhammer.hammer.names import PERIOD, RATE
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from printhammer.chaos.continuation.fixed_points import Node
    from printhammer.chaos.strobe.map import Image
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray

TESTS: Final[dict[str, Callable[[FloatArray], float]]] = {
    "fold": fold_test,
    "period doubling": doubling_test,
    "Neimark-Sacker": torus_test,
}
"""What vanishes of the monodromy matrix, by the kind of bifurcation."""

GRAZING: Final = "grazing"
KINDS: Final = (*TESTS, GRAZING)
"""The kinds of bifurcation that can be followed."""

SPACING: Final = 1e-6
"""Of differences, in scales; they only steer Newton's method."""
_PARTS: Final = 5.0
"""Parts of the range of a constant that count as much as half a width of the window."""


@dataclass(frozen=True)
class Plane:
    """The plane of two constants, and the orbits above it."""

    regime: Regime
    names: tuple[str, str]
    bounds: tuple[tuple[float, float], tuple[float, float]]
    firings: int
    tolerance: float

    @cached_property
    def scales(self) -> FloatArray:
        """By which displacement, velocity and both constants are divided, shape (4,)."""
        widths = [(high - low) / _PARTS for low, high in self.bounds]
        return np.array([*self.regime.window.half_widths, *widths])

    def at(self, first: float, second: float) -> Regime:
        """Return the regime with these constants; InputError where they are not possible."""
        return self.regime.with_(self.names[1], float(second)).with_(self.names[0], float(first))


def check_two(first: str, second: str) -> None:
    """Refuse the same constant twice; a rate is its period. InputError says so."""
    if second == first or {first, second} == {PERIOD, RATE}:
        raise InputError(f"second = {second!r}, expected another constant than that of the branch, {first}")


class Place(Declared):
    """A point of a curve in the plane, with the orbit there."""

    first: float = part("the first constant, SI")
    second: float = part("the second constant, SI")
    state: FloatArray = part("displacement, m, and velocity, m/s, at the section, shape (2,)")
    phase: float = part("part of the period from the firing to the section")
    jacobian: FloatArray = part("derivative of the strobe map, shape (2, 2)")
    contacts: str = part("sequence of the contacts, P and B")
    slope: FloatArray | None = part(
        "derivative of the state after the firings with respect to the first constant", default=None
    )
    acceleration: float = part("at the touch of a grazing, m/s^2; NaN of others", default=math.nan)

    @property
    def multipliers(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues of the derivative, the larger absolute value first, shape (2,), complex."""
        values = np.linalg.eigvals(self.jacobian).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]


class MultiplierSystem:
    """Orbits with a multiplier of 1 or -1, or a pair on the unit circle: state and first constant."""

    def __init__(self, plane: Plane, kind: str) -> None:
        self.plane, self.kind, self.test = plane, kind, TESTS[kind]
        self.scales = plane.scales

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Return the map of state and first constant at a value of the second one."""
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
            extra=Place(
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


def place_of(node: Node) -> Place:
    """Return what a fixed point of such a map is in the plane."""
    place: Place = node.value.extra
    return place
