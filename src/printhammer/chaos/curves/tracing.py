"""Tracing of bifurcation curves: start, choice of the extended map, section changes, end of the curve."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from printhammer.chaos.continuation.arclength import Steps, Stop, Watch, follow
from printhammer.chaos.continuation.branch_points import zero_between
from printhammer.chaos.continuation.family import has_rigid_backstop
from printhammer.chaos.continuation.fixed_points import Corrector, Node
from printhammer.chaos.continuation.flights import near_touches
from printhammer.chaos.curves.codimension import (
    CodimensionTwo,
    meeting,
    point_of,
    points_along,
    resonance_test,
)
from printhammer.chaos.curves.normal_forms import doubling_coefficient
from printhammer.chaos.curves.starts import Start
from printhammer.chaos.curves.systems import (
    GRAZING,
    TESTS,
    CurvePoint,
    GrazingSystem,
    ImpactSystem,
    MultiplierSystem,
    Plane,
    curve_point_of,
)
from printhammer.chaos.strobe.map import quiet_section
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.threads import mapped

PRECISION: Final = 1e-12
"""Scaled correction of Newton's method below which a point lies on the curve; arbitrary."""

_NOISY: Final = 1e-9
"""Scaled closing error above which a point that Newton's method accepts is rejected; arbitrary."""
_GENTLE: Final = 1e-6  # Impact speed, in scales, at which a curve ends in a grazing; arbitrary
_SLOW: Final = 0.05  # Arbitrary
"""Impact speed, in half-widths of the window, below which a curve may end in a resonant grazing."""
_FAR: Final = 0.02
"""Distance in the scaled plane within which a point of codimension two is the end of a curve; arbitrary."""
_TURNS: Final = 8
"""Maximum number of section changes along a curve; arbitrary."""

System = MultiplierSystem | ImpactSystem | GrazingSystem


@dataclass
class Traced:
    """Traced bifurcation curve: nodes, ends, points of codimension two, and normal-form coefficients."""

    kind: str
    surface: str
    nodes: list[Node]
    stops: tuple[Stop, Stop]
    points: list[CodimensionTwo]
    coefficients: FloatArray = field(repr=False)
    pieces: list[tuple[System, list[Node]]] = field(repr=False)

    @property
    def places(self) -> list[CurvePoint]:
        """Points of the curve in the parameter plane, in order."""
        return [curve_point_of(node) for node in self.nodes]

    def crossings(self, which: int, value: float) -> list[CurvePoint]:
        """Find the points of the curve at which one of the parameters has a given value.

        `which` is 0 for the first parameter, 1 for the second.
        """
        places: list[CurvePoint] = []
        for system, nodes in self.pieces:
            corrector = Corrector(system, system.scales, PRECISION)
            column = system.scales.size - 2 + which
            row, level = np.eye(system.scales.size)[column], value / system.scales[column]
            for here, ahead in itertools.pairwise(nodes):
                begin, end = corrector.point(here), corrector.point(ahead)
                if (begin[column] - level) * (end[column] - level) > 0.0 or begin[column] == end[column]:
                    continue
                share = (level - begin[column]) / (end[column] - begin[column])
                z = begin + share * (end - begin)
                z[column] = level
                node = corrector.correct(z, row)
                if node is not None and not any(_is_same(curve_point_of(node), place) for place in places):
                    places.append(curve_point_of(node))
        return places


def _is_same(one: CurvePoint, other: CurvePoint) -> bool:
    return bool(np.allclose([one.first, one.second], [other.first, other.second], rtol=1e-9, atol=0.0))


class CurveTracer:
    """Continuation of the bifurcation curves of one kind in a plane of two parameters."""

    def __init__(self, plane: Plane, kind: str, steps: Steps) -> None:
        self.plane, self.kind, self.steps = plane, kind, steps
        self.rigid = has_rigid_backstop(plane.regime)

    def trace(self, start: Start, second: float, threads: int | None) -> Traced:
        """Trace the bifurcation curve through `start`, an initial guess of its first point.

        `second` is the value of the second parameter at the start. Raises InputError if Newton's method
        fails.
        """
        system, unknown = self.begin(start, second)
        at = f"{self.kind} at {start.first} = {start.value:.9g} {start.regime.quantity(start.first).si}"
        try:
            curve = follow(
                system,
                unknown,
                second,
                scales=system.scales,
                bounds=self.plane.bounds[1],
                steps=self.steps,
                watch=self.watch(system),
            )
        except InputError as error:
            raise error.within(at) from None
        nodes = curve.nodes
        pieces = [(system, nodes)]
        stops = list(curve.stops)
        if isinstance(system, MultiplierSystem) and not curve.closed:
            for end in (0, 1):
                beside, stops[end] = self.resumed(nodes, stops[end], first=end == 0)
                pieces = [*reversed(beside), *pieces] if end == 0 else [*pieces, *beside]
            nodes = [node for _, part in pieces for node in part]
        coefficients = np.full(len(nodes), np.nan)
        if self.kind == "period doubling":
            coefficients[:] = mapped(lambda node: self.coefficient(curve_point_of(node)), nodes, threads)
        points, begin = [], 0
        for own, part in pieces:
            corrector = Corrector(own, own.scales, self.steps.precision)
            some = coefficients[begin : begin + len(part)]
            found = points_along(self.kind, self.rigid, part, corrector, some, self.coefficient)
            points += [replace(point, after=point.after + begin) for point in found]
            points += self.meetings(part, begin)
            begin += len(part)
        points.sort(key=lambda point: point.after)
        for end, inner in ((0, 1), (-1, -2)):
            if stops[end].reason == "resonance" and len(nodes) > 1:
                # The last node lies beyond the resonance: move it onto the resonance.
                node = self.resonance(pieces[end][0], nodes[inner], nodes[end])
                nodes[end] = pieces[end][1][end] = node
        if not curve.closed:
            points = self.with_ends(nodes, stops, points)
        surface = system.surface if isinstance(system, GrazingSystem) else ""
        first, last = (self.in_words(stop, points, end) for end, stop in enumerate(stops))
        return Traced(self.kind, surface, nodes, (first, last), points, coefficients, pieces)

    def resonance(self, system: System, here: Node, beyond: Node) -> Node:
        """Locate the resonance on a Neimark-Sacker curve, at which both multipliers become real.

        The resonance lies between the nodes `here` and `beyond`.
        """
        sign = float(np.sign(np.trace(curve_point_of(beyond).jacobian)))
        corrector = Corrector(system, system.scales, self.steps.precision)
        _, node = zero_between(
            corrector, here, beyond, lambda each: sign * float(np.trace(curve_point_of(each).jacobian)) - 2.0
        )
        return here if node is None else node

    def coefficient(self, place: CurvePoint) -> float:
        """Compute the normal-form coefficient of a period doubling at a point of the curve."""
        return doubling_coefficient(self.plane, place)

    def begin(self, start: Start, second: float) -> tuple[System, FloatArray]:
        """Choose the extended map for a start; return the map and the initial guess of its unknowns."""
        plane, tolerance = self.plane, self.plane.tolerance
        regime = replace(plane.at(start.value, second), phase=start.regime.phase)
        near = near_touches(regime, start.state, plane.firings, tolerance)
        if self.kind == GRAZING:
            if not near:
                raise InputError(
                    f"grazing at {start.first} = {start.value:.9g}: the orbit comes near no surface",
                    key=start.first,
                    value=start.value,
                )
            touch = near[0]
            return GrazingSystem(plane, touch.surface), np.array([touch.phase, start.value])
        impacts = [touch for touch in near if touch.speed > 0.0 and touch.surface == "backstop"]
        if self.rigid and impacts:
            slowest = min(impacts, key=lambda touch: touch.speed)
            return ImpactSystem(plane, self.kind), np.array([slowest.phase, slowest.speed, start.value])
        quiet = quiet_section(regime, start.state, plane.firings, tolerance) or (regime, start.state)
        moved = replace(plane, regime=replace(plane.regime, phase=quiet[0].phase))
        return MultiplierSystem(moved, self.kind), np.append(quiet[1], start.value)

    def state_at(self, start: Start, second: float) -> FloatArray:
        """Compute the orbit of a start, as a state (m, m/s), at the section used along the curve."""
        system, unknown = self.begin(start, second)
        if isinstance(system, MultiplierSystem):
            return np.asarray(unknown[:2])
        surface = self.plane.at(start.value, second).hammer.position
        return np.array([surface, unknown[1]])

    def watch(self, system: System) -> Watch:
        """Build the callback of `follow` that ends a curve.

        The curve ends where it is lost, or at a grazing, a resonance or a bound of the first parameter.
        """
        low, high = self.plane.bounds[0]
        corrector = Corrector(system, system.scales, self.steps.precision)
        place = system.scales.size - 2
        row = np.eye(system.scales.size)[place]

        def watched(here: Node, ahead: Node) -> Stop | None:
            if not ahead.residual <= _NOISY:
                why = "Newton's method does not converge beyond"
                return Stop("lost", here.parameter, here.state, why, here)
            if self.rigid and here.value.label != ahead.value.label:
                why = "another contact grazes the rigid backstop"
                return Stop("grazing", here.parameter, here.state, why, here)
            if isinstance(system, ImpactSystem) and ahead.state[1] < _GENTLE * system.scales[1]:
                return Stop("grazing", here.parameter, here.state, "the impact vanishes in a grazing", here)
            if self.kind == "Neimark-Sacker" and abs(np.trace(curve_point_of(ahead).jacobian)) > 2.0:
                why = "both multipliers become real: a resonance"
                return Stop("resonance", ahead.parameter, ahead.state, why, ahead)
            value = float(ahead.state[place])
            if low <= value <= high:
                return None
            bound = low if value < low else high
            share = (bound - here.state[place]) / (value - here.state[place])
            z = corrector.point(here) + share * (corrector.point(ahead) - corrector.point(here))
            z[place] = bound / system.scales[place]
            node = corrector.correct(z, row)
            if node is not None:
                tangent = node.tangent if node.tangent @ ahead.tangent > 0.0 else -node.tangent
                arc = here.arc + share * (ahead.arc - here.arc)
                ahead = replace(node, tangent=tangent, arc=arc)
            return Stop(
                "bound", ahead.parameter, ahead.state, self.at_value(0, bound) + " is the bound", ahead
            )

        return watched

    def resumed(
        self, nodes: list[Node], stop: Stop, *, first: bool
    ) -> tuple[list[tuple[System, list[Node]]], Stop]:
        """Continue a curve past a section change; return the new segments and the reason for stopping.

        If `first`, the curve is continued beyond the first of its `nodes`, else beyond the last.
        """
        pieces: list[tuple[System, list[Node]]] = []
        for _ in range(_TURNS):
            if stop.reason not in ("lost", "jump", "no value"):
                break
            node = nodes[0] if first else nodes[-1]
            place = curve_point_of(node)
            regime = replace(self.plane.at(place.first, place.second), phase=place.phase)
            quiet = quiet_section(regime, place.state, self.plane.firings, self.plane.tolerance)
            if quiet is None or abs(quiet[0].phase - place.phase) < 1e-3:
                break
            system = MultiplierSystem(
                replace(self.plane, regime=replace(self.plane.regime, phase=quiet[0].phase)), self.kind
            )
            row = np.append(np.zeros(2), node.tangent[-2:]) * (-1.0 if first else 1.0)
            size = float(np.linalg.norm(row))
            if size == 0.0:
                break
            try:
                curve = follow(
                    system,
                    np.append(quiet[1], place.first),
                    place.second,
                    scales=system.scales,
                    bounds=self.plane.bounds[1],
                    steps=self.steps,
                    directions="up",
                    row=row / size,
                    watch=self.watch(system),
                )
            except InputError:
                break
            stop = curve.stops[1]
            if len(curve.nodes) < 2:
                break
            nodes = curve.nodes[1:]
            if first:
                nodes = [replace(each, tangent=-each.tangent, arc=-each.arc) for each in reversed(nodes)]
            pieces.append((system, nodes))
        return pieces, stop

    def meetings(self, nodes: list[Node], begin: int) -> list[CodimensionTwo]:
        """Locate the points at which a fold or doubling curve meets a grazing of a compliant surface.

        `begin` is the index of the first of the `nodes` along the whole curve.
        """
        if self.rigid or self.kind not in ("fold", "period doubling"):
            return []
        points = []
        for after in range(len(nodes) - 1):
            here, ahead = nodes[after], nodes[after + 1]
            if here.value.label == ahead.value.label:
                continue
            span = self.distance(curve_point_of(here), curve_point_of(ahead))
            for node in (here, ahead):
                place = self.grazing_near(curve_point_of(node), 2.0 * span + 1e-6)
                if place is not None:
                    points.append(point_of(f"{self.short} meets grazing", place, begin + after))
                    break
        return points

    @property
    def short(self) -> str:
        """Short name of the kind of bifurcation, such as "doubling" for "period doubling"."""
        return self.kind.removeprefix("period ")

    def distance(self, one: CurvePoint, other: CurvePoint) -> float:
        """Compute the distance between two points of the parameter plane, in units of its scales."""
        away = np.array([one.first - other.first, one.second - other.second]) / self.plane.scales[2:]
        return float(np.linalg.norm(away))

    def grazing_near(self, place: CurvePoint, within: float) -> CurvePoint | None:
        """Find the grazing near a point of the curve at which the test function of the curve is zero.

        None if there is no such grazing up to the scaled distance `within` in the parameter plane.
        """
        regime = replace(self.plane.at(place.first, place.second), phase=place.phase)
        for touch in near_touches(regime, place.state, self.plane.firings, self.plane.tolerance)[:3]:
            guess = np.array([touch.phase, place.first, place.second])
            met = meeting(self.plane, touch.surface, guess, TESTS[self.kind])
            if met is not None and self.distance(met, place) <= within:
                return met
        return None

    def with_ends(
        self, nodes: list[Node], stops: list[Stop], points: list[CodimensionTwo]
    ) -> list[CodimensionTwo]:
        """Find the points of codimension two at which a curve ends in a grazing.

        Returns `points`, the points found between the ends, together with those at the ends. The reasons in
        `stops` are updated.
        """
        if self.kind not in ("fold", "period doubling"):
            return points
        for end, (node, after) in enumerate(((nodes[0], -1), (nodes[-1], len(nodes) - 1))):
            if stops[end].reason not in ("grazing", "lost", "jump", "no value"):
                continue
            point = self.end_at(curve_point_of(node), after)
            if point is not None:
                stops[end] = replace(stops[end], reason="grazing")
                points = [point, *points] if end == 0 else [*points, point]
        return points

    def end_at(self, place: CurvePoint, after: int) -> CodimensionTwo | None:
        """Find the point of codimension two at which a curve ends, near its last point `place`.

        `after` is the index of the preceding node. None if no such point is found.
        """
        speed = float(place.state[1]) / float(self.plane.scales[1])
        if self.rigid and 0.0 < speed < _SLOW:
            guess = np.array([place.phase, place.first, place.second])
            for firings in range(1, self.plane.firings + 1):
                if self.plane.firings % firings == 0:
                    passages = self.plane.firings // firings
                    shorter = replace(self.plane, firings=firings)
                    met = meeting(shorter, "backstop", guess, resonance_test(passages))
                    if met is not None and self.distance(met, place) <= _FAR:
                        return point_of("resonant grazing", met, after, passages)
        met = self.grazing_near(place, _FAR)
        return None if met is None else point_of(f"{self.short} meets grazing", met, after)

    def at_value(self, which: int, value: float) -> str:
        """Format a value of the first (0) or second (1) parameter with its name and unit."""
        name = self.plane.names[which]
        return f"{name} = {value:.9g} {self.plane.regime.quantity(name).si}".removesuffix(" 1")

    def in_words(self, stop: Stop, points: list[CodimensionTwo], end: int) -> Stop:
        """Return a copy of a `Stop` whose sentence states the parameters, with units.

        For an end in a grazing, the sentence names the point of codimension two at this end (0: first, 1:
        last).
        """
        at = self.at_value(1, stop.parameter)
        if stop.reason == "grazing" and points:
            point = points[-1 if end else 0]
            sentence = f"{point.message} at {self.at_value(0, point.first)}, {self.at_value(1, point.second)}"
            return replace(stop, sentence=sentence, parameter=point.second)
        sentences = {
            "bound": f"{at} is the bound" if "parameter" in stop.sentence else stop.sentence,
            "closed": f"the curve closes upon itself at {at}",
            "length": f"the maximum number of steps is reached at {at}",
            "no value": f"beyond {at} there is no strobe map: {stop.sentence.partition(': ')[2]}",
        }
        why = stop.sentence.rpartition(": ")[2]
        return replace(stop, sentence=sentences.get(stop.reason, f"beyond {at} {why}"))
