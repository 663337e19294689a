"""Branch: a curve of periodic orbits in one parameter, with its bifurcations and grazings.

Events along a branch are described in terms of the hammer, e.g. its contacts with pack and backstop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, Literal, SupportsIndex, get_args

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.arclength import Curve, Stop
from printhammer.chaos.continuation.branch_points import BIRTH, BranchPoint
from printhammer.chaos.continuation.crossings import CROSSINGS, Crossing
from printhammer.chaos.continuation.family import Passage, Surface, Touch
from printhammer.chaos.orbits.orbit import Orbit
from printhammer.chaos.orbits.search import orbit
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.results import Column, Declared, Result, column, derived, part, scalar
from printhammer.results.declare import heading
from printhammer.results.files import plain
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    multiplier,
    styled,
)
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

EventKind = Literal["fold", "period doubling", "Neimark-Sacker", Crossing, "grazing", "section"]
KINDS: Final[tuple[str, ...]] = get_args(EventKind)

Change = Literal["", "appears", "vanishes", "splits", "merges", "several"]


class BranchEvent(Declared, eq=False):
    """Event on a branch: a bifurcation, a grazing, or a change of the section."""

    kind: EventKind = part(
        '"fold": the branch turns back; "period doubling": a multiplier is -1, orbits of twice the period'
        ' are born; "Neimark-Sacker": a complex pair of multipliers crosses the unit circle, a torus is'
        ' born; "pitchfork", "transcritical": two branches cross, and one or none turns back; "branching": a'
        ' crossing of unknown kind; "grazing": a contact appears or vanishes; "section": the section moves'
        " to another phase, since a contact nears it"
    )
    value: float = part("value of the parameter, SI")
    state: FloatArray = part("displacement [m] and velocity [m/s] at the section, shape (2,)")
    phase: float = part("phase of the section, as a fraction of the period")
    multipliers: npt.NDArray[np.complex128] = part("multipliers at the point, shape (2,)")
    surface: str = part('surface of a grazing: "pack", "backstop" or, if several contacts change, ""')
    change: Change = part(
        'change at a grazing as the parameter grows: a contact "appears", "vanishes" or "splits", two'
        ' contacts "merge" ("merges"), or "several" contacts change; empty for other events'
    )
    contacts: tuple[str, str] = part("sequence of contacts before and after the point along the branch")
    after: int = part("index of the orbit of the branch before the point")
    sharp: bool = part("whether the point was located; otherwise it is only bracketed by two orbits")
    point: BranchPoint = part("special point of the curve", repr=False)

    @property
    def message(self) -> str:
        """Short description of the event, such as "grazing: a pack contact appears"."""
        if self.kind == "section":
            return f"a contact nears the section, which moves to the phase {self.phase:.4g}"
        if self.kind != "grazing":
            return self.kind
        if self.change == "several":
            return "grazing: several contacts change"
        whose = f"{self.surface} contact"
        return f"grazing: {f'two {whose}s merge' if self.change == 'merges' else f'a {whose} {self.change}'}"


def event_of(point: BranchPoint, phase: float = 0.0) -> BranchEvent:
    """Convert a special point of a curve of fixed points to an event of a branch.

    `phase` is the phase of the section at which the state of the fixed point applies.
    """
    surface, change = ("", "") if point.sides is None else _grazing_of(point)
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


def _grazing_of(point: BranchPoint) -> tuple[str, str]:
    """Return the surface that the orbit grazes at a contact change, and the kind of change.

    The kind is "appears", "vanishes", "splits", "merges" or "several".
    """
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
    parts = _is_parted((after if more > 0 else before).of(surface), before.period * before.firings)
    if parts:
        return surface, "splits" if more > 0 else "merges"
    return surface, "appears" if more > 0 else "vanishes"


def _is_parted(touches: list[Touch], length: float) -> bool:
    """Whether two successive contacts of an orbit are separated by a gap shorter than every contact.

    Such a gap appears when a contact splits. `touches` are the touches of one surface in a period of the
    orbit, and `length` is the length of this period [s].
    """
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
    along: FloatArray, stable: BoolArray, events: Sequence[BranchEvent], ends: tuple[float, float]
) -> list[tuple[float, float]]:
    """Compute the ranges of the parameter over which the orbits of a branch are stable, in ascending order.

    `along` contains the parameter value of each orbit of the branch, `stable` whether it is stable. `ends`
    are the parameter values at the ends of the branch, which may lie beyond its first and last orbit. Where a
    branch of asymmetric orbits turns back at a pitchfork, its orbits stay stable.
    """
    limits = [event for event in events if event.kind not in ("grazing", "section")]
    values = along.tolist()
    ranges: list[tuple[float, float]] = []
    stretch: list[float] = []
    for i, value in enumerate(values):
        if i and bool(stable[i]) != bool(stable[i - 1]):
            between = [event.value for event in limits if event.after == i - 1]
            edge = between[0] if between else 0.5 * (value + values[i - 1])
            if stable[i]:
                stretch = [between[-1] if between else edge, value]
            else:
                ranges.append((min(*stretch, edge), max(*stretch, edge)))
        elif stable[i]:
            stretch += [value] if i else [ends[0], value]
            stretch += [event.value for event in limits if event.after == i - 1]
    if len(stable) and stable[-1]:
        ranges.append((min(*stretch, ends[1]), max(*stretch, ends[1])))
    return sorted(ranges)


MOST: Final = 1000
"""Default maximum number of continuation steps in each direction; arbitrary."""

_DIGITS: Final = ".9g"


class Branch(Result):
    """Branch: a curve of periodic orbits in one parameter, with its bifurcations and grazings.

    Every array has one row for each orbit, in order along the curve; the values of the parameter need not
    ascend. Reasons for stopping: "bound" (the parameter reaches a bound), "closed" (the curve returns to its
    start), "period doubling" (the branch is born there), "grazing" (of a rigid backstop), "merged" (with an
    orbit of fewer firings), "no value" (a run ended early), "lost" (Newton's method does not converge),
    "jump" (Newton's method converges to another curve), "length" (the maximum number of steps is reached).
    """

    regime: Regime = part("hammer and periodic drive at the start, and phase of the section")
    parameter: str = scalar(
        "", 'name of the parameter: "period", "rate", or the key of a constant of hammer, waveform or drive'
    )
    unit: str = part("SI unit of the parameter")
    bounds: tuple[float, float] = scalar("SI", "parameter values between which the branch was followed")
    firings: int = column("1", "number of firings after which the orbits repeat", "", dtype=np.int32)
    tolerance: float = part("tolerance of the integration")
    values: FloatArray = column("SI", "value of the parameter", "orbit", name="value")
    phases: FloatArray = column(
        "1",
        "phase of the section, as a fraction of the period",
        "orbit",
        more="changes where a contact nears the section",
        name="orbit_phase",
    )
    x: FloatArray = column("m", "displacement at the section", "orbit firing")
    v: FloatArray = column("m/s", "velocity at the section", "orbit firing")
    multipliers: npt.NDArray[np.complex128] = part(
        "Floquet multipliers of the orbits, the larger absolute value first", more="shape (N, 2)", repr=False
    )
    backstop_contacts: IntArray = column(
        "1", "number of backstop contacts in one period of the orbit", "orbit", dtype=np.int32
    )
    pack_contacts: IntArray = column(
        "1", "number of pack contacts in one period of the orbit", "orbit", dtype=np.int32
    )
    printed: IntArray = column(
        "1", "number of firings in one period that print a dot", "orbit", dtype=np.int32
    )
    lost: IntArray = column("1", "number of firings in one period that print no dot", "orbit", dtype=np.int32)
    flight_time: FloatArray = column(
        "s", "time from the firing to the touch of the pack", "orbit firing", more="nan for a lost dot"
    )
    impact_speed: FloatArray = column(
        "m/s", "velocity at the touch of the pack", "orbit firing", more="nan for a lost dot"
    )
    peak_force: FloatArray = column("N", "largest pack force", "orbit firing", more="nan for a lost dot")
    coil_work: FloatArray = column("J", "work of the coil in one period of the orbit", "orbit")
    drive_work: FloatArray = column("J", "work of a force drive in one period of the orbit", "orbit")
    pack_loss: FloatArray = column("J", "energy absorbed by the pack in one period of the orbit", "orbit")
    backstop_loss: FloatArray = column(
        "J", "energy absorbed by the backstop in one period of the orbit", "orbit"
    )
    damping_loss: FloatArray = column(
        "J", "energy dissipated by the damping in one period of the orbit", "orbit"
    )
    residual: FloatArray = column(
        "1", "closing error after one period, in half-widths of the window", "orbit"
    )
    contacts: tuple[str, ...] = part(
        "sequence of the contacts of each orbit, P for the pack and B for the backstop", repr=False
    )
    symmetry: str = scalar(
        "",
        'whether the middle orbit is its own mirror image, x -> -x half a period later: "symmetric" or'
        ' "asymmetric"; "" if a pack or a backstop acts on one side',
    )
    events: tuple[BranchEvent, ...] = part(
        "folds, period doublings, Neimark-Sacker points, crossings and grazings, in order along the curve",
        repr=False,
    )
    stops: tuple[Stop, Stop] = part(
        "ends of the branch before its first and after its last orbit, with the reasons for stopping",
        repr=False,
    )
    follow_event: Callable[[BranchEvent, int, int | None], Branch] = part(
        "function that follows the branch from an event, given the numbers of steps and threads", repr=False
    )
    curve: Curve = part(
        "branch as a curve of fixed points of `printhammer.chaos.continuation.arclength`", repr=False
    )

    @property
    def title(self) -> str:
        """Title of the branch: orbit period, name of the hammer, and parameter."""
        kind = f"{self.symmetry} period" if self.symmetry else "period"
        return f"{kind}-{self.firings} orbits of {self.regime.hammer.name} along {self.parameter}"

    def summary(self) -> Summary:
        """Summarise the stable ranges of the parameter and the events of the branch."""
        stable = [
            f"   {styled('good', 'stable')} from {low:.9g} to {high:.9g} {self.unit}"
            for low, high in self.stable_ranges
        ]
        columns = [
            Cells(
                self.parameter,
                [event.value for event in self.events],
                self.unit if self.unit != "1" else "",
                ".9g",
            ),
            Cells("event", [event.message for event in self.events], left=True),
            Cells("multipliers", ["  ".join(map(multiplier, event.multipliers)) for event in self.events]),
            Cells("", ["" if event.sharp else "between two orbits" for event in self.events], left=True),
        ]
        return Summary([*stable, *([Grid(columns)] if self.events else [])])

    def __len__(self) -> int:
        return len(self.values)

    @property
    @derived("1", "phase of the section, as a fraction of the period")
    def phase(self) -> float:
        """Phase of the section at the first orbit, as a fraction of the period; see also `phases`."""
        return self.regime.phase

    @property
    @derived("1", "whether all small perturbations of the state decay", "orbit", dtype=np.int32)
    def stable(self) -> BoolArray:
        """Mask of the stable orbits, shape (N,): all small perturbations decay.

        Where a branch is born at a period doubling, a multiplier is 1; the orbit there is assigned the
        stability of its neighbour.
        """
        stable = np.asarray(np.abs(self.multipliers[:, 0]) < 1.0)
        for end, beside, stop in ((0, 1, self.stops[0]), (-1, -2, self.stops[1])):
            if stop.reason == BIRTH and len(stable) > 1:
                stable[end] = stable[beside]
        return stable

    @property
    @derived("1", "whether the branch is a closed loop", kind="column", dtype=np.int32)
    def closed(self) -> bool:
        """Whether the branch is an isola: a closed loop, whose ends coincide."""
        return self.curve.closed

    @property
    def stable_ranges(self) -> list[tuple[float, float]]:
        """Ranges of the parameter over which the orbits are stable, in ascending order."""
        return stable_ranges(
            self.values, self.stable, self.events, (self.stops[0].parameter, self.stops[1].parameter)
        )

    @property
    def message(self) -> str:
        """Description of the branch, and the reasons for stopping at its two ends, in one line."""
        reached = [*self.values.tolist(), *(event.value for event in self.events if event.kind == "fold")]
        low, high = min(reached), max(reached)
        span = f"{self.parameter} from {low:{_DIGITS}} to {high:{_DIGITS}} {self.unit}"
        what = f"period-{self.firings} branch of {len(self)} orbits, {span}"
        if self.closed:
            return f"{what}: a closed loop"
        first, last = (stop.sentence for stop in self.stops)
        return f"{what}; at its first orbit {first}; at its last orbit {last}"

    def notes(self) -> dict[str, Any]:
        """Return the reasons for stopping and the stable ranges, for the attributes of the Dataset."""
        first, last = (stop.sentence for stop in self.stops)
        stable = [list(pair) for pair in self.stable_ranges]
        return {"first_end": first, "last_end": last, "stable_ranges": stable}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: properties of the orbits along `orbit`, events along `event`."""
        own = super().entries()
        own["value"] = replace(own["value"][0], unit=self.unit, meaning=self.parameter), self.values
        for name in ("real", "imag"):
            pair = ("orbit", "multiplier")
            note = Column("1", f"{name} part of the multipliers", pair, name=f"multiplier_{name}")
            own[note.name] = note, getattr(self.multipliers, name)
        # At least one: a dimension of length 0 has another meaning in the classic NetCDF format.
        rows = self.events or (None,)
        for name, unit, meaning, missing, value in (
            ("kind", "1", "kind of the event", -1, lambda event: KINDS.index(event.kind)),
            ("value", self.unit, self.parameter, np.nan, lambda event: event.value),
            ("after", "1", "index of the orbit before the event", -1, lambda event: event.after),
            ("located", "1", "whether the event was located", -1, lambda event: event.sharp),
            ("x", "m", "displacement at the section at the event", np.nan, lambda event: event.state[0]),
            ("v", "m/s", "velocity at the section at the event", np.nan, lambda event: event.state[1]),
            (
                "phase",
                "1",
                "phase of the section at the event, fraction of the period",
                np.nan,
                lambda event: event.phase,
            ),
            ("text", "", "description of the event in a few words", "", lambda event: event.message),
            (
                "contacts_before",
                "",
                "sequence of contacts before the event",
                "",
                lambda event: event.contacts[0],
            ),
            (
                "contacts_after",
                "",
                "sequence of contacts after the event",
                "",
                lambda event: event.contacts[1],
            ),
        ):
            codes, dtype = KINDS if name == "kind" else (), np.int32 if missing == -1 else None
            note = Column(unit, meaning, ("event",), name=f"event_{name}", dtype=dtype, codes=codes)
            own[note.name] = note, np.array([missing if row is None else value(row) for row in rows])
        there = np.array([np.full(2, np.nan) if row is None else row.multipliers for row in rows])
        for name in ("real", "imag"):
            meaning = f"{name} part of the multipliers there"
            note = Column("1", meaning, ("event", "multiplier"), name=f"event_multiplier_{name}")
            own[note.name] = note, getattr(there.astype(np.complex128), name)
        return own

    def to_dataframe(self) -> pd.DataFrame:
        """Convert the branch to a table with one row per orbit and firing."""
        return branches_table([self], self.attributes).drop(columns="branch")

    def orbit(self, number: int) -> Orbit:
        """Recompute one orbit of the branch by Newton's method, at its value of the parameter.

        Parameters
        ----------
        number : int
            Index of the orbit along the branch.
        """
        regime = replace(self.regime, phase=float(self.phases[number]))
        regime = regime.with_(self.parameter, float(self.values[number]))
        state = self.curve.nodes[number].state
        return orbit(regime, state, firings=self.firings, tolerance=self.tolerance)

    def doubled(
        self, event: BranchEvent, *, most: SupportsIndex = MOST, threads: int | None = None
    ) -> Branch:
        """Follow the branch of twice the period that is born at a period doubling of this branch.

        Parameters
        ----------
        event : BranchEvent
            A period doubling, from `events`.
        most : int, optional
            Maximum number of steps in each direction.
        threads : int, optional
            Number of threads; by default the number of cores.

        Raises
        ------
        InputError
            The event is not a period doubling of this branch, or Newton's method finds no orbit of twice the
            period nearby.
        """
        if event.kind != "period doubling" or event not in self.events:
            raise InputError.of("event", event.kind, "a period doubling of this branch")
        return self.follow_event(event, read_count(most, "most"), threads)

    def crossing(
        self, event: BranchEvent, *, most: SupportsIndex = MOST, threads: int | None = None
    ) -> Branch:
        """Follow the branch that crosses this branch at a pitchfork or a transcritical point.

        Parameters
        ----------
        event : BranchEvent
            A pitchfork, transcritical or branching point, from `events`.
        most, threads
            As for `doubled`.

        Raises
        ------
        InputError
            The event is not a crossing of this branch, or Newton's method finds no orbit of another branch
            nearby.
        """
        if event.kind not in CROSSINGS or event not in self.events:
            raise InputError.of("event", event.kind, "a crossing of this branch")
        return self.follow_event(event, read_count(most, "most"), threads)


def branches_table(branches: Sequence[Branch], attributes: Mapping[str, Any]) -> pd.DataFrame:
    """Convert branches to a table with one row per orbit and firing."""
    import pandas as pd

    tables = []
    for number, branch in enumerate(branches):
        count, firings = len(branch), branch.firings
        entries = branch.entries()
        columns: dict[str, Any] = {
            "branch": np.full(count * firings, number),
            "orbit": np.repeat(np.arange(count), firings),
            "firing": np.tile(np.arange(firings), count),
            heading(branch.parameter, branch.unit): np.repeat(branch.values, firings),
        }
        for name, (note, values) in entries.items():
            if note.dims == ("orbit", "firing"):
                columns[note.heading(name)] = values.reshape(-1)
        for name, (note, values) in entries.items():
            if note.dims == ("orbit",) and name != "value":
                columns[note.heading(name)] = np.repeat(values, firings)
        for j in range(2):
            columns[f"multiplier_{j}_real"] = np.repeat(branch.multipliers[:, j].real, firings)
            columns[f"multiplier_{j}_imag"] = np.repeat(branch.multipliers[:, j].imag, firings)
        columns["contacts"] = np.repeat(np.array(branch.contacts, dtype=object), firings)
        tables.append(pd.DataFrame(columns))
    table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=["branch", "orbit"])
    table.attrs.update(plain(dict(attributes)))
    return table
