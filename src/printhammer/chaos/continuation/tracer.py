"""Branch tracing: continuation of periodic orbits across changes of section, and orbit properties."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from printhammer.chaos.continuation.arclength import Curve, Steps, Stop, follow
from printhammer.chaos.continuation.branch import Branch, BranchEvent, event_of
from printhammer.chaos.continuation.branch_points import (
    BIRTH,
    BranchPoint,
    birth_of,
    doubling_near,
    follow_doubled,
    points_of,
)
from printhammer.chaos.continuation.crossings import follow_crossing
from printhammer.chaos.continuation.family import Passage, RegimeFamily, has_rigid_backstop
from printhammer.chaos.continuation.fixed_points import Corrector, Node
from printhammer.chaos.continuation.flights import fades, grazing_end
from printhammer.chaos.strobe.map import mirror_image, quiet_section, state_later
from printhammer.drive.input import read_number
from printhammer.errors import InputError
from printhammer.run.effort import Effort
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray
from printhammer.support.threads import Progress, mapped

PRECISION: Final = 1e-10
"""Scaled correction of Newton's method below which an orbit has converged; see `arclength`. Arbitrary."""

_PARTS: Final = 5.0
"""Ratio of the parameter range to the parameter scale; arbitrary."""
_LOST: Final = ("lost", "jump", "no value")
GRAZING: Final = "grazing"
_AT_GRAZING: Final = "it grazes the rigid backstop, where the strobe map has no derivative"
_SHORTER: Final = 1e-6  # Arbitrary
"""Scaled closing error below which an orbit that closes after fewer firings has the shorter period."""
_DIGITS: Final = ".9g"
_MOST_SECTIONS: Final = 8  # Maximum number of segments of a branch at different sections; arbitrary
_SAME_PHASE: Final = 1e-3  # Arbitrary
"""Difference of section phases, as a fraction of the period, below which two phases are the same."""
_CLEAR: Final = 1e-3  # Arbitrary
"""Scaled distance from the end of a segment within which orbits are dropped at a section change."""
_LEAST_CHORD: Final = 1e-5
"""Smallest scaled distance between two orbits whose chord gives the direction of the branch; arbitrary."""
_NO_STOP: Final = Stop("section", math.nan, np.zeros(0), "the section moves")


def read_bounds(
    regime: Regime, parameter: str, bounds: tuple[float | str, float | str]
) -> tuple[float, float]:
    """Parse the bounds of a parameter; return two numbers in SI units.

    Raises InputError unless the bounds are two ascending numbers, or texts with units.
    """
    unit = regime.quantity(parameter).si
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise InputError.of("bounds", bounds, f"the least and the largest {parameter}") from None
    ends = read_number(low, unit, parameter), read_number(high, unit, parameter)
    if not ends[0] < ends[1]:
        raise InputError.of("bounds", bounds, f"the least and the largest {parameter}, ascending")
    return ends


@dataclass
class Tracer:
    """Continuation of the branches of one regime in one parameter."""

    regime: Regime
    parameter: str
    bounds: tuple[float, float]
    effort: Effort

    def __post_init__(self) -> None:
        part = (self.bounds[1] - self.bounds[0]) / _PARTS
        self.scales = np.append(self.regime.window.half_widths, part)

    def family(self, firings: int) -> RegimeFamily:
        """Return the strobe map over a number of firings, as a function of state and parameter."""
        return RegimeFamily(self.regime, self.parameter, firings, self.effort.tolerance)

    def branch(
        self, state: FloatArray, firings: int, steps: Steps, progress: Progress | None = None
    ) -> Branch:
        """Trace the branch through the orbit of `firings` firings near a state, in both directions."""
        family = self.family(firings)
        curve = follow(
            family,
            state,
            self.regime.value(self.parameter),
            scales=self.scales,
            bounds=self.bounds,
            steps=steps,
            watch=self.watch(firings, steps, replace(self.effort, progress=progress)),
        )
        curve = self.grazed(family, curve)
        pieces, (first, last) = [(family, curve.nodes)], curve.stops
        before, first = self.resumed(family, curve.nodes, first, steps, backward=True)
        after, last = self.resumed(family, curve.nodes, last, steps, backward=False)
        return self.described([*reversed(before), *pieces, *after], (first, last), steps, self.effort.threads)

    def resumed(
        self, family: RegimeFamily, nodes: list[Node], stop: Stop, steps: Steps, *, backward: bool
    ) -> tuple[list[tuple[RegimeFamily, list[Node]]], Stop]:
        """Continue a branch past a section change; return the new segments and the reason for stopping.

        A branch is lost where an impact meets its section. If `backward`, the branch is continued beyond the
        first of its `nodes`, else beyond the last. Each new segment starts with the last orbit of the
        preceding segment, at the phase at which this orbit is farthest from its contacts. Orbits too close to
        the end at which the branch was lost are removed from `nodes`.
        """
        pieces: list[tuple[RegimeFamily, list[Node]]] = []
        while stop.reason in _LOST and len(pieces) < _MOST_SECTIONS and len(nodes) > 1:
            kept = self.before_end(nodes if backward else nodes[::-1])
            node = kept[0]
            regime = family.regime.with_(self.parameter, node.parameter)
            quiet = quiet_section(regime, node.state, family.firings, self.effort.tolerance)
            if quiet is None or abs(quiet[0].phase - regime.phase) < _SAME_PHASE:
                break
            tracer = self.at_phase(quiet[0].phase)
            way = self.way_at(family, kept, quiet)
            if way is None:
                break
            family = tracer.family(family.firings)
            try:
                curve = follow(
                    family,
                    quiet[1],
                    node.parameter,
                    scales=self.scales,
                    bounds=self.bounds,
                    steps=steps,
                    directions="up",
                    row=way,
                    watch=tracer.watch(family.firings, steps, self.effort),
                )
            except InputError:
                break
            if len(curve.nodes) < 2:
                break
            nodes[:] = kept if backward else kept[::-1]
            curve = tracer.grazed(family, curve)
            stop, nodes = curve.stops[1], curve.nodes
            if backward:
                nodes = [replace(each, tangent=-each.tangent, arc=-each.arc) for each in reversed(nodes)]
            nodes = [replace(each, arc=each.arc + node.arc) for each in nodes]
            pieces.append((family, nodes))
        return pieces, stop

    def before_end(self, nodes: list[Node]) -> list[Node]:
        """Drop orbits close to the first node, the end of a segment at which an impact meets the section.

        The impact spoils the derivatives of the strobe map there.
        """
        places = np.array([np.append(node.state, node.parameter) for node in nodes]) / self.scales
        away = np.linalg.norm(places - places[0], axis=1) > _CLEAR
        return nodes[min(int(np.argmax(away)) if away.any() else 0, len(nodes) - 2) :]

    def way_at(
        self, family: RegimeFamily, nodes: list[Node], quiet: tuple[Regime, FloatArray]
    ) -> FloatArray | None:
        """Compute the scaled direction in which a branch continues at a section with another phase.

        The first of `nodes` is the last orbit; `quiet` contains the regime at the new phase and the state of
        this orbit there. The direction is that of the chord from an earlier orbit, since the tangent is
        useless: a contact at the section has no derivative, and at a fold the sign of the parameter is
        ambiguous. None if no orbit is far enough from the last orbit, or if a run ends early.
        """
        last = nodes[0]
        end = np.append(quiet[1], last.parameter) / self.scales
        for node in nodes[1:]:
            own = family.regime.with_(self.parameter, node.parameter)
            there = state_later(own, node.state, quiet[0].phase, self.effort.tolerance)
            way = end - np.append(there, node.parameter) / self.scales
            length = float(np.linalg.norm(way))
            if not math.isfinite(length):
                return None
            if length > _LEAST_CHORD:
                return np.asarray(way / length)
        return None

    def at_phase(self, phase: float) -> Tracer:
        """Return a copy of the tracer whose section has the phase `phase`."""
        same = phase == self.regime.phase
        return self if same else replace(self, regime=replace(self.regime, phase=phase))

    def grazed(self, family: RegimeFamily, curve: Curve) -> Curve:
        """Extend a curve that ends near a grazing of a rigid backstop to the grazing itself."""
        if not has_rigid_backstop(self.regime):
            return curve
        nodes, stops = curve.nodes, list(curve.stops)
        for end, sign in ((0, -1.0), (-1, 1.0)):
            if stops[end].reason not in (*_LOST, GRAZING):
                continue
            last = replace(nodes[end], tangent=sign * nodes[end].tangent, arc=sign * nodes[end].arc)
            ended = grazing_end(family, self.scales, last)
            if ended is None:
                continue
            more, place = ended
            if end == 0:
                more = [replace(each, tangent=-each.tangent, arc=-each.arc) for each in reversed(more)]
            nodes = [*more, *nodes] if end == 0 else [*nodes, *more]
            stops[end] = Stop(GRAZING, place, nodes[end].state, _AT_GRAZING)
        return Curve(nodes, (stops[0], stops[1]))

    def followed(self, firings: int, event: BranchEvent, most: int, threads: int | None) -> Branch:
        """Follow the branch that is born at an event of a branch, or crosses the branch there.

        `firings` is the orbit period of the known branch, `most` the maximum number of steps.
        """
        if event.phase != self.regime.phase:
            return self.at_phase(event.phase).followed(firings, event, most, threads)
        way = self.doubled if event.kind == "period doubling" else self.crossed
        return way(firings, event, most, threads)

    def crossed(self, firings: int, event: BranchEvent, most: int, threads: int | None) -> Branch:
        """Follow the branch that crosses a branch of orbits of `firings` firings at an event."""
        family, steps = self.family(firings), Steps(most=most, precision=PRECISION)
        curve = follow_crossing(
            family,
            event.point.node,
            scales=self.scales,
            bounds=self.bounds,
            steps=steps,
            watch=self.watch(firings, steps, self.effort),
        )
        curve = self.grazed(family, curve)
        return self.described([(family, curve.nodes)], curve.stops, steps, threads)

    def doubled(self, firings: int, event: BranchEvent, most: int, threads: int | None) -> Branch:
        """Follow the branch that is born at a period doubling of orbits of `firings` firings."""
        family = self.family(2 * firings)
        steps = Steps(most=most, precision=PRECISION)
        curve = follow_doubled(
            family,
            event.point,
            scales=self.scales,
            bounds=self.bounds,
            steps=steps,
            watch=self.watch(2 * firings, steps, self.effort),
        )
        curve = self.grazed(family, curve)
        value, state = event.value, event.point.node.state
        sentence = f"the orbit is born at {self.at_value(value)}, in a period doubling"
        born = Stop(BIRTH, value, state, sentence)
        nodes = curve.nodes
        at_birth = family(state, value)
        if not at_birth.trouble:
            way = np.append(nodes[0].state - state, nodes[0].parameter - value) / self.scales
            arc = nodes[0].arc - float(np.linalg.norm(way))
            nodes = [Node(state, value, nodes[0].tangent, arc, at_birth, 0.0), *nodes]
        return self.described([(family, nodes)], (born, curve.stops[1]), steps, threads)

    def at(self, value: float, state: FloatArray, firings: int) -> FloatArray | None:
        """Find the orbit near a state at a value of the parameter; return its state, or None if not found."""
        follower = Corrector(self.family(firings), self.scales, PRECISION)
        node = follower.at_parameter(follower.scaled(state, value))
        return None if node is None else np.asarray(node.state)

    def at_value(self, value: float) -> str:
        """Format a value of the parameter with name and unit."""
        return f"{self.parameter} = {value:{_DIGITS}} {self.regime.quantity(self.parameter).si}"

    def watch(self, firings: int, steps: Steps, effort: Effort) -> Any:
        """Build the callback of `follow` that ends a branch of orbits of `firings` firings.

        The branch ends at a grazing of a rigid backstop, at a merger with orbits of fewer firings, or at the
        period doubling that creates the branch.
        """
        half, whole = None, self.family(firings)
        if firings % 2 == 0:
            half = Corrector(self.family(firings // 2), self.scales, steps.precision)
        rigid = has_rigid_backstop(self.regime)
        parts = [self.family(firings // k) for k in range(2, firings + 1) if firings % k == 0]
        taken, fading = 0, fades(whole, self.scales)

        def watched(here: Node, ahead: Node) -> Stop | None:
            nonlocal taken
            taken += 1
            effort.report(min(taken, 2 * steps.most), 2 * steps.most)
            if rigid and here.value.label != ahead.value.label:
                why = "its sequence of contacts changes in a grazing, where the strobe map has no derivative"
                return Stop(GRAZING, here.parameter, here.state, why, here)
            if rigid and fading(here, ahead):
                return Stop(GRAZING, ahead.parameter, ahead.state, _AT_GRAZING)
            born = None if half is None else birth_of(half, here, ahead)
            if born is None:
                shorter = [part for part in parts if self.is_repeat(part, ahead)]
                return self.merged(shorter, here, ahead) if shorter else None
            if born.node is None:
                return born
            # The doubling was located on the curve of half the period; the branch stores whole-period values.
            value = whole(born.node.state, born.node.parameter)
            last = replace(born.node, value=value) if not value.trouble else here
            return replace(born, node=last)

        return watched

    def is_repeat(self, part: RegimeFamily, node: Node) -> bool:
        """Whether an orbit already repeats after the firings of `part`, a fraction of its own firings."""
        end = part.end_of(node.state, node.parameter)
        return end is not None and bool(np.abs((end - node.state) / self.scales[:2]).max() < _SHORTER)

    def merged(self, shorter: list[RegimeFamily], here: Node, ahead: Node) -> Stop:
        """Build the `Stop` of a branch whose last step jumped to an orbit of fewer firings.

        Near a period doubling the curves of both periods are so close that a step may jump between them.
        """
        longest = max(shorter, key=lambda part: part.firings)
        half = Corrector(longest, self.scales, PRECISION)
        single = half.at_parameter(half.point(ahead))
        node = None if single is None else doubling_near(half, single)
        if node is not None:
            before = half.point(here)
            step = float(np.linalg.norm(half.point(ahead) - before))
            if float(np.linalg.norm(half.point(node) - before)) < 3.0 * step:
                return Stop(BIRTH, node.parameter, node.state, "born", here)
        sentence = f"it merges with an orbit of {longest.firings} firings"
        return Stop("merged", here.parameter, here.state, sentence, here)

    def described(
        self,
        pieces: list[tuple[RegimeFamily, list[Node]]],
        stops: tuple[Stop, Stop],
        steps: Steps,
        threads: int | None,
    ) -> Branch:
        """Build a `Branch` from segments with different sections; compute the properties of its orbits."""
        family = pieces[0][0]
        # A segment begins with the last orbit of the segment before it.
        owned = [
            (own, node) for k, (own, part) in enumerate(pieces) for node in (part if k == 0 else part[1:])
        ]
        nodes = [node for _, node in owned]
        courses = mapped(lambda pair: pair[0].course(pair[1].state, pair[1].parameter), owned, threads)
        count = len(nodes)
        passages: list[Passage] = [node.value.extra for node in nodes]
        dots = [passage.dots for passage in passages]

        def of_dots(place: int) -> FloatArray:
            rows = [[math.nan if dot is None else dot[place] for dot in row] for row in dots]
            return np.array(rows, dtype=np.float64).reshape(count, family.firings)

        def of_courses(name: str) -> FloatArray:
            return np.array([getattr(course, name) for course in courses], dtype=np.float64)

        states = of_courses("states").reshape(count, family.firings, 2)
        events: list[BranchEvent] = []
        begin = 0
        for k, (own, part) in enumerate(pieces):
            if k:
                moved = BranchPoint("section", part[0], begin, (part[0].value.label, part[0].value.label))
                events.append(event_of(moved, own.regime.phase))
            inside = stops[0] if k == 0 else _NO_STOP, stops[1] if k + 1 == len(pieces) else _NO_STOP
            points = points_of(
                own,
                Curve(part, inside),
                self.scales,
                steps.precision,
                lambda node, own=own: own.margin(node.state, node.parameter),  # type: ignore[misc]
            )
            events += [
                event_of(replace(point, after=point.after + begin), own.regime.phase) for point in points
            ]
            begin += len(part) - 1
        lost = np.array([sum(dot is None for dot in row) for row in dots], dtype=np.int64)
        first, last = stops
        return Branch(
            regime=self.regime,
            parameter=self.parameter,
            unit=self.regime.quantity(self.parameter).si,
            bounds=self.bounds,
            firings=family.firings,
            tolerance=self.effort.tolerance,
            values=np.array([node.parameter for node in nodes]),
            phases=np.array([own.regime.phase for own, _ in owned]),
            x=states[:, :, 0],
            v=states[:, :, 1],
            multipliers=np.array([node.multipliers for node in nodes]).reshape(count, 2),
            backstop_contacts=np.array([len(row.of("backstop")) for row in passages], dtype=np.int64),
            pack_contacts=np.array([len(row.of("pack")) for row in passages], dtype=np.int64),
            printed=family.firings - lost,
            lost=lost,
            flight_time=of_dots(0),
            impact_speed=of_dots(1),
            peak_force=of_courses("peak_forces").reshape(count, family.firings),
            coil_work=of_courses("coil_work"),
            drive_work=of_courses("drive_work"),
            pack_loss=of_courses("pack_loss"),
            backstop_loss=of_courses("backstop_loss"),
            damping_loss=of_courses("damping_loss"),
            residual=np.array([node.residual for node in nodes]),
            contacts=tuple(row.sequence for row in passages),
            symmetry=self.symmetry_of(*owned[count // 2]),
            events=tuple(events),
            stops=(self.in_words(first), self.in_words(last)),
            curve=Curve(nodes, stops),
            follow_event=partial(self.followed, family.firings),
        )

    def symmetry_of(self, family: RegimeFamily, node: Node) -> str:
        """Classify an orbit as "symmetric" (its own mirror image) or "asymmetric"; "" if undefined."""
        regime = family.regime.with_(self.parameter, node.parameter)
        image = mirror_image(regime, node.state, self.effort.tolerance)
        if image is None or not np.isfinite(image).all():
            return ""
        states = np.asarray(family.course(node.state, node.parameter).states)
        apart = np.abs((states - image) / self.scales[:2]).max(axis=1).min()
        return "symmetric" if apart < _SHORTER else "asymmetric"

    def in_words(self, stop: Stop) -> Stop:
        """Return a copy of a `Stop` whose sentence states the parameter value with its unit."""
        at = self.at_value(stop.parameter)
        why = stop.sentence.rpartition(": ")[2]
        sentences = {
            "bound": f"{at} is the bound",
            "closed": f"the branch closes upon itself at {at}",
            "no value": f"beyond {at} there is no strobe map: {why}",
            "lost": f"beyond {at} Newton's method does not converge",
            "jump": f"beyond {at} Newton's method converges to another curve",
            "length": f"the maximum number of steps is reached at {at}",
            GRAZING: f"at {at} {why}",
            "merged": f"close to {at} {why}",
            BIRTH: f"at {at} it is born in the period doubling of an orbit of half its period",
            "not asked": f"it was not followed beyond {at}",
        }
        return replace(stop, sentence=sentences.get(stop.reason, stop.sentence))
