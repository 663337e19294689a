"""Orbits from one touch of a surface to the next: grazings, and what bounces off a rigid backstop.

The section is put at the touch: there the displacement is that of the surface, b, and unknown are the phase s
of the drive and the velocity v. Without velocity the touch is a grazing,

    G((b, 0); s, p, r) = (b, 0),

two equations for s and p by r. An orbit that leaves a rigid backstop with the velocity v, and comes back
after its firings with w, obeys G((b, v); s, p, r) = (b, w), v = -e w, and with the derivative M of that way

    f = 0,   J = S M,   S = [[-e, 0], [(a_out + e a_in) / w, -e]],

S being the saltation matrix of the impact with the accelerations on both sides of it. A rigid backstop bends
the strobe map of a fixed section by a square root at a grazing, and S is infinite there; here all is smooth,
also w f, and v may pass through 0. To that end the motion close to the touch is computed without the surface.
Where an impact meets a fixed section its state jumps, which does not happen here.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.chaos.continuation.family import cyclic, rigid_backstop
from printhammer.chaos.continuation.fixed_points import MapValue
from printhammer.chaos.curves.systems import GRAZING, SPACING, Place, Plane
from printhammer.chaos.strobe.map import turns
from printhammer.derivatives.states import follow
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.run.contacts import touches_of
from printhammer.run.problem import Problem

if TYPE_CHECKING:
    from printhammer.chaos.continuation.family import Surface
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray

_PHASES: Final = 0.2
"""Part of the period that counts as much as half a width of the window."""
_STILL: Final = 1e-9
_CLOSE: Final = 0.01
"""Part of the period before and after a touch over which the surface is left out."""
_IN_TRACE: Final = {"fold": -1.0, "period doubling": 1.0, "Neimark-Sacker": 0.0}
"""f as a function of trace and determinant of J: the factor of the trace; the rest is 1 + det, or det - 1."""


class Flight(Declared):
    """A motion from a touch to the next, some firings later; the surface is left out close to both."""

    end: FloatArray = part("displacement, m, and velocity, m/s, at the end, shape (2,)")
    jacobian: FloatArray = part("derivative with respect to the state at the start, shape (2, 2)")
    accelerations: tuple[float, float] = part("at its start and at its end, m/s^2")
    contacts: tuple[str, ...] = part("surfaces touched on the way")
    surface: float = part("displacement of the surface, m")
    rebound: float = part("coefficient of restitution; NaN without a rigid backstop")
    trouble: str = part("why there is none; empty where there is")


def fly(plane: Plane, surface: Surface, phase: float, speed: float, first: float, second: float) -> Flight:
    """Return the flight that leaves a surface at a phase of the drive; speed in m/s, constants SI."""
    regime = plane.at(first, second)
    hammer = regime.hammer
    place = hammer.front if surface == "pack" else hammer.position
    assert place is not None
    train, _ = regime.train(plane.firings + 1)
    begin, *_, end = (float(time) for time in regime.moments(train, plane.firings, phase % 1.0))
    close = _CLOSE * regime.period
    state, jacobian, trouble = np.array([place, speed]), np.eye(2), ""
    contacts: list[str] = []
    rigid = surface == "backstop" and rigid_backstop(regime)

    def problem(start: float, *, alone: bool) -> Problem:
        made = Problem(hammer, train, (float(state[0]), float(state[1])), start, plane.tolerance)
        if alone:
            made.leave_out(surface)
        return made

    leaving = _acceleration(problem(begin, alone=True), close)
    # Inside a contact, with a surface that gives way, there is nothing to leave out.
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
    """Return the acceleration at the start of a run, m/s^2."""
    record = problem.run(problem.start + time)
    (row,) = problem.resample(record, np.array([problem.start]))
    push = row[2] if problem.drive.quantity == "force" else 0.0
    return float((push + row[3:9].sum()) / problem.hammer.mass)


class GrazingSystem:
    """Orbits that touch a surface with no velocity: phase of the touch and first constant."""

    def __init__(self, plane: Plane, surface: Surface) -> None:
        self.plane, self.kind, self.surface = plane, GRAZING, surface
        self.scales = np.array([_PHASES, *plane.scales[2:]])

    def at(self, phase: float, first: float, second: float) -> tuple[Place, FloatArray] | str:
        """Return the orbit that leaves a touch, and by how far it misses the next one; text where it ends.

        In scales of the state; InputError where the constants are not possible.
        """
        flight = fly(self.plane, self.surface, phase, 0.0, first, second)
        if flight.trouble:
            return flight.trouble
        at, contacts = np.array([flight.surface, 0.0]), cyclic(flight.contacts)
        place = Place(
            first, second, at, phase % 1.0, flight.jacobian, contacts, acceleration=flight.accelerations[0]
        )
        return place, (flight.end - at) / self.plane.scales[:2]

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Return the map of phase and first constant at a value of the second one."""
        steps, point = SPACING * self.scales, np.append(whole, other)
        missed = []
        for phase, first, second in [point, *(point + step for step in np.diag(steps))]:
            try:
                value = self.at(float(phase), float(first), float(second))
            except InputError as error:
                return MapValue.none(2, str(error))
            if isinstance(value, str):
                return MapValue.none(2, value)
            missed.append(value)
        (place, miss), *beside = missed
        widths = self.scales[:2]
        slopes = [(near[1] - miss) / step for near, step in zip(beside, steps, strict=True)]
        return MapValue(
            whole + miss * widths,
            np.eye(2) + np.column_stack(slopes[:2]) * widths[:, np.newaxis],
            slopes[2] * widths,
            place.contacts,
            extra=replace(place, slope=slopes[1] * self.plane.scales[:2]),
            monodromy=place.jacobian,
        )


class ImpactSystem:
    """As `MultiplierSystem`, of orbits that bounce off a rigid backstop: phase and velocity there instead."""

    def __init__(self, plane: Plane, kind: str) -> None:
        self.plane, self.kind = plane, kind
        self.scales = np.array([_PHASES, *plane.scales[1:]])

    def __call__(self, whole: FloatArray, other: float) -> MapValue:
        """Return the map of phase and velocity after the impact, and of the first constant."""
        moves, point = SPACING * self.scales, np.append(whole, other)
        try:
            flights = [
                fly(self.plane, "backstop", *map(float, at))
                for at in [point, *(point + move for move in np.diag(moves))]
            ]
        except InputError as error:
            return MapValue.none(3, str(error))
        for flight in flights:
            if flight.trouble:
                return MapValue.none(3, flight.trouble)
        speeds = whole[1] + moves[1] * np.array([0.0, 0.0, 1.0, 0.0, 0.0])
        misses = [self._miss(flight, speed) for flight, speed in zip(flights, speeds, strict=True)]
        slopes = [(near - misses[0]) / move for near, move in zip(misses[1:], moves, strict=True)]
        here = flights[0]
        jacobian, determinant = _monodromy(here)
        known = np.diag([-self._sign, -self._sign * determinant]) if self._sign else jacobian
        contacts = cyclic((*here.contacts, "backstop"))
        state = np.array([here.surface, whole[1]])
        place = Place(float(whole[2]), other, state, float(whole[0]) % 1.0, jacobian, contacts)
        return MapValue(
            whole + misses[0],
            np.eye(3) + np.column_stack(slopes[:3]),
            slopes[3],
            contacts,
            extra=replace(place, jacobian=known if whole[1] == 0.0 else jacobian),
            monodromy=known,
        )

    @property
    def _sign(self) -> float:
        """Minus the multiplier that is known along the curve; 0 without one."""
        return _IN_TRACE[self.kind]

    def _miss(self, flight: Flight, speed: float) -> FloatArray:
        """Return by how far an orbit misses the next impact and the bifurcation, scaled as the unknowns."""
        matrix, e, w = flight.jacobian, flight.rebound, float(flight.end[1])
        determinant = e * e * float(np.linalg.det(matrix))
        trace, rest = self._sign, determinant + (1.0 if self._sign else -1.0)
        turned = -e * float(np.trace(matrix))
        jump = (flight.accelerations[0] + e * flight.accelerations[1]) * float(matrix[0, 1])
        test = w * (rest + trace * turned) + trace * jump
        way, fast = self.plane.scales[:2]
        misses = [(flight.end[0] - flight.surface) / way, (-e * w - speed) / fast, test / fast]
        return np.asarray(misses * self.scales[:3])


def _monodromy(flight: Flight) -> tuple[FloatArray, float]:
    """Return the derivative from one impact to behind the next, and its determinant."""
    e, w = flight.rebound, float(flight.end[1])
    jump = flight.accelerations[0] + e * flight.accelerations[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        saltation = np.array([[-e, 0.0], [np.divide(jump, w), -e]])
    return saltation @ flight.jacobian, e * e * float(np.linalg.det(flight.jacobian))


class NearTouch(Declared):
    """Where an orbit touches a surface, or turns near it."""

    surface: Surface = part('"pack" or "backstop"')
    phase: float = part("part of the period from a firing to it")
    gap: float = part("how far it is from a grazing, in half-widths of the window")
    speed: float = part("with which it leaves a rigid backstop, m/s; 0 of a turn")


def near_touches(regime: Regime, state: FloatArray, firings: int, tolerance: float) -> list[NearTouch]:
    """Return the turns of an orbit, and its impacts on a rigid backstop, those nearest to a grazing first."""
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
    if rigid_backstop(regime):
        rows = [(float(row[1]), float(row[4])) for row in record.contacts if not row[6]]
        if state[0] == hammer.position and state[1] > 0.0:
            rows = [row for row in rows if row[0] < end - _CLOSE * regime.period]
            rows.append((begin, float(state[1])))
        touches += [NearTouch("backstop", phase(time), (v / fast) ** 2, v) for time, v in rows if v > 0.0]
    return sorted(touches, key=lambda touch: touch.gap)


def _still(state: FloatArray, begin: float, fast: float) -> list[tuple[float, float]]:
    return [(begin, float(state[0]))] if abs(state[1]) < _STILL * fast else []
