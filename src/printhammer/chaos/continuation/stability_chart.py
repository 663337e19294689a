"""The designer's chart: where in the plane of two constants an orbit is stable, and what ends it.

An orbit loses its stability at a fold, a period doubling or a Neimark-Sacker point. Each of them is a curve
in the plane of two constants p and r, on which state, p and r obey

    G(u, p, r) = u,   f(J(u, p, r)) = 0,   f = det(J - I), det(J + I) or det(J) - 1.

These are the fixed points of the map (u, p) -> (G, p + f) with the parameter r, and are followed like any
others (`printhammer.chaos.continuation.arclength`). Beside the curves the chart shows to what a train from
rest settles, on a grid; a stable orbit need not be what is reached from there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.continuation.arclength import Curve, Steps, Stop, follow
from printhammer.chaos.continuation.branch import Branch
from printhammer.chaos.continuation.branch_points import doubling_test, fold_test, torus_test
from printhammer.chaos.continuation.continuation import continuation
from printhammer.chaos.continuation.fixed_points import MapValue, Node
from printhammer.chaos.continuation.tracer import read_bounds
from printhammer.chaos.strobe.map import image_of
from printhammer.chaos.strobe.train import States, Train, run_trains
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.results import Column, Declared, Result, column, derived, part, provenance, scalar
from printhammer.support.threads import Progress, mapped, thread_count

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from printhammer.chaos.continuation.events import BranchEvent
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing, Regime
    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

MOST: Final = 200
"""Number of steps of a curve in either direction unless told otherwise."""

GRID: Final = (48, 32)
"""Numbers of values of the two constants at which trains from rest are judged."""

_TESTS: Final[dict[str, Callable[[FloatArray], float]]] = {
    "fold": fold_test,
    "period doubling": doubling_test,
    "Neimark-Sacker": torus_test,
}
_SPACING: Final = 1e-5
_PRECISION: Final = 1e-8
_PARTS: Final = 5.0
_FIRINGS: Final = 300
_JUDGED: Final = 64
_GRID_TOLERANCE: Final = 1e-9
_SAME: Final = 1e-3


class LossCurve(Declared, eq=False):
    """A curve in the plane of two constants on which an orbit loses its stability, or would."""

    kind: str = part('"fold", "period doubling" or "Neimark-Sacker"')
    first: FloatArray = part("the first constant along the curve, SI, shape (N,)")
    second: FloatArray = part("the second constant, SI, shape (N,)")
    state: FloatArray = part("displacement, m, and velocity, m/s, at the section, shape (N, 2)")
    multipliers: npt.NDArray[np.complex128] = part(
        "one of them is 1 or -1, or both lie on the unit circle, shape (N, 2)"
    )
    limits: BoolArray = part(
        "whether the other multiplier lies inside the unit circle, so that stability is lost here, shape (N,)"
    )
    stops: tuple[Stop, Stop] = part("why and where the curve ends")


class StabilityChart(Result):
    """Where in the plane of two constants an orbit is stable, and what ends it."""

    regime: Regime = part("hammer and periodic drive of the branch it came from")
    names: tuple[str, str] = scalar("", "the two constants")
    units: tuple[str, str] = scalar("", "their SI units")
    bounds: tuple[tuple[float, float], tuple[float, float]] = scalar("SI", "their ranges")
    firings: int = scalar("1", "number of firings after which the orbit repeats")
    curves: tuple[LossCurve, ...] = part("on which it loses its stability", repr=False)
    grid: tuple[FloatArray, FloatArray] = part(
        "values of the two constants, shapes (m,) and (n,), at which trains from rest were judged", repr=False
    )
    settled: IntArray = column(
        "1",
        "firings after which the train from rest repeats",
        "value main",
        more="0 where it does not within the firings given to it, -1 where its run stopped",
        dtype=np.int32,
    )
    refused: tuple[str, ...] = part("why a curve could not be followed, a sentence each", default=())

    @property
    def title(self) -> str:
        """One line that says what the chart is."""
        return f"stability of the period-{self.firings} orbit of {self.regime.hammer.name}"

    @property
    @derived("", "what was found")
    def message(self) -> str:
        """What was found, in one line."""
        kinds = [curve.kind for curve in self.curves]
        counts = ", ".join(f"{kinds.count(kind)} of {kind}" for kind in dict.fromkeys(kinds)) or "none"
        share = float(np.mean(self.settled == self.firings)) if self.settled.size else 0.0
        missed = f"; {len(self.refused)} could not be followed" if self.refused else ""
        return (
            f"curves on which the period-{self.firings} orbit loses its stability: {counts}{missed};"
            f" from rest {100.0 * share:.0f} % of the grid settles to period {self.firings}"
        )

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the chart comes from; the tolerance is that of the trains from rest."""
        regime, waveform = self.regime, self.regime.fired
        return provenance(
            hammer=regime.hammer,
            waveform=waveform,
            overlap=regime.overlap,
            period=regime.period,
            tolerance=_GRID_TOLERANCE,
        )

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return trains from rest over `value` and `main`, curves over `curve` and `point`."""
        # At least one of each: a dimension of length 0 has another meaning in the classic NetCDF format.
        most, count = max((len(curve.first) for curve in self.curves), default=1), max(len(self.curves), 1)
        table = np.full((2, count, most), np.nan)
        limits = np.full((count, most), -1, np.int32)
        codes = np.full(count, -1, np.int32)
        codes[: len(self.curves)] = [list(_TESTS).index(curve.kind) for curve in self.curves]
        for i, curve in enumerate(self.curves):
            table[0, i, : len(curve.first)] = curve.first
            table[1, i, : len(curve.second)] = curve.second
            limits[i, : len(curve.limits)] = curve.limits
        pair = ("curve", "point")
        own = super().entries()
        kind = Column("1", "how stability is lost", ("curve",), name="kind", codes=tuple(_TESTS))
        own["kind"] = kind, codes
        own["limits"] = Column("1", "whether stability is lost", pair, name="limits"), limits
        for k, (name, axis) in enumerate((("first", "main"), ("second", "value"))):
            own[name] = Column(self.units[k], self.names[k], pair, name=name), table[k]
            note = Column(self.units[k], self.names[k], (axis,), "coordinate", name=axis)
            own[axis] = note, self.grid[k]
        return own


def stability_chart(
    branch: Branch | Regime | Hammer,
    second: str,
    bounds: tuple[float | str, float | str],
    *,
    first: tuple[str, float | str, float | str] | None = None,
    grid: tuple[int, int] = GRID,
    most: SupportsIndex = MOST,
    threads: int | None = None,
    progress: Progress | None = None,
    **firing: Unpack[Firing],
) -> StabilityChart:
    """Follow the limits of stability of a branch through a second constant.

    Parameters
    ----------
    branch : Branch, Regime or Hammer
        From `printhammer.continuation`, usually in the rate; its constant is the first one, in its bounds. Of
        a regime, or of a hammer with all that `firing` says of it, the branch along `first` is followed.
    second : str
        The second constant, such as "backstop.damping" or "waveform.amplitude".
    bounds : tuple
        Its least and largest value, SI or text with a unit.
    first : tuple, optional
        Of a regime or hammer: the first constant, its least and its largest value.
    grid : tuple of int, optional
        Numbers of values of the two constants at which trains from rest are judged; (0, 0) for none.
    most : int, optional
        Number of steps of a curve in either direction.
    threads : int, optional
        By default as many as there are cores; the chart does not depend on it.
    progress : callable, optional
        Called now and then with the number of curves that are done and of all.
    **firing
        How a hammer is fired, as for `printhammer.Regime.of`.

    Returns
    -------
    StabilityChart
        With the curves on which the branch's orbit loses its stability, one through each limit of a range of
        stability that lies on no other curve, and what trains from rest settle to.

    Raises
    ------
    InputError
        An argument is not what is described above, or both constants are the same.
    """
    if isinstance(branch, Branch):
        if first is not None or firing:
            raise InputError("a branch is given, expected no first constant and no firing beside it")
    elif first is None:
        raise InputError("first is missing, expected the first constant with its least and largest value")
    else:
        branch = continuation(branch, first[0], first[1:], threads=threads, **firing)
    regime = branch.regime
    if second == branch.parameter:
        raise InputError(f"second = {second!r}, expected another constant than that of the branch")
    ends = read_bounds(regime, second, bounds)
    value = regime.value(second)
    if not ends[0] <= value <= ends[1]:
        raise InputError(f"bounds = {bounds!r}, expected a range around the hammer's own {second}, {value:g}")
    if min(grid) < 0:
        raise InputError(f"grid = {grid!r}, expected two numbers of values, not negative")
    chart = _Chart(branch, second, ends, Steps(most=read_count(most, "most"), precision=_PRECISION))
    # The other multiplier lies inside the unit circle there.
    lost = [event for event in branch.events if np.abs(event.multipliers).max() < 1.0 + _SAME]
    limits = [event for event in lost if event.kind in _TESTS]
    curves, refused = chart.curves(limits, thread_count(threads), progress)
    axes, settled = _grid(branch, second, ends, grid, threads)
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
    )


class _Chart:
    """The curves of one chart."""

    def __init__(self, branch: Branch, second: str, bounds: tuple[float, float], steps: Steps) -> None:
        self.branch, self.second, self.bounds, self.steps = branch, second, bounds, steps
        widths = [(high - low) / _PARTS for low, high in (branch.bounds, bounds)]
        self.scales = np.array([*branch.regime.window.half_widths, *widths])

    def curves(
        self, limits: list[BranchEvent], threads: int, progress: Progress | None
    ) -> tuple[list[LossCurve], list[str]]:
        """Return a curve through each limit, but those that lie on one already."""
        curves: list[LossCurve] = []
        refused: list[str] = []
        left = list(limits)
        while left:
            left = [event for event in left if not any(self.on(curve, event) for curve in curves)]
            # As many at once whatever the number of threads, so that the outcome is the same.
            now, left = left[:2], left[2:]
            for event, curve in zip(now, mapped(self.curve, now, threads, length=1), strict=True):
                if isinstance(curve, str):
                    refused.append(curve)
                elif not any(self.on(other, event) for other in curves):
                    curves.append(curve)
            if progress is not None:
                progress(len(limits) - len(left), len(limits))
        return curves, refused

    def curve(self, event: BranchEvent) -> LossCurve | str:
        """Return the curve through an event of the branch, or why there is none."""
        try:
            curve = follow(
                self.family(event.kind),
                np.append(event.state, event.value),
                self.branch.regime.value(self.second),
                scales=self.scales,
                bounds=self.bounds,
                steps=self.steps,
                watch=self.watch,
            )
        except InputError as error:
            return f"{event.kind} at {self.branch.parameter} = {event.value:.9g} {self.branch.unit}: {error}"
        return self.described(event.kind, curve)

    def watch(self, here: Node, ahead: Node) -> Stop | None:
        """End a curve where the first constant leaves its bounds."""
        low, high = self.branch.bounds
        if low <= ahead.state[2] <= high:
            return None
        bound = low if ahead.state[2] < low else high
        sentence = f"{self.branch.parameter} = {bound:.9g} {self.branch.unit} is the bound"
        return Stop("bound", here.parameter, here.state, sentence, ahead)

    def described(self, kind: str, curve: Curve) -> LossCurve:
        """Return a curve in the words of a chart."""
        nodes = curve.nodes
        jacobians = [node.value.extra for node in nodes]
        multipliers = np.array([np.linalg.eigvals(matrix) for matrix in jacobians], dtype=np.complex128)
        multipliers = multipliers.reshape(len(nodes), 2)
        return LossCurve(
            kind=kind,
            first=np.array([node.state[2] for node in nodes]),
            second=np.array([node.parameter for node in nodes]),
            state=np.array([node.state[:2] for node in nodes]),
            multipliers=multipliers,
            limits=np.abs(multipliers).max(axis=1) < 1.0 + _SAME,
            stops=curve.stops,
        )

    def on(self, curve: LossCurve, event: BranchEvent) -> bool:
        """Return whether an event of the branch lies on a curve, between two of its points."""
        if curve.kind != event.kind:
            return False
        points = np.column_stack([curve.state, curve.first, curve.second]) / self.scales
        place = np.array([*event.state, event.value, self.branch.regime.value(self.second)]) / self.scales
        along = np.diff(points, axis=0)
        lengths = (along**2).sum(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = np.clip(((place - points[:-1]) * along).sum(axis=1) / lengths, 0.0, 1.0)
        feet = points[:-1] + np.nan_to_num(shares)[:, np.newaxis] * along
        # A chord leaves its curve by a part of its length.
        near = np.sqrt(((feet - place) ** 2).sum(axis=1)) <= 0.1 * np.sqrt(lengths) + _SAME
        return bool(near.any())

    def family(self, kind: str) -> Callable[[FloatArray, float], MapValue]:
        """Return the map whose fixed points are the curve: state and first constant, by the second one."""
        branch, test = self.branch, _TESTS[kind]
        scale = float(self.scales[2])

        def family(whole: FloatArray, other: float) -> MapValue:
            moves = _SPACING * self.scales
            points = [(whole, other)]
            points += [(whole + moves[k] * np.eye(3)[k], other) for k in range(3)]
            points.append((whole, other + moves[3]))
            values = []
            for point, second in points:
                try:
                    regime = branch.regime.with_(self.second, second).with_(branch.parameter, float(point[2]))
                except InputError as error:
                    return MapValue.none(3, str(error))
                end = image_of(regime, point[:2], branch.firings, branch.tolerance, contacts=False)
                if not end.ok or not np.isfinite(end.jacobian).all():
                    return MapValue.none(3, "no derivative" if end.ok else end.status)
                values.append((end.state, end.jacobian))
            (image, jacobian), *beside = values
            value = scale * test(jacobian)
            slopes = [(scale * test(near) - value) / moves[k] for k, (_, near) in enumerate(beside)]
            across = [(state - image) / moves[k] for k, (state, _) in enumerate(beside)]
            matrix = np.zeros((3, 3))
            matrix[:2, :2] = jacobian
            matrix[:2, 2] = across[2]
            matrix[2] = slopes[:3]
            matrix[2, 2] += 1.0
            slope = np.append(across[3], slopes[3])
            return MapValue(np.append(image, whole[2] + value), matrix, slope, extra=jacobian)

        return family


def _grid(
    branch: Branch, second: str, bounds: tuple[float, float], grid: tuple[int, int], threads: int | None
) -> tuple[tuple[FloatArray, FloatArray], IntArray]:
    """Return the values of both constants, and after how many firings trains from rest repeat there."""
    axes = (np.linspace(*branch.bounds, grid[0]), np.linspace(*bounds, grid[1]))
    settled = np.zeros((grid[1], grid[0]), dtype=np.int64)
    judged = np.arange(_FIRINGS - _JUDGED + 1, _FIRINGS + 1)
    for row, value in enumerate(axes[1]):
        moved = branch.regime.with_(second, float(value))
        regimes = [moved.with_(branch.parameter, float(first)) for first in axes[0]]
        trains = [Train.of(regime.at_firings, _FIRINGS) for regime in regimes]
        every, _ = run_trains(trains, judged, _GRID_TOLERANCE, None, threads=threads)
        settled[row] = [
            _period(states, train) if states.status == "ok" else -1
            for train, states in zip(trains, every, strict=True)
        ]
    return axes, settled


def _period(states: States, train: Train) -> int:
    """Return after how many firings a train repeats, 0 where that is not known."""
    ends_at = states.settled(train, states.distances(train))
    return 0 if ends_at is None or ends_at.period is None else ends_at.period
