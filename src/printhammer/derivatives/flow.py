"""Integration of variational equations along a recorded run; the only interface to their kernel.

The integration is a second pass over the record of a run, so that ordinary runs bear no extra cost.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from printhammer.kernel.compile.specialise import variational
from printhammer.kernel.model.layout import BACKSTOP_PART, COIL, DAMPING, FRONT, MAGNET, PACK, SPRING
from printhammer.kernel.model.modes import PAUSED, STATUS_NAMES
from printhammer.kernel.variational import layout as V
from printhammer.results import Declared, part
from printhammer.run.problem import Problem, Record, Stretch
from printhammer.support.arrays import FloatArray

_VALUE_SPACING: Final = 1e-3
"""Drive step of the finite difference d(force)/d(drive), as a fraction of the largest pulse."""


class Flow(Declared):
    """Columns of the variational equations along a run, at requested times, the marks."""

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
        """Name of the status of the run."""
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
    """Integrate columns along a run, at the times `marks`; NaN after an early end of the run.

    Parameters
    ----------
    problem, stretches
        The run, and its record.
    marks : array, shape (m,)
        Ascending times at which the columns are returned, s.
    initial : array, shape (3, n), with a circuit (3, n) or (6, n)
        Changes of displacement, m, velocity, m/s, and latest local maximum, m, at the first mark; of flux
        linkage of the coil and of its shorted turn, Wb, and voltage of the reservoir, V, by default zero. If
        no current flows, the displacement determines the linkage, and the given change of the linkage is
        ignored.
    forcing : tuple, optional
        Derivatives of the equations with respect to constants, see `forcing_of`; by default none, and only
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
    """Pack the derivatives by "hammer", "firings" and "pieces" for n constants into kernel arguments."""
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
