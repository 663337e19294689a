"""Bifurcation curves in a plane of two parameters, continued from events of branches or from saved curves.

A `BifurcationCurve` contains the points at which an orbit bifurcates, and the points of codimension two.

`settled_plane` computes the periods of trains from rest on a grid of the plane, as an ensemble.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, SupportsIndex

import numpy as np
import numpy.typing as npt

from printhammer.chaos.continuation.arclength import Steps, Stop
from printhammer.chaos.continuation.branch import Branch, BranchEvent
from printhammer.chaos.continuation.tracer import read_bounds
from printhammer.chaos.curves.codimension import CodimensionTwo
from printhammer.chaos.curves.normal_forms import MOST_PERIODS, grazing_sides, root_coefficient
from printhammer.chaos.curves.starts import start_of
from printhammer.chaos.curves.systems import GRAZING, CurvePoint, Plane, check_two
from printhammer.chaos.curves.tracing import PRECISION, CurveTracer, Traced
from printhammer.chaos.strobe.train import States, Train, run_trains
from printhammer.drive.input import read_count, read_number
from printhammer.errors import InputError
from printhammer.results import Column, Reopened, Result, column, derived, part, provenance, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    multiplier,
)
from printhammer.run.effort import Effort
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

SAME: Final = 1e-3
"""Distance from the unit circle within which a multiplier is treated as critical; arbitrary."""


class BifurcationCurve(Result, rows="point"):
    """Curve in the plane of two parameters on which a periodic orbit bifurcates.

    Every array has one row per point, in order along the curve.
    """

    regime: Regime = part("hammer and periodic drive at the start")
    kind: str = scalar("", '"fold", "period doubling", "Neimark-Sacker" or "grazing"')
    surface: str = scalar("", 'surface of a grazing: "pack" or "backstop"; else empty')
    names: tuple[str, str] = scalar("", "names of the two parameters")
    units: tuple[str, str] = scalar("", "SI units of the parameters")
    bounds: tuple[tuple[float, float], tuple[float, float]] = scalar("SI", "ranges of the parameters")
    firings: int = scalar("1", "number of firings after which the orbits repeat")
    tolerance: float = part("tolerance of the integration")
    first: FloatArray = column("SI", "value of the first parameter", "point")
    second: FloatArray = column("SI", "value of the second parameter", "point")
    state: FloatArray = part("displacement [m] and velocity [m/s] at the section, shape (N, 2)", repr=False)
    phase: FloatArray = column(
        "1",
        "phase of the section, as a fraction of the period, from a firing on",
        "point",
        more="for a grazing: phase of the touch",
    )
    multipliers: npt.NDArray[np.complex128] = part(
        "Floquet multipliers, the larger absolute value first",
        more="shape (N, 2); for a grazing those of the orbit without the touch",
        repr=False,
    )
    coefficient: FloatArray = column(
        "SI",
        "coefficient of the normal form",
        "point",
        more="for a period doubling dimensionless, positive if supercritical; for a grazing of a rigid"
        " backstop the factor of the square root, m^(1/2)/s; nan for other kinds or if unknown",
    )
    sides: IntArray = column(
        "1",
        "side of a grazing of a rigid backstop on which orbits exist",
        "point orbit",
        more="orbit without the touch, then orbits with one touch in 1, 2, 3 and 4 periods: 1 for larger"
        " values of the first parameter, -1 for smaller values, 0 for neither side",
        dtype=np.int32,
    )
    contacts: tuple[str, ...] = part(
        "sequence of the contacts of each orbit, P for the pack and B for the backstop", repr=False
    )
    points: tuple[CodimensionTwo, ...] = part("points of codimension two, in order along the curve")
    stops: tuple[Stop, Stop] = part("ends of the curve, with the reasons for stopping", repr=False)
    grid: tuple[FloatArray, FloatArray] = part(
        "values of the two parameters, shapes (m,) and (n,), at which trains from rest were classified",
        repr=False,
    )
    crossings: Callable[[int, float], list[CurvePoint]] = part(
        "function that solves for the points at which the first or second parameter has a given value",
        repr=False,
    )
    settled: IntArray = column(
        "1",
        "number of firings after which the train from rest repeats",
        "value main",
        more="0 if it does not repeat within the firings simulated, -1 if its run stopped",
        dtype=np.int32,
    )

    def __len__(self) -> int:
        return len(self.first)

    @property
    def title(self) -> str:
        """Title of the curve: kind of the bifurcation, orbit period, and name of the hammer."""
        return f"{self.kind} of period-{self.firings} orbits of {self.regime.hammer.name}"

    def summary(self) -> Summary:
        """Summarise the curve and its points of codimension two."""
        if not self.points:
            return Summary([self.message])
        first, second = (unit if unit != "1" else "" for unit in self.units)
        columns = [
            Cells(self.names[0], [point.first for point in self.points], first, ".9g"),
            Cells(self.names[1], [point.second for point in self.points], second, ".9g"),
            Cells("kind", [point.message for point in self.points], left=True),
            Cells("multipliers", ["  ".join(map(multiplier, point.multipliers)) for point in self.points]),
        ]
        return Summary([Grid(columns), "", self.message])

    @property
    @derived("1", "whether a stable orbit loses its stability at the point", "point")
    def limits(self) -> BoolArray:
        """Mask of the points of the curve at which a stable orbit loses its stability."""
        if self.kind == "grazing":
            return np.asarray(np.abs(self.multipliers).max(axis=1) < 1.0)
        return np.asarray(np.abs(self.multipliers).max(axis=1) < 1.0 + SAME)

    @property
    def criticality(self) -> tuple[str, ...]:
        """Criticality of a period doubling at each point: "supercritical", "subcritical" or "" if unknown."""
        if self.kind != "period doubling":
            return ("",) * len(self)
        words = {1.0: "supercritical", -1.0: "subcritical"}
        return tuple(words.get(float(sign), "") for sign in np.sign(self.coefficient))

    @property
    def message(self) -> str:
        """Description of the curve, its special points, and the reasons for stopping, in one line."""
        count = len(self)
        spans = " and ".join(
            f"{name} from {values.min():.9g} to {values.max():.9g} {unit}".removesuffix(" 1")
            for name, values, unit in zip(self.names, (self.first, self.second), self.units, strict=True)
        )
        what = f"{self.kind} of the period-{self.firings} orbit, {count} points, {spans}"
        words = Counter(word for word in self.criticality if word)
        kinds = [f"{word} at {number} of {count}" for word, number in words.items()]
        kinds += [f"{point.message} at ({point.first:.9g}, {point.second:.9g})" for point in self.points]
        ends = [
            f"at its {name} point {stop.sentence}"
            for name, stop in zip(("first", "last"), self.stops, strict=True)
        ]
        if self.stops[0].reason == "closed":
            ends = ["a closed loop"]
        return "; ".join([what, *kinds, *ends])

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the curve: hammer, waveform, tolerance, versions."""
        regime = self.regime
        return provenance(
            hammer=regime.hammer,
            waveform=regime.fired,
            overlap=regime.overlap,
            period=regime.period,
            tolerance=self.tolerance,
        )

    def at(self, name: str, value: float | str) -> list[tuple[float, float]]:
        """Find all points of the curve at which one of the two parameters has a given value, in order.

        Parameters
        ----------
        name : str
            Name of one of the two parameters.
        value : float or str
            Value in SI, or text with a unit.
        """
        if name not in self.names:
            raise InputError.of("name", name, f"{self.names[0]} or {self.names[1]}")
        which = self.names.index(name)
        level = read_number(value, self.units[which], name)
        return [(place.first, place.second) for place in self.crossings(which, level)]

    def notes(self) -> dict[str, Any]:
        """Return reasons for stopping and points of codimension two, for the attributes of the Dataset."""
        first, last = (stop.sentence for stop in self.stops)
        return {
            "first_end": first,
            "last_end": last,
            "codimension_two": [[point.message, point.first, point.second] for point in self.points],
        }

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: the curve along `point`, and the periods of trains from rest.

        The periods have the dimensions `value` (second parameter) and `main` (first parameter).
        """
        own = super().entries()
        for k, (name, axis) in enumerate((("first", "main"), ("second", "value"))):
            own[name] = Column(self.units[k], self.names[k], ("point",), name=name), getattr(self, name)
            note = Column(self.units[k], self.names[k], (axis,), "coordinate", name=axis)
            # A dimension of length 0 has another meaning in the classic NetCDF format.
            own[axis] = note, self.grid[k] if self.settled.size else np.full(1, np.nan)
        if not self.settled.size:
            own["settled"] = own["settled"][0], np.full((1, 1), -1)
        for k, (name, unit, meaning) in enumerate((("x", "m", "displacement"), ("v", "m/s", "velocity"))):
            own[name] = Column(unit, f"{meaning} at the section", ("point",), name=name), self.state[:, k]
        for name in ("real", "imag"):
            pair = ("point", "multiplier")
            note = Column("1", f"{name} part of the multipliers", pair, name=f"multiplier_{name}")
            own[note.name] = note, getattr(self.multipliers, name)
        own["contacts"] = (
            Column("", "sequence of the contacts", ("point",), name="contacts"),
            np.array(self.contacts),
        )
        return own


GRID_TOLERANCE: Final = 1e-9
"""Integration tolerance of the trains from rest on the grid of both parameters; arbitrary."""

_FIRINGS: Final = 300  # Number of firings of a train from rest; arbitrary
_JUDGED: Final = 64  # Number of last firings that are classified; arbitrary


def settled_plane(
    regime: Regime,
    names: tuple[str, str],
    bounds: tuple[tuple[float, float], tuple[float, float]],
    grid: tuple[int, int],
    threads: int | None,
) -> tuple[tuple[FloatArray, FloatArray], IntArray]:
    """Compute the periods, in firings, of trains from rest over a grid of two parameters.

    `grid` contains the number of values of the first parameter, m, and of the second, n. Raises InputError if
    one of these numbers is negative.

    Returns
    -------
    tuple of array
        Values of the first parameter, shape (m,), and of the second, shape (n,), evenly spaced in `bounds`.
    array, shape (n, m)
        Periods of the trains: 0 for a train without a period, -1 for a run that ended early.
    """
    if min(grid) < 0:
        raise InputError.of("grid", grid, "two numbers of values, not negative")
    axes = (np.linspace(*bounds[0], grid[0]), np.linspace(*bounds[1], grid[1]))
    settled = np.zeros((grid[1], grid[0]), dtype=np.int64)
    judged = np.arange(_FIRINGS - _JUDGED + 1, _FIRINGS + 1)
    for row, value in enumerate(axes[1]):
        moved = regime.with_(names[1], float(value))
        regimes = [moved.with_(names[0], float(first)) for first in axes[0]]
        trains = [Train.of(at.at_firings, _FIRINGS) for at in regimes]
        every, _ = run_trains(trains, judged, None, Effort(GRID_TOLERANCE, threads))
        settled[row] = [
            _period(states, train) if states.status == "ok" else -1
            for train, states in zip(trains, every, strict=True)
        ]
    return axes, settled


def _period(states: States, train: Train) -> int:
    """Return the period to which a train settles, in firings; 0 if unknown."""
    ends_at = states.settled(train, states.distances(train))
    return 0 if ends_at is None or ends_at.period is None else ends_at.period


MOST: Final = 200
"""Default maximum number of continuation steps of a curve in each direction; arbitrary."""


def bifurcation_curve(
    source: Branch | Reopened | str | Path,
    second: str,
    bounds: tuple[float | str, float | str],
    *,
    event: BranchEvent | int | str | None = None,
    regime: Regime | None = None,
    first: tuple[float | str, float | str] | None = None,
    grid: tuple[int, int] = (0, 0),
    most: SupportsIndex = MOST,
    threads: int | None = None,
) -> BifurcationCurve:
    """Follow a fold, a period doubling, a Neimark-Sacker point or a grazing in a second parameter.

    Parameters
    ----------
    source : Branch, Reopened or path
        A branch from `printhammer.continuation`, or a file with branches or a curve. The first branch of a
        file is used; a curve is followed anew from one of its points. The parameter of the source is the
        first parameter.
    second : str
        Name of the second parameter, such as "backstop.damping" or "waveform.amplitude".
    bounds : tuple
        Smallest and largest value of the second parameter, SI or text with a unit.
    event : BranchEvent, int or str, optional
        Start of the curve: an event object of the branch; the index of an event, from 0; a kind of event, for
        the first event of that kind; or "first" or "last", for the grazing at that end of the branch. By
        default the first event that can be followed. For a curve in a file: the index of a point, "first" or
        "last".
    regime : Regime, optional
        For a file: the regime (hammer and periodic drive), which the file does not contain.
    first : tuple, optional
        Smallest and largest value of the first parameter, by default those of the branch.
    grid : tuple of int, optional
        Numbers of values of the two parameters at which the periods of trains from rest are computed
        (default: none).
    most : int, optional
        Maximum number of steps in each direction.
    threads : int, optional
        Number of threads; by default the number of cores. The curve is independent of this number.

    Returns
    -------
    BifurcationCurve
        Curve whose points are converged by Newton's method to a scaled correction of 1e-12, or to the noise
        of the map if that is larger.
    """
    start = start_of(source, event, regime)
    unit = start.regime.quantity(start.first).si
    check_two(start.first, second)
    own = start.bounds if first is None else read_bounds(start.regime, start.first, first)
    ends = read_bounds(start.regime, second, bounds)
    value = start.regime.value(second) if start.other is None else start.other
    for name, (low, high), at in ((start.first, own, start.value), (second, ends, value)):
        if not low <= at <= high:
            raise InputError(
                f"{name} = {at:.9g} {start.regime.quantity(name).si} at the start",
                key=name,
                value=at,
                expected=f"one within the bounds {low:.9g} to {high:.9g}",
            )
    plane = Plane(start.regime, (start.first, second), (own, ends), start.firings, start.tolerance)
    steps = Steps(most=read_count(most, "most"), precision=PRECISION)
    traced = CurveTracer(plane, start.kind, steps).trace(start, value, threads)
    away = abs(traced.places[_nearest(traced, value)].first - start.value)
    if not away < 0.1 * (own[1] - own[0]):
        raise InputError(
            f"{start.kind} at {start.first} = {start.value:.9g} {unit}: Newton's method leads away from it",
            key=start.first,
            value=start.value,
        )
    return curve_of(plane, traced, grid, threads)


def _nearest(traced: Traced, value: float) -> int:
    return int(np.argmin([abs(place.second - value) for place in traced.places]))


def curve_of(plane: Plane, traced: Traced, grid: tuple[int, int], threads: int | None) -> BifurcationCurve:
    """Build the result from a traced curve, with normal-form coefficients and a grid of trains from rest."""
    places = traced.places
    coefficients, sides = traced.coefficients, np.zeros((len(places), MOST_PERIODS + 1), np.int64)
    if traced.kind == GRAZING and traced.surface == "backstop":
        coefficients = np.array([root_coefficient(plane, place) for place in places])
        sides = np.array([grazing_sides(plane, place) for place in places])
    axes, settled = settled_plane(plane.regime, plane.names, plane.bounds, grid, threads)
    names = plane.names
    return BifurcationCurve(
        regime=plane.regime,
        kind=traced.kind,
        surface=traced.surface,
        names=names,
        units=(plane.regime.quantity(names[0]).si, plane.regime.quantity(names[1]).si),
        bounds=plane.bounds,
        firings=plane.firings,
        tolerance=plane.tolerance,
        first=np.array([place.first for place in places]),
        second=np.array([place.second for place in places]),
        state=np.array([place.state for place in places]),
        phase=np.array([place.phase for place in places]),
        multipliers=np.array([node.multipliers for node in traced.nodes]),
        coefficient=coefficients,
        sides=sides,
        contacts=tuple(place.contacts for place in places),
        points=tuple(traced.points),
        stops=traced.stops,
        crossings=traced.crossings,
        grid=axes,
        settled=settled,
    )
