"""The tangent flow through a coil circuit, from finite differences of runs; for tests."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from tests.tangents import SHARP, SMALLEST

from printhammer.derivatives.flow import flow, rest_columns
from printhammer.derivatives.parameters import Parameter, parameter_names, parameters
from printhammer.derivatives.states import follow, state_rows
from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.kernel.model.circuit import BLOCKED
from printhammer.kernel.model.layout import (
    CHARGED,
    CURRENT_SCALE,
    LINKAGE_SCALE,
    RESISTANCE,
    TURN_RESISTANCE,
)
from printhammer.kernel.model.modes import RELOADING, UNLOADING
from printhammer.kernel.single import carry
from printhammer.run.problem import Problem, fresh_carry
from printhammer.run.start import initial_state
from printhammer.run.supply import current_of

if TYPE_CHECKING:
    import printhammer as ph
    from printhammer.derivatives.flow import Flow


def problem_of(hammer: ph.Hammer, drive: Any, state: tuple[float, float] | None = None) -> Problem:
    """Run of a hammer, suitable for finite differences."""
    return Problem(hammer, drive, initial_state(hammer, state), 0.0, SHARP)


def units_of(problem: Problem) -> np.ndarray:
    """Typical magnitudes of displacement, velocity, memory and electric state."""
    way, speed = problem.scales
    linkage = problem.constants[LINKAGE_SCALE]
    voltage = max(
        problem.constants[CHARGED], problem.constants[RESISTANCE] * problem.constants[CURRENT_SCALE]
    )
    return np.array([way, speed, way, linkage, linkage, voltage])


def currents(problem: Problem, state: Any, path: float) -> tuple[float, float]:
    """Convert the flux linkages of a state to the currents in the coil and in its shorted turn, A."""
    hammer, x, linkage, main = problem.hammer, *(float(state[k]) for k in (0, 3, 4))
    coil = current_of(hammer, x, linkage, main) if path != BLOCKED else 0.0
    if not problem.constants[TURN_RESISTANCE] > 0.0:
        return coil, 0.0
    alone = hammer.replace({"coil.turn_resistance": None, "coil.leakage": None})
    return coil, current_of(alone, x, main, main) - coil


def arrive(problem: Problem, state: Any, branch: int, path: float, start: float, end: float) -> np.ndarray:
    """Return the state at `end` of a run from `state` at `start`; both states have six components."""
    begin = fresh_carry(start, (float(state[0]), float(state[1])))
    if branch in (UNLOADING, RELOADING):
        begin[carry.STATE], begin[carry.MODE], begin[carry.PEAK] = carry.ON_BRANCH, branch, state[2]
    begin[carry.WITH_CURRENT] = 1.0
    begin[carry.ELECTRIC : carry.ELECTRIC + 3] = (*currents(problem, state, path), state[5])
    nodes = np.empty((20_000, 9))
    status, used, _touched, _steps = problem.kernel.run(
        (problem.drive_arrays(), problem.constants, problem.control, problem.bounds, 100_000),
        end,
        nodes,
        np.empty((500, 7)),
        begin,
    )
    assert status == 0
    assert used <= len(nodes)
    _t, x, v, mode, kept = nodes[used - 1, :5]
    memory = kept if int(mode) in (UNLOADING, RELOADING) else 0.0
    return np.array([x, v, memory, *nodes[used - 1, 5:8]])


def settled(difference: Any, size: float, levels: int, units: np.ndarray) -> np.ndarray:
    """Extrapolate central differences of halved steps to zero; return the extrapolate that changes least."""
    rows: list[list[np.ndarray]] = []
    best, found = np.inf, np.zeros(len(units))
    for k in range(levels):
        row = [difference(size / 2**k)]
        for i in range(k):
            row.append(row[i] + (row[i] - rows[-1][i]) / (4.0 ** (i + 1) - 1.0))
            change = float(np.abs((row[i + 1] - rows[-1][i]) / units).max())
            if change < best:
                best, found = change, row[i + 1]
        rows.append(row)
    return found


def deviation(
    hammer: ph.Hammer, drive: Any, start: float, end: float, size: float = 4e-6, levels: int = 5
) -> float:
    """Relative difference between the flow and differences of runs, in typical magnitudes."""
    problem = problem_of(hammer, drive)
    followed: Flow = follow(problem, np.array([start, end]), np.eye(6), renormalise=False)
    assert followed.status_name == "ok"
    assert followed.smooth
    units = units_of(problem)
    first = followed.states[0, [0, 1, 3, 4, 5, 6]]
    branch, path = int(followed.states[0, 2]), float(followed.states[0, 7])
    begun = Problem(hammer, drive, (float(first[0]), float(first[1])), start, SHARP)
    begun.scales, begun.control = problem.scales, problem.control
    columns, rows = (state_rows(problem, code) for code in followed.states[:, 2])

    def difference(j: int, step: float) -> np.ndarray:
        move = np.zeros(6)
        move[j] = step * units[j]
        ahead, behind = (arrive(begun, first + sign * move, branch, path, start, end) for sign in (1.0, -1.0))
        return np.asarray((ahead - behind) / (2.0 * step))

    def column(j: int) -> np.ndarray:
        return settled(lambda step: difference(j, step), size, levels, units)

    truth = np.array([column(j) for j in columns]).T[rows] / units[rows, np.newaxis]
    own = followed.columns[np.ix_(rows, columns)] * units[columns] / units[rows, np.newaxis]
    return float(np.linalg.norm(own - truth)) / max(float(np.linalg.norm(truth)), SMALLEST)


def changed(
    hammer: ph.Hammer, drive: ph.PulseTrain, name: str, value: float
) -> tuple[ph.Hammer, ph.PulseTrain]:
    """Hammer and drive with a changed constant."""
    section, _, last = name.rpartition(".")
    waveform, times = drive.waveform, drive.times.tolist()
    if section == "waveform":
        other = type(waveform)(**{**waveform.model_dump(), last: value})
        return hammer, PulseTrain(other, at=times, overlap=drive.overlap)
    if name == "period":
        return hammer, PulseTrain(waveform, at=[k * value for k in range(len(times))], overlap=drive.overlap)
    return hammer.replace(name, value), drive


def deviations(
    hammer: ph.Hammer,
    drive: ph.PulseTrain,
    end: float,
    names: list[str] | None = None,
    *,
    size: float = 4e-5,
    levels: int = 4,
) -> dict[str, float]:
    """Return the relative difference between tangent columns and finite differences, by constant.

    The differences are relative, in typical magnitudes; a constant at an end of its range is omitted. The
    steps of the differences, relative to the constant, begin at `size` and are halved `levels` - 1 times.
    """
    problem = problem_of(hammer, drive)
    wanted = []
    for name in names or parameter_names(hammer, drive):
        with suppress(InputError):
            wanted += parameters(hammer, drive, [name])
    record = problem.run(end)
    carried = flow(problem, record, wanted, np.array([0.0, end]), rest_columns(problem, wanted))
    assert carried.smooth
    rows, units = state_rows(problem, carried.states[1, 2]), units_of(problem)
    own = carried.changes[1][[0, 1, 2, 8, 9, 10]] / units[:, np.newaxis]

    def final(name: str, value: float) -> np.ndarray:
        other = problem_of(*changed(hammer, drive, name, value))
        other.scales, other.control = problem.scales, problem.control
        node = other.run(end).nodes[-1]
        memory = node[4] if int(node[3]) in (UNLOADING, RELOADING) else 0.0
        return np.array([node[1], node[2], memory, *node[5:8]])

    found = {}
    for k, parameter in enumerate(wanted):

        def difference(step: float, parameter: Parameter = parameter) -> np.ndarray:
            ends = [
                final(parameter.name, parameter.value + sign * step * parameter.scale) for sign in (1.0, -1.0)
            ]
            return np.asarray((ends[0] - ends[1]) / (2.0 * step))

        with suppress(InputError):
            truth = settled(difference, size, levels, units) / units
            norm = max(float(np.linalg.norm(truth[rows])), SMALLEST)
            found[parameter.name] = float(np.linalg.norm((own[:, k] - truth)[rows])) / norm
    return found
