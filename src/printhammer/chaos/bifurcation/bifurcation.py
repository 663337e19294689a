"""Bifurcation diagrams by brute force: the states at the firings, against a parameter.

For each value of the parameter, a pulse train is fired and a transient is discarded. The states at the
following firings form the column of the diagram at that value: one point for a train of period 1, two for
period 2, many for a strange train.
"""

from __future__ import annotations

from typing import Final, Literal, SupportsIndex, Unpack, get_args

import numpy as np
import numpy.typing as npt

from printhammer.chaos.bifurcation.builder import DiagramBuilder
from printhammer.chaos.bifurcation.columns import EFFORT
from printhammer.chaos.bifurcation.diagram import Bifurcation
from printhammer.chaos.strobe.train import FROM_REST
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import PERIOD, RATE
from printhammer.run.effort import Effort, computation
from printhammer.run.regime import Fired, Firing, Regime
from printhammer.run.start import initial_state, state_beyond
from printhammer.support.arrays import FloatArray

FIRINGS: Final = 1000
"""Default number of firings per train of a bifurcation diagram; arbitrary."""

_JUDGED: Final = 200
"""Default number of recorded firings per train, after the transient; arbitrary."""

REFINE: Final = 2
"""Default number of times to halve the parameter step where neighbouring trains differ; arbitrary."""

MOST_STATES: Final = 100_000_000
"""Largest number of states in a diagram; a larger diagram raises `InputError`. Arbitrary."""

Direction = Literal["from rest", "up", "down", "both"]
DIRECTIONS: Final = get_args(Direction)


class InterruptedDiagram(KeyboardInterrupt):
    """Raised when the computation of a bifurcation diagram is interrupted.

    Attributes
    ----------
    diagram : Bifurcation
        Diagram with the finished columns; all other columns have the status "not run".
    """

    def __init__(self, diagram: Bifurcation) -> None:
        super().__init__("interrupted")
        self.diagram = diagram


@computation
def bifurcation(
    hammer: Hammer | Regime,
    *,
    periods: npt.ArrayLike | None = None,
    rates: npt.ArrayLike | None = None,
    parameter: str | None = None,
    values: npt.ArrayLike | None = None,
    firings: SupportsIndex = FIRINGS,
    transient: SupportsIndex | None = None,
    direction: Direction = "from rest",
    state: tuple[float, float] | None = None,
    refine: SupportsIndex = REFINE,
    exponents: bool = False,
    effort: Effort = EFFORT,
    **firing: Unpack[Fired],
) -> Bifurcation:
    """Compute a bifurcation diagram of a hammer under a periodic drive.

    At the display tolerance, trains that settle slowly are classified as undecided.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime; a hammer requires the keywords of `printhammer.Regime.of`.
    periods, rates : array, optional
        Times between firings, s, or firings per second, Hz, ascending.
    parameter, values : str and array, optional
        Instead of periods or rates: name of a constant, such as "backstop.damping" or "waveform.amplitude",
        and its values, SI, ascending; see `printhammer.run.regime.Regime.with_`.
    firings, transient : int, optional
        Number of firings at each value, and number of firings to discard from the start. By default all but
        the last 200 firings are discarded, and at least a third of all firings. With few firings, trains that
        settle slowly are undecided.
    direction : str, optional
        "from rest": every train begins at rest, without earlier firings. "up", "down": a train starts in the
        final state of the train at the next lower ("up") or next higher ("down") value, with earlier pulses
        still active; the first train begins at rest. "both": up and down. See
        `printhammer.chaos.bifurcation.builder`.
    state : tuple of float, optional
        Displacement [m] and velocity [m/s] that replace the rest state; pulses of earlier firings are still
        active.
    refine : int, optional
        Number of times to halve the step between neighbouring values whose trains have different periods or
        distant orbits.
    exponents : bool, optional
        Whether to compute the Lyapunov exponents of aperiodic trains, which are needed to classify a train as
        strange; the computation then takes many times as long.
    **firing
        Firing of the hammer, as for `printhammer.Regime.of`; period or rate only if another parameter
        varies.

    Returns
    -------
    Bifurcation
        Diagram with a status for each train; a run that ends early raises no exception.

    Raises
    ------
    InputError
        An argument is not as described above, the parameter cannot take one of the values, or the hammer has
        no rest state and no state is given.
    InterruptedDiagram
        The computation was interrupted (KeyboardInterrupt); carries the finished columns.
    """
    name, grid, regime = _parameter(hammer, (periods, rates, parameter, values), firing)
    count = read_count(firings, "firings")
    default = max(count - _JUDGED, count // 3)
    skipped = default if transient is None else read_count(transient, "transient", least=0)
    if count - skipped < 2:
        raise InputError.of("transient", transient, f"at least 2 fewer than the {count} firings")
    if direction not in DIRECTIONS:
        raise InputError.of("direction", direction, f"one of {', '.join(DIRECTIONS)}")
    halvings = read_count(refine, "refine", least=0)
    ways = ("up", "down") if direction == "both" else (direction,)
    if len(grid) * len(ways) * (count - skipped) > MOST_STATES:
        raise InputError(
            f"{len(grid)} values", key="values", expected=f"at most {MOST_STATES} states in a diagram"
        )
    begin = FROM_REST
    if state is not None:
        begin = (
            *initial_state(regime.hammer, state[:2]),
            *state_beyond(regime.hammer, state, regime.fired.quantity),
        )
    builder = DiagramBuilder(regime, name, ways, (count, skipped), begin, effort)
    try:
        builder.base(grid)
        for level in range(1, halvings + 1):
            builder.refine(level)
        if exponents:
            builder.measure()
        builder.compare()
    except KeyboardInterrupt:
        raise InterruptedDiagram(_result(builder)) from None
    return _result(builder)


def _result(builder: DiagramBuilder) -> Bifurcation:
    """Build the diagram from the trains of a builder; trains not yet run keep the status "not run"."""
    order = np.argsort(builder.values, kind="stable")
    rows = (len(builder.ways) * order + np.arange(len(builder.ways))[:, np.newaxis]).astype(np.int64)
    table = builder.table
    firings, transient = builder.counts
    return Bifurcation(
        regime=builder.regime,
        parameter=builder.name,
        values=builder.values[order],
        directions=builder.ways,
        firing=np.arange(transient + 1, firings + 1),
        x=table.columns.x[rows],
        v=table.columns.v[rows],
        branch=table.columns.branch[rows],
        status=table.columns.status[rows],
        cycles=table.cycles[rows],
        distances=table.distances[rows],
        exponents=builder.exponents[rows],
        standard_errors=builder.errors[rows],
        sensitive=builder.sensitive[rows],
        levels=builder.levels[order],
        carried=table.carried,
        tolerance=builder.effort.tolerance,
    )


def _parameter(
    hammer: Hammer | Regime,
    choice: tuple[npt.ArrayLike | None, npt.ArrayLike | None, str | None, npt.ArrayLike | None],
    firing: Firing,
) -> tuple[str, FloatArray, Regime]:
    """Validate the choice of parameter, given as the arguments (periods, rates, parameter, values).

    Returns the name of the parameter, its values [SI], and the regime in which it is varied.
    """
    periods, rates, parameter, values = choice
    if sum(entry is not None for entry in (periods, rates, parameter)) != 1:
        raise InputError("periods, rates and parameter: expected one of them", key="parameter")
    if (parameter is None) != (values is None):
        raise InputError("parameter and values: expected both of them, or neither", key="parameter")
    name = parameter or (PERIOD if periods is not None else RATE)
    grid = _ascending(values if values is not None else periods if periods is not None else rates, name)
    if name in (PERIOD, RATE):
        if firing.get("period") is not None or firing.get("rate") is not None:
            raise InputError(
                f"period and rate: expected neither together with values of {name!r}", key="period"
            )
        if isinstance(hammer, Hammer) and firing.get("drive") is None:
            first = float(grid[0])
            firing = {**firing, "period": first} if name == PERIOD else {**firing, "rate": first}
    regime = Regime.of(hammer, **firing)
    regime.value(name)
    return name, grid, regime


def _ascending(values: npt.ArrayLike | None, name: str) -> FloatArray:
    try:
        grid = np.atleast_1d(np.array(values, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected numbers in SI", key=name) from None
    if grid.ndim != 1 or grid.size == 0 or not np.isfinite(grid).all():
        raise InputError(f"{name}: expected a list of at least one finite number in SI", key=name)
    falling = np.flatnonzero(np.diff(grid) <= 0.0)
    if falling.size:
        before, after = grid[falling[0] : falling[0] + 2].tolist()
        raise InputError(f"{name}: {after:.9g} follows {before:.9g}", key=name, expected="ascending values")
    return grid
