"""Curves of fixed points of a map with a parameter, by pseudo-arclength continuation.

A fixed point G(u, p) = u of a map of the plane, or of any number of variables, lies on a curve in the space
of state and parameter z = (u, p). The curve is followed by predictor and corrector: a step ds along the
tangent, then Newton's method on

    G(u, p) - u = 0,   t . z = t . z_0 + ds

with the tangent t at the previous point z_0 (H. B. Keller, in P. H. Rabinowitz (ed.), *Applications of
Bifurcation Theory*, Academic Press 1977, 359; E. L. Allgower and K. Georg, *Introduction to Numerical
Continuation Methods*, SIAM 2003). The system is regular at folds, where the parameter turns back. Lengths are
measured in scaled variables, u and p each divided by its scale.

Bifurcations on the curve, such as folds and period doublings, are located by
`printhammer.chaos.continuation.branch_points`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.fixed_points import Corrector, MapFamily, Node
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray

_GROWTH: Final = 1.5  # Factor by which the step grows after an accepted step; arbitrary
_LEAST_COSINE: Final = 0.97  # Arbitrary
"""Smallest cosine of the angle between successive tangents, below which the step is halved and repeated."""
_FARTHEST: Final = 0.4  # Arbitrary
"""Distance between predicted and corrected point, relative to the step, above which a step is rejected."""
_LEAP: Final = 1.0  # Arbitrary
"""Change of a multiplier in one step, relative to 1 + |multiplier|, above which the step is halved."""
_SAME: Final = 1e-6
"""Scaled distance below which two points of a curve are identical; arbitrary."""


class Stop(Declared):
    """End of a curve of fixed points, with the reason for stopping."""

    reason: str = part(
        '"bound"; "closed"; "no value": the map has no value beyond; "lost": Newton\'s method does not'
        ' converge beyond; "jump": it converges to another curve; "length": maximum number of steps; "not'
        " asked\": not followed; or the reason of the caller's watch"
    )
    parameter: float = part("parameter at the end")
    state: FloatArray = part("state at the end")
    sentence: str = part("reason as a sentence")
    node: Node | None = part(
        "last node of the curve, if the caller's watch stops between two nodes",
        default=None,
        repr=False,
    )


class Curve(Declared):
    """Curve of fixed points of a map with a parameter, with the reasons for stopping at both ends."""

    nodes: list[Node] = part("fixed points in order along the curve; `arc` increases")
    stops: tuple[Stop, Stop] = part("reasons for stopping before the first and after the last point")

    @property
    def closed(self) -> bool:
        """Whether the curve returns to its start, so that its first and last nodes are the same point."""
        return self.stops[1].reason == "closed"


class Steps(Declared):
    """Step sizes and maximum number of steps along a curve, in scaled variables."""

    first: float = part("scaled length of the first step", default=0.02)
    smallest: float = part("smallest scaled step length", default=1e-7)
    largest: float = part("largest scaled step length", default=0.1)
    most: int = part("maximum number of steps in each direction", default=1000)
    precision: float = part(
        "scaled correction of Newton's method below which a point is on the curve", default=1e-11
    )

    def __post_init__(self) -> None:
        if not 0.0 < self.smallest <= self.first <= self.largest < math.inf:
            raise InputError(
                f"steps of {self.smallest:g}, {self.first:g} and {self.largest:g}",
                key="steps",
                expected="the smallest, the first and the largest, ascending",
            )
        if self.most < 1:
            raise InputError.of("most", self.most, "a number of steps from 1 on", written=str(self.most))


Watch = Callable[[Node, Node], Stop | None]
"""Callback for each pair of successive nodes; a returned `Stop` ends the curve between the two nodes."""


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
    """Follow the curve of fixed points near a given state by pseudo-arclength continuation.

    Parameters
    ----------
    family : callable
        The map with a parameter.
    state : array, shape (n,)
        State near a fixed point.
    parameter : float
        Parameter of the first point, held fixed while this point is corrected.
    scales : array, shape (n + 1,)
        Scales that divide the components of the state and, last, the parameter.
    bounds : tuple of float
        Smallest and largest parameter, at which the curve ends.
    steps : Steps, optional
        Step sizes and maximum number of steps.
    directions : str, optional
        Direction from the first point: "up", initially toward larger parameters, "down", or "both".
    row : array, shape (n + 1,), optional
        Scaled direction in which the curve leaves the first point upward, if known, as for a branch born at a
        bifurcation. The correction of the first point then fixes the component along `row` instead of the
        parameter.
    watch : callable, optional
        Function called with every pair of successive nodes, in the direction of travel; it ends the curve
        between the two nodes by returning a `Stop`.

    Returns
    -------
    Curve
        The curve: its nodes, from the end of the downward direction to the end of the upward direction, and
        the reason for stopping at either end.

    Raises
    ------
    InputError
        The parameter is out of bounds, or there is no fixed point near the first point.
    """
    chosen = Steps() if steps is None else steps
    low, high = (float(bound) for bound in bounds)
    if not (math.isfinite(low) and math.isfinite(high) and low <= parameter <= high and low < high):
        raise InputError.of(
            "parameter", parameter, f"one within the bounds {low:g} to {high:g}", written=f"{parameter:g}"
        )
    follower = Corrector(family, scales, chosen.precision)
    z = follower.scaled(state, parameter)
    leaving = None if row is None else np.asarray(row, dtype=np.float64)
    start = follower.onto(z) if leaving is None else follower.correct(z, leaving)
    if start is None:
        why = f": {follower.trouble}" if follower.trouble else ""
        raise InputError(
            f"there is no fixed point near the parameter {parameter:.9g}{why}",
            key="parameter",
            value=parameter,
        )
    upward = start.tangent if leaving is not None or start.tangent[-1] >= 0.0 else -start.tangent
    halves: list[tuple[list[Node], Stop]] = []
    for sign in (-1.0, 1.0):
        if directions != "both" and (directions == "up") != (sign > 0.0):
            sentence = f"the curve was not followed beyond the parameter {start.parameter:.9g}"
            halves.append(([], Stop("not asked", start.parameter, start.state, sentence)))
            continue
        begin = replace(start, tangent=sign * upward)
        nodes, stop = _half(follower, begin, (low, high), chosen, watch)
        halves.append((nodes, stop))
        if stop.reason == "closed":
            if sign < 0.0:
                # Traced in the other direction, a closed curve is the same curve with its nodes reversed.
                whole = _reversed([begin, *nodes])
                return Curve(whole, (stop, stop))
            return Curve([begin, *nodes], (stop, stop))
    (before, first), (after, last) = halves
    return Curve([*_reversed(before), replace(start, tangent=upward), *after], (first, last))


def _reversed(nodes: list[Node]) -> list[Node]:
    return [replace(node, tangent=-node.tangent, arc=-node.arc) for node in reversed(nodes)]


def _half(
    follower: Corrector, start: Node, bounds: tuple[float, float], steps: Steps, watch: Watch | None
) -> tuple[list[Node], Stop]:
    """Follow a curve from its start node along its tangent; return the later nodes and the `Stop`."""
    nodes: list[Node] = []
    here, length = start, steps.first
    home = follower.point(start)
    outside = _beyond(start, bounds)
    if outside is not None:
        return nodes, _bound_stop(start, outside)
    while len(nodes) < steps.most:
        z = follower.point(here)
        ahead = follower.correct(z + length * here.tangent, here.tangent, arc=here.arc + length)
        trouble, reached = follower.trouble, None
        jumped = ahead is not None and not _is_joined(follower, here, ahead, length)
        if jumped:
            ahead = None
        if ahead is not None:
            ahead = replace(ahead, arc=here.arc + float(np.linalg.norm(follower.point(ahead) - z)))
            reached = _beyond_between(here, ahead, bounds)
        if ahead is not None and reached is not None:
            ahead = _at_parameter(follower, here, ahead, reached)
        if ahead is None:
            length *= 0.5
            if length < steps.smallest:
                return nodes, _lost(here, trouble, jumped=jumped)
            continue
        if reached is None and len(nodes) > 2 and _is_passed(follower, here, ahead, home, start):
            nodes.append(replace(start, arc=here.arc + float(np.linalg.norm(home - z))))
            sentence = f"the curve closes upon itself at the parameter {start.parameter:.9g}"
            return nodes, Stop("closed", start.parameter, start.state, sentence)
        stop = watch(here, ahead) if watch is not None else None
        if stop is not None and stop.node is here and 0.5 * length >= steps.smallest:
            # The curve ends somewhere within the last step: approach the end with half the step.
            length *= 0.5
            continue
        if stop is None and reached is not None:
            stop = _bound_stop(ahead, reached)
        last = ahead if stop is None or stop.node is None else stop.node
        if last is not here:
            nodes.append(last)
        if stop is not None:
            return nodes, stop
        if float(here.tangent @ ahead.tangent) > 0.5 * (1.0 + _LEAST_COSINE):
            length = min(length * _GROWTH, steps.largest)
        here = ahead
    sentence = f"the limit of {steps.most} steps is reached at the parameter {here.parameter:.9g}"
    return nodes, Stop("length", here.parameter, here.state, sentence)


def _is_joined(follower: Corrector, here: Node, ahead: Node, length: float) -> bool:
    """Whether the corrected node `ahead` continues the curve: near its prediction, and similar to `here`.

    The prediction lies a step of `length` along the tangent at `here`. The nodes are similar if the angle
    between their tangents is small and no multiplier jumps.
    """
    predicted = follower.point(here) + length * here.tangent
    near = float(np.linalg.norm(follower.point(ahead) - predicted)) <= _FARTHEST * length
    return near and float(here.tangent @ ahead.tangent) >= _LEAST_COSINE and not _has_leap(here, ahead)


def _has_leap(here: Node, ahead: Node) -> bool:
    """Whether a multiplier jumps between two nodes whose sequences of contacts are equal."""
    if here.value.label != ahead.value.label:
        return False
    before, after = here.multipliers, ahead.multipliers
    most = _LEAP * (1.0 + np.minimum(np.abs(before), np.abs(after)))
    return bool((np.abs(after - before) > most).any() and (np.abs(after[::-1] - before) > most).any())


def _lost(node: Node, trouble: str, *, jumped: bool = False) -> Stop:
    at = f"the parameter {node.parameter:.9g}"
    reason, sentence = "lost", f"the curve was lost at {at}: Newton's method does not converge beyond"
    if jumped:
        reason, sentence = "jump", f"the curve was lost at {at}: Newton's method converges to another curve"
    if trouble:
        reason, sentence = "no value", f"the map has no value beyond {at}: {trouble}"
    return Stop(reason, node.parameter, node.state, sentence)


def _beyond(node: Node, bounds: tuple[float, float]) -> float | None:
    """Return the parameter bound that the curve reaches or crosses, outward, at a node; else None."""
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


def _at_parameter(follower: Corrector, here: Node, ahead: Node, parameter: float) -> Node | None:
    """Find the fixed point between two nodes at a given parameter; None if not found.

    The tangent of the new node points in the direction of travel, from `here` to `ahead`.
    """
    share = (parameter - here.parameter) / (ahead.parameter - here.parameter)
    begin = follower.point(here)
    z = begin + share * (follower.point(ahead) - begin)
    z[-1] = parameter / follower.scales[-1]
    node = follower.at_parameter(z)
    if node is None:
        return None
    tangent = node.tangent if node.tangent @ ahead.tangent > 0.0 else -node.tangent
    arc = here.arc + float(np.linalg.norm(follower.scaled(node.state, parameter) - begin))
    return replace(node, parameter=parameter, tangent=tangent, arc=arc)


def _is_passed(follower: Corrector, here: Node, ahead: Node, home: FloatArray, start: Node) -> bool:
    """Whether a closed curve passes through its start node between the nodes `here` and `ahead`.

    `home` is the scaled point of the start node.
    """
    begin = follower.point(here)
    along = follower.point(ahead) - begin
    share = float((home - begin) @ along) / float(along @ along)
    if not 0.0 < share <= 1.0 or float(start.tangent @ ahead.tangent) < 0.5:
        return False
    if float(np.linalg.norm(begin + share * along - home)) > _FARTHEST * float(np.linalg.norm(along)):
        return False
    level = float(start.tangent @ (home - begin - share * along))
    node = follower.correct(begin + share * along + level * start.tangent, start.tangent)
    return node is not None and float(np.linalg.norm(follower.point(node) - home)) < _SAME
