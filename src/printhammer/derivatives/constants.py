"""Tangent flow of constants: derivatives of a motion with respect to constants of hammer and drive.

A second pass along a recorded run integrates the columns of `printhammer.kernel.variational`, as for the
tangent flow of the state (`printhammer.derivatives.states`). The derivation is in docs/tangent.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from printhammer.derivatives.flow import Flow, carry_columns, forcing_of
from printhammer.derivatives.parameters import Parameter, as_arrays, rest_changes
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    CHARGED,
    COUPLED,
    DECAY_PIECE,
    FRONT,
    MAGNET,
    PACK,
    POSITION,
    SWITCHED_PIECE,
    TURN_RESISTANCE,
)
from printhammer.kernel.variational.layout import SPACING
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import FloatArray


def flow(
    problem: Problem,
    record: Record,
    wanted: Sequence[Parameter],
    marks: FloatArray,
    initial: FloatArray,
    nodes: Sequence[int] = (),
) -> Flow:
    """Integrate the columns of constants along a recorded run; most arguments are as for `carry_columns`.

    Derivatives are with respect to the scaled constants, ``value / scale``.
    """
    forcing = forcing_of(problem, as_arrays(wanted))
    return carry_columns(problem, [record], marks, initial, forcing, nodes=nodes)


def rest_columns(problem: Problem, wanted: Sequence[Parameter]) -> FloatArray:
    """Return the derivatives of displacement, velocity and latest maximum at rest at time 0, shape (3, n).

    If a pulse with a sharp edge is fired at time 0, a shift of its firing changes the initial velocity. With
    a coil circuit, the shape is (6, n), for a start without current.
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
    """Return the derivatives of an initial state without current, shape (6, n): rows 3 to 5 are electric.

    The flux linkage at zero current depends on the initial displacement. If a voltage is switched on at time
    0, a shift of its firing changes the initial flux linkage.
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
    """Return the derivatives of the positions of pack front and backstop, m, by surface, shape (n,) each."""
    moves = as_arrays(wanted)["hammer"]
    return {"pack": moves[:, FRONT], "backstop": moves[:, POSITION]}


def pack_push_changes(
    problem: Problem, wanted: Sequence[Parameter], state: FloatArray, changes: FloatArray
) -> FloatArray:
    """Return the derivatives of the pack force on the armature, N, shape (n,).

    `state` is a row of `Flow.states` inside the pack; `changes`, shape (3 or more, n), are the derivatives of
    displacement, velocity and latest local maximum in this state.
    """
    moves = as_arrays(wanted)["hammer"]
    return np.array(
        [_push_change(problem, moves[k], state, changes[:3, k]) for k in range(len(wanted))], dtype=np.float64
    )


def pack_push_rate(problem: Problem, record: Record, t: float) -> float:
    """Return the rate of change of the pack force at a time, s, in N/s; NaN off the loading branch."""
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
    """Return the derivative of the pack force, N, in the direction of a change of constants and state."""
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
