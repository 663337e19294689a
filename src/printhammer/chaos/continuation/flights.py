"""Flights from one touch of a surface to a later touch, and the touches of an orbit closest to a grazing.

At a touch the displacement is that of the surface; the remaining state variable is the velocity, 0 at a
grazing. With a rigid backstop, the strobe map has a square-root singularity at a grazing. If the surface is
removed from the model close to the touch, the motion is smooth on both sides of the grazing.
"""

from __future__ import annotations

import itertools
import math
from typing import Final

import numpy as np

from printhammer.chaos.continuation.family import Surface, has_rigid_backstop
from printhammer.chaos.strobe.map import turns
from printhammer.derivatives.states import follow
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.run.contacts import touches_of
from printhammer.run.problem import Problem
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

_CURRENT: Final = "with a voltage drive, the current at a touch belongs to the state"
_CLOSE: Final = 0.01
"""Time before and after a touch during which the surface is removed, as a fraction of the period."""
_STILL: Final = 1e-9  # Speed, relative to the typical one, below which an orbit turns at its section
_SPACING: Final = 1e-6  # Finite-difference step of Newton's method, in scaled variables
_ROUNDS: Final = 20  # Iteration limit of Newton's method; arbitrary
_PRECISION: Final = 1e-12  # Scaled correction below which Newton's method has converged
_STAGNANT: Final = 1e3  # Multiple of the precision below which stagnation counts as convergence
_SLOWER: Final = (0.98, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.02, 0.005)
"""Impact speeds, relative to the initial speed, at which a branch is computed down to its grazing."""


class Flight(Declared):
    """Motion between two touches, some firings apart, with the surface removed close to both touches."""

    end: FloatArray = part("displacement, m, and velocity, m/s, at the end, shape (2,)")
    jacobian: FloatArray = part("derivative with respect to the state at the start, shape (2, 2)")
    accelerations: tuple[float, float] = part("acceleration at the start and at the end, m/s^2")
    contacts: tuple[str, ...] = part("surfaces touched during the flight")
    surface: float = part("displacement of the surface, m")
    rebound: float = part("coefficient of restitution; NaN without a rigid backstop")
    trouble: str = part("reason why there is no flight; empty if there is a flight")


def fly(
    regime: Regime, surface: Surface, phase: float, speed: float, firings: int, tolerance: float
) -> Flight:
    """Compute the flight that leaves a surface at a given phase of the drive and speed, m/s."""
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

    def problem(start: float, *, alone: bool) -> Problem:
        made = Problem(hammer, train, (float(state[0]), float(state[1])), start, tolerance)
        if alone:
            made.leave_out(surface)
        return made

    leaving = _acceleration(problem(begin, alone=True), close)
    # In a contact with a compliant surface the surface is not removed.
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
    """Compute the acceleration of the armature at the start of a run of length `time`, s; result in m/s^2."""
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
    """List the turning points and rigid-backstop impacts of an orbit, those closest to a grazing first."""
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
    """Solve for touch phase and parameter of the orbit that leaves a surface at a given speed.

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
        Firings after which the orbit repeats; error allowed in one step.
    width : float
        Scale of the parameter, SI.

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
    """Follow an impact down to its grazing; return phase, speed and parameter for decreasing speeds.

    A branch of orbits is smooth in these variables up to the grazing, which is the last entry. In terms of
    the state at a section, the curvature of the branch diverges, since the derivative of the strobe map grows
    as the inverse of the speed. None if the impact speed does not reach zero nearby. The arguments are those
    of `touch_at`.
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
