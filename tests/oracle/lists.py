"""Motion of one mass under lists of forces, contacts, rigid stops and Coulomb friction; part of the oracle.

m x'' = sum of forces, solved by DOP853 between events. The guards of the present mode (distances, velocity,
contact forces before clipping) are interpolated at Chebyshev nodes of each step, all roots of the interpolant
are computed, and the first falling root is polished by Newton's method, each iteration by a new step of
order 8. Displacement is kept as the distance from the surface last touched, so that nothing cancels near it.
Friction is set-valued: the mass is held while the other forces lie within the static force. An infinite
sequence of bounces is summed as a geometric series once its height is below `REST_HEIGHT` length scales.

Every force and contact has its own work, integrated with the motion.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from tests.oracle.list_laws import Piece, Stop, System
from tests.oracle.list_steps import NODES, Array, Event, Rates, Run, Step, first_fall, flow, solver

Guard = tuple[str, int, Callable[[Any, Any], Any], int]
"""Kind of event, index of its contact or stop, guard as a function of (y, v), order of its zero now."""

REST_HEIGHT = 1e-14
"""Height of a bounce, in length scales, below which the sequence of bounces is summed."""

EVENT_LIMIT = 100_000
_SIGNS = {"front": 1.0, "back": -1.0}


class _Motion:
    """State of a run: time, ref, z = (y, v, works), modes of contacts (open, closed, cut), slip direction."""

    def __init__(self, system: System, x: float, v: float, t: float) -> None:
        self.system, self.t, self.ref = system, t, x
        self.kinetic = sum(part.kinetic for part in system.friction)
        self.static = sum(part.static for part in system.friction)
        self.signs = [_SIGNS[contact.side] for contact in system.contacts]
        self.stops = [(stop, _SIGNS[stop.side]) for stop in system.stops]
        listed = (*system.forces, *system.drives, *system.friction, *system.contacts)
        self.names = [part.name for part in listed]
        self.z = np.zeros(2 + len(listed))
        self.z[1] = v
        self.modes = ["open"] * len(system.contacts)
        self.sigma, self.held = math.copysign(1.0, v), False
        self.switched = -1
        """Contact whose force before clipping is zero now."""
        self.active: list[list[Piece]] = []
        """Pieces of each drive in the present interval, which ends at ``bound``."""
        self.bound = t
        self.run = Run(system, lost={stop.name: 0.0 for stop in system.stops})
        for stop, sign in self.stops:
            if sign * (x - stop.position) > 0.0:
                raise ValueError(f"x = {x} m lies beyond the stop {stop.name!r}")

    def arrange(self) -> None:
        """Set the modes of contacts that the state decides."""
        for i, contact in enumerate(self.system.contacts):
            d, rate = self.depth(i), self.signs[i] * self.z[1]
            if d > 0.0:
                self.modes[i] = "closed" if contact.push(d, rate) >= 0.0 else "cut"
            elif d == 0.0:
                inward = rate > 0.0 or (rate == 0.0 and self.signs[i] * self.sigma > 0.0)
                self.modes[i] = "closed" if inward else "open"

    def depth(self, i: int) -> float:
        position = self.system.contacts[i].position
        return self.signs[i] * float((self.ref - position) + self.z[0])

    def stored(self) -> list[float]:
        """Energies stored in the contacts, J."""
        return [contact.stored(self.depth(i)) for i, contact in enumerate(self.system.contacts)]

    def parts(self, t: float) -> list[float]:
        """Forces on the mass at rest at its place, friction and stops left out, N."""
        x = self.ref + float(self.z[0])
        forces = [part.force(x, 0.0) for part in self.system.forces]
        forces += [piece.force(t) for pieces in self.active for piece in pieces]
        for i, contact in enumerate(self.system.contacts):
            if self.modes[i] == "closed":
                forces.append(-self.signs[i] * float(contact.push(self.depth(i), 0.0)))
        return forces

    def touched(self) -> list[tuple[Stop, float]]:
        return [(stop, sign) for stop, sign in self.stops if (self.ref - stop.position) + self.z[0] == 0.0]

    def bounds(self) -> tuple[float, float]:
        """Interval of the other forces in which friction and the stops touched hold the mass, N."""
        low, high = -self.static, self.static
        for _stop, sign in self.touched():
            low, high = (low, math.inf) if sign > 0.0 else (-math.inf, high)
        return low, high

    def record(self, kind: str, name: str) -> None:
        self.run.events.append(Event(self.t, kind, name, self.ref + float(self.z[0]), float(self.z[1])))
        if len(self.run.events) > EVENT_LIMIT:
            raise RuntimeError(f"more than {EVENT_LIMIT} events")

    def settle(self) -> None:
        """Decide at v = 0 whether the mass is held, and the direction of slip otherwise."""
        self.z[1] = 0.0
        # A cut contact pushes again as soon as the mass stops.
        self.modes = ["closed" if mode == "cut" else mode for mode in self.modes]
        (low, high), rest = self.bounds(), math.fsum(self.parts(self.t))
        was_held, self.held = self.held, low < high and low <= rest <= high
        if not self.held:
            self.sigma = math.copysign(1.0, rest)
            self.arrange()
        elif not was_held:
            stops = self.touched()
            self.record(*(("rest", stops[0][0].name) if stops else ("stick", "friction")))

    def rates(self) -> Rates:
        """Right-hand side of the present mode, with the time counted from now, analytic beyond its ends."""
        system, origin, ref, active = self.system, self.t, self.ref, list(self.active)
        rubbing = [-self.sigma * part.kinetic for part in system.friction]
        laws = list(enumerate(zip(system.contacts, self.signs, self.modes, strict=True)))
        first = len(system.forces) + len(active) + len(rubbing)

        def rates(s: float, z: Array) -> Array:
            t, y, v = origin + s, float(z[0]), float(z[1])
            forces = [part.force(ref + y, v) for part in system.forces]
            forces += [sum(piece.force(t) for piece in pieces) for pieces in active]
            forces += rubbing + [0.0] * len(laws)
            for i, (contact, sign, mode) in laws:
                if mode == "closed":
                    d = sign * ((ref - contact.position) + y)
                    forces[first + i] = -sign * float(contact.push(d, sign * v))
            return np.array([v, sum(forces) / system.mass, *(force * v for force in forces)])

        return rates

    def guards(self) -> list[Guard]:
        """Functions of (y, v) that are positive while the present mode lasts."""
        guards: list[Guard] = []
        forces = self.parts(self.t)
        net = sum(forces) - self.sigma * self.kinetic
        # A force that grows from zero, such as at a release with equal static and kinetic force.
        is_weak = abs(net) <= 1e-11 * (sum(map(abs, forces)) + self.kinetic)
        if self.system.friction:
            order = 0 if self.z[1] != 0.0 else 2 if is_weak else 1
            guards.append(("turn", 0, lambda _y, v: self.sigma * v, order))
        on_surface = 1 if self.z[1] != 0.0 else 3 if is_weak else 2

        def distance(position: float, sign: float) -> tuple[Callable[[Any, Any], Any], int]:
            offset = self.ref - position
            return lambda y, _v: sign * (offset + y), on_surface if offset + self.z[0] == 0.0 else 0

        for i, (stop, sign) in enumerate(self.stops):
            guards.append(("impact", i, *distance(stop.position, -sign)))
        for i, (contact, sign) in enumerate(zip(self.system.contacts, self.signs, strict=True)):
            if self.modes[i] == "open":
                guards.append(("touch", i, *distance(contact.position, -sign)))
                continue
            guards.append(("leave", i, *distance(contact.position, sign)))
            if contact.loss or contact.damping:
                depth, _order = distance(contact.position, sign)
                way = 1.0 if self.modes[i] == "closed" else -1.0

                def force(y: Any, v: Any, law: Any = (contact, depth, sign, way)) -> Any:
                    contact, depth, sign, way = law
                    return way * contact.sign(depth(y, v), sign * v)

                guards.append(("cut" if way > 0.0 else "uncut", i, force, int(self.switched == i)))
        return guards

    def slide(self) -> None:
        """Integrate to the next event, or to the end of the interval."""
        origin, rates, guards = self.t, self.rates(), self.guards()
        bound = self.bound - origin
        steps, start = solver(self.system, rates, 0.0, self.z, bound), 0.0
        while start < bound:
            message = steps.step()
            if steps.status == "failed":
                raise RuntimeError(str(message))
            span = float(steps.t) - start
            y, v = steps.dense_output()(start + 0.5 * span * (NODES + 1.0))[:2]
            falls = []
            for guard in guards:
                at_start = float(guard[2](self.z[0], self.z[1]))
                fall = first_fall(np.asarray(guard[2](y, v)), at_start, guard[3])
                if fall is not None:
                    falls.append((fall[0], fall[1], guard))
            if falls:
                fraction, slope, guard = min(falls, key=lambda fall: fall[0])
                t, z = self.polish(rates, start, span, fraction, slope, guard)
            else:
                t, z = float(steps.t), np.asarray(steps.y)
            if t > start:
                self.run.steps.append(Step(self.t, origin + t, self.ref, self.z, rates, start))
            # A short step must not miss the bound by a rounding.
            self.t = origin + t if t < bound else self.bound
            start, self.z = t, z.copy()
            if falls:
                self.happen(guard[0], guard[1], is_jump=slope == 0.0)
                return
            guards = [(kind, i, function, 0) for kind, i, function, _order in guards]
        self.switched = -1

    def polish(
        self, rates: Rates, start: float, span: float, fraction: float, slope: float, guard: Guard
    ) -> tuple[float, Array]:
        """Time since the last event and state at the root of a guard, by Newton's method."""
        t = start + fraction * span
        z = flow(self.system, rates, start, self.z, t)
        for _ in range(3):
            value = float(guard[2](z[0], z[1]))
            # Near a graze the correction is not trusted.
            if slope == 0.0 or abs(value / slope) > 1e-3:
                break
            corrected = max(start, t - value * span / slope)
            if corrected == t:
                break
            t = corrected
            z = flow(self.system, rates, start, self.z, t)
        return t, z

    def happen(self, kind: str, i: int, is_jump: bool) -> None:
        """Apply an event; where a stop makes the velocity jump, a contact is cut at a force other than 0."""
        self.switched = -1
        if kind == "turn":
            self.settle()
            return
        if kind == "impact":
            stop, sign = self.stops[i]
            self.ref, self.z[0] = stop.position, 0.0
            self.strike(stop, sign)
            return
        contact = self.system.contacts[i]
        if kind in ("touch", "leave"):
            self.ref, self.z[0] = contact.position, 0.0
        elif not is_jump:
            self.switched = i
        self.modes[i] = {"touch": "closed", "leave": "open", "cut": "cut", "uncut": "closed"}[kind]
        self.record(kind, contact.name)

    def strike(self, stop: Stop, sign: float) -> None:
        """Rebound from a stop, or come to rest on it."""
        mass, before = self.system.mass, float(self.z[1])
        after = -stop.restitution * before
        rest = sign * math.fsum(self.parts(self.t))
        up, down = (rest + self.kinetic) / mass, (rest - self.kinetic) / mass
        ends = after == 0.0
        if up > 0.0 and after**2 <= 2.0 * up * REST_HEIGHT * self.system.length:
            duration = abs(after) / up
            if rest > self.static:
                # Flights up and down have different lengths under friction.
                ratio = stop.restitution * math.sqrt(down / up)
                duration = (
                    abs(after) * (1.0 / up + 1.0 / math.sqrt(up * down)) / (1.0 - ratio)
                    if ratio < 1.0
                    else math.inf
                )
            ends = self.t + duration < self.bound
            if ends:
                self.run.steps.append(Step(self.t, self.t + duration, self.ref, 0.0 * self.z, None))
                self.t += duration
        self.z[1] = 0.0 if ends else after
        self.run.lost[stop.name] += 0.5 * mass * (before**2 - float(self.z[1]) ** 2)
        if ends:
            self.settle()
        else:
            self.sigma = -sign
        if not self.held:
            self.record("impact", stop.name)

    def hold(self) -> None:
        """Stay at rest until the other forces leave their bounds, or to the end of the interval."""
        (low, high), bound = self.bounds(), self.bound
        fastest = max((abs(piece.rate) for pieces in self.active for piece in pieces), default=0.0)
        count = max(1, math.ceil((bound - self.t) * fastest / (0.5 * math.pi)))
        start = self.t
        for a, b in itertools.pairwise(np.linspace(self.t, bound, count + 1).tolist()):
            times = a + 0.5 * (b - a) * (NODES + 1.0)
            rest = np.array([math.fsum(self.parts(t)) for t in times])
            falls = []
            for limit, sign in ((low, 1.0), (high, -1.0)):
                if math.isfinite(limit):
                    at_a = sign * (math.fsum(self.parts(a)) - limit)
                    small = 1e-13 * (abs(limit) + float(np.abs(rest).max()))
                    # A force that starts at its limit is released where it leaves the limit at once.
                    values = sign * (rest - limit)
                    fall = (0.0, 0.0) if abs(at_a) <= small and values[-1] < 0.0 else None
                    fall = fall or first_fall(values, at_a, 0)
                    falls += [(fall[0], fall[1], limit)] if fall else []
            if falls:
                fraction, slope, limit = min(falls)
                sign = -1.0 if limit == high else 1.0
                self.t = a + fraction * (b - a)
                for _ in range(3 if slope else 0):
                    value = sign * (math.fsum(self.parts(self.t)) - limit)
                    self.t = max(a, self.t - value * (b - a) / slope)
                self.stay(start)
                self.held, self.sigma = False, -sign
                self.arrange()
                stops = self.touched()
                self.record("release", stops[0][0].name if stops else "friction")
                return
        self.t = bound
        self.stay(start)

    def stay(self, start: float) -> None:
        if self.t > start:
            self.run.steps.append(Step(start, self.t, self.ref, self.z.copy(), None))


def simulate(system: System, x: float, v: float, end: float, start: float = 0.0) -> Run:
    """Integrate from displacement ``x``, m, and velocity ``v``, m/s, at ``start`` to ``end``, s."""
    motion = _Motion(system, x, v, start)
    pieces = [drive.pieces for drive in system.drives]
    edges = {edge for drive in pieces for piece in drive for edge in (piece.start, piece.end)}
    knots = sorted({start, end} | {edge for edge in edges if start < edge < end})
    stored = []
    for i, (a, b) in enumerate(itertools.pairwise(knots)):
        middle = 0.5 * (a + b)
        motion.active = [[piece for piece in drive if piece.start <= middle < piece.end] for drive in pieces]
        motion.bound = b
        if i == 0:
            motion.arrange()
            stored = motion.stored()
            if v == 0.0:
                motion.settle()
        while motion.t < b - 4.0 * math.ulp(b):
            (motion.hold if motion.held else motion.slide)()
        motion.t = b
    run = motion.run
    run.work = dict(zip(motion.names, motion.z[2:].tolist(), strict=True))
    for contact, before, after in zip(system.contacts, stored, motion.stored(), strict=True):
        run.lost[contact.name] = before - after - run.work[contact.name]
    return run
