"""Points of codimension two on a bifurcation curve, at which two degeneracies coincide.

| kind | on | degeneracy |
|---|---|---|
| cusp | fold | both components of the tangent of the curve in the plane are 0: two folds meet and end |
| fold-flip | fold, doubling | the other multiplier is -1, or 1 |
| 1:1 resonance | fold, Neimark-Sacker | both multipliers are 1 |
| 1:2 resonance | doubling, Neimark-Sacker | both multipliers are -1 |
| degenerate doubling | doubling | c (`normal_forms`) is 0: super- and subcritical doublings meet |
| fold or doubling meets grazing | fold, doubling, grazing | a contact appears while a multiplier is 1 or -1 |
| resonant grazing | grazing, fold, doubling | the element (1, 2) of A^n is 0 |
| degenerate grazing | grazing | the acceleration at the touch is 0 |

A is the derivative of the strobe map without the touch. At a resonant grazing of a rigid backstop, the
square-root term of the map over n periods of the orbit has no effect on the trace (A. P. Ivanov, J. Sound
Vib. 162 (1993) 562; J. Molenaar, J. G. de Weger and W. van de Water, Nonlinearity 14 (2001) 301). At these
points, folds and doublings of the orbits with one touch in n periods begin.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.branch_points import doubling_test, fold_test, zero_between
from printhammer.chaos.continuation.family import Surface
from printhammer.chaos.continuation.fixed_points import Corrector, Node
from printhammer.chaos.curves.systems import CurvePoint, GrazingSystem, Plane, curve_point_of
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray

RESONANCES: Final = 3  # Arbitrary
"""Largest number n of orbit periods per touch for which a grazing orbit is tested for a resonance."""

_LEVEL: Final = 1e-3  # Arbitrary
"""Component of a unit tangent along a parameter below which a curve is stationary in this parameter."""
_VANISHES: Final = 0.1  # Arbitrary
"""Largest tangent component, relative to the tangents of neighbouring nodes, treated as zero at a cusp."""
_ROUNDS: Final = 20  # Iteration limit of Newton's method; arbitrary
_MOVE: Final = 1e-6  # Finite-difference step of Newton's method, in scaled variables; arbitrary
_PRECISION: Final = 1e-11  # Scaled residual below which Newton's method has converged; arbitrary
_NOISE: Final = 1e-8  # Magnitude below which a test function or a tangent component is noise; arbitrary


class CodimensionTwo(Declared):
    """Point of codimension two on a bifurcation curve, at which two degeneracies coincide."""

    kind: str = part('kind of the point, such as "cusp", "fold-flip" or "resonant grazing"')
    first: float = part("value of the first parameter, SI")
    second: float = part("value of the second parameter, SI")
    state: FloatArray = part("displacement [m] and velocity [m/s] at the section, shape (2,)")
    phase: float = part("phase of the section, as a fraction of the period from the firing on")
    multipliers: npt.NDArray[np.complex128] = part("multipliers of the orbit, shape (2,)")
    after: int = part("index of the preceding point of the curve; -1 before the first point")
    passages: int = part("number n of orbit periods per touch at a resonant grazing; else 1", default=1)

    @property
    def message(self) -> str:
        """Kind of the point as text; for a resonant grazing, with the number of orbit periods per touch."""
        return f"{self.kind} of {self.passages} passages" if self.passages > 1 else self.kind


def point_of(kind: str, place: CurvePoint, after: int, passages: int = 1) -> CodimensionTwo:
    """Build a point of codimension two from a point of the curve.

    `after` is the index of the preceding node of the curve, `passages` the number of orbit periods per touch.
    """
    multipliers = place.multipliers
    return CodimensionTwo(
        kind, place.first, place.second, place.state, place.phase, multipliers, after, passages
    )


def _determinant(node: Node) -> float:
    return float(np.linalg.det(_matrix(node)))


def _matrix(node: Node) -> FloatArray:
    matrix = node.value.monodromy
    assert matrix is not None
    return matrix


def _resonance(passages: int) -> Callable[[Node], float]:
    test = resonance_test(passages)
    return lambda node: test(_matrix(node))


def _along(direction: FloatArray) -> Callable[[Node], float]:
    return lambda node: float(node.tangent[-2:] @ direction)


def _tests(kind: str, rigid: bool) -> dict[tuple[str, int], Callable[[Node], float]]:
    """Return the test functions for points of codimension two on a bifurcation curve.

    `kind` is the bifurcation: "fold", "period doubling", "Neimark-Sacker" or "grazing". The keys are the name
    of the point and the number of orbit periods per touch. `rigid` tells whether the backstop is rigid, so
    that resonant grazings exist.
    """
    if kind == "fold":
        return {
            ("fold-flip", 1): lambda node: _determinant(node) + 1.0,
            ("1:1 resonance", 1): lambda node: _determinant(node) - 1.0,
        }
    if kind == "period doubling":
        return {
            ("fold-flip", 1): lambda node: _determinant(node) + 1.0,
            ("1:2 resonance", 1): lambda node: _determinant(node) - 1.0,
        }
    if kind == "Neimark-Sacker":
        return {
            ("1:1 resonance", 1): lambda node: float(np.trace(_matrix(node))) - 2.0,
            ("1:2 resonance", 1): lambda node: float(np.trace(_matrix(node))) + 2.0,
        }
    tests: dict[tuple[str, int], Callable[[Node], float]] = {
        ("fold meets grazing", 1): lambda node: fold_test(_matrix(node)),
        ("doubling meets grazing", 1): lambda node: doubling_test(_matrix(node)),
        ("degenerate grazing", 1): lambda node: curve_point_of(node).acceleration,
    }
    if rigid:
        tests |= {("resonant grazing", n): _resonance(n) for n in range(1, RESONANCES + 1)}
    return tests


def points_along(
    kind: str,
    rigid: bool,
    nodes: list[Node],
    follower: Corrector,
    coefficients: FloatArray,
    coefficient: Callable[[CurvePoint], float],
) -> list[CodimensionTwo]:
    """Locate the points of codimension two on a bifurcation curve, in order.

    `kind` is the bifurcation, such as "fold". `rigid` tells whether the backstop is rigid. `coefficients` are
    the normal-form coefficients at the nodes of a curve of period doublings; `coefficient` computes this
    coefficient at any other point of the curve.
    """
    points: list[CodimensionTwo] = []
    tests = _tests(kind, rigid)
    for after, (here, ahead) in enumerate(itertools.pairwise(nodes)):
        named = [
            (name, passages, test)
            for (name, passages), test in tests.items()
            if test(here) * test(ahead) < 0.0 and max(abs(test(here)), abs(test(ahead))) > _NOISE
        ]
        # The tests for n > 1 also change sign where the test for n = 1 does: report the smallest n.
        first = {name: passages for name, passages, _ in reversed(named)}
        for name, passages, test in named:
            if passages == first[name]:
                share, node = zero_between(follower, here, ahead, test)
                place = curve_point_of(node if node is not None else (here, ahead)[int(share > 0.5)])
                points.append(point_of(name, place, after, passages))
        if kind == "fold" and float(here.tangent[-2:] @ ahead.tangent[-2:]) < 0.0:
            # The curve turns back in the plane, whatever the orientation of the cusp.
            turn = ahead.tangent[-2:] - here.tangent[-2:]
            _, node = zero_between(follower, here, ahead, _along(turn))
            if node is not None and _is_stationary(node, here, ahead):
                points.append(point_of("cusp", curve_point_of(node), after))
        pair = coefficients[after : after + 2]
        if kind == "period doubling" and pair[0] * pair[1] < 0.0:
            _, node = zero_between(follower, here, ahead, lambda node: coefficient(curve_point_of(node)))
            # At a resonance or fold-flip the coefficient changes sign through infinity.
            if node is not None and (
                not named or abs(coefficient(curve_point_of(node))) < float(np.abs(pair).min())
            ):
                points.append(point_of("degenerate doubling", curve_point_of(node), after))
    return points


def _is_stationary(node: Node, here: Node, ahead: Node) -> bool:
    """Whether a curve is stationary in both parameters at a node between two neighbouring nodes.

    Each component of the tangent is compared with its values at the neighbouring nodes, since the component
    of a parameter with a wide range is small everywhere.
    """
    components = np.abs([each.tangent[-2:] for each in (node, here, ahead)])
    beside = np.maximum(_VANISHES * components[1:].max(axis=0), _NOISE)
    return bool((components[0] < np.minimum(beside, _LEVEL)).all())


def meeting(
    plane: Plane,
    surface: Surface,
    guess: FloatArray,
    test: Callable[[FloatArray], float],
) -> CurvePoint | None:
    """Find the grazing near a guess at which a test function of the derivative vanishes; None if not found.

    Parameters
    ----------
    plane : Plane
        Plane of the two parameters, with the period of the grazing orbit in firings.
    surface : str
        Surface that the orbit grazes: "pack" or "backstop".
    guess : array, shape (3,)
        Initial guess: phase of the touch, first and second parameter.
    test : callable
        Test function of the derivative of the strobe map without the touch.
    """
    system = GrazingSystem(plane, surface)
    z = np.asarray(guess, dtype=np.float64) / system.scales
    size = np.inf
    for _ in range(_ROUNDS):
        try:
            here = _missed(system, z, test)
            beside = [_missed(system, z + move, test) for move in _MOVE * np.eye(3)]
        except InputError:
            return None
        if here is None or None in beside:
            return None
        matrix = np.column_stack([(near[1] - here[1]) / _MOVE for near in beside if near is not None])
        try:
            change = -np.linalg.solve(matrix, here[1])
        except np.linalg.LinAlgError:
            return None
        last, size = size, float(np.abs(change).max())
        if size <= _PRECISION or (size >= 0.5 * last and size <= 1e3 * _PRECISION):
            return here[0]
        if not size < 1.0:
            return None
        z = z + change
    return None


def _missed(
    system: GrazingSystem, z: FloatArray, test: Callable[[FloatArray], float]
) -> tuple[CurvePoint, FloatArray] | None:
    phase, first, second = (float(value) for value in z * system.scales)
    value = system.at(phase, first, second)
    if isinstance(value, str):
        return None
    place, miss = value
    return place, np.append(miss, test(place.jacobian))


def resonance_test(passages: int) -> Callable[[FloatArray], float]:
    """Return the test function of a resonant grazing: element (1, 2) of the n-th power of the derivative.

    `passages` is n, the number of orbit periods per touch.
    """
    return lambda jacobian: float(np.linalg.matrix_power(jacobian, passages)[0, 1])
