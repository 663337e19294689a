"""Stable and unstable manifolds of saddles of the strobe map, as curves in the plane of states.

The unstable manifold of a saddle is the set of states whose backward orbits converge to the saddle. The
stable manifold is the set of states whose forward orbits converge to the saddle; it bounds basins. At the
saddle, each manifold is tangent to an eigenvector of the monodromy matrix. The unstable manifold is grown
from a fundamental segment on that eigenvector, whose images under the map are the whole curve; where two
images lie too far apart or the curve bends too much, a point of the segment between them is added (D. Hobson,
J. Comput. Phys. 104 (1993) 14). The map has no inverse through the paper's pack or a contact at rest, so the
stable manifold is continued instead: each further point is the state whose image is a point of the known
curve, found by Newton's method with the tangent flow (J. P. England, B. Krauskopf and H. M. Osinga, SIAM J.
Appl. Dyn. Syst. 3 (2004) 161).

Lengths are in half-widths of the strobe window. Limitation: a curve ends where the map is not differentiable
or the state is invalid, as behind a rigid backstop; its continuation beyond is not computed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.orbits.newton import CLOSED, ExactMaps
from printhammer.chaos.orbits.orbit import SADDLE, Orbit, multipliers_of
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.results import Column, Result, column, part
from printhammer.run.effort import DEFAULT, AtFixedTolerance, Effort, computation
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray, IntArray

KINDS: Final = ("stable", "unstable")
LENGTH: Final = 10.0
"""Default arc length of each manifold curve, in half-widths of the strobe window; arbitrary."""
POINTS: Final = 4000
"""Default maximum number of points of each manifold curve; arbitrary."""
SPACING: Final = 0.02
"""Default target distance between neighbouring points, in half-widths of the strobe window; arbitrary."""
BEND: Final = 0.2
"""Angle between neighbouring segments, rad, above which a point is inserted; arbitrary."""

_NEAR: Final = 1e-5
"""Distance from the saddle, in half-widths, within which a manifold is treated as straight; arbitrary."""
_FINEST: Final = 1e-3
"""Distance of points, as a fraction of the spacing, below which no point is inserted at a bend; arbitrary."""
_TIGHT: Final = 1e-12  # Arbitrary
"""Smallest step along a fundamental segment; a gap of the images at this step is a jump of the map."""
_SETTLED: Final = 0.1  # Arbitrary
"""Extent of an image of a fundamental segment, relative to the spacing, below which a sink is sought."""
_CLOSE: Final = 1e-10  # Relative residual at which Newton's method has converged; arbitrary
_NEWTON: Final = 8  # Iteration limit of Newton's method; arbitrary
_FEW: Final = 4  # Number of points from which the prediction is a cubic, since a cubic has four coefficients


class Manifolds(Result, rows="point"):
    """Stable and unstable manifolds of a saddle: curves to either side of each state of the saddle orbit.

    A jump of the strobe map, where a contact happens at the section, is represented by a row of NaN.
    """

    orbit: Orbit = part("the saddle")
    x: FloatArray = column("m", "displacement", "point")
    v: FloatArray = column("m/s", "velocity", "point")
    curve: IntArray = column("1", "number of the curve, from 0 on", "point", dtype=np.int32)
    length: FloatArray = column(
        "1", "arc length along the curve from the saddle, in half-widths of the window", "point"
    )
    kinds: IntArray = column("1", "kind of the curve", "curves", dtype=np.int32, codes=KINDS, name="kind")
    ends: tuple[str, ...] = part(
        'reason for the end of each curve: "length"; "points"; "sink": it reaches a stable orbit; "no'
        ' preimage": Newton\'s method finds no preimage; "no value": every run fails'
    )
    spacing: float = part("target distance of neighbouring points")

    @property
    def title(self) -> str:
        """Title of the manifolds, with the name of the saddle and of the hammer."""
        return f"manifolds of the {self.orbit.name} of {self.orbit.regime.hammer.name}"

    def points(self, number: int) -> FloatArray:
        """Return the points of curve `number`: displacements [m] and velocities [m/s], shape (n, 2)."""
        rows = self.curve == number
        return np.column_stack([self.x[rows], self.v[rows]])

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: states along `point`; kind and reason for the end of each curve."""
        own = super().entries()
        ends = np.array(self.ends, "U16")
        own["end"] = Column("", "reason for the end of the curve", ("curves",), name="end"), ends
        return own


@computation
def manifolds(
    orbit: Orbit,
    *,
    length: float = LENGTH,
    points: SupportsIndex = POINTS,
    spacing: float = SPACING,
    kinds: tuple[str, ...] = KINDS,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[AtFixedTolerance],
) -> Manifolds:
    """Compute the stable and unstable manifolds of a saddle, at the phase of its section.

    Parameters
    ----------
    orbit : Orbit
        A saddle, from `printhammer.orbits`.
    length : float, optional
        Arc length of each curve, in half-widths of the strobe window.
    points : int, optional
        Maximum number of points of each curve.
    spacing : float, optional
        Target distance between neighbouring points, in half-widths of the strobe window.
    kinds : tuple of str, optional
        "stable", "unstable", or both.

    Returns
    -------
    Manifolds
        Manifolds with 2 n curves of each kind for an orbit of n firings.

    Raises
    ------
    InputError
        The orbit is not a saddle with known multipliers, or an argument is not as described above.
    """
    if not orbit.ok or orbit.kind != SADDLE:
        raise InputError(
            f"the orbit is a {orbit.name}", key="orbit", expected="a saddle, which has both manifolds"
        )
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown or not kinds:
        raise InputError.of("kinds", kinds, f"some of {', '.join(KINDS)}")
    limits = _Limits(
        read_positive(length, "1", "length"),
        read_count(points, "points"),
        read_positive(spacing, "1", "spacing"),
    )
    own = Scaled(orbit.regime, orbit.tolerance)
    states = [own.inward(orbit.section)]
    for _ in range(orbit.firings - 1):
        states.append(own.image(states[-1], 1)[0])
    tasks = list(product(kinds, states, (1.0, -1.0)))
    grow = {"stable": _stable, "unstable": _unstable}
    made = effort.mapped(
        lambda i: grow[tasks[i][0]](own, tasks[i][1], tasks[i][2], orbit.firings, limits), range(len(tasks))
    )
    curves = [own.outward(curve.points) for curve in made]
    return Manifolds(
        orbit=orbit,
        x=np.concatenate([curve[:, 0] for curve in curves]),
        v=np.concatenate([curve[:, 1] for curve in curves]),
        curve=np.repeat(np.arange(len(curves)), [len(curve) for curve in curves]),
        length=np.concatenate([_along(curve.points) for curve in made]),
        kinds=np.array([KINDS.index(kind) for kind, _, _ in tasks]),
        ends=tuple(curve.end for curve in made),
        spacing=limits.spacing,
    )


@dataclass(frozen=True)
class _Limits:
    length: float
    points: int
    spacing: float


@dataclass
class _Curve:
    """Manifold curve: its points, from the saddle outward, and the reason for its end."""

    points: FloatArray
    end: str


class Scaled:
    """Strobe map and its derivative, with states in half-widths of the strobe window."""

    def __init__(self, regime: Regime, tolerance: float) -> None:
        self.maps, self.scales = ExactMaps(regime, Effort(tolerance, threads=1)), regime.window.half_widths

    def inward(self, states: FloatArray) -> FloatArray:
        """Convert states, m and m/s, to half-widths of the strobe window."""
        return np.asarray(states / self.scales)

    def outward(self, points: FloatArray) -> FloatArray:
        """Convert states in half-widths of the strobe window to m and m/s."""
        return np.asarray(points * self.scales)

    def image(self, point: FloatArray, firings: int) -> tuple[FloatArray, FloatArray]:
        """Compute the image of a scaled state, and the derivative of the map there; NaN if the run fails."""
        images = self.maps(self.outward(point)[np.newaxis], np.array([firings]))
        if images.reasons[0] != CLOSED:
            return np.full(2, np.nan), np.full((2, 2), np.nan)
        jacobian = images.jacobians[0] / self.scales[:, np.newaxis] * self.scales
        return self.inward(images.states[0]), jacobian


def _direction(own: Scaled, saddle: FloatArray, firings: int, stable: bool) -> tuple[FloatArray, float, int]:
    """Return the stable or unstable eigenvector at a saddle, and the factor by which a step scales it.

    A step is one period of the saddle orbit, or two if the multiplier is negative, since images then
    alternate between the two sides of the saddle. The third result is the number of firings per step.
    """
    _, jacobian = own.image(saddle, firings)
    # The smaller eigenvalue would be lost in the rounding of the trace.
    large, small = (float(value.real) for value in multipliers_of(jacobian[np.newaxis]))
    multiplier = small if stable else large
    first = jacobian - multiplier * np.eye(2)
    row = first[int(np.argmax(np.abs(first).sum(axis=1)))]
    vector = np.array([-row[1], row[0]])
    turns = 1 if multiplier > 0.0 else 2
    return vector / np.hypot(*vector), abs(multiplier) ** turns, turns * firings


def _unstable(own: Scaled, saddle: FloatArray, side: float, firings: int, limits: _Limits) -> _Curve:
    """Grow one side of an unstable manifold as the images of a fundamental segment; return the curve.

    `side` is 1 or -1, the direction along the eigenvector.
    """
    vector, growth, firings = _direction(own, saddle, firings, stable=False)
    start = _NEAR / growth

    def on_segment(share: float, level: int) -> FloatArray:
        point = saddle + side * start * growth**share * vector
        for _ in range(level):
            if not np.isfinite(point).all():
                break
            point = own.image(point, firings)[0]
        return np.asarray(point)

    points, total, level = [saddle], 0.0, 0
    shares = [0.0, 1.0]
    row = [on_segment(share, 0) for share in shares]
    extent = math.inf
    while True:
        level += 1
        row = [own.image(point, firings)[0] if np.isfinite(point).all() else point for point in row]
        k = 0
        while k + 1 < len(row):
            gap, close = _has_gap(row, k, limits.spacing), shares[k + 1] - shares[k] <= _TIGHT
            if gap and not close and len(points) + len(row) < 2 * limits.points:
                shares.insert(k + 1, 0.5 * (shares[k] + shares[k + 1]))
                row.insert(k + 1, on_segment(shares[k + 1], level))
                continue
            k += 1
            if close and gap:
                points.append(np.full(2, np.nan))
            elif np.isfinite(row[k]).all() and np.isfinite(points[-1]).all():
                total += float(np.hypot(*(row[k] - points[-1])))
            points.append(row[k])
            if total >= limits.length:
                return _Curve(np.array(points), "length")
            if len(points) >= limits.points:
                return _Curve(np.array(points), "points")
        if not np.isfinite(row).any():
            return _Curve(np.array(points), "no value")
        before, extent = extent, float(np.ptp(row, axis=0).max())
        if extent < min(before, _SETTLED * limits.spacing):
            sink = _sink(own, row[-1], firings, limits.spacing)
            if sink is not None:
                return _Curve(np.array([*points, sink]), "sink")


def _sink(own: Scaled, point: FloatArray, firings: int, spacing: float) -> FloatArray | None:
    """Find the stable fixed point within the distance `spacing` of a point, by Newton's method; else None."""
    guess = point
    for _ in range(_NEWTON):
        image, jacobian = own.image(guess, firings)
        if not np.isfinite(jacobian).all() or np.linalg.det(jacobian - np.eye(2)) == 0.0:
            return None
        move = np.linalg.solve(jacobian - np.eye(2), image - guess)
        guess = guess - move
        if not float(np.hypot(*(guess - point))) <= spacing:
            return None
        if float(np.hypot(*move)) <= _CLOSE * max(1.0, float(np.hypot(*guess))):
            return guess if np.abs(np.linalg.eigvals(jacobian)).max() < 1.0 else None
    return None


def _has_gap(row: list[FloatArray], k: int, spacing: float) -> bool:
    """Whether a point has to be inserted after point k of a row of points.

    A point is needed in a gap wider than `spacing`, at a sharp bend, or before the end of the curve.
    """
    here, there = row[k], row[k + 1]
    step = float(np.hypot(*(there - here)))
    if not math.isfinite(step):
        # Between a finite and a non-finite point, insert points to approach the end of the curve.
        return bool(np.isfinite(here).any() != np.isfinite(there).any())
    if step > spacing:
        return True
    if k == 0 or step < _FINEST * spacing:
        return False
    before = here - row[k - 1]
    return bool(np.isfinite(before).all() and _angle(before, there - here) > BEND)


def _stable(own: Scaled, saddle: FloatArray, side: float, firings: int, limits: _Limits) -> _Curve:
    """Continue one side of a stable manifold: each new point is the preimage of a point of the known curve.

    `side` is 1 or -1, the direction along the eigenvector.
    """
    vector, shrink, firings = _direction(own, saddle, firings, stable=True)
    made = _Inward(saddle, side * _NEAR * vector, shrink)
    place, step, total = 1.0, 0.05, 0.0
    end = "length"
    while total < limits.length:
        if len(made.points) >= limits.points:
            end = "points"
            break
        if step <= _TIGHT:
            end = "no preimage"
            break
        last, wanted = made.points[-1], made.at(place + step - 1.0)
        # The prediction extrapolates the curve, which is straight at first.
        ahead = made.at(place + step) if len(made.points) >= _FEW else made.ahead(step)
        move = ahead - last
        # A run from a state far from the curve may take unboundedly long.
        near = float(np.hypot(*move)) <= 2.0 * limits.spacing
        solved = _preimage(own, wanted, last + move, firings, limits.spacing) if near else None
        if solved is None:
            step *= 0.5
            continue
        point = solved
        way = float(np.hypot(*(point - last)))
        turn = _angle(last - made.points[-2], point - last) if len(made.points) > 1 else 0.0
        if way > limits.spacing or (turn > BEND and way > _FINEST * limits.spacing):
            step *= 0.5
            continue
        place += step
        total += way
        made.points.append(point)
        made.places.append(place)
        if way < 0.5 * limits.spacing and turn < 0.5 * BEND:
            step *= 1.5
    return _Curve(np.array([saddle, *made.points]), end)


@dataclass
class _Inward:
    """Known part of a stable manifold, from the saddle outward, with a parameter along the curve.

    The parameter of the preimage of a point is larger by 1 than that of the point. Up to the parameter 1 the
    curve is treated as straight.
    """

    saddle: FloatArray
    reach: FloatArray
    """Vector from the saddle to the point with parameter 1."""
    shrink: float
    points: list[FloatArray] = field(default_factory=list)
    places: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.points.append(self.saddle + self.reach)
        self.places.append(1.0)

    def ahead(self, step: float) -> FloatArray:
        """Extrapolate the curve by a parameter step beyond its end, along the line from the saddle."""
        return np.asarray(self.saddle + (self.points[-1] - self.saddle) * self.shrink**-step)

    def at(self, place: float) -> FloatArray:
        """Return the point of the curve at the parameter value `place`.

        Up to 1 the curve is straight. Beyond 1 a cubic interpolates the offset from the saddle, divided by
        its growth under the linearised map.
        """
        if place <= 1.0:
            return np.asarray(self.saddle + self.shrink ** (1.0 - place) * self.reach)
        right = int(np.searchsorted(self.places, place))
        first = min(max(right - 2, 0), max(len(self.places) - 4, 0))
        near = slice(first, first + 4)
        t, rows = np.array(self.places[near]), np.array(self.points[near])
        weights = [
            math.prod((place - t[j]) / (t[i] - t[j]) for j in range(len(t)) if j != i) for i in range(len(t))
        ]
        away = (rows - self.saddle) * self.shrink ** (t - place)[:, np.newaxis]
        return np.asarray(self.saddle + np.array(weights) @ away)


def _preimage(
    own: Scaled, wanted: FloatArray, guess: FloatArray, firings: int, spacing: float
) -> FloatArray | None:
    """Find the preimage of the point `wanted` near `guess` by Newton's method; None if not found."""
    point = guess
    for _ in range(_NEWTON):
        image, jacobian = own.image(point, firings)
        if not np.isfinite(jacobian).all() or np.linalg.det(jacobian) == 0.0:
            return None
        miss = image - wanted
        move = np.linalg.solve(jacobian, miss)
        point = point - move
        if not float(np.hypot(*move)) <= 2.0 * spacing:
            return None
        if float(np.hypot(*miss)) <= _CLOSE * max(1.0, float(np.hypot(*wanted))):
            return point
    return None


def _angle(one: FloatArray, other: FloatArray) -> float:
    """Compute the angle [rad] between two vectors of the plane."""
    across = one[0] * other[1] - one[1] * other[0]
    return abs(math.atan2(across, float(one @ other)))


def _along(points: FloatArray) -> FloatArray:
    """Compute the arc length from the first point of a curve to each point; jumps add no length."""
    steps = np.nan_to_num(np.hypot(*np.diff(points, axis=0).T))
    return np.concatenate([[0.0], np.cumsum(steps)])
