"""Stability chart: the region of two parameters in which an orbit is stable, with its boundaries.

An orbit loses its stability at folds, period doublings or Neimark-Sacker points, which form curves in the
plane (`printhammer.chaos.curves.systems`). The chart also shows, on a grid, the periods that trains from rest
settle to; a stable orbit need not be reached from rest.

The curves start at the stability limits of a branch in the first parameter, and of branches in the second
parameter that start from orbits of the first branch. A closed curve that none of these branches meets is
missed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.continuation.branch import Branch, BranchEvent
from printhammer.chaos.continuation.continuation import continuation
from printhammer.chaos.continuation.tracer import read_bounds
from printhammer.chaos.curves.bifurcation_curve import (
    GRID_TOLERANCE,
    MOST,
    SAME,
    BifurcationCurve,
    curve_of,
    settled_plane,
)
from printhammer.chaos.curves.starts import Start, start_of
from printhammer.chaos.curves.systems import TESTS, Plane, check_two
from printhammer.chaos.curves.tracing import PRECISION, CurveTracer
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Result, column, derived, part, provenance, scalar
from printhammer.results.summary import (
    Summary,
)
from printhammer.run.effort import DEFAULT, Effort, computation
from printhammer.run.regime import FiredAtFixedTolerance, Firing, Regime
from printhammer.support.arrays import FloatArray, IntArray

GRID: Final = (48, 32)
"""Default numbers of values of the two parameters at which trains from rest are classified; arbitrary."""

_ACROSS: Final = (0.02, 0.98)  # Arbitrary
"""Fractions of the range of the first parameter at which branches in the second parameter start."""


class StabilityChart(Result):
    """Stability chart: curves that bound the stable region of an orbit, and a grid of trains from rest.

    The grid shows, for trains that start from rest, the number of firings after which the motion repeats.
    """

    regime: Regime = part("hammer and periodic drive of the original branch")
    names: tuple[str, str] = scalar("", "names of the two parameters")
    units: tuple[str, str] = scalar("", "SI units of the two parameters")
    bounds: tuple[tuple[float, float], tuple[float, float]] = scalar("SI", "ranges of the two parameters")
    firings: int = scalar("1", "number of firings after which the orbit repeats")
    curves: tuple[BifurcationCurve, ...] = part("curves on which the orbit loses its stability", repr=False)
    grid: tuple[FloatArray, FloatArray] = part(
        "values of the two parameters, shapes (m,) and (n,), at which trains from rest were classified",
        repr=False,
    )
    settled: IntArray = column(
        "1",
        "number of firings after which the train from rest repeats",
        "value main",
        more="0 if it does not repeat within the firings simulated, -1 if its run stopped",
        dtype=np.int32,
    )
    refused: tuple[str, ...] = part("one sentence per curve that could not be followed", default=())
    across: tuple[float, ...] = part(
        "values of the first parameter at which limits were sought along the second, SI", default=()
    )

    @property
    def title(self) -> str:
        """Title of the chart, with the period of the orbit and the name of the hammer."""
        return f"stability of the period-{self.firings} orbit of {self.regime.hammer.name}"

    def summary(self) -> Summary:
        """Summarise the numbers of curves by kind, and the fraction of trains that settle."""
        return Summary([self.message])

    @property
    @derived("", "summary in one line")
    def message(self) -> str:
        """Summary in one line: numbers of curves by kind, and the fraction of trains that settle."""
        kinds = [curve.kind for curve in self.curves]
        counts = ", ".join(f"{kinds.count(kind)} of {kind}" for kind in dict.fromkeys(kinds)) or "none"
        share = float(np.mean(self.settled == self.firings)) if self.settled.size else 0.0
        missed = f"; {len(self.refused)} could not be followed" if self.refused else ""
        at = ", ".join(f"{value:.6g}" for value in self.across)
        sought = f"along {self.names[0]}" + (
            f" and along {self.names[1]} at {at} {self.units[0]}" if at else ""
        )
        return (
            f"curves on which the period-{self.firings} orbit loses its stability: {counts}{missed};"
            f" limits were sought {sought.removesuffix(' 1')}, other limits are not in the chart;"
            f" from rest {100.0 * share:.0f} % of the grid settles to period {self.firings}"
        )

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the chart, with the tolerance of the trains from rest."""
        regime, waveform = self.regime, self.regime.fired
        return provenance(
            hammer=regime.hammer,
            waveform=waveform,
            overlap=regime.overlap,
            period=regime.period,
            tolerance=GRID_TOLERANCE,
        )

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: curves along `curve`, and the periods of trains from rest.

        The periods have the dimensions `value` (second parameter) and `main` (first parameter).
        """
        # At least one of each: a dimension of length 0 has another meaning in the classic NetCDF format.
        most, count = max((len(curve.first) for curve in self.curves), default=1), max(len(self.curves), 1)
        table = np.full((2, count, most), np.nan)
        limits = np.full((count, most), -1, np.int32)
        codes = np.full(count, -1, np.int32)
        codes[: len(self.curves)] = [list(TESTS).index(curve.kind) for curve in self.curves]
        for i, curve in enumerate(self.curves):
            table[0, i, : len(curve.first)] = curve.first
            table[1, i, : len(curve.second)] = curve.second
            limits[i, : len(curve.limits)] = curve.limits
        pair = ("curve", "point")
        own = super().entries()
        kind = Column(
            "1", "kind of bifurcation at which stability is lost", ("curve",), name="kind", codes=tuple(TESTS)
        )
        own["kind"] = kind, codes
        own["limits"] = Column("1", "whether stability is lost", pair, name="limits"), limits
        for k, (name, axis) in enumerate((("first", "main"), ("second", "value"))):
            own[name] = Column(self.units[k], self.names[k], pair, name=name), table[k]
            note = Column(self.units[k], self.names[k], (axis,), "coordinate", name=axis)
            own[axis] = note, self.grid[k]
        return own


@computation
def stability_chart(
    branch: Branch | Regime | Hammer,
    second: str,
    bounds: tuple[float | str, float | str],
    *,
    first: tuple[str, float | str, float | str] | None = None,
    grid: tuple[int, int] = GRID,
    most: SupportsIndex = MOST,
    effort: Effort = DEFAULT,
    **firing: Unpack[FiredAtFixedTolerance],
) -> StabilityChart:
    """Compute the stability chart of a branch in the plane of its parameter and a second parameter.

    Parameters
    ----------
    branch : Branch, Regime or Hammer
        Branch from `printhammer.continuation`, usually along the rate; its parameter and bounds are the first
        parameter and its range. For a regime, or a hammer with the keywords of `printhammer.Regime.of`, the
        branch along `first` is computed.
    second : str
        Name of the second parameter, such as "backstop.damping" or "waveform.amplitude".
    bounds : tuple
        Smallest and largest value of the second parameter, SI or text with a unit.
    first : tuple, optional
        For a regime or hammer: name, smallest and largest value of the first parameter.
    grid : tuple of int, optional
        Numbers of values of the two parameters at which the periods of trains from rest are computed; (0, 0)
        for none.
    most : int, optional
        Maximum number of steps of a curve in each direction.

    Returns
    -------
    StabilityChart
        Curves on which the orbit of the branch loses its stability, one through each stability limit that
        lies on no other curve, and the periods of trains from rest. Limits are sought along the branch, and
        along branches in the second parameter from two of its orbits; a curve that meets none of these
        branches is missed.
    """
    if isinstance(branch, Branch):
        if first is not None or firing:
            raise InputError(
                "branch = a branch", key="first", expected="no first parameter and no firing options with it"
            )
    elif first is None:
        raise InputError(
            "first is missing", key="first", expected="the first parameter with its least and largest value"
        )
    else:
        fired: Firing = firing
        branch = continuation(branch, first[0], first[1:], threads=effort.threads, **fired)
    regime = branch.regime
    check_two(branch.parameter, second)
    ends = read_bounds(regime, second, bounds)
    value = regime.value(second)
    if not ends[0] <= value <= ends[1]:
        raise InputError.of("bounds", bounds, f"a range around the hammer's own {second}, {value:g}")
    chart = _Chart(branch, second, ends, Steps(most=read_count(most, "most"), precision=PRECISION))
    axes, settled = settled_plane(regime, chart.plane.names, chart.plane.bounds, grid, effort.threads)
    limits = _limits(branch)
    starts = [start_of(branch, event, None) for event in limits]
    across = chart.across(effort)
    starts += [start for _, some in across for start in some]
    curves, refused = chart.curves(starts, effort)
    return StabilityChart(
        regime=regime,
        names=(branch.parameter, second),
        units=(branch.unit, regime.quantity(second).si),
        bounds=(branch.bounds, ends),
        firings=branch.firings,
        curves=tuple(curves),
        grid=axes,
        settled=settled,
        refused=tuple(refused),
        across=tuple(value for value, _ in across),
    )


def _limits(branch: Branch) -> list[BranchEvent]:
    """List the events at which the stable orbits of a branch lose their stability."""
    lost = [event for event in branch.events if np.abs(event.multipliers).max() < 1.0 + SAME]
    return [event for event in lost if event.kind in TESTS]


class _Chart:
    """Curve finder of one chart: locates stability limits and traces the curves through them."""

    def __init__(self, branch: Branch, second: str, bounds: tuple[float, float], steps: Steps) -> None:
        self.branch, self.steps = branch, steps
        names, own = (branch.parameter, second), (branch.bounds, bounds)
        self.plane = Plane(branch.regime, names, own, branch.firings, branch.tolerance)
        self.value = branch.regime.value(second)

    def across(self, effort: Effort) -> list[tuple[float, list[Start]]]:
        """Locate stability limits along branches in the second parameter, through orbits of the first branch.

        Returns, for each of these branches, the value of the first parameter and the starts of curves.
        """
        branch, values = self.branch, self.branch.values
        low, high = float(values.min()), float(values.max())
        # Prefer a stable orbit: its branch loses stability at its limits.
        among = np.flatnonzero(branch.stable) if branch.stable.any() else np.arange(len(values))
        aims = [low + place * (high - low) for place in _ACROSS]
        numbers = dict.fromkeys(int(among[np.argmin(np.abs(values[among] - aim))]) for aim in aims)

        def along(number: int) -> tuple[float, list[Start]]:
            value = float(values[number])
            try:
                other = continuation(
                    branch.orbit(number), self.plane.names[1], self.plane.bounds[1], most=self.steps.most
                )
            except InputError:
                return value, []
            starts = [start_of(other, event, None) for event in _limits(other)]
            return value, [
                replace(start, first=branch.parameter, bounds=branch.bounds, value=value, other=start.value)
                for start in starts
            ]

        return effort.quiet.mapped(along, list(numbers), length=1)

    def second(self, start: Start) -> float:
        """Return the value of the second parameter at the start of a curve."""
        return self.value if start.other is None else start.other

    def curves(self, starts: list[Start], effort: Effort) -> tuple[list[BifurcationCurve], list[str]]:
        """Trace a curve through each start that lies on no earlier curve.

        Returns the curves, and the reason for each failure as a sentence.
        """
        curves: list[BifurcationCurve] = []
        refused: list[str] = []
        left = starts
        while left:
            left = [start for start in left if not any(self.is_on(curve, start) for curve in curves)]
            # The batch size is independent of the number of threads, so that the outcome is, too.
            now, left = left[:2], left[2:]
            for start, curve in zip(now, effort.quiet.mapped(self.curve, now, length=1), strict=True):
                if isinstance(curve, str):
                    refused.append(curve)
                elif not any(self.is_on(other, start) for other in curves):
                    curves.append(curve)
            effort.report(len(starts) - len(left), len(starts))
        return curves, refused

    def curve(self, start: Start) -> BifurcationCurve | str:
        """Trace the bifurcation curve through a start; return the curve, or the reason for the failure."""
        try:
            traced = CurveTracer(self.plane, start.kind, self.steps).trace(start, self.second(start), 1)
        except InputError as error:
            return str(error)
        return curve_of(self.plane, traced, (0, 0), 1)

    def is_on(self, curve: BifurcationCurve, start: Start) -> bool:
        """Whether a start lies between two points of a traced curve of the same kind of bifurcation."""
        if curve.kind != start.kind:
            return False
        second = self.second(start)
        event = CurveTracer(self.plane, start.kind, self.steps).state_at(start, second)
        points = np.column_stack([curve.state, curve.first, curve.second]) / self.plane.scales
        place = np.array([*event, start.value, second]) / self.plane.scales
        along = np.diff(points, axis=0)
        lengths = (along**2).sum(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = np.clip(((place - points[:-1]) * along).sum(axis=1) / lengths, 0.0, 1.0)
        feet = points[:-1] + np.nan_to_num(shares)[:, np.newaxis] * along
        # A chord deviates from its curve by a small fraction of the length of the chord.
        near = np.sqrt(((feet - place) ** 2).sum(axis=1)) <= 0.1 * np.sqrt(lengths) + SAME
        return bool(near.any())
