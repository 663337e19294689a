"""Bifurcation diagram: states at the firings, windows of one classification, and routes to chaos.

A window is an interval of the parameter in which all computed trains have the same classification. A value
of the parameter represents the interval that extends halfway to either neighbouring value, so that the
widths of all windows add up to the parameter range. Windows between two neighbouring values are missed.

A route to chaos is the series of windows before the first strange train; it shows whether period doublings
lead to chaos.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from printhammer.chaos.bifurcation.builder import SAME
from printhammer.chaos.bifurcation.columns import orbit_distance
from printhammer.chaos.strobe.train import exponents_onward
from printhammer.chaos.strobe.verdict import SIGNIFICANT, SUPERSTABLE, is_positive
from printhammer.errors import InputError
from printhammer.hammer.names import PERIOD, RATE
from printhammer.results import Column, Declared, Result, column, coordinate, derived, part, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
)
from printhammer.run.effort import Effort
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray, IntArray, TextArray
from printhammer.units import from_si

SERIES: Final = (2, 4, 8)
"""Orbit periods, in firings, of the first windows of a period-doubling cascade, by definition."""

_WHOLE_DIGITS: Final = 6  # Number of digits up to which whole parameter values are written out; arbitrary
MOST_UNDECIDED: Final = 32
"""Number of undecided aperiodic trains after which the search for chaos along a route stops; arbitrary."""


class Window(Declared):
    """Range of neighbouring parameter values whose trains have the same classification; values in SI."""

    verdict: str = part('classification: "period-q", "strange", "superstable" or "undecided"')
    period: int = part("period q in firings; 0 if aperiodic")
    low: float = part("smallest value")
    high: float = part("largest value")
    width: float = part("width of the window, which reaches halfway to the neighbouring values")
    columns: int = part("number of values")


class Route(Declared):
    """Route to chaos: windows from one end of the parameter range to the first train classified "strange"."""

    way: Literal["rising", "falling"] = part("direction in which the parameter is followed")
    before: tuple[Window, ...] = part(
        "windows before the first strange train, in this direction; all windows without a strange train"
    )
    first: float | None = part(
        "parameter value of the first strange train, SI",
        more="None without a strange train, or if the search stopped before it",
    )
    complete: bool = part(
        "whether the search reached a strange train or the end of the range; False if it stopped after"
        " `MOST_UNDECIDED` undecided trains"
    )

    @property
    def periods(self) -> list[int]:
        """Orbit periods of the windows on the route, in firings, without undecided windows."""
        return [window.period for window in self.before if window.period]

    @property
    def cascade(self) -> bool:
        """Whether three successive windows on the route have the periods 2, 4 and 8."""
        return bool(doublings(self.before))

    @property
    def sentence(self) -> str:
        """Sentence that describes the windows up to the first strange train, with parameter values in SI."""
        return self.worded("{:.9g}".format)

    def worded(self, shown: Callable[[float], str]) -> str:
        """Describe the route to the first strange train; `shown` formats a parameter value."""
        values = f"With {self.way} values"
        way = ", ".join(window.verdict for window in self.before)
        if not self.complete:
            return f"{values} the search stopped after {MOST_UNDECIDED} undecided aperiodic trains: {way}."
        if self.first is None:
            return f"{values} no train is strange: {way}."
        if not way:
            return f"{values} the very first train, at {shown(self.first)}, is strange."
        series = "a period-doubling cascade" if self.cascade else "no period-doubling cascade"
        return f"{values} the first strange train is at {shown(self.first)}, after {series}: {way}."


def cells(values: FloatArray) -> FloatArray:
    """Compute the width of the interval that each value represents, halfway to either neighbouring value."""
    if len(values) < 2:
        return np.zeros(len(values))
    edges = np.concatenate([values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]])
    return np.diff(edges)


def doublings(windows: Sequence[Window]) -> list[Window]:
    """Find period-doubling cascades; return the first window of each.

    A cascade consists of three successive windows of periods 2, 4 and 8. Undecided windows in between are
    skipped, since trains take long to settle near a period doubling.
    """
    decided = [window for window in windows if window.verdict != "undecided"]
    threes = zip(decided, decided[1:], decided[2:], strict=False)
    return [three[0] for three in threes if tuple(window.period for window in three) == SERIES]


class Bifurcation(Result, rows="direction column"):
    """Bifurcation diagram: states at the firings against a parameter, in one or several directions."""

    regime: Regime = part("hammer, periodic drive and phase; the parameter differs in each column")
    parameter: str = scalar("", "name of the parameter, see `printhammer.run.regime.Regime.with_`")
    directions: tuple[str, ...] = coordinate(
        "",
        "direction in which the state was carried",
        "direction",
        more='"from rest", "up" or "down"',
        name="direction",
    )
    values: FloatArray = coordinate("SI", "value of the parameter", "column", more="ascending", name="value")
    firing: IntArray = coordinate(
        "1", "number of the firing", "firing", more="the first firing of a train is number 1", dtype=np.int32
    )
    x: FloatArray = column("m", "displacement", "direction column firing", more="nan after the end of a run")
    v: FloatArray = column("m/s", "velocity", "direction column firing", more="nan after the end of a run")
    branch: npt.NDArray[np.int8] = column(
        "1",
        "mode of motion",
        "direction column firing",
        more="as an index of `printhammer.run.ensemble.MODE_NAMES`, -1 after the end of a run",
        codes=MODE_NAMES,
    )
    cycles: IntArray = column(
        "1",
        "number of firings after which the states repeat, 0 if aperiodic",
        "direction column",
        more="the smallest number, up to 64",
        name="cycle",
        dtype=np.int32,
    )
    distances: FloatArray = column(
        "1",
        "distance of states a period apart, half-widths of the window",
        "direction column",
        more="nan without a period",
        name="distance",
    )
    exponents: FloatArray = column(
        "1",
        "largest exponent of the strobe map, per firing",
        "direction column",
        more="for aperiodic trains; nan if it was not computed",
        name="exponent",
        head="exponent per firing",
    )
    standard_errors: FloatArray = column(
        "1",
        "standard error of the exponent",
        "direction column",
        name="standard_error",
        head="standard error",
    )
    sensitive: BoolArray = column(
        "1",
        "whether the period differs at a tenth or a hundredth of the tolerance",
        "direction column",
        more="computed for motions of period 5 or more that may come to rest on a rigid backstop",
        dtype=np.int8,
    )
    status: TextArray = column("", "status of the run", "direction column")
    levels: IntArray = column(
        "1",
        "refinement level, 0 for a given value",
        "column",
        more="k for values inserted at the k-th refinement",
        name="level",
        dtype=np.int32,
    )
    carried: int = scalar(
        "1",
        "number of trains that were run again to close the joints between strands",
        name="trains_run_again",
    )
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """Title of the diagram, with the name of the hammer and the parameter."""
        return f"bifurcation diagram of {self.regime.hammer.name} in {self.parameter}"

    def summary(self) -> Summary:
        """Summarise windows, routes to chaos, hysteresis, and undecided trains of all directions."""
        several = len(self.directions) > 1
        value, unit = self._value_text()
        lines = [""]
        for direction in self.directions:
            lines += [
                (f"{direction}: " if several else "") + route.worded(lambda each: f"{value(each)} {unit}")
                for route in self.routes(direction)
            ]
        if several:
            widths = cells(self.values)
            share = float(widths[hysteresis(self)].sum() / (widths.sum() or 1.0))
            lines.append(
                f"Attractors of rising and falling values differ over {100.0 * share:.2f} % of the range."
            )
        return Summary(
            [
                *map(self._windows_grid, self.directions),
                *lines,
                *self._undecided_reasons(),
                *self._sensitive(),
            ]
        )

    def _value_text(self) -> tuple[Callable[[float], str], str]:
        """Return a formatter of parameter values, precise enough to tell neighbours apart, and its unit."""
        si = self.regime.quantity(self.parameter).si
        unit = {"s": "ms", "m": "um"}.get(si, si)
        steps = np.diff(self.values)
        ratio = float(np.abs(self.values).max() / steps.min()) if steps.size else 1e6
        largest = from_si(float(np.abs(self.values).max()), si, unit)
        # Digits before the decimal point, so that 140 is not written as 1.4e+02.
        whole = 1 + math.floor(math.log10(max(largest, 1.0)))
        digits = max(1 + math.ceil(math.log10(max(ratio, 10.0))), min(whole, _WHOLE_DIGITS))
        return lambda value: f"{from_si(value, si, unit):.{digits}g}", unit

    def _windows_grid(self, direction: str) -> Grid:
        """Tabulate the windows of one direction by classification: number, total width, and widest window."""
        windows = sorted(self.windows(direction), key=lambda window: (window.period or 1000, window.verdict))
        total = sum(window.width for window in windows) or 1.0
        groups = [
            list(group) for _verdict, group in itertools.groupby(windows, key=lambda each: each.verdict)
        ]
        widest = [max(group, key=lambda window: window.width) for group in groups]
        shares = [100.0 * sum(window.width for window in group) / total for group in groups]
        value, unit = self._value_text()
        columns = [
            Cells("verdict", [window.verdict.replace("-", " ") for window in widest], left=True),
            Cells("windows", [len(group) for group in groups]),
            Cells("share", shares, "%", ".2f"),
            Cells("widest from", [value(window.low) for window in widest], unit),
            Cells("to", [value(window.high) for window in widest], unit),
        ]
        return Grid(columns, direction, most=12)

    def _undecided_reasons(self) -> list[str]:
        """Return sentences with the reasons why completed trains are undecided, one sentence per reason."""
        undecided = (self.verdicts == "undecided") & (self.status == "ok")
        known = undecided & ~np.isnan(self.exponents)
        settling = known & (self.exponents < -SIGNIFICANT * self.standard_errors)
        reasons = (
            (
                settling,
                "neighbouring motions converge; more firings will show the period",
            ),
            (known & ~settling, "the exponent lies within three standard errors of zero"),
            (
                undecided & ~known,
                "the diagram has no exponent; use the option `exponents` (none exists at a grazing touch)",
            ),
        )
        count = int(undecided.sum())
        return [
            f"{int(some.sum())} of {count} undecided trains: {why}." for some, why in reasons if some.any()
        ]

    def _sensitive(self) -> list[str]:
        """Return a list of one sentence, on the number of periods that change at finer tolerances.

        The list is empty if no period changes.
        """
        count = int(self.sensitive.sum())
        whose = "1 period changes" if count == 1 else f"{count} periods change"
        return [f"{whose} at a finer tolerance: rounding decides the length of long cycles."] if count else []

    @property
    @derived("1", "time from a firing to its point, as a fraction of the period")
    def phase(self) -> float:
        """Phase of the strobe section: time since the last firing, as a fraction of the period."""
        return self.regime.phase

    @property
    @derived("", "verdict", "direction column", name="verdict")
    def verdicts(self) -> TextArray:
        """Classification of each train, by direction and parameter value, shape (directions, values).

        The classes are "period-q", "strange", "undecided" and, for an armature that comes to rest on the
        backstop in a cycle longer than 64 firings, "superstable".

        A train is undecided if its run ended early, or if it has no period and its exponent was not computed
        or is not positive by three standard errors. See also `printhammer.chaos.strobe.verdict`.
        """
        names = np.full(self.cycles.shape, "undecided", "U16")
        for q in np.unique(self.cycles[self.cycles > 0]).tolist():
            names[self.cycles == q] = f"period-{q}"
        names[(self.cycles == 0) & (self.exponents > SIGNIFICANT * self.standard_errors)] = "strange"
        names[(self.cycles == 0) & (self.exponents == -np.inf)] = SUPERSTABLE
        return names

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the diagram; without the period if the parameter is the period or the rate."""
        known = super().provenance
        return {key: known[key] for key in known if key != "period" or self.parameter not in (PERIOD, RATE)}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: states along direction, value and firing; one verdict per train."""
        own = super().entries()
        of = self.regime.quantity(self.parameter)
        note = replace(own["value"][0], unit=of.si, meaning=of.meaning, head=self.parameter)
        own["value"] = replace(note, attrs={"parameter": self.parameter}), self.values
        return {"verdict": own.pop("verdict"), **own}

    def windows(self, direction: str | None = None) -> list[Window]:
        """Compute the windows of one direction, in ascending order of the parameter.

        The default is the first direction; raises InputError if the diagram lacks the direction.
        """
        return self._group(self._row(direction), range(len(self.values)))

    def routes(self, direction: str | None = None) -> tuple[Route, Route]:
        """Compute the two routes to chaos: for rising and for falling parameter, to the first strange train.

        `direction` is as for `windows`. Missing Lyapunov exponents of aperiodic trains are computed here,
        from one end of the parameter range up to the first strange train.
        """
        row = self._row(direction)
        names = self.verdicts[row].tolist()
        known: dict[int, bool] = {}

        def is_strange(k: int) -> bool:
            if names[k] == "undecided" and k not in known:
                known[k] = self._is_strange(row, k)
            return names[k] == "strange" or known.get(k, False)

        def route(way: Literal["rising", "falling"], order: Sequence[int]) -> Route:
            undecided = 0
            for place, k in enumerate(order):
                before = order[:place]
                if is_strange(k):
                    return Route(way, tuple(self._group(row, before)), float(self.values[k]), True)
                undecided += names[k] == "undecided"
                if undecided > MOST_UNDECIDED:
                    return Route(way, tuple(self._group(row, before)), None, False)
            return Route(way, tuple(self._group(row, order)), None, True)

        columns = range(len(names))
        return route("rising", columns), route("falling", columns[::-1])

    def _row(self, direction: str | None) -> int:
        if direction is None:
            return 0
        if direction not in self.directions:
            known = " and ".join(self.directions)
            raise InputError.of("direction", direction, f"a direction of the diagram: {known}")
        return self.directions.index(direction)

    def _group(self, row: int, order: Sequence[int]) -> list[Window]:
        """Group neighbouring parameter values with the same classification into windows, in the given order.

        `row` is the index of the direction; `order` contains the indices of the values.
        """
        names, cycles = self.verdicts[row].tolist(), self.cycles[row].tolist()
        widths = cells(self.values)
        windows = []
        for name, group in itertools.groupby(order, key=lambda k: names[k]):
            places = sorted(group)
            first, last = places[0], places[-1]
            low, high = float(self.values[first]), float(self.values[last])
            width = float(widths[first : last + 1].sum())
            windows.append(Window(name, int(cycles[first]), low, high, width, len(places)))
        return windows

    def _is_strange(self, row: int, k: int) -> bool:
        """Whether an aperiodic train is strange, by its Lyapunov exponent after the last recorded firing.

        `row` is the index of the direction, `k` that of the parameter value.
        """
        x, v = (float(states[row, k, -1]) for states in (self.x, self.v))
        regime = self.regime.with_(self.parameter, float(self.values[k]))
        front = regime.hammer.front
        # Inside the pack and between firings the stored state lacks the memory and the phase.
        if self.status[row, k] != "ok" or self.phase or (front is not None and x > front):
            return False
        points = self.x.shape[2]
        (exponent,) = exponents_onward([(regime, (x, v))], points, Effort(self.tolerance, threads=1))
        return is_positive(exponent)


def hysteresis(diagram: Bifurcation) -> BoolArray:
    """Return the mask of the values at which a rising and a falling parameter lead to different attractors.

    Two periodic attractors differ if their periods differ or their orbits are farther apart than
    `printhammer.chaos.bifurcation.builder.SAME`. An aperiodic attractor differs from every periodic
    attractor; two aperiodic attractors are never distinguished. The mask has one entry for each value; all
    entries are False if the diagram has a single direction.
    """
    different = np.zeros(len(diagram.values), np.bool_)
    if len(diagram.directions) < 2:
        return different
    half = diagram.regime.window.half_widths
    for k, (q, other) in enumerate(diagram.cycles.T.tolist()):
        different[k] = q != other
        if q and q == other:
            orbits = [
                np.column_stack([diagram.x[way, k, -q:], diagram.v[way, k, -q:]]) / half for way in (0, 1)
            ]
            different[k] = orbit_distance(*orbits) > SAME
    return different
