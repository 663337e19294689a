"""Bifurcation diagrams by brute force: the states at the firings, against a parameter.

For each value of a parameter a train is fired, the first firings are left out, and the states at the others
are the column of the diagram above that value: one point for a train that repeats itself at every firing, two
where it does at every second one, and many for a strange one.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Literal, SupportsIndex, get_args

import numpy as np

from printhammer.chaos.bifurcation_carry import Table, carry, strands_of
from printhammer.chaos.bifurcation_columns import (
    FROM_REST,
    NOT_RUN,
    OK,
    blank_columns,
    cycles_of,
    orbit_distance,
    put,
    run_columns,
    scales_of_columns,
    usable,
)
from printhammer.chaos.regime import PERIOD, RATE, Regime
from printhammer.chaos.strobe_map import check_phase
from printhammer.chaos.train import Train, exponents_of
from printhammer.chaos.verdict import SIGNIFICANT
from printhammer.drive import PulseTrain
from printhammer.drive_input import read_count
from printhammer.ensemble import DISPLAY_TOLERANCE
from printhammer.errors import InputError
from printhammer.problem import check_tolerance
from printhammer.start import initial_state

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import xarray as xr

    from printhammer.chaos.bifurcation_columns import State
    from printhammer.chaos.bifurcation_windows import Route, Window
    from printhammer.drive import Drive
    from printhammer.drive_base import Overlap
    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray
    from printhammer.threads import Progress
    from printhammer.waveforms import Waveform

FIRINGS: Final = 300
"""Firings of a train unless told otherwise."""

TRANSIENT: Final = 100
"""Of these, firings that are left out at the beginning."""

REFINE: Final = 2
"""Times that the steps between neighbours that differ are halved, unless told otherwise."""

MOST_STATES: Final = 100_000_000
"""Number of states above which a diagram is refused."""

JUMP: Final = 0.2
"""Distance of the orbits of neighbours with the same period, in half-widths of the window, that is refined."""

Direction = Literal["from rest", "up", "down", "both"]
DIRECTIONS: Final = get_args(Direction)


class InterruptedDiagram(KeyboardInterrupt):
    """A diagram was interrupted.

    Attributes
    ----------
    diagram : Bifurcation
        What is done; the status of the others is "not run".
    """

    def __init__(self, diagram: Bifurcation) -> None:
        super().__init__("interrupted")
        self.diagram = diagram


@dataclass(frozen=True)
class Bifurcation:
    """States at the firings against a parameter: D directions, C values, P points each.

    Attributes
    ----------
    regime : Regime
        Hammer and periodic drive; the parameter has other values in each column.
    parameter : str
        What is changed, see `printhammer.chaos.regime.Regime.with_`.
    values : array, shape (C,)
        Its values, ascending, SI.
    directions : tuple of str
        Of "from rest", "up" and "down": how the state at the start came about.
    firing : int array, shape (P,)
        Numbers of the firings of the points; the first of a train is number 1.
    phase : float
        Part of the period between a firing and its point.
    x, v : array, shape (D, C, P)
        Displacement, m, and velocity, m/s; NaN where a run did not get.
    branch : int8 array, shape (D, C, P)
        Code of the mode, a place in `printhammer.ensemble.MODE_NAMES`; -1 where a run did not get.
    status : str array, shape (D, C)
        How the runs ended.
    cycles : int array, shape (D, C)
        Smallest number of firings, up to 64, after which the states repeat; 0 where there is none.
    distances : array, shape (D, C)
        Largest distance of states so many firings apart, in half-widths of the window; NaN where there is no
        such number.
    exponents, standard_errors : array, shape (D, C)
        Largest exponent of the strobe map, per firing, of trains without a period; NaN where it was not
        computed.
    levels : int array, shape (C,)
        0 for the values that were given, k for those put between them at the k-th refinement.
    carried : int
        Number of trains that were run again to close the joints of strands.
    tolerance : float
        Of the integration.
    """

    regime: Regime
    parameter: str
    values: FloatArray = field(repr=False)
    directions: tuple[str, ...]
    firing: npt.NDArray[np.int64] = field(repr=False)
    phase: float
    x: FloatArray = field(repr=False)
    v: FloatArray = field(repr=False)
    branch: npt.NDArray[np.int8] = field(repr=False)
    status: npt.NDArray[np.str_] = field(repr=False)
    cycles: npt.NDArray[np.int64] = field(repr=False)
    distances: FloatArray = field(repr=False)
    exponents: FloatArray = field(repr=False)
    standard_errors: FloatArray = field(repr=False)
    levels: npt.NDArray[np.int64] = field(repr=False)
    carried: int
    tolerance: float

    @property
    def verdicts(self) -> npt.NDArray[np.str_]:
        """Verdicts, shape (D, C): "period-q", "strange" or "undecided", by `printhammer.chaos.verdict`.

        Undecided are trains without a period whose exponent was not computed, or is not positive by three
        standard errors, and those whose run ended early.
        """
        names = np.full(self.cycles.shape, "undecided", "U16")
        for q in np.unique(self.cycles[self.cycles > 0]).tolist():
            names[self.cycles == q] = f"period-{q}"
        names[(self.cycles == 0) & (self.exponents > SIGNIFICANT * self.standard_errors)] = "strange"
        return names

    def windows(self, direction: str | None = None) -> list[Window]:
        """Return the intervals of the parameter with one verdict; see `printhammer.chaos.bifurcation_windows`."""
        from printhammer.chaos.bifurcation_windows import windows_of

        return windows_of(self, direction)

    def routes(self, direction: str | None = None) -> tuple[Route, Route]:
        """Return what comes before the first strange train, with the parameter rising and falling."""
        from printhammer.chaos.bifurcation_windows import routes_of

        return routes_of(self, direction)

    def to_dataset(self) -> xr.Dataset:
        """Return the diagram as a Dataset over `direction`, `column` and `firing`, with units and provenance."""
        from printhammer.chaos.bifurcation_tables import bifurcation_dataset

        return bifurcation_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw the diagram; returns a matplotlib figure, see `printhammer.figures.bifurcation`."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.bifurcation").plot(self, **options)


def bifurcation(
    hammer: Hammer,
    *,
    periods: npt.ArrayLike | None = None,
    rates: npt.ArrayLike | None = None,
    parameter: str | None = None,
    values: npt.ArrayLike | None = None,
    period: float | str | None = None,
    rate: float | str | None = None,
    waveform: Waveform | None = None,
    drive: Drive | None = None,
    overlap: Overlap = "add",
    firings: SupportsIndex = FIRINGS,
    transient: SupportsIndex = TRANSIENT,
    phase: float = 0.0,
    direction: Direction = "from rest",
    state: tuple[float, float] | None = None,
    refine: SupportsIndex = REFINE,
    exponents: bool = False,
    tolerance: float = DISPLAY_TOLERANCE,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Bifurcation:
    """Compute a bifurcation diagram of a hammer under a periodic drive.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    periods, rates : array, optional
        Times between firings, s, or firings per second, Hz, ascending.
    parameter, values : str and array, optional
        Instead: the name of any constant, such as "backstop.damping" or "waveform.amplitude", and its
        values, SI, ascending; see `printhammer.chaos.regime.Regime.with_`.
    period, rate : float or str, optional
        With a parameter: the time between firings, s, or its inverse, Hz.
    waveform, drive, overlap
        As for `printhammer.strobe`; a drive is an endless force.
    firings, transient : int, optional
        Firings at each value, and how many of these are left out at the beginning.
    phase : float, optional
        Part of the period between a firing and its point, from 0 up to but not including 1.
    direction : str, optional
        "from rest": every train begins at rest, with nothing fired before. "up", "down": it begins where the
        train at the value before, or after, ended, with the pulses before under way; the first begins at
        rest. "both": up and down. See `printhammer.chaos.bifurcation_carry`.
    state : tuple of float, optional
        Displacement, m, and velocity, m/s, that takes the place of rest, with the pulses before under way.
    refine : int, optional
        How often the step between neighbours whose periods differ, or whose orbits lie apart, is halved.
    exponents : bool, optional
        Compute the exponents of trains without a period, which tell strange ones from undecided ones; takes
        many times as long.
    tolerance : float, optional
        As for `printhammer.simulate`; by default that for pictures.
    threads : int, optional
        By default as many as there are cores; the diagram does not depend on it.
    progress : callable, optional
        Called now and then with the number of trains done and of all that are known of so far.

    Returns
    -------
    Bifurcation
        With a status for each train; a run that could not go on is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above; a value that the parameter cannot have; a hammer without
        a rest state where no state is given.
    InterruptedDiagram
        A KeyboardInterrupt, with what was done.
    """
    name, grid, regime = _parameter(
        hammer,
        (periods, rates, parameter, values),
        (period, rate),
        {"waveform": waveform, "drive": drive, "overlap": overlap},
    )
    count, skipped = read_count(firings, "firings"), _whole(transient, "transient")
    if count - skipped < 2:
        raise InputError(f"transient = {transient!r}, expected at least 2 fewer than the {count} firings")
    if direction not in DIRECTIONS:
        raise InputError(f"direction = {direction!r}, expected one of {', '.join(DIRECTIONS)}")
    part, halvings = check_phase(phase), _whole(refine, "refine")
    check_tolerance(tolerance)
    ways = ("up", "down") if direction == "both" else (direction,)
    if len(grid) * len(ways) * (count - skipped) > MOST_STATES:
        raise InputError(f"{len(grid)} values, expected at most {MOST_STATES} states in a diagram")
    begin = FROM_REST
    if state is not None:
        begin = (*initial_state(hammer, state), -1.0, 0.0)
    work = _Work(regime, name, ways, (count, skipped, part, tolerance), begin, threads, progress)
    try:
        work.base(grid)
        for level in range(1, halvings + 1):
            work.refine(level)
        if exponents:
            work.measure()
    except KeyboardInterrupt:
        raise InterruptedDiagram(work.result()) from None
    return work.result()


class _Work:
    """A diagram under way. Trains are numbered as they come: those of all directions at one value in a row."""

    def __init__(
        self,
        regime: Regime,
        name: str,
        ways: tuple[str, ...],
        counts: tuple[int, int, float, float],
        begin: State,
        threads: int | None,
        progress: Progress | None,
    ) -> None:
        self.regime, self.name, self.ways, self.counts, self.begin = regime, name, ways, counts, begin
        self.threads, self.progress = threads, progress
        self.points = counts[0] - counts[1]
        self.values = np.zeros(0)
        self.levels = np.zeros(0, np.int64)
        none = np.zeros(0)
        self.table = Table(
            [], blank_columns(0, self.points), np.zeros(0, np.int64), none, np.zeros((0, 3))
        )
        self.exponents, self.errors = none.copy(), none.copy()
        self.done = 0
        self.known = 0

    def add(self, values: FloatArray, level: int) -> list[int]:
        """Make room for trains at new values; return the places of the values."""
        first = len(self.values)
        regimes = [self.regime.with_(self.name, value) for value in values.tolist()]
        every = [regime for regime in regimes for _way in self.ways]
        table = self.table
        longer = blank_columns(len(table.regimes) + len(every), self.points)
        put(longer, np.arange(len(table.regimes)), table.columns)
        scales = np.repeat(scales_of_columns(regimes), len(self.ways), axis=0)
        nothing = np.full(len(every), np.nan)
        self.table = Table(
            [*table.regimes, *every],
            longer,
            np.concatenate([table.cycles, np.zeros(len(every), np.int64)]),
            np.concatenate([table.distances, nothing]),
            np.concatenate([table.scales, scales]),
            table.carried,
        )
        self.exponents = np.concatenate([self.exponents, nothing])
        self.errors = np.concatenate([self.errors, nothing])
        self.values = np.concatenate([self.values, values])
        self.levels = np.concatenate([self.levels, np.full(len(values), level)])
        self.known += len(every)
        return list(range(first, len(self.values)))

    def rows(self, places: Sequence[int], way: int) -> list[int]:
        """Return the rows of the trains at some values in one direction."""
        return [len(self.ways) * place + way for place in places]

    def base(self, grid: FloatArray) -> None:
        """Run the trains at the values that were given."""
        places = self.add(grid, 0)
        if self.ways == ("from rest",):
            self.run(places, np.array([usable(self.table.regimes[row], self.begin) for row in places]))
            return
        strands = []
        for way, name in enumerate(self.ways):
            order = places if name == "up" else places[::-1]
            strands += strands_of(self.rows(order, way), len(strands))
        carry(self.table, strands, self.begin, self.run, self.trial)

    def refine(self, level: int) -> None:
        """Run trains between neighbours that differ, carrying the state from that neighbour which comes before."""
        order = np.argsort(self.values, kind="stable").tolist()
        pairs = [pair for pair in itertools.pairwise(order) if self.differ(*pair)]
        middles = np.array([0.5 * (self.values[one] + self.values[other]) for one, other in pairs])
        new = [
            k
            for k, (one, other) in enumerate(pairs)
            if self.values[one] < middles[k] < self.values[other]
        ]
        if not new:
            return
        places = self.add(middles[new], level)
        rows: list[int] = []
        states: list[State] = []
        for way, name in enumerate(self.ways):
            for place, k in zip(places, new, strict=True):
                (row,) = self.rows([place], way)
                begin = self.begin
                if name != "from rest":
                    (before,) = self.rows([pairs[k][0 if name == "up" else 1]], way)
                    x, v, branch, memory = self.table.columns.last[before].tolist()
                    begin = (x, v, branch, memory)
                rows.append(row)
                states.append(usable(self.table.regimes[row], begin))
        self.run(rows, np.array(states))

    def differ(self, one: int, other: int) -> bool:
        """Tell whether the trains at two values differ in a direction: in period, or by a jump of the orbit."""
        table = self.table
        for way in range(len(self.ways)):
            a, b = self.rows([one, other], way)
            q = int(table.cycles[a])
            if q != table.cycles[b] or table.columns.status[a] != table.columns.status[b]:
                return True
            if q:
                orbits = [
                    np.column_stack([table.columns.x[row, -q:], table.columns.v[row, -q:]])
                    / table.scales[row, :2]
                    for row in (a, b)
                ]
                if orbit_distance(*orbits) > JUMP:
                    return True
        return False

    def trial(self, rows: Sequence[int], states: FloatArray) -> tuple[Any, Any, Any]:
        """Run trains from states; return their states, periods and distances."""
        regimes = [self.table.regimes[row] for row in rows]
        begin = self.done

        def tell(part: int, _all: int) -> None:
            self.tell(begin + part)

        found = run_columns(regimes, states, *self.counts, threads=self.threads, progress=tell)
        fronts = np.array([math.inf if r.hammer.front is None else r.hammer.front for r in regimes])
        cycles, distances = cycles_of(found, fronts, self.table.scales[list(rows)])
        return found, cycles, distances

    def run(self, rows: Sequence[int], states: FloatArray) -> None:
        """Run trains from states and keep what is found."""
        found, cycles, distances = self.trial(rows, states)
        put(self.table.columns, rows, found)
        self.table.cycles[list(rows)] = cycles
        self.table.distances[list(rows)] = distances
        self.done += len(rows)

    def tell(self, done: int) -> None:
        """Tell how many trains are done; those that are run again to close joints do not count."""
        if self.progress is not None:
            self.progress(min(done, self.known), self.known)

    def measure(self) -> None:
        """Compute the exponents of the trains without a period, over as many firings as there are points."""
        columns, table = self.table.columns, self.table
        rows = [
            row
            for row, regime in enumerate(table.regimes)
            if columns.status[row] == OK
            and table.cycles[row] == 0
            and not (regime.hammer.front is not None and columns.x[row, 0] > regime.hammer.front)
        ]
        window = (_BEFORE + 1, _BEFORE + self.points)
        trains = []
        for row in rows:
            regime = table.regimes[row]
            drive = regime.drive or PulseTrain(
                regime.fired, period=regime.period, pulses=window[1] + 2, overlap=regime.overlap
            )
            begin = (float(columns.last[row, 0]), float(columns.last[row, 1]))
            if columns.last[row, 2] >= 0.0 or math.isnan(begin[0]):
                continue
            trains.append((row, Train(regime.hammer, drive, regime.period, begin)))
        self.known += len(trains)
        begun = self.done
        found = exponents_of(
            [train for _row, train in trains],
            window,
            self.counts[3],
            threads=self.threads,
            progress=lambda done, _all: self.tell(begun + done),
        )
        for (row, _train), exponent in zip(trains, found, strict=True):
            if exponent.ok and exponent.smooth:
                self.exponents[row], self.errors[row] = exponent.value, exponent.standard_error
        self.done += len(trains)

    def result(self) -> Bifurcation:
        """Return the diagram as far as it is."""
        order = np.argsort(self.values, kind="stable")
        rows = (len(self.ways) * order + np.arange(len(self.ways))[:, np.newaxis]).astype(np.int64)
        table = self.table
        return Bifurcation(
            regime=self.regime,
            parameter=self.name,
            values=self.values[order],
            directions=self.ways,
            firing=np.arange(self.counts[1] + 1, self.counts[0] + 1),
            phase=self.counts[2],
            x=table.columns.x[rows],
            v=table.columns.v[rows],
            branch=table.columns.branch[rows],
            status=table.columns.status[rows],
            cycles=table.cycles[rows],
            distances=table.distances[rows],
            exponents=self.exponents[rows],
            standard_errors=self.errors[rows],
            levels=self.levels[order],
            carried=table.carried,
            tolerance=self.counts[3],
        )


_BEFORE: Final = 100
"""Firings before an exponent counts."""


def _parameter(
    hammer: Hammer,
    given: tuple[npt.ArrayLike | None, npt.ArrayLike | None, str | None, npt.ArrayLike | None],
    timing: tuple[float | str | None, float | str | None],
    options: dict[str, Any],
) -> tuple[str, FloatArray, Regime]:
    """Return the name of the parameter, its values, and the regime in which it is changed."""
    periods, rates, parameter, values = given
    if sum(entry is not None for entry in (periods, rates, parameter)) != 1:
        raise InputError("periods, rates and parameter: expected one of them")
    if (parameter is None) != (values is None):
        raise InputError("parameter and values: expected both of them, or neither")
    name = parameter or (PERIOD if periods is not None else RATE)
    grid = _ascending(values if values is not None else periods if periods is not None else rates, name)
    timed = name in (PERIOD, RATE)
    if timed and timing != (None, None):
        raise InputError(f"period and rate: expected none of them beside the values of {name!r}")
    if timed and options["drive"] is None:
        options = {**options, name: float(grid[0])}
    else:
        options = {**options, "period": timing[0], "rate": timing[1]}
    regime = Regime.of(hammer, **options)
    regime.value(name)
    return name, grid, regime


def _ascending(values: npt.ArrayLike | None, name: str) -> FloatArray:
    try:
        found = np.atleast_1d(np.array(values, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected numbers in SI") from None
    if found.ndim != 1 or found.size == 0 or not np.isfinite(found).all():
        raise InputError(f"{name}: expected a list of at least one finite number in SI")
    falling = np.flatnonzero(np.diff(found) <= 0.0)
    if falling.size:
        before, after = found[falling[0] : falling[0] + 2].tolist()
        raise InputError(f"{name}: {after:.9g} follows {before:.9g}, expected ascending values")
    return found


def _whole(value: SupportsIndex, name: str) -> int:
    try:
        count = -1 if isinstance(value, bool) else value.__index__()
    except AttributeError:
        count = -1
    if count < 0:
        raise InputError(f"{name} = {value!r}, expected a whole number, not negative")
    return count
