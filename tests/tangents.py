"""Derivatives of the motion by finite differences, for comparison with the tangent flow.

Helpers only; assertions are in the tests that use them.
"""

from typing import Any

import numpy as np

import printhammer as ph
from printhammer.derivatives.states import TangentMap, tangent_map
from printhammer.kernel.model.modes import RELOADING, UNLOADING
from printhammer.kernel.single import carry
from printhammer.run.problem import Problem, fresh_carry

SHARP = 1e-13
"""Tolerance of runs whose differences are taken."""
SLOW = 1e-3
"""Speed, m/s, of a touch below which the motion is all but not differentiable."""
SMALLEST = 1e-3
"""Norm of a scaled matrix below which differences of runs tell no more digits of it."""


def arrive(problem: Problem, state: Any, branch: int, start: float, end: float) -> np.ndarray:
    """State (displacement, velocity, latest local maximum) at `end` of a run from `state` at `start`."""
    begin = fresh_carry(start, (float(state[0]), float(state[1])))
    if branch in (UNLOADING, RELOADING):
        begin[carry.STATE], begin[carry.MODE], begin[carry.PEAK] = carry.ON_BRANCH, branch, state[2]
    nodes = np.empty((20_000, 5))
    status, used, _touched, _steps = problem.kernel.run(
        (problem.drive_arrays(), problem.constants, problem.control, problem.bounds, 100_000),
        end,
        nodes,
        np.empty((500, 7)),
        begin,
    )
    assert status == 0
    assert used <= len(nodes)
    _t, x, v, mode, kept = nodes[used - 1]
    return np.array([x, v, kept if int(mode) in (UNLOADING, RELOADING) else 0.0])


def richardson(difference: Any, size: float, levels: int, scales: np.ndarray) -> np.ndarray:
    """Extrapolate central differences of halved steps to step size 0; return the most converged value."""
    rows: list[list[np.ndarray]] = []
    best = np.inf, np.zeros(3)
    for k in range(levels):
        row = [difference(size / 2**k)]
        for i in range(k):
            row.append(row[i] + (row[i] - rows[-1][i]) / (4.0 ** (i + 1) - 1.0))
            change = float(np.abs((row[i + 1] - rows[-1][i]) / scales).max())
            if change < best[0]:
                best = change, row[i + 1]
        rows.append(row)
    return best[1]


def differences(
    hammer: ph.Hammer, drive: Any, found: TangentMap, size: float = 1e-4, levels: int = 6
) -> np.ndarray:
    """Matrix d(state at the end) / d(state at the start) between the ends of a tangent map."""
    x, v, memory = found.state_at_start
    problem = Problem(hammer, drive, (x, v), found.start, SHARP)
    units = np.array([problem.scales[0], problem.scales[1], problem.scales[0]])
    columns = []
    for j in range(found.matrix.shape[1]):

        def difference(step: float, j: int = j) -> np.ndarray:
            move = np.zeros(3)
            move[j] = step * units[j]
            ends = [
                arrive(
                    problem,
                    np.array([x, v, memory]) + sign * move,
                    found.branch_at_start,
                    found.start,
                    found.end,
                )
                for sign in (1.0, -1.0)
            ]
            return (ends[0] - ends[1]) / (2.0 * step * units[j])

        columns.append(richardson(difference, size, levels, units))
    return np.array(columns).T[: found.matrix.shape[0]]


def scaled(matrix: np.ndarray, scales: tuple[float, float]) -> np.ndarray:
    """A matrix in units of the scales of displacement and velocity."""
    units = np.array([scales[0], scales[1], scales[0]])
    rows, columns = matrix.shape
    return matrix * units[:columns] / units[:rows, np.newaxis]


def deviation(
    hammer: ph.Hammer,
    drive: Any,
    start: float,
    end: float,
    state: tuple[float, float] | None = None,
    found: TangentMap | None = None,
    **how: Any,
) -> float:
    """Return the relative difference between tangent map and finite differences, in scaled variables."""
    found = found or tangent_map(hammer, drive, start, end, state=state, tolerance=SHARP)
    assert found.ok
    assert found.smooth
    truth = differences(hammer, drive, found, **how)
    scales = Problem(hammer, drive, found.state_at_start[:2], start, SHARP).scales
    norm = max(float(np.linalg.norm(scaled(truth, scales))), SMALLEST)
    return float(np.linalg.norm(scaled(found.matrix - truth, scales))) / norm


def before_slow_touches(
    hammer: ph.Hammer, drive: Any, end: float, state: tuple[float, float] | None = None
) -> float:
    """Shorten a run so that no touch in it is slower than 1 mm/s."""
    motion = ph.simulate(hammer, drive, duration=end, state=state, points=2)
    slow = [c.t_in for c in motion.contacts if not c.initial and abs(c.v_in) < SLOW]
    return min([end, *(0.999 * t for t in slow)])
