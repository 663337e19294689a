"""Flights between impacts on a surface, and the impacts of an orbit near a grazing.

At a touch the displacement is that of the surface; the remaining state variable is the velocity, 0 at a
grazing. With a rigid backstop, the strobe map has a square-root singularity at a grazing. If the surface is
removed from the model close to the touch, the motion is smooth on both sides of the grazing.

A branch is continued up to its grazing of a rigid backstop, where it ends. As the impact speed of an orbit
falls to zero, a multiplier grows as the inverse of the speed, and the steps along the branch shrink with the
square of the speed: with the state at a section as unknown, the grazing is never reached. In terms of phase
and speed of the impact, the branch is smooth up to and through the grazing. The last orbits of a branch are
therefore computed in these variables.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from printhammer.chaos.continuation.family import Passage, RegimeFamily, Surface, has_rigid_backstop
from printhammer.chaos.continuation.fixed_points import Node
from printhammer.chaos.strobe.map import state_later, turns
from printhammer.derivatives.states import follow
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.run.contacts import touches_of
from printhammer.run.problem import Problem
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

_CURRENT: Final = "with a voltage drive, the current at a touch belongs to the state"
_CLOSE: Final = 0.01  # Arbitrary
"""Time before and after an impact during which the surface is removed, as a fraction of the period."""
_STILL: Final = 1e-9
"""Relative speed at a section below which the section is a turning point of the orbit; arbitrary."""
_SPACING: Final = 1e-6  # Finite-difference step of Newton's method, in scaled variables; arbitrary
_ROUNDS: Final = 20  # Iteration limit of Newton's method; arbitrary
_PRECISION: Final = 1e-12  # Scaled correction below which Newton's method has converged; arbitrary
_STAGNANT: Final = 1e3  # Multiple of the precision below which stagnation counts as convergence; arbitrary
_SLOWER: Final = (0.98, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.02, 0.005)
"""Impact speeds, relative to the first, at which the last orbits before a grazing are computed; arbitrary."""


class Flight(Declared):
    """Motion between two impacts on a surface; close to both impacts the surface exerts no force."""

    end: FloatArray = part("displacement [m] and velocity [m/s] at the end, shape (2,)")
    jacobian: FloatArray = part("derivative with respect to the state at the start, shape (2, 2)")
    accelerations: tuple[float, float] = part("acceleration at the start and at the end, m/s^2")
    contacts: tuple[str, ...] = part("surfaces touched during the flight")
    surface: float = part("displacement of the surface, m")
    rebound: float = part("coefficient of restitution; NaN without a rigid backstop")
    trouble: str = part("reason why there is no flight; empty if there is a flight")


def fly(
    regime: Regime, surface: Surface, phase: float, speed: float, firings: int, tolerance: float
) -> Flight:
    """Compute the flight that leaves a surface at a given phase and speed [m/s], over `firings` periods."""
    hammer = regime.hammer
    place = hammer.front if surface == "pack" else hammer.position
    assert place is not None
    if regime.fired.quantity == "voltage":
        nothing = np.full(2, np.nan)
        return Flight(nothing, np.full((2, 2), np.nan), (math.nan, math.nan), (), place, math.nan, _CURRENT)
    train, _ = regime.train(firings + 1)
    begin, *_, end = (float(time) for time in regime.moments(train, firings, phase % 1.0))
    close = _CLOSE * regime.period
    state, jacobian, trouble = np.array([place, speed]), np.eye(2), ""
    contacts: list[str] = []
    rigid = surface == "backstop" and has_rigid_backstop(regime)

    first = Problem(hammer, train, (float(state[0]), float(state[1])), begin, tolerance)

    def problem(start: float, *, alone: bool) -> Problem:
        made = first.started((float(state[0]), float(state[1])), start)
        if alone:
            made.leave_out(surface)
        return made

    leaving = _acceleration(problem(begin, alone=True), close)
    # A motion inside a compliant surface needs the surface.
    outside = rigid or (leaving < 0.0) == (surface == "pack")
    cuts = [begin, begin + close, end - close, end] if outside else [begin, end]
    for number, (start, stop) in enumerate(itertools.pairwise(cuts)):
        alone = outside and number != 1
        if rigid and not alone and state[0] < place:
            trouble = "the armature does not leave the backstop after the touch"
            break
        made = problem(start, alone=alone)
        flow = follow(made, np.array([start, stop]), np.eye(3), renormalise=False)
        if flow.status_name != "ok":
            trouble = str(flow.status_name)
            break
        state, jacobian = flow.states[-1, :2].copy(), flow.columns[:2, :2] @ jacobian
        if not alone:
            contacts = [name for name, _ in touches_of(made.run(stop))]
    arriving = math.nan
    if not trouble:
        finite = np.isfinite(jacobian).all() and np.isfinite(state).all()
        trouble = "" if finite else "no derivative"
        arriving = _acceleration(problem(end, alone=True), close)
    restitution = float(regime.value("backstop.restitution")) if rigid else math.nan
    return Flight(state, jacobian, (leaving, arriving), tuple(contacts), place, restitution, trouble)


def _acceleration(problem: Problem, time: float) -> float:
    """Compute the acceleration of the armature [m/s^2] at the start of a problem.

    The forces are taken from a run of `time` seconds.
    """
    record = problem.run(problem.start + time)
    (row,) = problem.resample(record, np.array([problem.start]))
    push = row[2] if problem.drive.quantity == "force" else 0.0
    return float((push + row[3:9].sum()) / problem.hammer.mass)


class NearTouch(Declared):
    """Touch of a surface by an orbit, or turning point of an orbit near a surface."""

    surface: Surface = part('"pack" or "backstop"')
    phase: float = part("phase of the touch, as a fraction of the period")
    gap: float = part("distance from a grazing, in half-widths of the window")
    speed: float = part("speed after the impact on a rigid backstop, m/s; 0 for a turning point")


def near_touches(regime: Regime, state: FloatArray, firings: int, tolerance: float) -> list[NearTouch]:
    """List the turning points and rigid impacts of an orbit, in ascending order of distance from a grazing.

    `state` is the state of the orbit at the section, `firings` its period.
    """
    train, _ = regime.train(firings + 1)
    begin, *_, end = (float(time) for time in regime.moments(train, firings))
    hammer = regime.hammer
    problem = Problem(hammer, train, (float(state[0]), float(state[1])), begin, tolerance)
    record = problem.run(end)
    way, fast = regime.window.half_widths
    surfaces: list[tuple[Surface, float | None]] = [("pack", hammer.front), ("backstop", hammer.position)]
    known = [(name, place) for name, place in surfaces if place is not None]

    def phase(time: float) -> float:
        return (regime.phase + (time - begin) / regime.period) % 1.0

    touches = []
    # An orbit may turn, or leave a surface, at the section itself.
    for time, x in [*zip(*turns(problem, record)[:2], strict=True), *_still(state, begin, fast)]:
        name, gap = min(((name, abs(x - place) / way) for name, place in known), key=lambda pair: pair[1])
        touches.append(NearTouch(name, phase(float(time)), float(gap), 0.0))
    if has_rigid_backstop(regime):
        rows = [(float(row[1]), float(row[4])) for row in record.contacts if not row[6]]
        if state[0] == hammer.position and state[1] > 0.0:
            rows = [row for row in rows if row[0] < end - _CLOSE * regime.period]
            rows.append((begin, float(state[1])))
        touches += [NearTouch("backstop", phase(time), (v / fast) ** 2, v) for time, v in rows if v > 0.0]
    return sorted(touches, key=lambda touch: touch.gap)


def _still(state: FloatArray, begin: float, fast: float) -> list[tuple[float, float]]:
    return [(begin, float(state[0]))] if abs(state[1]) < _STILL * fast else []


def touch_at(
    regime: Regime,
    name: str,
    surface: Surface,
    guess: tuple[float, float],
    speed: float,
    firings: int,
    tolerance: float,
    width: float,
) -> tuple[float, float] | None:
    """Solve for the touch phase and the parameter of the orbit that leaves a surface at a given speed.

    Parameters
    ----------
    regime : Regime
        Regime with a value of the parameter near the solution.
    name : str
        Name of the parameter.
    surface : str
        "pack" or "backstop".
    guess : tuple of float
        Phase of the touch, as a fraction of the period, and value of the parameter, SI.
    speed : float
        Speed with which the orbit leaves a rigid backstop, m/s; 0 for a grazing.
    firings, tolerance
        Number of firings after which the orbit repeats, and tolerance of the integration.
    width : float
        Scale that divides changes of the parameter in Newton's method, SI.

    Returns
    -------
    tuple of float or None
        Phase of the touch and value of the parameter; None if Newton's method does not converge.
    """
    phase, own = guess
    scales = regime.window.half_widths

    def missed(z: FloatArray) -> FloatArray | None:
        try:
            moved = regime.with_(name, own + float(z[1]) * width)
        except InputError:
            return None
        flight = fly(moved, surface, phase + float(z[0]), speed, firings, tolerance)
        at = np.array([flight.surface, -speed / flight.rebound if speed else 0.0])
        return None if flight.trouble else (flight.end - at) / scales

    z, size = np.zeros(2), math.inf
    for _ in range(_ROUNDS):
        here, *beside = [missed(z + move) for move in (np.zeros(2), *(_SPACING * np.eye(2)))]
        if here is None or beside[0] is None or beside[1] is None:
            return None
        matrix = np.column_stack([(beside[0] - here) / _SPACING, (beside[1] - here) / _SPACING])
        try:
            change = -np.linalg.solve(matrix, here)
        except np.linalg.LinAlgError:
            return None
        last, size = size, float(np.abs(change).max())
        if size <= _PRECISION or (size >= 0.5 * last and size <= _STAGNANT * _PRECISION):
            return phase + float(z[0]), own + float(z[1]) * width
        if not size < 1.0:
            return None
        z = z + change
    return None


def fading(
    regime: Regime, name: str, touch: NearTouch, firings: int, tolerance: float, width: float
) -> list[tuple[float, float, float]] | None:
    """Follow the orbits of a branch, with decreasing speed of one impact, to the grazing of this impact.

    Returns a list of tuples: phase of the impact, its speed [m/s], and parameter value [SI]. The last entry
    is the grazing itself. The result is None if the impact speed does not reach zero nearby. In these
    variables the branch is smooth up to the grazing. In terms of the state at a section, the curvature of the
    branch diverges, since the derivative of the strobe map grows as the inverse of the speed. The arguments
    are as for `touch_at`.
    """
    way = [(touch.phase, touch.speed, float(regime.value(name)))]
    speeds = [touch.speed * share for share in _SLOWER] if touch.speed else []
    for speed in [*speeds, 0.0]:
        phase, _, value = way[-1]
        if len(way) > 1:
            (before, fast, at), (phase, slow, value) = way[-2:]
            share = (speed - slow) / (slow - fast)
            phase, value = phase + share * (phase - before), value + share * (value - at)
        solved = touch_at(regime, name, touch.surface, (phase, value), speed, firings, tolerance, width)
        if solved is None:
            return None
        if len(way) > 1 and abs(solved[1] - value) > 0.5 * abs(value - way[-1][2]) + _SPACING * width:
            return None
        way.append((solved[0], speed, solved[1]))
    return way


_GENTLE: Final = 1e-2  # Arbitrary
"""Largest distance of a touch from a grazing, in half-widths, for a branch to end in that grazing."""
_NEAR: Final = 1e-2  # Arbitrary
"""Largest distance from the last orbit to the grazing that ends its branch, in parameter scales."""
_STEEP: Final = 10.0  # Arbitrary
"""Multiplier above which an orbit is so close to its grazing that no bifurcation lies in between."""
_CLOSER: Final = 0.7
"""Ratio of impact speeds, present to last attempt, below which a grazing is sought again; arbitrary."""
_ON_CURVE: Final = 1e-5
"""Largest scaled closing error of an orbit that is appended to a branch before its grazing; arbitrary."""


def grazing_end(
    family: RegimeFamily, scales: FloatArray, node: Node, *, impacts: bool = False
) -> tuple[list[Node], float] | None:
    """Compute the last orbits of a branch before the grazing that ends it, and the parameter at the grazing.

    `node` is the last known orbit. If `impacts` is true, only its impacts on a rigid backstop are examined,
    not its turning points. The result is None if the orbit is not close to a grazing.
    """
    regime, width = family.regime.with_(family.name, node.parameter), float(scales[-1])
    every = near_touches(regime, node.state, family.firings, family.tolerance)
    near = [touch for touch in every if touch.gap < _GENTLE and (touch.speed > 0.0 or not impacts)]
    for touch in near[:1]:
        way = fading(regime, family.name, touch, family.firings, family.tolerance, width)
        if way is None:
            continue
        place = way[-1][2]
        if touch.speed > 0.0 and abs(node.multipliers[0]) > _STEEP:
            nodes = _orbits(family, scales, node, way[1:-1])
            if nodes is not None:
                return nodes, place
        if not impacts and abs(place - node.parameter) < _NEAR * width:
            return [], place
    return None


def _orbits(
    family: RegimeFamily,
    scales: FloatArray,
    node: Node,
    way: list[tuple[float, float, float]],
) -> list[Node] | None:
    """Convert orbits to nodes that extend a branch beyond its last node `node`; None if an orbit is invalid.

    `way` contains, for each orbit, the phase of its impact, the impact speed [m/s] and the parameter value.
    """
    nodes = [node]
    place = family.regime.hammer.position
    for phase, speed, value in way:
        regime = replace(family.regime.with_(family.name, value), phase=phase % 1.0)
        start = np.array([place, speed])
        state = state_later(regime, start, family.regime.phase, family.tolerance)
        image = family(state, value) if np.isfinite(state).all() else None
        if image is None or image.trouble or image.label != node.value.label:
            return None
        residual = float(np.abs((image.image - state) / scales[:-1]).max())
        last = nodes[-1]
        chord = np.append(state - last.state, value - last.parameter) / scales
        length = float(np.linalg.norm(chord))
        if residual > _ON_CURVE or not length > 0.0 or chord[-1] == 0.0:
            return None
        tangent = chord / length
        # Finite differences in the parameter cross the grazing; differences along the curve do not.
        along = tangent * scales
        slope = -(image.jacobian - np.eye(2)) @ along[:-1] / along[-1]
        nodes.append(Node(state, value, tangent, last.arc + length, replace(image, slope=slope), residual))
    return nodes[1:]


def fades(family: RegimeFamily, scales: FloatArray) -> Callable[[Node, Node], bool]:
    """Build a predicate of two successive nodes: whether the slowest impact of the orbit fades to a grazing.

    The predicate tries to locate the grazing only if the speed of the impact has fallen well below its speed
    at the previous attempt.
    """
    tried = math.inf

    def is_fading(here: Node, ahead: Node) -> bool:
        nonlocal tried
        before, slow = _slowest(here), _slowest(ahead)
        fast = float(scales[1])
        if not (slow < before and (slow / fast) ** 2 < _GENTLE and slow < _CLOSER * tried):
            return False
        if abs(ahead.multipliers[0]) < _STEEP:
            return False
        tried = slow
        return grazing_end(family, scales, ahead, impacts=True) is not None

    return is_fading


def _slowest(node: Node) -> float:
    """Return the speed [m/s] of the slowest impact of an orbit on the backstop; infinite without impacts."""
    passage: Passage = node.value.extra
    return min((abs(touch.v_in) for touch in passage.of("backstop")), default=math.inf)
