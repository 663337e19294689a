"""Crossings of two curves of fixed points: location, kind, and continuation of the crossing curve.

At a crossing the corrector's matrix A = [dG/du - I, dG/dp] has a null space of two dimensions. With the
left null vector l of A and the second derivative B of G, the tangents of the two curves are the directions z
in this space for which the equation of the crossing, l B(z, z) = 0, holds (W. J. F. Govaerts, *Numerical
Methods for Bifurcations of Dynamical Equilibria*, SIAM 2000; H. B. Keller, in P. H. Rabinowitz (ed.),
*Applications of Bifurcation Theory*, Academic Press 1977, 359).

Where one of the two curves turns back in the parameter, the crossing is a pitchfork; otherwise it is
transcritical.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.arclength import Curve, Steps, Watch, follow
from printhammer.chaos.continuation.fixed_points import Corrector, MapFamily, Node, between, on_chord
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray

Crossing = Literal["pitchfork", "transcritical", "branching"]
"""Kind of a crossing; "branching" if the second derivatives leave the kind undecided."""
CROSSINGS: Final[tuple[Crossing, ...]] = get_args(Crossing)

_ROUNDS: Final = 60  # Iteration limit of the bracketing of a crossing; arbitrary
_BRACKET: Final = 1e-5  # Arbitrary
"""Smallest bracket of a crossing, as a fraction of a step, since Newton's method fails at the crossing."""
_DIFFERENCE: Final = 1e-3
"""Scaled step of the second differences; tuned: 1e-4 to 1e-2 give the same kinds in the tests."""
_FLAT: Final = 1e-6  # Arbitrary
"""Relative mixed second derivative below which the tangent of the crossing curve is undetermined."""
_UPRIGHT: Final = 0.01
"""Largest component along the parameter of the tangent of a curve that turns back; arbitrary."""
_AMPLITUDE: Final = 1e-2
"""First scaled distance from a crossing at which to seek the crossing curve; arbitrary."""
_LEAST_AMPLITUDE: Final = 1e-5  # Smallest scaled distance from a crossing to try; arbitrary
_CLOSER: Final = 4.0
"""Factor by which the distance from a crossing shrinks after a failed search for its curve; arbitrary."""
_OVER: Final = 1.7  # Arbitrary; not 1, since a point at the crossing itself may lead to either curve
"""First step along the crossing curve, as a multiple of the distance of its first point from the crossing."""
_ASIDE: Final = 0.5  # Arbitrary
"""Largest distance of a point on the crossing curve from the predicted point, relative to the step."""


def locate_crossing(
    follower: Corrector, here: Node, ahead: Node, test: Callable[[Node], float]
) -> tuple[float, Node | None]:
    """Locate a crossing, the zero of a test function, between two nodes of a curve.

    Since Newton's method fails at the crossing itself, the crossing is bracketed ever more closely, and its
    position is interpolated. Returns the position as a fraction of the step from `here` to `ahead`, and the
    interpolated node; the node is None if no closer bracket was found.
    """
    low, high, one, other = 0.0, 1.0, here, ahead
    for _ in range(_ROUNDS):
        share = low + (high - low) * test(one) / (test(one) - test(other))
        off = 0.1 * (high - low)
        if off < _BRACKET:
            break
        before = between(follower, here, ahead, max(share - off, low))
        beyond = between(follower, here, ahead, min(share + off, high))
        if before is None or beyond is None or test(before) * test(beyond) >= 0.0:
            break
        low, high, one, other = max(share - off, low), min(share + off, high), before, beyond
    if one is here:
        return share, None
    return share, on_chord(one, other, (share - low) / (high - low), one.arc)


def crossing_tangents(follower: Corrector, node: Node) -> tuple[FloatArray, FloatArray] | None:
    """Compute the scaled tangents of the two curves at a crossing, each of shape (n + 1,).

    Returns
    -------
    tuple or None
        Tangent of the curve that was followed, and of the crossing curve; None if the second derivatives
        leave the tangents undetermined.
    """
    z = follower.point(node)
    value = follower.family(node.state, node.parameter)
    if value.trouble:
        return None
    left, _, right = np.linalg.svd(follower.derivative(value))
    null, plane = left[:, -1], right[-2:]

    def residual(s: float, r: float) -> float:
        at = (z + s * plane[0] + r * plane[1]) * follower.scales
        there = follower.family(at[:-1], float(at[-1]))
        return np.nan if there.trouble else float(null @ ((there.image - at[:-1]) / follower.scales[:-1]))

    h, here = _DIFFERENCE, residual(0.0, 0.0)
    mixed = (residual(h, h) - residual(h, -h) - residual(-h, h) + residual(-h, -h)) / (4.0 * h**2)
    form = np.array(
        [
            [(residual(h, 0.0) - 2.0 * here + residual(-h, 0.0)) / h**2, mixed],
            [mixed, (residual(0.0, h) - 2.0 * here + residual(0.0, -h)) / h**2],
        ]
    )
    if not np.isfinite(form).all():
        return None
    # The quadratic form vanishes along two directions if its eigenvalues differ in sign.
    (low, high), axes = np.linalg.eigh(form)
    if not (low < 0.0 < high) or np.sqrt(-low * high) <= _FLAT * max(1.0, -low, high):
        return None
    rows = [(axes @ np.array([np.sqrt(high), sign * np.sqrt(-low)])) @ plane for sign in (1.0, -1.0)]
    units = [row / np.linalg.norm(row) for row in rows]
    # The node's own tangent is that of a chord, inexact so close to the crossing.
    followed, other = sorted(units, key=lambda unit: -abs(float(unit @ node.tangent)))
    return followed, other


def crossing_kind(follower: Corrector, node: Node) -> Crossing:
    """Classify a crossing by the tangents of its two curves as pitchfork or transcritical.

    The kind is "branching" if the tangents are undetermined.
    """
    tangents = crossing_tangents(follower, node)
    if tangents is None:
        return "branching"
    upright = min(abs(float(tangent[-1])) for tangent in tangents) < _UPRIGHT
    return "pitchfork" if upright else "transcritical"


def follow_crossing(
    family: MapFamily,
    node: Node,
    *,
    scales: npt.ArrayLike,
    bounds: tuple[float, float],
    steps: Steps,
    watch: Watch | None = None,
) -> Curve:
    """Follow, in both directions, the curve that crosses a known curve at one of its nodes.

    The first point of the crossing curve is sought at a scaled distance along its tangent; if no fixed point
    is found, the distance is reduced. For the other arguments see `follow`.

    Raises
    ------
    InputError
        The direction of the crossing curve is undetermined, or no fixed point lies in this direction.
    """
    corrector = Corrector(family, scales, steps.precision)
    begin, tangents = corrector.point(node), crossing_tangents(corrector, node)
    row = None if tangents is None else tangents[1]
    amplitude = _AMPLITUDE
    while row is not None and amplitude >= _LEAST_AMPLITUDE:
        first = corrector.correct(begin + amplitude * row, row)
        if first is not None:
            aside = float(np.linalg.norm(corrector.point(first) - begin - amplitude * row))
            if aside <= _ASIDE * amplitude:
                return follow(
                    family,
                    first.state,
                    first.parameter,
                    scales=scales,
                    bounds=bounds,
                    steps=replace(steps, first=min(steps.first, _OVER * amplitude)),
                    row=row,
                    watch=watch,
                )
        amplitude /= _CLOSER
    raise InputError(f"no other branch is found at the parameter {node.parameter:.9g}", key="parameter")
