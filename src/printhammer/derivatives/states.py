"""Tangent flow of the state through all contacts, and Lyapunov exponents of a pulse train.

A neighbouring motion meets every discontinuity slightly earlier or later; docs/tangent.md derives the jumps
(saltation matrices) that result. The flow is integrated in a second pass over the record of a run, so that
ordinary runs bear no extra cost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.derivatives.flow import Flow, carry_columns
from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model.layout import CAPACITANCE, TURN_RESISTANCE
from printhammer.kernel.model.modes import HELD_UNLOADING, OK, RELOADING, STATUS_NAMES, UNLOADING
from printhammer.results import Declared, part, scalar
from printhammer.run.problem import TOLERANCE, Problem, check_tolerance
from printhammer.run.start import initial_state, state_beyond
from printhammer.support.arrays import FloatArray

_NODES: Final = 4096  # Number of nodes of a record processed at once, which bounds the memory; arbitrary
_WARM_UP: Final = 100  # Arbitrary
"""Number of firings during which perturbations align with the growth directions before averaging."""
_FEWEST: Final = 8
"""Smallest number of growth factors from which a standard error is estimated; arbitrary."""


class TangentMap(Declared):
    """Derivative of the state at one time with respect to the state at an earlier time.

    The state is displacement [m] and velocity [m/s]; on the unloading branch of a pack with memory also the
    displacement of the latest local maximum, m (0 in `state_at_start` and `state_at_end` if the state does
    not include a memory). If a voltage drives the coil, the flux linkages of the coil and of its shorted
    turn, Wb, and the voltage of the reservoir, V, follow if the circuit has them. Without a current, the
    displacement determines the linkage: the row of the linkage follows that of the displacement, and its
    column is zero.
    """

    matrix: FloatArray = part(
        "derivative d(state at the end) / d(state at the start), shape (2 or 3, 2 or 3), with a circuit up to"
        " (6, 6)",
        more="NaN if the run ended early",
    )
    start: float = scalar("s", "time at the start")
    end: float = scalar("s", "time at the end")
    state_at_start: tuple[float, float, float] = part(
        "displacement, m, velocity, m/s, and latest local maximum, m, at that time"
    )
    state_at_end: tuple[float, float, float] = part(
        "displacement, m, velocity, m/s, and latest local maximum, m, at that time"
    )
    branch_at_start: int = part("code of the mode, see `printhammer.kernel.model.modes`")
    branch_at_end: int = part("code of the mode at the end", more="-1 if the run ended before")
    smooth: bool = part(
        "whether the state has a derivative; False if the motion passes a touch without velocity"
    )
    status: str = part("status of the run")

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.status == STATUS_NAMES[OK]

    @property
    def determinant(self) -> float:
        """Growth factor of volumes in state space; 0 if the state has fewer components at the end.

        Raises
        ------
        ValueError
            The state at the end includes a memory, the state at the start does not.
        """
        rows, columns = self.matrix.shape
        if rows > columns:
            raise ValueError("the state at the end has more components than that at the start")
        if rows < columns:
            return 0.0
        return float(np.linalg.det(self.matrix))


class Exponent(Declared):
    """Lyapunov exponents of a strobe map: mean logarithmic growth of small perturbations per firing."""

    value: float = part(
        "largest exponent, per firing",
        more="minus infinity if the motion forgets its past, NaN if the run ended early",
    )
    standard_error: float = part(
        "standard error of the largest exponent, from overlapping batch means; infinite for fewer than eight"
        " firings"
    )
    second: float = part(
        "second exponent in the plane of displacement and velocity, per firing; with a voltage drive the"
        " second largest",
        more="a third, that of the memory of the pack, is minus infinity: every contact meets fresh paper",
    )
    period: float = scalar("s", "time between firings")
    factors: FloatArray = part("logarithm of the growth from each firing to the next")
    smooth: bool = part("whether the motion has a derivative; False if it passes a touch without velocity")
    status: str = part("status of the run")
    second_factors: FloatArray = part(
        "as `factors`, for the second exponent", repr=False, default_factory=lambda: np.zeros(0)
    )
    states: FloatArray = part(
        "displacement, m, velocity, m/s, mode, and latest local maximum, m, at the firings, shape (number of"
        " factors + 1, 4); with a voltage drive also electric state and path, (.., 8)",
        more="NaN if the run ended before",
        repr=False,
        default_factory=lambda: np.zeros((0, 4)),
    )

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.status == STATUS_NAMES[OK]

    @property
    def per_second(self) -> float:
        """Largest Lyapunov exponent per unit time, 1/s."""
        return self.value / self.period

    @property
    def total(self) -> float:
        """Sum of both Lyapunov exponents: mean logarithmic growth of areas of the (x, v) plane per firing."""
        return self.value + self.second


def tangent_map(
    hammer: Hammer,
    drive: Drive,
    start: float,
    end: float,
    *,
    state: Sequence[float] | None = None,
    tolerance: float = TOLERANCE,
) -> TangentMap:
    """Compute the derivative of the state at time `end` with respect to the state at time `start`.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    drive : Drive
        The drive.
    start, end : float
        Times, s, in a run that begins at time 0. At a discontinuity, the state after it is used.
    state : sequence of float, optional
        Displacement [m], velocity [m/s] and any further components at time 0, as for `printhammer.simulate`;
        by default the rest state.
    tolerance : float, optional
        Error allowed in one step of the run.

    Returns
    -------
    TangentMap
        Derivative with a status; a run that ends early raises no exception.

    Raises
    ------
    InputError
        The times are not ascending, the state or tolerance is invalid, or no state is given and the hammer
        has no rest state.
    """
    problem = problem_between(hammer, drive, start, end, state, tolerance)
    flow = follow(problem, np.array([start, end]), np.eye(problem.state_size), renormalise=False)
    branches = [int(code) if code >= 0.0 else -1 for code in flow.states[:, 2]]
    columns, rows = (state_rows(problem, branch) for branch in branches)
    ok = flow.status == OK
    matrix = flow.columns[np.ix_(rows, columns)] if ok else np.full((2, len(columns)), np.nan)
    return TangentMap(
        matrix=matrix,
        start=start,
        end=end,
        state_at_start=state_of(flow.states[0]),
        state_at_end=state_of(flow.states[1]),
        branch_at_start=branches[0],
        branch_at_end=branches[1],
        smooth=flow.smooth,
        status=flow.status_name,
    )


def problem_between(
    hammer: Hammer,
    drive: Drive,
    start: float,
    end: float,
    state: Sequence[float] | None,
    tolerance: float,
) -> Problem:
    """Build the problem of a tangent map from `start` to `end` [s]; check the arguments of `tangent_map`."""
    if not (math.isfinite(start) and math.isfinite(end) and 0.0 <= start < end):
        raise InputError(
            f"start = {start!r} s and end = {end!r} s",
            key="start",
            value=start,
            expected="ascending times, not negative",
        )
    return _problem(hammer, drive, state, tolerance)


def components(mode: float) -> int:
    """Return the number of mechanical state components in a mode of motion: 3 with a pack memory, else 2.

    A mode, such as free flight or unloading of the pack, is a number of the kernel.
    """
    return 3 if mode in (UNLOADING, RELOADING, HELD_UNLOADING) else 2


def state_rows(problem: Problem, mode: float, electric: int = 3) -> list[int]:
    """Return the row indices of `Flow.changes` that form the state in a mode of motion, see `components`.

    `electric` is the index of the first electric row. The components have the same indices in the initial
    columns of `carry_columns`.
    """
    rows = list(range(components(mode)))
    if problem.laws.circuit:
        there = (True, problem.constants[TURN_RESISTANCE] > 0.0, problem.constants[CAPACITANCE] > 0.0)
        rows += [electric + place for place, has in enumerate(there) if has]
    return rows


def state_of(row: FloatArray) -> tuple[float, float, float]:
    """Return displacement [m], velocity [m/s] and latest local maximum of displacement [m] of a state.

    `row` is a row of `Flow.states`.
    """
    return float(row[0]), float(row[1]), float(row[3])


def strobe_exponent(
    hammer: Hammer,
    waveform_or_drive: Waveform | Drive,
    period: float | None = None,
    *,
    first: int = 1,
    last: int,
    state: Sequence[float] | None = None,
    tolerance: float = TOLERANCE,
) -> Exponent:
    """Compute the Lyapunov exponents of the strobe map of a train, with a standard error.

    Two perturbations, initially orthonormal, are integrated along the motion and re-orthonormalised at every
    step (G. Benettin, L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15 (1980) 9 and 21). The
    standard error of the mean growth, an autocorrelated series, is estimated by overlapping batch means of
    length sqrt(n) (M. S. Meketon and B. Schmeiser, Proc. Winter Simulation Conf. 1984, 227; J. M. Flegal and
    G. L. Jones, Ann. Statist. 38 (2010) 1034).

    Parameters
    ----------
    hammer, state, tolerance
        As for `tangent_map`.
    waveform_or_drive : Waveform or Drive
        Waveform fired every `period`; or a drive, whose firings are used if it has several, else multiples of
        the period after its first firing.
    period : float, optional
        Time between firings, s; by default the period of the drive.
    first, last : int
        First and last of the firings between which growth is averaged, counted from 1.

    Returns
    -------
    Exponent
        Exponents with a status; a run that ends early raises no exception.
    """
    drive, times, spacing = _strobes(waveform_or_drive, period, first, last)
    problem = _problem(hammer, drive, state, tolerance)
    before = max(first - 1 - _WARM_UP, 0)
    scale, speed = problem.scales
    initial = np.zeros((problem.state_size, 2))
    initial[0, 0], initial[1, 1] = scale, speed
    followed = follow(problem, times[before:], initial, renormalise=True)
    growth = followed.growth[first - before :]
    factors = growth[:, 0].copy()
    if followed.status == OK:
        value, second = (float(mean) for mean in growth.mean(axis=0))
        error = standard_error(factors)
    else:
        value = error = second = math.nan
    return Exponent(
        value=value,
        standard_error=error,
        second=second,
        period=spacing,
        factors=factors,
        smooth=followed.smooth,
        status=followed.status_name,
        second_factors=growth[:, 1].copy(),
        states=followed.states[first - 1 - before :].copy(),
    )


def standard_error(series: npt.ArrayLike) -> float:
    """Estimate the standard error of the mean of an autocorrelated series, by overlapping batch means.

    With n numbers, batches of length b = floor(sqrt(n)) and batch means m_j, the square of the standard error
    is b / ((n - b)(n - b + 1)) sum (m_j - m)^2. The result is infinite for fewer than eight numbers, or if a
    number is not finite.
    """
    numbers = np.asarray(series, dtype=np.float64)
    n = numbers.size
    if n < _FEWEST or not np.isfinite(numbers).all():
        return math.inf
    b = math.isqrt(n)
    mean = numbers.mean()
    sums = np.cumsum(np.concatenate([[0.0], numbers - mean]))
    means = (sums[b:] - sums[:-b]) / b
    return float(math.sqrt(b / ((n - b) * (n - b + 1.0)) * float(means @ means)))


def _problem(hammer: Hammer, drive: Drive, state: Sequence[float] | None, tolerance: float) -> Problem:
    check_tolerance(tolerance)
    start = initial_state(hammer, None if state is None else state[:2])
    return Problem(hammer, drive, start, 0.0, tolerance, state_beyond(hammer, state, drive.quantity))


def _strobes(
    waveform_or_drive: Waveform | Drive, period: float | None, first: int, last: int
) -> tuple[Drive, FloatArray, float]:
    """Return the drive, the times of the firings 1 to `last` [s], and the firing period [s]."""
    if not 1 <= first < last:
        raise InputError(
            f"first = {first!r} and last = {last!r}",
            key="first",
            value=first,
            expected="numbers of firings, ascending",
        )
    drive = waveform_or_drive
    if not isinstance(drive, Drive):
        if period is None:
            raise InputError(
                "period is missing", key="period", expected="the time between the firings of the waveform"
            )
        drive = PulseTrain(drive, period=period, pulses=last)
    spacing = drive.period if period is None else period
    if spacing is None or not (math.isfinite(spacing) and spacing > 0.0):
        raise InputError.of("period", spacing, "a positive number", unit="s")
    times = np.array(drive.times, dtype=np.float64)
    if times.size == 1:
        times = times[0] + spacing * np.arange(last)
    if times.size < last:
        raise InputError.of(
            "last", last, f"at most {times.size}, the number of firings of the drive", written=str(last)
        )
    return drive, times[:last], float(spacing)


def follow(problem: Problem, marks: FloatArray, initial: FloatArray, *, renormalise: bool) -> Flow:
    """Simulate a problem to the last time in `marks`; integrate perturbations from the first time on.

    The record is processed in segments, so that memory does not grow with the length of the run.
    """
    return problem.in_stretches(
        float(marks[-1]),
        _NODES,
        lambda stretches: carry_columns(problem, stretches, marks, initial, renormalise=renormalise),
    )
