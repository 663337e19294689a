"""Crossings of two curves of fixed points: location, kind, and continuation of the crossing curve.

At a crossing the corrector's matrix A = [dG/du - I, dG/dp] has a null space of two dimensions. One
direction in it is the tangent t of the curve that was followed; q is perpendicular to it. With the left null
vector l of A and the second derivative B of G, the tangent of the other curve is that combination of t and q
for which the equation of the crossing, l B(z, z) = 0, holds (W. J. F. Govaerts, *Numerical Methods for
Bifurcations of Dynamical Equilibria*, SIAM 2000; H. B. Keller, in P. H. Rabinowitz (ed.), *Applications of
Bifurcation Theory*, Academic Press 1977, 359).

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
"""Smallest bracket of a crossing, as a fraction of a step; Newton's method fails at the crossing itself."""
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
"""Ratio of successive scaled distances from a crossing at which the crossing curve is sought; arbitrary."""
_ASIDE: Final = 0.5  # Arbitrary
"""Largest distance from the predicted point, relative to the step, of a point on the crossing curve."""


def locate_crossing(
    follower: Corrector, here: Node, ahead: Node, test: Callable[[Node], float]
) -> tuple[float, Node | None]:
    """Locate a crossing between two nodes; return the fraction of the step, and the node or None.

    Since Newton's method fails at the crossing itself, the crossing is bracketed ever closer and
    interpolated.
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


def crossing_direction(follower: Corrector, node: Node) -> FloatArray | None:
    """Compute the scaled tangent of the crossing curve at a crossing, shape (n + 1,); None if unknown."""
    z = follower.point(node)
    value = follower.family(node.state, node.parameter)
    if value.trouble:
        return None
    left, _, right = np.linalg.svd(follower.derivative(value))
    null = left[:, -1]
    plane = right[-2:]
    along = plane.T @ (plane @ node.tangent)
    along /= np.linalg.norm(along)
    aside = plane[0] - (plane[0] @ along) * along
    if np.linalg.norm(aside) < _ASIDE:
        aside = plane[1] - (plane[1] @ along) * along
    aside /= np.linalg.norm(aside)

    def residual(s: float, r: float) -> float:
        at = (z + s * along + r * aside) * follower.scales
        there = follower.family(at[:-1], float(at[-1]))
        return np.nan if there.trouble else float(null @ ((there.image - at[:-1]) / follower.scales[:-1]))

    h = _DIFFERENCE
    square = (residual(0.0, h) - 2.0 * residual(0.0, 0.0) + residual(0.0, -h)) / h**2
    mixed = (residual(h, h) - residual(h, -h) - residual(-h, h) + residual(-h, -h)) / (4.0 * h**2)
    if not (np.isfinite(square) and np.isfinite(mixed)) or abs(mixed) <= _FLAT * max(1.0, abs(square)):
        return None
    direction = aside - square / (2.0 * mixed) * along
    return np.asarray(direction / np.linalg.norm(direction))


def crossing_kind(follower: Corrector, node: Node) -> Crossing:
    """Classify a crossing by the tangents of its two curves: pitchfork, transcritical or branching."""
    other = crossing_direction(follower, node)
    if other is None:
        return "branching"
    upright = min(abs(float(node.tangent[-1])), abs(float(other[-1]))) < _UPRIGHT
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

    The first point of the other curve is sought at a scaled distance along the tangent of the other curve; if
    no fixed point is found, the distance is reduced. The other arguments are those of `follow`.

    Raises
    ------
    InputError
        The direction of the crossing curve is undetermined, or no fixed point lies along it.
    """
    corrector = Corrector(family, scales, steps.precision)
    begin, row = corrector.point(node), crossing_direction(corrector, node)
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
                    steps=replace(steps, first=min(steps.first, amplitude)),
                    row=row,
                    watch=watch,
                )
        amplitude /= _CLOSER
    raise InputError(f"no other branch is found at the parameter {node.parameter:.9g}", key="parameter")
