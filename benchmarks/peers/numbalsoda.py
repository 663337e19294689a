"""numbalsoda: LSODA and DOP853 called from compiled code, with compiled right-hand sides and events.

Events are located at a crossing in either direction to 1e-8 of the time unit; a Newton step then moves the
state to the surface. The units of time and length are chosen such that this accuracy suffices.
"""

from __future__ import annotations

import importlib
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.solvers.entry import Absent, Entry
from benchmarks.solvers.problem import FIRST, GRID, PERIOD

from .equations import (
    BACKSTOP,
    FREE,
    LENGTH,
    LOADING,
    TIME,
    UNLOADING,
    compiled_acceleration,
    hammer_constants,
    scaled_pieces,
)

if TYPE_CHECKING:
    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

_MODE, _PEAK, _PIECE, _CONSTANTS = 0, 1, 2, 7
_SIZE = _CONSTANTS + 12
_FIRST = 0.1
_MOST_STEPS = 10_000_000


def entries(task: Task, quick: bool) -> list[Entry]:
    """Return the benchmark entries of numbalsoda.

    Raises
    ------
    Absent
        numbalsoda is not installed.
    """
    try:
        importlib.import_module("numbalsoda")
    except (ImportError, OSError) as error:
        raise Absent("not installed") from error
    from importlib.metadata import version

    name = f"numbalsoda {version('numbalsoda')}"
    pulses = 2 if quick else 20
    empty = np.zeros(0)

    def entry(label: str, split: bool, tolerance: float) -> Entry:
        def run(end: float, grid: FloatArray) -> FloatArray:
            split_march, naive_march, _ = _functions()
            march = split_march if split else naive_march
            pieces = scaled_pieces(task, end)
            return np.asarray(
                march(pieces, hammer_constants(task), task.rest / LENGTH, tolerance, grid / TIME) * LENGTH
            )

        return Entry(
            f"{name} {label}, {tolerance:.0e}",
            lambda: run(FIRST, GRID),
            lambda: run(pulses * PERIOD, empty),
            pulses * PERIOD,
        )

    return [
        entry("LSODA, one right-hand side", False, 1e-9),
        entry("DOP853, its events", True, 1e-8),
        entry("DOP853, its events", True, 1e-11),
    ]


@lru_cache(maxsize=1)
def _functions() -> tuple[Any, Any, list[Any]]:
    """Compile the two integration loops: split at events, and with one right-hand side."""
    numba: Any = importlib.import_module("numba")

    numbalsoda: Any = importlib.import_module("numbalsoda")
    acceleration = compiled_acceleration()
    carray = numba.carray

    def rates(t: float, y: Any, out: Any, data: Any) -> None:
        d = carray(data, (_SIZE,))
        a = acceleration(
            t,
            y[0] * LENGTH,
            y[1] * (LENGTH / TIME),
            int(d[_MODE]),
            d[_PEAK],
            d[_CONSTANTS:],
            d[_PIECE:_CONSTANTS],
        )
        out[0] = y[1]
        out[1] = a * (TIME * TIME / LENGTH)

    def naive_rates(t: float, y: Any, out: Any, data: Any) -> None:
        d = carray(data, (_SIZE,))
        c = d[_CONSTANTS:]
        x = y[0] * LENGTH
        r = (x - c[7]) / c[8]
        if r > 0.0:
            d[_PEAK] = max(d[_PEAK], r)
            mode = LOADING if y[1] >= 0.0 else UNLOADING
        else:
            d[_PEAK] = 0.0
            mode = BACKSTOP if x < c[9] else FREE
        out[0] = y[1]
        out[1] = acceleration(t, x, y[1] * (LENGTH / TIME), mode, d[_PEAK], c, d[_PIECE:_CONSTANTS]) * (
            TIME * TIME / LENGTH
        )

    def guards(_t: float, y: Any, out: Any, data: Any) -> None:
        d = carray(data, (_SIZE,))
        front, position = d[_CONSTANTS + 7] / LENGTH, d[_CONSTANTS + 9] / LENGTH
        mode = int(d[_MODE])
        out[1] = 1.0
        if mode == FREE:
            out[0] = y[0] - position
            out[1] = front - y[0]
        elif mode == LOADING:
            out[0] = y[1]
        elif mode == UNLOADING:
            out[0] = y[0] - front
            out[1] = -y[1]
        else:
            out[0] = position - y[0]

    cfunc: Any = numba.cfunc(numbalsoda.lsoda_sig)
    functions = [cfunc(function) for function in (rates, naive_rates, guards)]
    rates_at, naive_at, guards_at = (function.address for function in functions)
    solve_ivp, lsoda = numbalsoda.solve_ivp, numbalsoda.lsoda

    def prepare(constants: FloatArray) -> FloatArray:
        data = np.zeros(_SIZE)
        data[_MODE] = BACKSTOP
        data[_PEAK] = 1.0
        data[_CONSTANTS:] = constants
        return data

    prepared = numba.njit(prepare)

    def split(
        pieces: FloatArray, constants: FloatArray, rest: float, tolerance: float, grid: FloatArray
    ) -> FloatArray:
        data = prepared(constants)
        front, position = constants[7] / LENGTH, constants[9] / LENGTH
        out = np.full(grid.size, np.nan)
        state = np.array([rest, 0.0])
        span = np.empty(2)
        done = 0
        for p in range(pieces.shape[0]):
            piece = pieces[p]
            data[_PIECE:_CONSTANTS] = piece
            t, end = piece[0], piece[1]
            while t < end:
                span[0], span[1] = t, end
                upto = done
                while upto < grid.size and grid[upto] <= end:
                    upto += 1
                wanted = np.append(grid[done:upto], end)
                mode = int(data[_MODE])
                found = solve_ivp(
                    rates_at,
                    span,
                    state,
                    wanted,
                    "DOP853",
                    2,
                    guards_at,
                    data.ctypes.data,
                    min(_FIRST, end - t),
                    0.0,
                    tolerance,
                    tolerance,
                )
                if not found.success:
                    return out
                if not found.event_found:
                    out[done:upto] = found.y[: upto - done, 0]
                    done = upto
                    state = found.y[-1].copy()
                    break
                out[done : done + found.t.size] = found.y[:, 0]
                done += found.t.size
                state = found.y_event.copy()
                t = found.t_event
                a = acceleration(
                    t, state[0] * LENGTH, state[1] * (LENGTH / TIME), mode, data[_PEAK], constants, piece
                ) * (TIME * TIME / LENGTH)
                if mode == LOADING or (mode == UNLOADING and found.ind_event == 1):
                    rest_of_way = -state[1] / a
                    state[0] += state[1] * rest_of_way
                    state[1] = 0.0
                    if mode == LOADING:
                        data[_PEAK] = (state[0] - front) * LENGTH / constants[8]
                    data[_MODE] = UNLOADING if mode == LOADING else LOADING
                else:
                    level = (
                        front if mode == UNLOADING or (mode == FREE and found.ind_event == 1) else position
                    )
                    rest_of_way = (level - state[0]) / state[1]
                    state[0] = level
                    state[1] += a * rest_of_way
                    if mode == FREE:
                        data[_MODE] = BACKSTOP if found.ind_event == 0 else LOADING
                    else:
                        data[_MODE] = FREE
                t += rest_of_way
        return out

    def naive(
        pieces: FloatArray, constants: FloatArray, rest: float, tolerance: float, grid: FloatArray
    ) -> FloatArray:
        data = prepared(constants)
        out = np.full(grid.size, np.nan)
        state = np.array([rest, 0.0])
        done = 0
        for p in range(pieces.shape[0]):
            piece = pieces[p]
            data[_PIECE:_CONSTANTS] = piece
            while done < grid.size and grid[done] <= piece[0]:
                out[done] = state[0]
                done += 1
            upto = done
            while upto < grid.size and grid[upto] < piece[1]:
                upto += 1
            times = np.empty(upto - done + 2)
            times[0], times[-1] = piece[0], piece[1]
            times[1:-1] = grid[done:upto]
            found, good = lsoda(naive_at, state, times, data, tolerance, tolerance, _MOST_STEPS)
            if not good:
                return out
            out[done:upto] = found[1:-1, 0]
            done = upto
            state = found[-1].copy()
        out[done:] = state[0]
        return out

    # Return the functions, too, since the loops refer to their addresses.
    return numba.njit(split), numba.njit(naive), functions
