"""The derivative of a state with respect to constants, for tests of the flow that propagates it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.derivatives.flow import flow
from printhammer.derivatives.parameters import parameters
from printhammer.derivatives.states import problem_between, state_of, state_rows
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    CAPACITANCE,
    CHARGED,
    CHARGING,
    COILS,
    END,
    RESERVOIR_PIECE,
    RESISTANCE,
    TURN_RESISTANCE,
)
from printhammer.kernel.variational.layout import ENERGY, electric_row
from printhammer.results import Declared, part, scalar
from printhammer.run.problem import TOLERANCE, Problem, Record

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray


class ConstantMap(Declared):
    """Derivative of the state at one time with respect to constants.

    The state is that of `printhammer.derivatives.states.TangentMap`.
    """

    matrix: FloatArray = part(
        "derivative d(state at the end) / d(constant), SI, the state at the start held, shape (2 or 3, n);"
        " with a circuit up to (6, n)",
        more="NaN if the run ended early",
    )
    constants: tuple[str, ...] = part("names of the constants, in the order of the columns")
    values: FloatArray = part("their values, SI, shape (n,)")
    start: float = scalar("s", "time at the start")
    end: float = scalar("s", "time at the end")
    state_at_start: tuple[float, float, float] = part("the state there, as of a tangent map")
    state_at_end: tuple[float, float, float] = part("the state there, as of a tangent map")
    rate_at_start: FloatArray = part(
        "rates of the state in time, just after any switch there, a number for each component", repr=False
    )
    rate_at_end: FloatArray = part("the same at the end", repr=False)
    smooth: bool = part("False where the motion in between passes a touch without velocity")
    status: str = part("how the run ended")

    @property
    def ok(self) -> bool:
        """Whether the run reached its end time."""
        return self.status == M.STATUS_NAMES[M.OK]

    def moving(
        self, state_map: FloatArray, start_moves: npt.ArrayLike = 0.0, end_moves: npt.ArrayLike = 0.0
    ) -> FloatArray:
        """Return the matrix for start and end times that depend on the constants.

        The state z at a start that moves is held: d(state) = matrix - M z' ds + y' de, with M the tangent map
        of the state, z' and y' its rates at start and end. For the strobe map over one period that begins
        at firing n of a train, with the period as the constant, ds = n and de = n + 1.

        Parameters
        ----------
        state_map : array
            Matrix of `printhammer.derivatives.states.tangent_map` between the same times.
        start_moves, end_moves : array, shape (n,) or ()
            d(start) / d(constant) and d(end) / d(constant), s per unit of the constant.

        Returns
        -------
        array, shape (2 or 3, n)
            The derivative of the state at the moving end.
        """
        begin = np.broadcast_to(np.asarray(start_moves, dtype=np.float64), self.values.shape)
        finish = np.broadcast_to(np.asarray(end_moves, dtype=np.float64), self.values.shape)
        return np.asarray(
            self.matrix - np.outer(state_map @ self.rate_at_start, begin) + np.outer(self.rate_at_end, finish)
        )


def constant_map(
    hammer: Hammer,
    drive: Drive,
    start: float,
    end: float,
    constants: Sequence[str],
    *,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
) -> ConstantMap:
    """Return the derivative of the state at `end` with respect to constants, the state at `start` held.

    Parameters
    ----------
    hammer, drive, start, end, state, tolerance
        As for `printhammer.derivatives.states.tangent_map`.
    constants : sequence of str
        Names such as "pack.stiffness", "waveform.width", "period", "rate" or "firing.1"; see
        `printhammer.derivatives.parameters`.

    Returns
    -------
    ConstantMap
        With a status; a run that ends early raises no exception.

    Raises
    ------
    InputError
        As for the tangent map; an unknown constant, or a value at which no derivative exists.
    """
    problem = problem_between(hammer, drive, start, end, state, tolerance)
    wanted = parameters(hammer, drive, constants)
    record = problem.run(end)
    marks = np.array([start, end])
    carried = flow(problem, record, wanted, marks, np.zeros((problem.state_size, len(wanted))))
    ok = record.status == M.OK
    scales = np.array([parameter.scale for parameter in wanted])
    before, rows = (state_rows(problem, code) for code in carried.states[:, 2])
    changes = np.full((2, len(wanted)), np.nan)
    rates = np.full((2, problem.state_size), np.nan)
    if ok:
        electric = electric_row(forced=True) - electric_row(forced=False)
        changes = carried.changes[1, [row + electric * (row >= ENERGY) for row in rows]] / scales
        rates = _rates(problem, record, marks, carried.states)
    return ConstantMap(
        matrix=changes,
        constants=tuple(constants),
        values=np.array([parameter.value for parameter in wanted]),
        start=start,
        end=end,
        state_at_start=state_of(carried.states[0]),
        state_at_end=state_of(carried.states[1]),
        rate_at_start=rates[0, before],
        rate_at_end=rates[1, rows],
        smooth=carried.smooth,
        status=record.status_name,
    )


def _rates(problem: Problem, record: Record, times: FloatArray, states: FloatArray) -> FloatArray:
    """Return the rates of the state at times of a run, shape (m, 3)."""
    table: Any = problem.resample(record, times)
    drive = table[:, 2] if problem.drive.quantity == "force" else 0.0
    acceleration = (table[:, 3:9].sum(axis=1) + drive) / problem.hammer.mass
    rates = np.zeros((len(times), problem.state_size))
    moving = states[:, 2] != M.RESTING
    rates[:, 0] = np.where(moving, table[:, 1], 0.0)
    rates[:, 1] = np.where(moving, acceleration, 0.0)
    if problem.laws.circuit:
        rates[:, 3:] = _electric_rates(problem, times, table)
    return rates


def _electric_rates(problem: Problem, times: FloatArray, table: FloatArray) -> FloatArray:
    """Return the rates of the electric state at times of a run, shape (m, 3), from its resampled rows."""
    c = problem.constants
    magnetising, current, voltage, reservoir = table[:, 2], table[:, 10], table[:, 11], table[:, 13]
    rates = np.zeros((len(times), 3))
    rates[:, 0] = voltage - c[RESISTANCE] * current
    rates[:, 1] = -c[TURN_RESISTANCE] * (magnetising - current)
    if c[CAPACITANCE] > 0.0:
        rates[:, 2] = (c[CHARGED] - reservoir) / (c[CHARGING] * c[CAPACITANCE])
        for row, t in enumerate(times):
            fired = int(np.searchsorted(problem.firings, t, side="right")) - 1
            if fired < 0:
                continue
            piece = int(problem.begins[fired])
            while (
                problem.pieces[piece, 1] != END and problem.firings[fired] + problem.pieces[piece + 1, 0] <= t
            ):
                piece += 1
            if problem.pieces[piece, 1] == RESERVOIR_PIECE:
                rates[row, 2] -= c[COILS] * current[row] / c[CAPACITANCE]
    return rates
