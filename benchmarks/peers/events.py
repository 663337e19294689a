"""Solvers with event detection that are called from Python: SciPy, and CVODE through scikit-sundae.

Each mode has one smooth right-hand side; the solver is restarted at every event and every edge of the drive.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from .equations import (
    BACKSTOP,
    FREE,
    LOADING,
    UNLOADING,
    compiled_acceleration,
    current_pieces,
    hammer_constants,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray


class Stretch(NamedTuple):
    """Result of a solver between two switches.

    Attributes
    ----------
    t : float
        End time, s.
    state : array, shape (2,)
        Displacement [m], and velocity [m/s] at the end time.
    event : int
        Index of the guard function that ended the stretch; -1 at the requested end.
    at : array
        Displacements [m] at the requested times up to the end time.
    """

    t: float
    state: FloatArray
    event: int
    at: FloatArray


class Solver(Protocol):
    """Interface of a solver that integrates one mode until a guard function falls through zero."""

    def __call__(
        self,
        rates: Callable[[float, FloatArray], tuple[float, float]],
        guards: list[Callable[[float, FloatArray], float]],
        begin: float,
        end: float,
        state: FloatArray,
        times: FloatArray,
    ) -> Stretch:
        """Integrate from time `begin` [s] to `end` [s] or to the first event."""


def event_split(task: Task, end: float, grid: FloatArray, solver: Solver) -> FloatArray:
    """Integrate mode by mode and piece by piece of the drive; return the displacement on the grid, m."""
    c = hammer_constants(task)
    acceleration = compiled_acceleration()
    front, position = c[7], c[9]
    guards: dict[int, list[Any]] = {
        FREE: [lambda _t, y: y[0] - position, lambda _t, y: front - y[0]],
        LOADING: [lambda _t, y: y[1]],
        UNLOADING: [lambda _t, y: y[0] - front, lambda _t, y: -y[1]],
        BACKSTOP: [lambda _t, y: position - y[0]],
    }
    following = {
        FREE: (BACKSTOP, LOADING),
        LOADING: (UNLOADING,),
        UNLOADING: (FREE, LOADING),
        BACKSTOP: (FREE,),
    }
    mode, peak = BACKSTOP, 1.0
    state = np.array([task.rest, 0.0])
    out = np.full(grid.size, np.nan)
    for piece in current_pieces(task, end):
        t = float(piece[0])
        while t < piece[1]:

            def rates(s: float, y: FloatArray, mode: int = mode, peak: float = peak) -> tuple[float, float]:
                return y[1], acceleration(s, y[0], y[1], mode, peak, c, piece)  # noqa: B023

            wanted = np.flatnonzero((grid >= t) & (grid <= piece[1]))
            done = solver(rates, guards[mode], t, float(piece[1]), state, grid[wanted])
            out[wanted[: done.at.size]] = done.at
            t, state = done.t, np.array(done.state)
            if done.event >= 0:
                if mode == LOADING:
                    peak = (state[0] - front) / c[8]
                surface = {FREE: (position, front), UNLOADING: (front, None), BACKSTOP: (position,)}
                level = surface.get(mode, (None,))[done.event]
                if level is None:
                    state[1] = 0.0
                else:
                    state[0] = level
                mode = following[mode][done.event]
    return out
