"""Integration of variational equations along a recorded run; the only interface to their kernel.

The integration is a second pass over the record of a run, so that ordinary runs bear no extra cost.

The tangent flow of constants consists of the derivatives of a motion with respect to constants of hammer and
drive. Its columns are integrated by `printhammer.kernel.variational`, as are the columns of the tangent flow
of the state (`printhammer.derivatives.states`). The derivation is in docs/tangent.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any, Final

import numpy as np

from printhammer.derivatives.parameters import Parameter, as_arrays, rest_changes
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.compile.specialise import variational
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    CHARGED,
    COIL,
    COUPLED,
    DAMPING,
    DECAY_PIECE,
    FRONT,
    MAGNET,
    PACK,
    POSITION,
    SPRING,
    SWITCHED_PIECE,
    TURN_RESISTANCE,
)
from printhammer.kernel.model.modes import PAUSED, STATUS_NAMES
from printhammer.kernel.variational import layout as V
from printhammer.kernel.variational.layout import SPACING
from printhammer.parts.friction import DryFriction
from printhammer.results import Declared, part
from printhammer.run.problem import Problem, Record, Stretch
from printhammer.support.arrays import FloatArray

_VALUE_SPACING: Final = 1e-3
"""Drive step of the finite difference d(force)/d(drive), as a fraction of the largest pulse; arbitrary."""


class Flow(Declared):
    """Tangent columns of the variational equations along a run, at requested times called marks."""

    states: FloatArray = part(
        "displacement, m, velocity, m/s, mode and latest local maximum, m, at the marks, shape (m, 4); with a"
        " circuit also electric state and path, as of a node, shape (m, 8)"
    )
    changes: FloatArray = part(
        "changes at the marks, shape (m, 3 or 8, n): displacement, m; velocity, m/s; latest local maximum,"
        " m; with constants also work of coil and of a force drive, loss in pack, backstop and damping, J,"
        " since the first mark; with a circuit four more rows: flux linkage of the coil and of its shorted"
        " turn, Wb, voltage of the reservoir, V, and end of a fixed off-time, s"
    )
    growth: FloatArray = part(
        "logarithms of the growth of orthonormalised columns since the preceding mark, shape (m, n)"
    )
    passed: FloatArray = part(
        "changes at chosen nodes of the record, before and after the discontinuity, shape (q, 2, .., n)"
    )
    columns: FloatArray = part("changes at the last mark, shape (.., n)")
    smooth: bool = part("whether the motion is differentiable from the first mark to the last")
    status: int = part("code of the status of the run")

    @property
    def status_name(self) -> str:
        """Name of the status of the run, such as "ok"."""
        return STATUS_NAMES[self.status]


def carry_columns(
    problem: Problem,
    stretches: Iterable[Stretch | Record],
    marks: FloatArray,
    initial: FloatArray,
    forcing: tuple[Any, ...] | None = None,
    *,
    nodes: Sequence[int] = (),
    renormalise: bool = False,
) -> Flow:
    """Integrate tangent columns along a run to the times `marks`; NaN after an early end of the run.

    Parameters
    ----------
    problem, stretches
        The run, and its record.
    marks : array, shape (m,)
        Ascending times at which the columns are returned, s.
    initial : array, shape (3, n), with a circuit (3, n) or (6, n)
        Changes of displacement [m], velocity [m/s] and latest local maximum of displacement [m] at the first
        mark; rows 3 to 5, zero by default, are changes of the flux linkages [Wb] of the coil and of its
        shorted turn, and of the reservoir voltage [V]. If no current flows, the displacement determines the
        linkage, and the given change of the linkage is ignored.
    forcing : tuple, optional
        Derivatives of the equations with respect to constants (see `forcing_of`); by default none, and only
        the initial state changes.
    nodes : sequence of int, optional
        Ascending indices of nodes at which the columns are also returned; requires an undivided record.
    renormalise : bool, optional
        Whether to orthonormalise the columns at each step and record the growth.
    """
    forced, circuit, count = forcing is not None, problem.laws.circuit, initial.shape[1]
    rows = V.row_count(forced, circuit)
    if circuit and len(initial) == V.ENERGY:
        initial = np.vstack([initial, np.zeros((V.ELECTRICS, count))])
    kernel = variational(problem.kernel, forced=forced)
    drive = problem.drive_arrays()
    track = np.zeros(V.GROWN + count)
    track[V.SMOOTH] = 1.0
    carried = V.Carried(
        columns=np.zeros((rows, count)),
        work=np.zeros((V.WORK_ROWS, V.work_width(count, forced, circuit))),
        track=track,
        states=np.full((len(marks), 8 if circuit else 4), np.nan),
        changes=np.full((len(marks), rows, count), np.nan),
        growth=np.full((len(marks), count), np.nan),
        passed=np.full((len(nodes), 2, rows, count), np.nan),
    )
    status = PAUSED
    for stretch in stretches:
        status = stretch.status
        kernel.flow(
            stretch.nodes,
            drive,
            problem.constants,
            problem.scales,
            problem.bounds,
            forcing or (),
            np.ascontiguousarray(marks, np.float64),
            np.asarray(nodes, dtype=np.int64),
            renormalise,
            status != PAUSED,
            np.ascontiguousarray(initial, np.float64),
            carried,
        )
    columns, _work, _track, states, changes, growth, passed = carried
    return Flow(states, changes, growth, passed, columns, bool(track[V.SMOOTH]), status)


def forcing_of(problem: Problem, changes: dict[str, FloatArray]) -> tuple[Any, ...]:
    """Convert derivatives with respect to n constants, from `parameters.as_arrays`, to kernel arguments."""
    moves = changes["hammer"]
    count = len(moves)
    away = V.SPACING * (np.arange(V.VARIED) - V.MIDDLE)
    field = moves[:, SPRING:PACK].any(axis=1) | moves[:, MAGNET:].any(axis=1)
    pack = moves[:, PACK:BACKSTOP_PART].any(axis=1) | (moves[:, FRONT] != 0.0)
    backstop = moves[:, BACKSTOP_PART:COIL].any(axis=1)
    damping = moves[:, DAMPING:SPRING].any(axis=1)
    laws = V.FIELD_MOVES * field + V.PACK_MOVES * pack
    laws = laws + V.BACKSTOP_MOVES * backstop + V.DAMPING_MOVES * damping
    laws = laws + V.CIRCUIT_MOVES * moves[:, COIL:].any(axis=1)
    return tuple(
        V.Forcing(
            varied=problem.constants + away[:, np.newaxis] * moves[:, np.newaxis, :],
            moves=moves,
            of_hammer=np.asarray(laws, dtype=np.int64),
            fire_moves=changes["firings"],
            piece_moves=changes["pieces"],
            live_moves=np.zeros((count, 5 * problem.firings.size)),
            memories=np.zeros((count, V.VARIED)),
            value_spacing=_VALUE_SPACING * (problem.drive.largest_pulse or 1.0),
        )
    )


def flow(
    problem: Problem,
    record: Record,
    wanted: Sequence[Parameter],
    marks: FloatArray,
    initial: FloatArray,
    nodes: Sequence[int] = (),
) -> Flow:
    """Integrate the derivatives with respect to constants along a recorded run; see `carry_columns`.

    Derivatives are with respect to the scaled constants, ``value / scale``.
    """
    forcing = forcing_of(problem, as_arrays(wanted))
    return carry_columns(problem, [record], marks, initial, forcing, nodes=nodes)


def rest_columns(problem: Problem, wanted: Sequence[Parameter]) -> FloatArray:
    """Return the derivatives of the rest state at time 0 with respect to n constants, shape (3, n).

    The rows are displacement [m], velocity [m/s] and latest local maximum of displacement [m]. If a pulse
    with a sharp edge is fired at time 0, a shift of its firing changes the initial velocity. With a coil
    circuit, the shape is (6, n); the run starts without current, see `without_current`.
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
        push = _released(problem.hammer, push, static.total(x))
        for k, parameter in enumerate(wanted):
            columns[1, k] = -push / problem.hammer.mass * float(parameter.firings[begun].sum())
    return columns


def _released(hammer: Hammer, push: float, before: float) -> float:
    """Return the net force [N] after a jump `push` of the force on a resting armature; 0 if still at rest.

    `before` is the sum of the forces [N] that a stop or friction balances until the jump.
    """
    after, damping = push + before, hammer.damping
    if isinstance(damping, DryFriction):
        return 0.0 if abs(after) <= damping.static else after - math.copysign(damping.kinetic, after)
    if not any(part is not None and part.rigid for part in (hammer.backstop, hammer.pack)):
        return push
    return 0.0 if before * after > 0.0 else after


def without_current(problem: Problem, wanted: Sequence[Parameter], columns: FloatArray) -> FloatArray:
    """Return the derivatives of a currentless initial state with respect to n constants, shape (6, n).

    Rows 0 to 2 are `columns`, the derivatives of the mechanical state. Rows 3 to 5 are the derivatives of the
    flux linkages of coil and shorted turn [Wb] and of the reservoir voltage [V]. The flux linkage at zero
    current depends on the initial displacement. If a voltage is switched on at time 0, a shift of its firing
    changes the initial flux linkage.
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
    """Return the derivatives of the positions [m] of pack front and backstop with respect to n constants.

    Each entry, "pack" and "backstop", has the shape (n,).
    """
    moves = as_arrays(wanted)["hammer"]
    return {"pack": moves[:, FRONT], "backstop": moves[:, POSITION]}


def pack_push_changes(
    problem: Problem, wanted: Sequence[Parameter], state: FloatArray, changes: FloatArray
) -> FloatArray:
    """Return the derivatives of the pack force [N] with respect to n constants, shape (n,).

    `state` is a row of `Flow.states` inside the pack; `changes`, shape (3 or more, n), are the derivatives of
    displacement, velocity and latest local maximum of displacement in this state.
    """
    moves = as_arrays(wanted)["hammer"]
    return np.array(
        [_push_change(problem, moves[k], state, changes[:3, k]) for k in range(len(wanted))], dtype=np.float64
    )


def pack_push_rate(problem: Problem, record: Record, t: float) -> float:
    """Return the time derivative [N/s] of the pack force at the time `t` [s].

    The result is NaN unless the pack is on its loading branch.
    """
    row = problem.resample(record, np.array([t]))[0]
    if int(row[9]) != M.LOADING:
        return math.nan
    drive = float(row[2]) if problem.drive.quantity == "force" else 0.0
    a = (float(row[3:9].sum()) + drive) / problem.hammer.mass
    still = np.zeros_like(problem.constants)
    # Scale by the time of the motion, which makes the changes as large as the state.
    time = problem.scales[0] / problem.scales[1]
    direction = np.array([float(row[1]), a, 0.0]) * time
    return _push_change(problem, still, np.array([row[0], row[1], row[9], 0.0]), direction) / time


def _push_change(problem: Problem, moves: FloatArray, state: FloatArray, change: FloatArray) -> float:
    """Return the directional derivative of the pack force [N] along a change of constants and state.

    `moves` is the change of the packed constants; `change` is that of displacement, velocity and latest local
    maximum of displacement in `state`, a row of `Flow.states`.
    """
    x, v, mode, peak = (float(number) for number in state[:4])
    dx, dv, dp = (float(number) for number in change)
    # A step must neither leave the pack nor change the indentation by much.
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
