"""Fixed points of a map with a parameter, one at a time, by Newton's method.

The state u and the parameter p form a point z = (u, p). A point is corrected onto the curve of fixed points
G(u, p) = u within the plane z . row = constant. All variables are scaled: u and p are each divided by a
scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray

_MOST_CORRECTIONS: Final = 12  # Iteration limit of Newton's method; arbitrary
_STAGNANT: Final = 1e3  # Arbitrary
"""Multiple of the precision below which a correction that stops shrinking is accepted as converged."""


class MapValue(Declared):
    """Value and derivatives of a map with a parameter at one point."""

    image: FloatArray = part("image G(u, p), shape (n,)")
    jacobian: FloatArray = part("derivative dG/du, shape (n, n)")
    slope: FloatArray = part("derivative dG/dp, shape (n,)")
    label: Hashable = part(
        "kind of motion between the two states, such as its sequence of contacts",
        more="a change along a curve is an event",
        default=(),
    )
    trouble: str = part("reason why the map has no value at this point; empty if it has a value", default="")
    extra: Any = part("further data that the map attaches to this evaluation", default=None, repr=False)
    monodromy: FloatArray | None = part(
        "derivative whose eigenvalues are the multipliers, if the map has more unknowns than the orbit",
        default=None,
        repr=False,
    )

    @classmethod
    def none(cls, count: int, trouble: str) -> MapValue:
        """Build the placeholder for a map of `count` variables without a value; `trouble` is the reason."""
        nan = math.nan
        return cls(np.full(count, nan), np.full((count, count), nan), np.full(count, nan), (), trouble)


MapFamily = Callable[["FloatArray", float], MapValue]
"""Map with a parameter: a callable of the state, shape (n,), and the parameter that returns `MapValue`."""


class Node(Declared):
    """Fixed point on a curve, with the tangent of the curve and the value of the map."""

    state: FloatArray = part("state u, shape (n,)")
    parameter: float = part("parameter p")
    tangent: FloatArray = part("direction of the curve in scaled variables, of length 1, shape (n + 1,)")
    arc: float = part("arc length from the start of the curve in scaled variables, negative before the start")
    value: MapValue = part("map at the point")
    residual: float = part("largest scaled component of G(u, p) - u")

    @property
    def multipliers(self) -> npt.NDArray[np.complex128]:
        """Multipliers of the fixed point, largest absolute value first.

        The multipliers are the eigenvalues of the monodromy matrix if the map provides this matrix, else of
        the derivative of the map.
        """
        value = self.value
        matrix = value.jacobian if value.monodromy is None else value.monodromy
        values = np.linalg.eigvals(matrix).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(np.abs(self.multipliers).max() < 1.0)


class Corrector:
    """Corrector of points onto the curve of fixed points of a map, by Newton's method.

    The components of the state, and last the parameter, are divided by the scales, shape (n + 1,); a point is
    on the curve if its scaled correction is below the precision.
    """

    def __init__(self, family: MapFamily, scales: npt.ArrayLike, precision: float) -> None:
        self.family = family
        self.scales = np.asarray(scales, dtype=np.float64)
        self.count = len(self.scales) - 1
        self.precision = precision
        self.trouble = ""
        if not (np.isfinite(self.scales).all() and (self.scales > 0.0).all()):
            raise InputError.of(
                "scales", self.scales.tolist(), "positive numbers", written=str(self.scales.tolist())
            )

    def scaled(self, state: npt.ArrayLike, parameter: float) -> FloatArray:
        """Divide a state and a parameter by the scales; return the scaled point z, shape (n + 1,)."""
        return np.append(np.asarray(state, dtype=np.float64), parameter) / self.scales

    def point(self, node: Node) -> FloatArray:
        """Return the scaled state and parameter of a node, shape (n + 1,)."""
        return self.scaled(node.state, node.parameter)

    def derivative(self, value: MapValue) -> FloatArray:
        """Compute the scaled derivative of the residual G(u, p) - u of the map G, shape (n, n + 1)."""
        rows = np.column_stack([value.jacobian - np.eye(self.count), value.slope])
        return np.asarray(rows * self.scales / self.scales[: self.count, np.newaxis])

    def correct(self, z: FloatArray, row: FloatArray, *, arc: float = 0.0) -> Node | None:
        """Find the fixed point near a scaled point z, in the plane through z normal to `row`.

        The tangent of the resulting node points along `row`; `arc` becomes the arc length of the node. None
        if no fixed point is found; the attribute `trouble` then contains the reason if the map has no value.
        """
        level, z = float(row @ z), z.copy()
        last = math.inf
        self.trouble = ""
        for _ in range(_MOST_CORRECTIONS):
            state, parameter = z[:-1] * self.scales[:-1], float(z[-1] * self.scales[-1])
            value = self.family(state, parameter)
            if value.trouble:
                self.trouble = value.trouble
                return None
            residual = (value.image - state) / self.scales[:-1]
            matrix = np.vstack([self.derivative(value), row])
            try:
                change = -np.linalg.solve(matrix, np.append(residual, row @ z - level))
            except np.linalg.LinAlgError:
                return None
            size = float(np.abs(change).max())
            settled = size <= self.precision or (size >= 0.5 * last and size <= _STAGNANT * self.precision)
            if settled:
                tangent = self._tangent(matrix)
                if tangent is None:
                    return None
                return Node(state, parameter, tangent, arc, value, float(np.abs(residual).max()))
            if not size < 1e3:
                return None
            z, last = z + change, size
        return None

    def at_parameter(self, z: FloatArray) -> Node | None:
        """Find the fixed point near a scaled point z, at the parameter of z; None if not found."""
        return self.correct(z, np.eye(self.count + 1)[-1])

    def onto(self, z: FloatArray) -> Node | None:
        """Find the fixed point near z, at the parameter of z if possible; None if Newton's method fails."""
        node = self.at_parameter(z)
        if node is not None:
            return node
        # At a fold no fixed point need exist at the parameter; the smallest correction is well defined.
        for _ in range(_MOST_CORRECTIONS):
            value = self.family(z[:-1] * self.scales[:-1], float(z[-1] * self.scales[-1]))
            if value.trouble:
                self.trouble = value.trouble
                return None
            matrix = self.derivative(value)
            _, singular, rows = np.linalg.svd(matrix)
            if singular[-1] > 0.0:
                node = self.correct(z, rows[-1])
                if node is not None:
                    return node
            residual = (value.image - z[:-1] * self.scales[:-1]) / self.scales[:-1]
            z = z - np.linalg.pinv(matrix) @ residual
        return None

    def _tangent(self, matrix: FloatArray) -> FloatArray | None:
        try:
            tangent = np.linalg.solve(matrix, np.eye(self.count + 1)[-1])
        except np.linalg.LinAlgError:
            return None
        length = float(np.linalg.norm(tangent))
        return np.asarray(tangent / length) if math.isfinite(length) and length > 0.0 else None


def between(follower: Corrector, here: Node, ahead: Node, share: float) -> Node | None:
    """Find the node of a curve at the fraction `share` of the step from `here` to `ahead`; None if not found.

    The fraction is measured along the tangent at `here`. The initial guess lies on the cubic Hermite curve
    through both nodes.
    """
    begin, end = follower.point(here), follower.point(ahead)
    chord = float(np.linalg.norm(end - begin))
    h = share
    z = (
        (1.0 + 2.0 * h) * (1.0 - h) ** 2 * begin
        + h * (1.0 - h) ** 2 * chord * here.tangent
        + h * h * (3.0 - 2.0 * h) * end
        - h * h * (1.0 - h) * chord * ahead.tangent
    )
    level = float(here.tangent @ begin) + share * float(here.tangent @ (end - begin))
    z = z + (level - float(here.tangent @ z)) * here.tangent
    return follower.correct(z, here.tangent, arc=here.arc + share * (ahead.arc - here.arc))


def on_chord(begin: Node, end: Node, share: float, arc: float) -> Node:
    """Interpolate state and parameter linearly at the fraction `share` of the chord between two nodes.

    The new node has the arc length `arc`; its other fields are copied from `begin`.
    """
    state = begin.state + share * (end.state - begin.state)
    return replace(
        begin, state=state, parameter=begin.parameter + share * (end.parameter - begin.parameter), arc=arc
    )
