"""Curves of fixed points of a map with a parameter, by pseudo-arclength continuation.

A fixed point G(u, p) = u of a map of the plane, or of any number of variables, lies on a curve in the space
of state and parameter z = (u, p). The curve is followed by predictor and corrector: a step ds along the
tangent, then Newton's method on

    G(u, p) - u = 0,   t . z = t . z_0 + ds

with the tangent t at z_0 as last row (H. B. Keller, in P. H. Rabinowitz (ed.), *Applications of Bifurcation
Theory*, Academic Press 1977, 359; E. L. Allgower and K. Georg, *Introduction to Numerical Continuation
Methods*, SIAM 2003). The system is regular at folds, where the parameter turns back. Lengths are measured in
scaled variables, u and p each divided by a scale of its own.

What happens on the way, folds, period doublings and the like, is the business of
`printhammer.chaos.branch_points`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Hashable

    import numpy.typing as npt

    from printhammer.segments import FloatArray

_MOST_CORRECTIONS: Final = 12
_FEW_CORRECTIONS: Final = 4
_GROWTH: Final = 1.5
_LEAST_COSINE: Final = 0.97
"""Of the angle between successive tangents, below which a step is taken again with half its length."""
_FARTHEST: Final = 0.4
"""Distance of a corrected point from its prediction, in steps, beyond which it may lie on another curve."""
_STAGNANT: Final = 1e3
"""Corrections that no longer shrink are noise of the map if they are below this many precisions."""
_SAME: Final = 1e-6
"""Scaled distance below which two points are one."""


@dataclass(frozen=True)
class MapValue:
    """A map with a parameter, evaluated at one point.

    Attributes
    ----------
    image : array, shape (n,)
        G(u, p).
    jacobian : array, shape (n, n)
        dG/du.
    slope : array, shape (n,)
        dG/dp.
    label : hashable
        What kind of motion led there, such as its sequence of contacts; where it changes along a curve, that
        is an event.
    trouble : str
        Why the map has no value there; empty where it has one.
    extra : object
        Whatever else the map wants to keep of this evaluation.
    """

    image: FloatArray
    jacobian: FloatArray
    slope: FloatArray
    label: Hashable = ()
    trouble: str = ""
    extra: Any = field(default=None, repr=False)

    @classmethod
    def none(cls, count: int, trouble: str) -> MapValue:
        """Return what stands for a value that does not exist."""
        nan = math.nan
        return cls(np.full(count, nan), np.full((count, count), nan), np.full(count, nan), (), trouble)


MapFamily = Callable[["FloatArray", float], MapValue]
"""A map with a parameter: state, shape (n,), and parameter in, `MapValue` out."""


@dataclass(frozen=True)
class Node:
    """A fixed point on a curve.

    Attributes
    ----------
    state : array, shape (n,)
        u.
    parameter : float
        p.
    tangent : array, shape (n + 1,)
        Direction of the curve in scaled variables, of length 1.
    arc : float
        Length of the curve from its start in scaled variables, negative before it.
    value : MapValue
        The map there.
    residual : float
        Largest scaled component of G(u, p) - u.
    """

    state: FloatArray
    parameter: float
    tangent: FloatArray
    arc: float
    value: MapValue
    residual: float

    @property
    def multipliers(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues of dG/du, largest absolute value first."""
        found = np.linalg.eigvals(self.value.jacobian).astype(np.complex128)
        return found[np.argsort(-np.abs(found), kind="stable")]

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(np.abs(self.multipliers).max() < 1.0)


@dataclass(frozen=True)
class Stop:
    """Where a curve ends, and why.

    Attributes
    ----------
    reason : str
        "bound", "closed", "grazing", "no value", "lost", "length", "branch point" or what the caller's watch
        said.
    parameter : float
        Where.
    state : array
        Where.
    sentence : str
        The same in words.
    node : Node or None
        Where the caller's watch stops between two nodes: the last node of the curve.
    """

    reason: str
    parameter: float
    state: FloatArray
    sentence: str
    node: Node | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Curve:
    """A curve of fixed points.

    Attributes
    ----------
    nodes : list of Node
        In order along the curve; `arc` increases.
    stops : tuple of Stop
        What ended it before the first and after the last.
    """

    nodes: list[Node]
    stops: tuple[Stop, Stop]

    @property
    def closed(self) -> bool:
        """Whether the curve returns to its start; its first and last nodes are then the same point."""
        return self.stops[1].reason == "closed"


@dataclass(frozen=True)
class Steps:
    """How a curve is followed; lengths in scaled variables.

    Attributes
    ----------
    first, smallest, largest : float
        Lengths of the steps.
    most : int
        Number of steps in either direction.
    precision : float
        Scaled correction of Newton's method below which a point is on the curve.
    """

    first: float = 0.02
    smallest: float = 1e-7
    largest: float = 0.1
    most: int = 1000
    precision: float = 1e-11

    def __post_init__(self) -> None:
        if not 0.0 < self.smallest <= self.first <= self.largest < math.inf:
            raise InputError(
                f"steps of {self.smallest:g}, {self.first:g} and {self.largest:g},"
                " expected the smallest, the first and the largest, ascending"
            )
        if self.most < 1:
            raise InputError(f"most = {self.most}, expected a number of steps from 1 on")


class Follower:
    """Corrects points onto the curves of one map family.

    Parameters
    ----------
    family : callable
        The map.
    scales : array, shape (n + 1,)
        By which the components of the state, and last the parameter, are divided.
    precision : float
        Scaled correction below which a point is on a curve.
    """

    def __init__(self, family: MapFamily, scales: npt.ArrayLike, precision: float) -> None:
        self.family = family
        self.scales = np.asarray(scales, dtype=np.float64)
        self.count = len(self.scales) - 1
        self.precision = precision
        self.trouble = ""
        if not (np.isfinite(self.scales).all() and (self.scales > 0.0).all()):
            raise InputError(f"scales = {self.scales.tolist()}, expected positive numbers")

    def scaled(self, state: npt.ArrayLike, parameter: float) -> FloatArray:
        """Return a point in scaled variables."""
        return np.append(np.asarray(state, dtype=np.float64), parameter) / self.scales

    def derivative(self, value: MapValue) -> FloatArray:
        """Return the scaled derivative of G(u, p) - u, shape (n, n + 1)."""
        rows = np.column_stack([value.jacobian - np.eye(self.count), value.slope])
        return np.asarray(rows * self.scales / self.scales[: self.count, np.newaxis])

    def correct(self, z: FloatArray, row: FloatArray, *, arc: float = 0.0) -> Node | None:
        """Return the fixed point near z whose scaled product with `row` is that of z; None if not found.

        The tangent of the node points along `row`.
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

    def onto(self, z: FloatArray) -> Node | None:
        """Return the fixed point near z that Newton's method with least corrections finds; None if none."""
        row = np.zeros(self.count + 1)
        row[-1] = 1.0
        found = self.correct(z, row)
        if found is not None:
            return found
        # At a fold the parameter cannot be held; the smallest correction can be taken instead.
        for _ in range(_MOST_CORRECTIONS):
            value = self.family(z[:-1] * self.scales[:-1], float(z[-1] * self.scales[-1]))
            if value.trouble:
                self.trouble = value.trouble
                return None
            matrix = self.derivative(value)
            _, singular, rows = np.linalg.svd(matrix)
            if singular[-1] > 0.0:
                found = self.correct(z, rows[-1])
                if found is not None:
                    return found
            residual = (value.image - z[:-1] * self.scales[:-1]) / self.scales[:-1]
            z = z - np.linalg.pinv(matrix) @ residual
        return None

    def _tangent(self, matrix: FloatArray) -> FloatArray | None:
        unit = np.zeros(self.count + 1)
        unit[-1] = 1.0
        try:
            tangent = np.linalg.solve(matrix, unit)
        except np.linalg.LinAlgError:
            return None
        length = float(np.linalg.norm(tangent))
        return np.asarray(tangent / length) if math.isfinite(length) and length > 0.0 else None


Watch = Callable[[Node, Node], Stop | None]
"""Called with each node and the next; a `Stop` ends the curve there."""


def follow(
    family: MapFamily,
    state: npt.ArrayLike,
    parameter: float,
    *,
    scales: npt.ArrayLike,
    bounds: tuple[float, float],
    steps: Steps | None = None,
    directions: Literal["both", "up", "down"] = "both",
    row: npt.ArrayLike | None = None,
    watch: Watch | None = None,
) -> Curve:
    """Follow the curve of fixed points through a point.

    Parameters
    ----------
    family : callable
        The map.
    state : array, shape (n,)
        Near a fixed point.
    parameter : float
        Its parameter, which is kept for the first point.
    scales : array, shape (n + 1,)
        By which the components of the state, and last the parameter, are divided.
    bounds : tuple of float
        Least and largest parameter; the curve ends there.
    steps : Steps, optional
        Lengths and number of steps.
    directions : str, optional
        From the first point, "up", toward larger parameters at first, "down", or "both".
    row : array, shape (n + 1,), optional
        Scaled direction in which the curve leaves the first point upward, where that is known: that of a
        branch that begins there. The component of the first point along it is kept instead of the parameter.
    watch : callable, optional
        Called with each node and the next, in the direction of travel; may end the curve.

    Returns
    -------
    Curve
        From its lower to its upper end; both ends have a reason and a place.

    Raises
    ------
    InputError
        The parameter is out of bounds, or there is no fixed point near the first point.
    """
    chosen = Steps() if steps is None else steps
    low, high = (float(bound) for bound in bounds)
    if not (math.isfinite(low) and math.isfinite(high) and low <= parameter <= high and low < high):
        raise InputError(f"parameter = {parameter:g}, expected one within the bounds {low:g} to {high:g}")
    follower = Follower(family, scales, chosen.precision)
    z = follower.scaled(state, parameter)
    given = None if row is None else np.asarray(row, dtype=np.float64)
    start = follower.onto(z) if given is None else follower.correct(z, given)
    if start is None:
        why = f": {follower.trouble}" if follower.trouble else ""
        raise InputError(f"there is no fixed point near the parameter {parameter:.9g}{why}")
    upward = start.tangent if given is not None or start.tangent[-1] >= 0.0 else -start.tangent
    halves: list[tuple[list[Node], Stop]] = []
    for sign in (-1.0, 1.0):
        if directions != "both" and (directions == "up") != (sign > 0.0):
            told = f"the curve was not followed beyond the parameter {start.parameter:.9g}"
            halves.append(([], Stop("not asked", start.parameter, start.state, told)))
            continue
        begin = _turned(start, sign * upward)
        nodes, stop = _half(follower, begin, (low, high), chosen, watch)
        halves.append((nodes, stop))
        if stop.reason == "closed":
            if sign < 0.0:
                # The way back round is the same curve.
                whole = _reversed([begin, *nodes])
                return Curve(whole, (stop, stop))
            return Curve([begin, *nodes], (stop, stop))
    (before, first), (after, last) = halves
    middle = _turned(start, upward)
    return Curve([*_reversed(before), middle, *after], (first, last))


def _turned(node: Node, tangent: FloatArray, arc: float = 0.0) -> Node:
    return Node(node.state, node.parameter, tangent, arc, node.value, node.residual)


def _reversed(nodes: list[Node]) -> list[Node]:
    return [_turned(node, -node.tangent, -node.arc) for node in reversed(nodes)]


def _half(
    follower: Follower, start: Node, bounds: tuple[float, float], steps: Steps, watch: Watch | None
) -> tuple[list[Node], Stop]:
    """Follow a curve along the tangent of its start; nodes after it."""
    nodes: list[Node] = []
    here, length = start, steps.first
    home = follower.scaled(start.state, start.parameter)
    outside = _beyond(start, bounds)
    if outside is not None:
        return nodes, _bound_stop(start, outside)
    while len(nodes) < steps.most:
        z = follower.scaled(here.state, here.parameter)
        ahead = follower.correct(z + length * here.tangent, here.tangent, arc=here.arc + length)
        trouble = follower.trouble
        if ahead is None or not _joined(follower, here, ahead, length):
            length *= 0.5
            if length < steps.smallest:
                return nodes, _lost(here, trouble)
            continue
        moved = float(np.linalg.norm(follower.scaled(ahead.state, ahead.parameter) - z))
        ahead = _turned(ahead, ahead.tangent, here.arc + moved)
        reached = _beyond_between(here, ahead, bounds)
        if reached is not None:
            end = _at_parameter(follower, here, ahead, reached)
            if end is None:
                length *= 0.5
                if length < steps.smallest:
                    return nodes, _lost(here, trouble)
                continue
            stop = watch(here, end) if watch is not None else None
            nodes.append(end if stop is None or stop.node is None else stop.node)
            return nodes, stop or _bound_stop(end, reached)
        if len(nodes) > 2 and _passes(follower, here, ahead, home, start):
            end = _turned(start, start.tangent, here.arc + float(np.linalg.norm(home - z)))
            nodes.append(end)
            told = f"the curve closes upon itself at the parameter {start.parameter:.9g}"
            return nodes, Stop("closed", start.parameter, start.state, told)
        stop = watch(here, ahead) if watch is not None else None
        if stop is not None:
            nodes.append(ahead if stop.node is None else stop.node)
            return nodes, stop
        nodes.append(ahead)
        if float(here.tangent @ ahead.tangent) > 0.5 * (1.0 + _LEAST_COSINE):
            length = min(length * _GROWTH, steps.largest)
        here = ahead
    told = f"{steps.most} steps were taken, and the curve goes on at the parameter {here.parameter:.9g}"
    return nodes, Stop("length", here.parameter, here.state, told)


def _joined(follower: Follower, here: Node, ahead: Node, length: float) -> bool:
    """Return whether a corrected point lies on the same curve, as far as its distance and tangent tell."""
    z = follower.scaled(ahead.state, ahead.parameter)
    predicted = follower.scaled(here.state, here.parameter) + length * here.tangent
    near = float(np.linalg.norm(z - predicted)) <= _FARTHEST * length
    return near and float(here.tangent @ ahead.tangent) >= _LEAST_COSINE


def _lost(node: Node, trouble: str) -> Stop:
    if trouble:
        told = f"the map has no value beyond the parameter {node.parameter:.9g}: {trouble}"
        return Stop("no value", node.parameter, node.state, told)
    told = (
        f"the curve was lost at the parameter {node.parameter:.9g}: Newton's method does not converge beyond"
    )
    return Stop("lost", node.parameter, node.state, told)


def _beyond(node: Node, bounds: tuple[float, float]) -> float | None:
    """Return the bound on which a node lies if its tangent leads out."""
    if node.parameter <= bounds[0] and node.tangent[-1] < 0.0:
        return bounds[0]
    if node.parameter >= bounds[1] and node.tangent[-1] > 0.0:
        return bounds[1]
    return None


def _beyond_between(here: Node, ahead: Node, bounds: tuple[float, float]) -> float | None:
    if ahead.parameter < bounds[0] <= here.parameter:
        return bounds[0]
    if ahead.parameter > bounds[1] >= here.parameter:
        return bounds[1]
    return None


def _bound_stop(node: Node, bound: float) -> Stop:
    return Stop("bound", bound, node.state, f"the bound {bound:.9g} of the parameter is reached")


def _at_parameter(follower: Follower, here: Node, ahead: Node, parameter: float) -> Node | None:
    """Return the point between two nodes at a parameter, its tangent in the direction of travel."""
    share = (parameter - here.parameter) / (ahead.parameter - here.parameter)
    one, other = (follower.scaled(node.state, node.parameter) for node in (here, ahead))
    z = one + share * (other - one)
    z[-1] = parameter / follower.scales[-1]
    row = np.zeros(len(z))
    row[-1] = 1.0
    found = follower.correct(z, row)
    if found is None:
        return None
    tangent = found.tangent if found.tangent @ ahead.tangent > 0.0 else -found.tangent
    where = follower.scaled(found.state, parameter)
    where[-1] = z[-1]
    exact = Node(found.state, parameter, tangent, here.arc, found.value, found.residual)
    return _turned(exact, tangent, here.arc + float(np.linalg.norm(where - one)))


def _passes(follower: Follower, here: Node, ahead: Node, home: FloatArray, start: Node) -> bool:
    """Return whether the curve goes through its start between two nodes."""
    one, other = (follower.scaled(node.state, node.parameter) for node in (here, ahead))
    along = other - one
    share = float((home - one) @ along) / float(along @ along)
    if not 0.0 < share <= 1.0 or float(start.tangent @ ahead.tangent) < 0.5:
        return False
    if float(np.linalg.norm(one + share * along - home)) > _FARTHEST * float(np.linalg.norm(along)):
        return False
    level = float(start.tangent @ (home - one - share * along))
    found = follower.correct(one + share * along + level * start.tangent, start.tangent)
    if found is None:
        return False
    return float(np.linalg.norm(follower.scaled(found.state, found.parameter) - home)) < _SAME


def between(follower: Follower, here: Node, ahead: Node, share: float) -> Node | None:
    """Return the point of a curve at a share, 0 to 1, of the way between two nodes; None if not found.

    The way is measured along the tangent of the first; the guess is the cubic through both.
    """
    one, other = (follower.scaled(node.state, node.parameter) for node in (here, ahead))
    chord = float(np.linalg.norm(other - one))
    h = share
    z = (
        (1.0 + 2.0 * h) * (1.0 - h) ** 2 * one
        + h * (1.0 - h) ** 2 * chord * here.tangent
        + h * h * (3.0 - 2.0 * h) * other
        - h * h * (1.0 - h) * chord * ahead.tangent
    )
    level = float(here.tangent @ one) + share * float(here.tangent @ (other - one))
    z = z + (level - float(here.tangent @ z)) * here.tangent
    return follower.correct(z, here.tangent, arc=here.arc + share * (ahead.arc - here.arc))
