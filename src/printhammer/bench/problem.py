"""The problem that all solvers are given: the frozen hammer, a train of 1.35 ms, in one form for everybody.

A peer gets the constants in one array, the drive as a table of smooth pieces of current, and the four modes
by number, so that none of them needs to know how printhammer works.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.drive.trains import PulseTrain
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

PERIOD: Final = 1.35e-3
"""Time between firings, s."""
FIRST: Final = 3e-3
"""Time over which errors are measured, s."""
GRID: Final = np.linspace(0.0, FIRST, 3001)
"""Times at which errors are measured, s."""

FREE, LOADING, UNLOADING, BACKSTOP = range(4)

LENGTH: Final = 1e-4
"""Unit of displacement, m, for solvers with a single tolerance for displacement and velocity."""
TIME: Final = 1e-4
"""Unit of time, s, that goes with it; both are of order one then."""

CONSTANTS: Final = (
    *("mass", "F0", "Am", "Bm", "Bs", "As"),
    *("pack_stiffness", "front", "thickness"),
    *("position", "backstop_stiffness", "damping"),
)
"""Names of the constants in the order of `Task.constants`."""


@dataclass(frozen=True)
class Task:
    """A hammer with the laws of the paper, fired at a constant rate, from rest.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    period : float
        Time between firings, s.
    """

    hammer: Hammer
    period: float = PERIOD

    @cached_property
    def constants(self) -> FloatArray:
        """The constants of the hammer, SI, in the order of `CONSTANTS`."""
        hammer: Any = self.hammer
        magnet, spring, pack, backstop = hammer.magnet, hammer.spring, hammer.pack, hammer.backstop
        return np.array(
            [
                hammer.mass,
                *(magnet.F0, magnet.Am, magnet.Bm, spring.Bs, spring.As),
                *(pack.stiffness, pack.front, pack.thickness),
                *(backstop.position, backstop.stiffness, backstop.damping),
            ]
        )

    @cached_property
    def rest(self) -> float:
        """Displacement at rest, m."""
        from printhammer.hammer.equilibrium import rest_state

        return rest_state(self.hammer)

    def drive(self, pulses: int) -> PulseTrain:
        """Return the drive with so many firings."""
        from printhammer.drive.trains import PulseTrain

        assert self.hammer.waveform is not None
        return PulseTrain(self.hammer.waveform, period=self.period, pulses=pulses)

    @lru_cache(maxsize=32)  # noqa: B019
    def pieces(self, end: float) -> FloatArray:
        """Return the smooth pieces of the current up to time `end`, s: rows (begin, end, A, B, rate).

        The current of a piece is A + B exp(-rate (t - begin)), A. Between pulses it is zero.
        """
        from printhammer.drive.waveforms.shapes import DECAY_TIMES

        form: Any = self.hammer.waveform
        top = -form.amplitude * np.expm1(-form.width / form.rise)
        rows = []
        for pulse in range(int(np.ceil(end / self.period))):
            fired = pulse * self.period
            off = fired + form.width
            over = min(off + DECAY_TIMES * form.decay, fired + self.period)
            rows += [
                (fired, off, form.amplitude, -form.amplitude, 1.0 / form.rise),
                (off, over, 0.0, top, 1.0 / form.decay),
                (over, fired + self.period, 0.0, 0.0, 0.0),
            ]
        table = np.array([row for row in rows if row[0] < min(row[1], end)])
        table[-1, 1] = min(table[-1, 1], end)
        return table


@lru_cache(maxsize=1)
def frozen() -> Task:
    """Return the problem of the benchmark."""
    from printhammer.hammer.hammer import load

    return Task(load(Path(__file__).with_name("frozen-hammer.toml")))


@lru_cache(maxsize=1)
def compiled_acceleration() -> Any:
    """Return the acceleration, m/s^2, in one mode as a function that Numba has compiled.

    Its arguments are time, displacement, velocity, mode, rmax of the unloading branch, constants, and a row
    of `Task.pieces`. Every mode's law goes on smoothly beyond its switch, as event location needs it.
    """
    import math

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


MEMBERS: Final = 512
"""Runs of an ensemble in the table."""
CHECKED: Final = 8
"""So many of them, evenly spread, are compared with the reference."""
ENDS: Final = np.linspace(3e-4, FIRST, 10)
"""Times at which they are compared, s."""


def ensemble_tasks(task: Task, members: int) -> list[Task]:
    """Return the problem with periods from 0.9 to 1.1 of its own, evenly spread."""
    return [Task(task.hammer, task.period * factor) for factor in np.linspace(0.9, 1.1, members).tolist()]


def checked(members: int) -> list[int]:
    """Return the numbers of the members that are compared with the reference."""
    return [int(i) for i in np.linspace(0, members - 1, min(CHECKED, members)).round()]
