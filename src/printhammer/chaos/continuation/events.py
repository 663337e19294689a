"""What happens along a branch of periodic orbits, in the words of a hammer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from printhammer.chaos.continuation.family import Passage, Surface, Touch
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.chaos.continuation.branch_points import BranchPoint
    from printhammer.support.arrays import BoolArray, FloatArray

EventKind = Literal["fold", "period doubling", "Neimark-Sacker", "branching", "grazing", "section"]
KINDS: Final[tuple[str, ...]] = get_args(EventKind)

Change = Literal["", "appears", "vanishes", "splits", "merges", "several"]


class BranchEvent(Declared, eq=False):
    """A point of a branch at which something happens."""

    kind: EventKind = part(
        '"fold": the branch turns back; "period doubling": a multiplier is -1, orbits of twice the period are'
        ' born; "Neimark-Sacker": a complex pair of multipliers crosses the unit circle, a torus is born;'
        ' "branching": two branches cross; "grazing": a contact appears or vanishes; "section": nothing'
        " to the orbit, but a contact comes near the section, which moves to another phase"
    )
    value: float = part("of the constant, SI")
    state: FloatArray = part("displacement, m, and velocity, m/s, at the section, shape (2,)")
    phase: float = part("part of the period from a firing to the section")
    multipliers: npt.NDArray[np.complex128] = part("the multipliers there, shape (2,)")
    surface: str = part('of a grazing: "pack", "backstop" or, where several contacts change at once, ""')
    change: Change = part(
        'of a grazing, as the constant grows: a contact "appears", "vanishes", "splits" in two or two "merge"'
        ' ("merges"); "several" where more than one changes at once. Else empty'
    )
    contacts: tuple[str, str] = part("sequence of contacts before and after it along the branch")
    after: int = part("number of the orbit of the branch that it follows")
    sharp: bool = part("whether it was located; otherwise it is known between two orbits only")
    point: BranchPoint = part("the point of the curve", repr=False)

    @property
    def message(self) -> str:
        """What happens, in a few words."""
        if self.kind == "section":
            return f"a contact nears the section, which moves to the phase {self.phase:.4g}"
        if self.kind != "grazing":
            return self.kind
        if self.change == "several":
            return "grazing: several contacts change"
        whose = f"{self.surface} contact"
        return f"grazing: {f'two {whose}s merge' if self.change == 'merges' else f'a {whose} {self.change}'}"


def event_of(point: BranchPoint, phase: float = 0.0) -> BranchEvent:
    """Return a point of a curve, looked at at a phase, in the words of a hammer."""
    surface, change = ("", "") if point.sides is None else _grazing(point)
    return BranchEvent(
        kind="grazing" if point.kind == "change" else point.kind,
        value=point.parameter,
        state=np.array(point.node.state),
        phase=phase,
        multipliers=point.node.multipliers,
        surface=surface,
        change=change,  # type: ignore[arg-type]
        contacts=(str(point.labels[0]), str(point.labels[1])),
        after=point.after,
        sharp=point.sharp,
        point=point,
    )


def _grazing(point: BranchPoint) -> tuple[str, str]:
    """Return on which surface a contact changes, and how as the constant grows."""
    assert point.sides is not None
    ordered = sorted(point.sides, key=lambda node: node.parameter)
    before, after = (node.value.extra for node in ordered)
    if not isinstance(before, Passage) or not isinstance(after, Passage):
        return "", "several"
    surfaces: tuple[Surface, ...] = ("pack", "backstop")
    changed = [surface for surface in surfaces if len(before.of(surface)) != len(after.of(surface))]
    if len(changed) != 1:
        return "", "several"
    (surface,) = changed
    more = len(after.of(surface)) - len(before.of(surface))
    if abs(more) != 1:
        return surface, "several"
    parts = _parted((after if more > 0 else before).of(surface), before.period * before.firings)
    if parts:
        return surface, "splits" if more > 0 else "merges"
    return surface, "appears" if more > 0 else "vanishes"


def _parted(touches: list[Touch], length: float) -> bool:
    """Return whether the shortest gap between contacts is shorter than the shortest contact."""
    durations = [touch.t_out - touch.t_in for touch in touches]
    if len(touches) < 2 or min(durations) == 0.0:
        return False
    begins = [touch.t_in for touch in touches]
    gaps = [
        begin - touch.t_out
        for touch, begin in zip(touches, [*begins[1:], begins[0] + length], strict=True)
        if math.isfinite(touch.t_out)
    ]
    return bool(gaps) and min(gaps) < min(durations)


def stable_ranges(
    along: FloatArray, stable: BoolArray, events: Sequence[BranchEvent]
) -> list[tuple[float, float]]:
    """Return the ranges of the constant over which the orbits of a branch are stable, ascending."""
    limits = [event for event in events if event.kind not in ("grazing", "section")]
    values = along.tolist()
    ranges: list[tuple[float, float]] = []
    begin: float | None = None
    for i, value in enumerate(values):
        if i and bool(stable[i]) != bool(stable[i - 1]):
            between = [event.value for event in limits if event.after == i - 1]
            edge = between[0] if between else 0.5 * (value + values[i - 1])
            if stable[i]:
                begin = between[-1] if between else edge
            elif begin is not None:
                ranges.append((begin, edge))
                begin = None
        elif not i and stable[0]:
            begin = value
    if begin is not None:
        ranges.append((begin, values[-1]))
    return sorted((min(pair), max(pair)) for pair in ranges)
