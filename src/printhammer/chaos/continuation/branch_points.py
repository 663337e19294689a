"""Special points of a curve of fixed points: folds, period doublings, tori, crossings, contact changes.

Each kind has a test function that changes sign at the point (W. J. F. Govaerts, *Numerical Methods for
Bifurcations of Dynamical Equilibria*, SIAM 2000; Yu. A. Kuznetsov, *Elements of Applied Bifurcation Theory*,
Springer 2004, section 10.2). With J = dG/du, its eigenvalues mu_i, the Floquet multipliers, and the tangent t
of the curve:

| kind | test function |
|---|---|
| fold | component of t along the parameter |
| period doubling | det(J + I): a multiplier is -1 |
| Neimark-Sacker | product over pairs of mu_i mu_j - 1: a complex pair crosses the unit circle |
| crossing | determinant of the corrector's matrix, the tangent its last row: pitchfork or transcritical |
| change | none; the label of the motion, its sequence of contacts, differs |

A product mu_i mu_j = 1 of two real multipliers, a neutral saddle, is not a bifurcation and is omitted. Two
sign changes within one step are not detected.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.arclength import Curve, Steps, Stop, Watch, follow
from printhammer.chaos.continuation.crossings import CROSSINGS, Crossing, crossing_kind, locate_crossing
from printhammer.chaos.continuation.fixed_points import (
    Corrector,
    MapFamily,
    MapValue,
    Node,
    between,
    on_chord,
)
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray

Kind = Literal["fold", "period doubling", "Neimark-Sacker", Crossing, "change", "section"]

BIRTH: Final = "period doubling"
"""Reason for stopping where a branch of even period ends in the period doubling that creates it."""

_ROUNDS: Final = 60  # Iteration limit of bisections and root searches; arbitrary
_SHARE: Final = 1e-13
"""Accuracy to which a special point is located, as a fraction of a continuation step; arbitrary."""
_REAL: Final = 1e-9  # Imaginary part up to which a multiplier counts as real; arbitrary
_ROUNDING: Final = 1e-8
"""Magnitude of a test function below which its sign change is rounding noise; arbitrary."""
_SHARE_OF_CHANGE: Final = 1e-10
"""Final bracket of a change of the contact sequence, as a fraction of a continuation step; arbitrary."""
_SMALL_MARGIN: Final = 0.05
"""Grazing margin below which the search for a contact change interpolates instead of bisecting; arbitrary."""
_CLOSE_MARGIN: Final = 1e-7
"""Grazing margin below which the interpolation of a contact change ends; arbitrary."""
_NEAR: Final = 1e-4
"""Distance, as a fraction of a step, within which a fold and a crossing are the same point; arbitrary."""
_AMPLITUDE: Final = 1e-2
"""First scaled distance from a period doubling at which to seek the doubled orbit; arbitrary."""
_LEAST_AMPLITUDE: Final = 1e-6  # Smallest scaled distance from a period doubling to try; arbitrary
_CLOSER: Final = 4.0  # Arbitrary
"""Factor by which the distance from a period doubling shrinks after a failed search for the doubled orbit."""
_ASIDE: Final = 0.5
"""Largest offset of a doubled orbit from the critical direction, relative to its distance; arbitrary."""
_NEW_MULTIPLIER: Final = 0.3
"""Largest distance between 1 and the nearest multiplier of an orbit near its birth by doubling; arbitrary."""
_HALF_NEAR: Final = 0.05  # Arbitrary
"""Scaled distance below which an orbit coincides with an orbit of half its period, as at a doubling."""
_HALF_DOUBLES: Final = 0.5
"""Largest distance of a multiplier from -1 at which a nearby period doubling is searched for; arbitrary."""


class BranchPoint(Declared):
    """Special point of a curve of fixed points: a bifurcation or a change of the contact sequence."""

    kind: Kind = part(
        '"fold", "period doubling", "Neimark-Sacker", "pitchfork", "transcritical", "branching", "change" or'
        ' "section"'
    )
    node: Node = part("fixed point at the special point")
    after: int = part("index of the node of the curve before the point")
    labels: tuple[Hashable, Hashable] = part("labels of the motion before and after the point")
    sharp: bool = part(
        "whether the point was located to the precision of the curve",
        more="otherwise it is only bracketed by two nodes",
        default=True,
    )
    sides: tuple[Node, Node] | None = part("fixed points close to a change, on both sides", default=None)

    @property
    def parameter(self) -> float:
        """Value of the parameter at the special point."""
        return self.node.parameter


def doubling_test(jacobian: FloatArray) -> float:
    """Compute the test function det(J + I) of a period doubling, zero where a multiplier is -1."""
    return float(np.linalg.det(jacobian + np.eye(len(jacobian))))


def torus_test(jacobian: FloatArray) -> float:
    """Compute the Neimark-Sacker test function, the product of mu_i mu_j - 1 over pairs of multipliers."""
    multipliers = np.linalg.eigvals(jacobian).astype(np.complex128)
    i, j = np.triu_indices(len(multipliers), 1)
    return float(np.prod(multipliers[i] * multipliers[j] - 1.0).real)


def fold_test(jacobian: FloatArray) -> float:
    """Compute the test function det(J - I) of a fold, zero where a multiplier is 1."""
    return float(np.linalg.det(jacobian - np.eye(len(jacobian))))


def points_of(
    family: MapFamily,
    curve: Curve,
    scales: npt.ArrayLike,
    precision: float,
    margin: Callable[[Node], float] | None = None,
) -> list[BranchPoint]:
    """Locate the special points along a curve of fixed points, in order.

    Parameters
    ----------
    family : callable
        The map with a parameter.
    curve : Curve
        Curve of fixed points, from `printhammer.chaos.continuation.arclength.follow`.
    scales, precision
        Scales and precision with which the curve was followed.
    margin : callable, optional
        Function of a node that passes through 0 where the label of the motion changes. The changes are then
        located by interpolation of this function, without evaluating the map very close to a change.

    Returns
    -------
    list of BranchPoint
        Special points, ordered along the curve.
    """
    follower = Corrector(family, scales, precision)

    def crossing_test(node: Node) -> float:
        return float(np.linalg.det(np.vstack([follower.derivative(node.value), node.tangent])))

    tests: dict[Kind, Callable[[Node], float]] = {
        "fold": lambda node: float(node.tangent[-1]),
        "period doubling": lambda node: doubling_test(node.value.jacobian),
        "Neimark-Sacker": lambda node: torus_test(node.value.jacobian),
        "branching": crossing_test,
    }
    every: list[BranchPoint] = []
    # A branch that begins at a period doubling turns back in the parameter there without a fold.
    places = (0, len(curve.nodes) - 2)
    births = [place for place, stop in zip(places, curve.stops, strict=True) if stop.reason == BIRTH]
    for after, (here, ahead) in enumerate(itertools.pairwise(curve.nodes)):
        kinds = [kind for kind, test in tests.items() if _has_sign_change(test(here), test(ahead))]
        if after in births:
            kinds = [kind for kind in kinds if kind not in ("fold", "branching")]
        points = []
        for kind in kinds:
            locate = locate_crossing if kind == "branching" else zero_between
            share, node = locate(follower, here, ahead, tests[kind])
            if kind == "Neimark-Sacker" and not _has_pair(node if node is not None else here):
                continue
            chord = on_chord(here, ahead, share, here.arc + share * (ahead.arc - here.arc))
            labels, sharp = (here.value.label, ahead.value.label), node is not None
            named = crossing_kind(follower, node) if kind == "branching" and node is not None else kind
            points.append((share, kind, BranchPoint(named, node or chord, after, labels, sharp)))
        points += _changes(follower, here, ahead, after, margin)
        every += [point for *_, point in sorted(points, key=lambda entry: entry[0])]
    return _without_folds_at_crossings(every, curve)


def _without_folds_at_crossings(points: list[BranchPoint], curve: Curve) -> list[BranchPoint]:
    """Remove folds that coincide with crossings: a curve that turns back at a pitchfork has no fold there."""
    crossings = [point for point in points if point.kind in CROSSINGS]

    def is_at(point: BranchPoint, crossing: BranchPoint) -> bool:
        if not point.sharp and point.after == crossing.after:
            # Newton's method fails at the crossing, so that the fold cannot be located.
            return True
        step = curve.nodes[point.after + 1].arc - curve.nodes[point.after].arc
        return abs(point.node.arc - crossing.node.arc) < _NEAR * step

    return [
        point
        for point in points
        if point.kind != "fold" or not any(is_at(point, crossing) for crossing in crossings)
    ]


def _has_sign_change(before: float, after: float) -> bool:
    """Whether a test function changes sign by more than rounding noise.

    For area-preserving maps, a test function may be zero up to rounding along the whole curve.
    """
    return before * after < 0.0 and max(abs(before), abs(after)) > _ROUNDING


def _has_pair(node: Node) -> bool:
    """Whether a node has a complex pair of multipliers within 1e-3 of the unit circle."""
    pair = np.abs(node.multipliers.imag) > _REAL
    return bool((pair & (np.abs(np.abs(node.multipliers) - 1.0) < 1e-3)).any())


def zero_between(
    follower: Corrector, here: Node, ahead: Node, test: Callable[[Node], float]
) -> tuple[float, Node | None]:
    """Find the zero of a test function between two nodes of a curve.

    Returns the position of the zero, as a fraction of the step from `here` to `ahead`, and the node there.
    The method alternates bisection and the Illinois variant of regula falsi. The node is None if Newton's
    method finds no fixed point at a trial fraction.
    """
    low, high = 0.0, 1.0
    at_low, at_high = test(here), test(ahead)
    share, node = at_low / (at_low - at_high), None
    best: tuple[float, Node | None] = (math.inf, None)
    for turn in range(_ROUNDS):
        if high - low <= _SHARE:
            break
        middle = turn % 3 == 2
        share = 0.5 * (low + high) if middle else low + (high - low) * at_low / (at_low - at_high)
        if not low < share < high:
            break
        node = between(follower, here, ahead, share)
        if node is None:
            return share, None
        value = test(node)
        if abs(value) < best[0]:
            best = (abs(value), node)
            place = share
        if value == 0.0:
            break
        if (value > 0.0) == (at_low > 0.0):
            low, at_low = share, value
            at_high *= 0.5
        else:
            high, at_high = share, value
            at_low *= 0.5
    return (share, None) if best[1] is None else (place, best[1])


def _changes(
    follower: Corrector, here: Node, ahead: Node, after: int, margin: Callable[[Node], float] | None
) -> list[tuple[float, Kind, BranchPoint]]:
    """Locate the contact changes between the successive nodes `here` and `ahead` of a curve.

    `after` is the index of `here`. Returns one tuple per change: position as a fraction of the step from
    `here` to `ahead`, kind of the special point, and special point.
    """
    changes: list[tuple[float, Kind, BranchPoint]] = []
    begin, first = 0.0, here
    while first.value.label != ahead.value.label and len(changes) < _ROUNDS:
        share, sides, sharp = _change(follower, here, ahead, (begin, first), margin)
        before, beyond = sides
        if sharp and beyond.arc > before.arc:
            place = here.arc + share * (ahead.arc - here.arc)
            part = min(max((place - before.arc) / (beyond.arc - before.arc), 0.0), 1.0)
            middle = on_chord(before, beyond, part, place)
        else:
            state = 0.5 * (before.state + beyond.state)
            middle = replace(before, state=state, parameter=0.5 * (before.parameter + beyond.parameter))
        labels = (first.value.label, beyond.value.label)
        changes.append((share, "change", BranchPoint("change", middle, after, labels, sharp, sides)))
        begin, first = (beyond.arc - here.arc) / (ahead.arc - here.arc), beyond
    return changes


def _change(
    follower: Corrector,
    here: Node,
    ahead: Node,
    start: tuple[float, Node],
    margin: Callable[[Node], float] | None,
) -> tuple[float, tuple[Node, Node], bool]:
    """Locate the first contact change in the step from `here` to `ahead`, beyond a start in this step.

    `start` is a position, as a fraction of the step, and the node there. Returns the position of the change,
    the nodes that bracket it, and whether it was located; otherwise the bracket is wide.
    """
    low, inside = start
    high, beyond = 1.0, ahead
    m_low = m_high = math.nan
    if margin is not None:
        m_low, m_high = margin(inside), margin(beyond)
    weights = [1.0, 1.0]
    for turn in range(_ROUNDS):
        crossing = m_low * m_high < 0.0 and max(abs(m_low), abs(m_high)) < _SMALL_MARGIN
        if high - low <= (_SHARE_OF_CHANGE if not crossing else _SHARE):
            break
        if crossing and min(abs(m_low), abs(m_high)) < _CLOSE_MARGIN:
            break
        by_margin = crossing and turn % 3 != 2
        a, b = m_low * weights[0], m_high * weights[1]
        share = low + (high - low) * a / (a - b) if by_margin else 0.5 * (low + high)
        node = between(follower, here, ahead, share)
        if node is None:
            return 0.5 * (low + high), (inside, beyond), False
        if node.value.label == inside.value.label:
            low, inside = share, node
            m_low = margin(node) if margin is not None else math.nan
            weights = [1.0, 0.5 * weights[1]]
        else:
            high, beyond = share, node
            m_high = margin(node) if margin is not None else math.nan
            weights = [0.5 * weights[0], 1.0]
    share = 0.5 * (low + high)
    if m_low * m_high < 0.0:
        share = low + (high - low) * m_low / (m_low - m_high)
    return share, (inside, beyond), True


def follow_doubled(
    doubled: MapFamily,
    point: BranchPoint,
    *,
    scales: npt.ArrayLike,
    bounds: tuple[float, float],
    steps: Steps,
    amplitude: float = _AMPLITUDE,
    watch: Watch | None = None,
) -> Curve:
    """Follow the orbits of twice the period that are born at a period doubling.

    The first orbit is sought at a scaled distance `amplitude` from the doubling `point`, in the direction of
    the eigenvector whose multiplier is -1; its parameter is also an unknown, and may lie on either side of
    the doubling. The orbit is accepted if, to first order, it lies in that direction, with the parameter and
    the multipliers of the doubling. Otherwise the search is repeated closer to the doubling. `doubled` is the
    map applied twice; for the other arguments see `follow`. Raises InputError if no such orbit is found.
    """
    widths = np.asarray(scales, dtype=np.float64)
    jacobian = point.node.value.jacobian
    within = jacobian * widths[:-1] / widths[:-1, np.newaxis]
    # The last right singular vector of J + I is the eigenvector of the multiplier -1.
    direction = np.linalg.svd(within + np.eye(len(within)))[2][-1]
    row = np.append(direction, 0.0)
    corrector = Corrector(doubled, widths, steps.precision)
    begin = corrector.point(point.node)
    while amplitude >= _LEAST_AMPLITUDE:
        first = corrector.correct(begin + amplitude * row, row)
        if first is not None and _is_born(corrector.point(first) - begin, row, amplitude, first):
            break
        amplitude /= _CLOSER
    else:
        raise InputError(
            f"no orbit of twice the period is near the parameter {point.parameter:.9g}", key="parameter"
        )
    return follow(
        doubled,
        first.state,
        first.parameter,
        scales=widths,
        bounds=bounds,
        steps=replace(
            steps, first=min(steps.first, amplitude), smallest=min(steps.smallest, 1e-3 * amplitude)
        ),
        directions="up",
        row=row,
        watch=watch,
    )


def _is_born(way: FloatArray, row: FloatArray, amplitude: float, node: Node) -> bool:
    """Whether a converged orbit lies, to first order, in the critical direction of a period doubling.

    `way` is the scaled vector from the doubling to the orbit, `row` the critical direction. The orbit must
    also have a multiplier close to 1.
    """
    aside = float(np.linalg.norm(way - amplitude * row))
    return aside <= _ASIDE * amplitude and float(np.abs(node.multipliers - 1.0).min()) <= _NEW_MULTIPLIER


def birth_of(half: Corrector, here: Node, ahead: Node) -> Stop | None:
    """Locate the period doubling at which a branch of even orbit period ends, as a `Stop`; None if not found.

    At the doubling, states half a period apart coincide, and the curve retraces the same orbits half a period
    later. `half` corrects points onto the curve of orbits of half the period; `here` and `ahead` are
    successive nodes of the curve of the whole period. The node of the returned stop is the doubling on the
    curve of half the period.
    """
    if here.tangent[-1] * ahead.tangent[-1] >= 0.0:
        return None
    share = here.tangent[-1] / (here.tangent[-1] - ahead.tangent[-1])
    start, end = half.point(here), half.point(ahead)
    z = (1.0 - share) * start + share * end
    single = half.at_parameter(z)
    if single is None or float(np.linalg.norm(half.point(single) - z)) > _HALF_NEAR:
        return None
    if np.abs(single.multipliers + 1.0).min() > _HALF_DOUBLES:
        return None
    node = doubling_near(half, single)
    if node is None:
        return None
    value, twice = node.value, node.value.jacobian @ node.value.jacobian
    slope = value.jacobian @ value.slope + value.slope
    whole = MapValue(value.image, twice, slope, here.value.label, extra=value.extra)
    arc = here.arc + float(np.linalg.norm(half.point(node) - start))
    last = replace(node, value=whole, tangent=here.tangent, arc=arc)
    sentence = f"the orbit ends at the parameter {node.parameter:.9g}, in the period doubling that creates it"
    return Stop(BIRTH, node.parameter, node.state, sentence, last)


def doubling_near(follower: Corrector, node: Node) -> Node | None:
    """Locate the period doubling near a node, on its curve, by the secant method; None if not found."""
    step = 1e-3
    z = follower.point(node)
    before, value = node, doubling_test(node.value.jacobian)
    offset, at_before = 0.0, value
    place = step
    for _ in range(_ROUNDS):
        here = follower.correct(z + place * node.tangent, node.tangent)
        if here is None:
            return None
        value = doubling_test(here.value.jacobian)
        if value == at_before or abs(place - offset) < follower.precision:
            return here if abs(value) <= abs(at_before) else before
        ahead = place - value * (place - offset) / (value - at_before)
        before, offset, at_before, place = here, place, value, ahead
        if abs(place) > 1.0:
            return None
    return None
