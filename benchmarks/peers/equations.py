"""The problem of the benchmark in a form that is independent of printhammer.

The constants form one array, the drive is a table of smooth pieces of current, and the four modes are
numbered, so that the other solvers do not depend on the data structures of printhammer.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

FREE, LOADING, UNLOADING, BACKSTOP = range(4)

LENGTH: Final = 1e-4
"""Unit of displacement, m, for solvers with a single tolerance for displacement and velocity."""
TIME: Final = 1e-4
"""Unit of time, s; with `LENGTH` and `TIME`, displacement and velocity are of order one."""

NAMES: Final = (
    *("mass", "F0", "Am", "Bm", "Bs", "As"),
    *("pack_stiffness", "front", "thickness"),
    *("position", "backstop_stiffness", "damping"),
)
"""Names of the constants in the order of `hammer_constants`."""


@lru_cache(maxsize=32)
def hammer_constants(task: Task) -> FloatArray:
    """Return the constants of the hammer, SI, in the order of `NAMES`."""
    hammer: Any = task.hammer
    magnet, spring, pack, backstop = hammer.magnet, hammer.spring, hammer.pack, hammer.backstop
    return np.array(
        [
            hammer.mass,
            *(magnet.F0, magnet.Am, magnet.Bm, spring.Bs, spring.As),
            *(pack.stiffness, pack.front, pack.thickness),
            *(backstop.position, backstop.stiffness, backstop.damping),
        ]
    )


@lru_cache(maxsize=32)
def current_pieces(task: Task, end: float) -> FloatArray:
    """Return the smooth pieces of the current up to time `end` [s]: rows (begin, end, A, B, rate).

    The current of a piece is A + B exp(-rate (t - begin)), A. Between pulses it is zero.
    """
    from printhammer.drive.waveforms.shapes import DECAY_TIMES

    form: Any = task.hammer.waveform
    top = -form.amplitude * np.expm1(-form.width / form.rise)
    rows = []
    for pulse in range(int(np.ceil(end / task.period))):
        fired = pulse * task.period
        off = fired + form.width
        over = min(off + DECAY_TIMES * form.decay, fired + task.period)
        rows += [
            (fired, off, form.amplitude, -form.amplitude, 1.0 / form.rise),
            (off, over, 0.0, top, 1.0 / form.decay),
            (over, fired + task.period, 0.0, 0.0, 0.0),
        ]
    table = np.array([row for row in rows if row[0] < min(row[1], end)])
    table[-1, 1] = min(table[-1, 1], end)
    return table


def scaled_pieces(task: Task, end: float) -> FloatArray:
    """Return `current_pieces` with times in units of `TIME`."""
    scaled: FloatArray = current_pieces(task, end) / np.array([TIME, TIME, 1.0, 1.0, 1.0 / TIME])
    return scaled


@lru_cache(maxsize=1)
def compiled_acceleration() -> Any:
    """Return a function, compiled by Numba, that computes the acceleration in one mode, m/s^2.

    The arguments are time, displacement, velocity, mode, rmax of the unloading branch, constants, and a row
    of `current_pieces`. The law of each mode continues smoothly beyond its switch, as required to locate
    events.
    """
    import numba

    def acceleration(
        t: float, x: float, v: float, mode: int, peak: float, c: FloatArray, piece: FloatArray
    ) -> float:
        if x <= 0.0:
            return math.nan
        current = piece[2]
        if piece[3] != 0.0:
            current += piece[3] * math.exp(-piece[4] * (t - piece[0]))
        reduced = c[2] - c[3] * current
        f = c[1] - reduced * reduced / math.sqrt(x) + c[4] - c[4] / c[5] * (x - c[9])
        if mode == BACKSTOP:
            depth = c[9] - x
            if depth > 0.0:
                f += depth * math.sqrt(depth) * (c[10] - c[11] * v)
        elif mode != FREE:
            r = (x - c[7]) / c[8]
            if r > 0.0:
                f -= c[6] * (r**2.7 if mode == LOADING else peak**-8.3 * r**11)
        return float(f / c[0])

    compiler: Any = numba.njit(error_model="numpy")
    return compiler(acceleration)
