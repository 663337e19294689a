"""The tangent flow of constants: how a motion changes with the constants of hammer and drive.

The columns of `printhammer.kernel.variational` carried along a recorded run, in a second pass as for the
tangent flow of the state (`printhammer.derivatives.states`). docs/tangent.md has the derivation.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.derivatives.flow import Flow, carry_columns, forcing_of
from printhammer.derivatives.parameters import Parameter, as_arrays, parameters, rest_changes
from printhammer.derivatives.states import problem_between, state_of, state_rows
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    CAPACITANCE,
    CHARGED,
    CHARGING,
    COILS,
    COUPLED,
    DECAY_PIECE,
    END,
    FRONT,
    MAGNET,
    PACK,
    POSITION,
    RESERVOIR_PIECE,
    RESISTANCE,
    SWITCHED_PIECE,
    TURN_RESISTANCE,
)
from printhammer.kernel.variational.layout import ENERGY, SPACING, electric_row
from printhammer.results import Declared, part, scalar
from printhammer.run.problem import TOLERANCE, Problem, Record

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray


class ConstantMap(Declared):
    """The derivative of the state at one time with respect to constants.

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
        """Whether the run went as asked."""
        return self.status == M.STATUS_NAMES[M.OK]

    def moving(
        self, state_map: FloatArray, start_moves: npt.ArrayLike = 0.0, end_moves: npt.ArrayLike = 0.0
    ) -> FloatArray:
        """Return the matrix for a start and an end that move with the constants themselves.

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
        With a status; a run that could not go on is no exception.

    Raises
    ------
    InputError
        As for the tangent map; a constant that is not known or at whose value nothing is differentiable.
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


def flow(
    problem: Problem,
    record: Record,
    wanted: Sequence[Parameter],
    marks: FloatArray,
    initial: FloatArray,
    nodes: Sequence[int] = (),
) -> Flow:
    """Carry the columns of constants along a recorded run; arguments as for `carry_columns`.

    The changes are those with ``value / scale`` of each constant.
    """
    forcing = forcing_of(problem, as_arrays(wanted))
    return carry_columns(problem, [record], marks, initial, forcing, nodes=nodes)


def rest_columns(problem: Problem, wanted: Sequence[Parameter]) -> FloatArray:
    """Return the changes of a start from rest at time 0 with constants, shape (3, n): m, m/s, m.

    A pulse fired at that time with a sharp edge begins to act later if its firing does. With a circuit shape
    (6, n), of a start without current.
    """
    columns = np.zeros((3, len(wanted)))
    columns[0] = rest_changes(problem.hammer, wanted)
    if problem.laws.circuit:
        return without_current(problem, wanted, columns)
    begun = problem.firings == 0.0
    if begun.any():
        from printhammer.hammer.static_force import StaticForce

        value = float(problem.drive.value(0.0))
        static, x = StaticForce(problem.hammer), problem.state[0]
        push = value if problem.drive.quantity == "force" else static.free(x, value) - static.free(x, 0.0)
        for k, parameter in enumerate(wanted):
            columns[1, k] = -push / problem.hammer.mass * float(parameter.firings[begun].sum())
    return columns


def without_current(problem: Problem, wanted: Sequence[Parameter], columns: FloatArray) -> FloatArray:
    """Return the changes of a start without current at time 0, shape (6, n): those of `columns`, Wb, Wb, V.

    The linkage is that of the place; a voltage switched on at that time acts later if its firing does.
    """
    magnet: Any = import_module(problem.laws.magnet or problem.laws.absent)
    linkage = getattr(magnet, "magnet_linkage", None) if problem.constants[COUPLED] else None
    electric = np.zeros((3, len(wanted)))
    x, n = float(problem.state[0]), len(problem.firings)
    begun = (problem.firings == 0.0) if n else np.zeros(0, bool)
    push = 0.0
    if begun.any():
        first = problem.pieces[problem.begins[int(np.flatnonzero(begun)[-1])]]
        push = float(first[2])
        if first[1] < SWITCHED_PIECE:
            push = float(problem.drive.value(0.0))
        elif first[1] == DECAY_PIECE:
            push = 0.0
    for k, parameter in enumerate(wanted):
        moves = parameter.hammer
        if linkage is not None:
            total = 0.0
            for offset, weight in ((-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)):
                e = offset * SPACING
                total += weight * linkage(
                    (problem.constants + e * moves)[MAGNET:], x + e * columns[0, k], 0.0
                )
            electric[:2, k] = total / (12.0 * SPACING)
        electric[2, k] = moves[CHARGED]
        if begun.any():
            electric[0, k] -= push * float(parameter.firings[begun].sum())
    if problem.constants[TURN_RESISTANCE] == 0.0:
        electric[1] = 0.0
    return np.vstack([columns, electric])


def surface_moves(wanted: Sequence[Parameter]) -> dict[str, FloatArray]:
    """Return the changes [m] of the front of the pack and of the position of the backstop, by surface."""
    moves = as_arrays(wanted)["hammer"]
    return {"pack": moves[:, FRONT], "backstop": moves[:, POSITION]}


def pack_push_changes(
    problem: Problem, wanted: Sequence[Parameter], state: FloatArray, changes: FloatArray
) -> FloatArray:
    """Return the changes [N] of the push of the pack on the armature, shape (n,).

    At a state inside the pack, a row of `Flow.states`, from the changes there of displacement, velocity and
    latest local maximum, shape (3 or more, n).
    """
    moves = as_arrays(wanted)["hammer"]
    return np.array(
        [_push_change(problem, moves[k], state, changes[:3, k]) for k in range(len(wanted))], dtype=np.float64
    )


def pack_push_rate(problem: Problem, record: Record, t: float) -> float:
    """Return the rate [N/s] of the push of the pack at a time of a run, s; NaN but on the loading branch."""
    row = problem.resample(record, np.array([t]))[0]
    if int(row[9]) != M.LOADING:
        return math.nan
    drive = float(row[2]) if problem.drive.quantity == "force" else 0.0
    a = (float(row[3:9].sum()) + drive) / problem.hammer.mass
    still = np.zeros_like(problem.constants)
    # In the time of the motion, so that the changes are of the size of the state.
    time = problem.scales[0] / problem.scales[1]
    direction = np.array([float(row[1]), a, 0.0]) * time
    return _push_change(problem, still, np.array([row[0], row[1], row[9], 0.0]), direction) / time


def _push_change(problem: Problem, moves: FloatArray, state: FloatArray, change: FloatArray) -> float:
    """Return the change [N] of the push of the pack with constants, displacement, velocity and memory."""
    x, v, mode, peak = (float(number) for number in state[:4])
    dx, dv, dp = (float(number) for number in change)
    # No point may leave the pack, and no depth may change much.
    sink = max(abs(dx - moves[FRONT]), abs(dp - moves[FRONT]))
    depth = x - problem.constants[FRONT]
    share = SPACING * min(1.0, depth / sink if sink > 0.0 and depth > 0.0 else 1.0)
    share *= min(1.0, problem.scales[1] / abs(dv) if dv else 1.0)

    part: Any = import_module(problem.laws.pack)
    unloads = mode != M.LOADING and getattr(part, "MEMORY", False)

    def push(e: float) -> float:
        c = (problem.constants + e * moves)[PACK:BACKSTOP_PART]
        if unloads:
            return -float(part.pack_unloading(c, x + e * dx, v + e * dv, part.pack_memory(c, peak + e * dp)))
        return -float(part.pack_loading(c, x + e * dx, v + e * dv))

    near, far = push(share) - push(-share), push(2.0 * share) - push(-2.0 * share)
    return (8.0 * near - far) / (12.0 * share)


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
