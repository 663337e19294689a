"""The work of the coil over a run: net, positive, given back, and its heat."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.hammer.static_force import StaticForce
from printhammer.results import Declared, scalar
from printhammer.run.supply import winding_of

if TYPE_CHECKING:
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.problem import Problem, Record
    from printhammer.support.arrays import FloatArray

_SAMPLES: Final = np.array([*np.linspace(0.0, 1.0, 9)[:-1], 1.0 - 1e-9])
_BISECTIONS: Final = 52
_HALVINGS: Final = 12
_HEAT_ERROR: Final = 1e-13


class CoilWork(Declared):
    """Work of the coil over one run; its power is (Fm(x, I) - Fm(x, 0)) v."""

    net: float = scalar("J", "integral of the power", more="`coil_work` of the energy ledger")
    positive: float = scalar(
        "J", "integral of the power where it is positive", more="what a supply gives that takes nothing back"
    )
    squared_current: float = scalar("A^2 s", "integral of the squared current")
    heat: float | None = scalar(
        "J", "resistance of the coil times that", more="None for a hammer without `coil.resistance`"
    )

    @property
    def given_back(self) -> float:
        """Work that the armature does on the coil, J: positive less net."""
        return self.positive - self.net


def coil_power(hammer: Hammer, x: FloatArray, v: FloatArray, magnet: FloatArray) -> FloatArray:
    """Return the power of the coil, W, from displacement, m, velocity, m/s, and force of the magnet, N."""
    static = StaticForce(hammer)
    unexcited = np.array([static.magnet(place) for place in x.ravel().tolist()]).reshape(x.shape)
    return np.asarray((magnet - unexcited) * v)


def coil_work_of(problem: Problem, record: Record) -> CoilWork:
    """Integrate the power of the coil along a run, each stretch of one sign by itself.

    The quadrature is that of the ledger. Steps in which the power changes its sign are split there, so that
    every integrand is smooth.
    """
    start, end = float(record.nodes[0, 0]), float(record.nodes[-1, 0])
    resistance = problem.hammer.coil_resistance
    squared = squared_current(problem.drive, start, end) if problem.drive.quantity == "current" else 0.0
    heat = None if resistance is None else resistance * squared
    if problem.laws.circuit:
        times = record.nodes[:, 0]
        whole = problem.quadratures(record, np.arange(len(times) - 1), times[:-1], times[1:])
        heat, warm = math.fsum(whole[:, 6]), winding_of(problem.hammer).warm_resistance
        squared = heat / warm if warm > 0.0 else math.nan
    if problem.drive.quantity == "force" or problem.hammer.magnet is None:
        return CoilWork(0.0, 0.0, squared, heat)
    steps, starts, ends = _stretches(problem, record)
    work = problem.quadratures(record, steps, starts, ends)[:, 0] if steps.size else np.zeros(0)
    return CoilWork(math.fsum(work), math.fsum(work[work > 0.0]), squared, heat)


def squared_current(drive: Drive, start: float, end: float) -> float:
    """Integrate the square of the current of a drive from one time, s, to another, A^2 s."""
    edges = np.unique(np.add.outer(drive.times, drive.segments()[:, 0]))
    inside = edges[(edges > start) & (edges < end)]
    total = []
    for low, high in zip([start, *inside], [*inside, end], strict=True):
        before = math.inf
        for halving in range(_HALVINGS):
            integral = _gauss(drive, np.linspace(low, high, 2**halving + 1))
            if abs(integral - before) <= _HEAT_ERROR * integral:
                break
            before = integral
        total.append(integral)
    return math.fsum(total)


def _gauss(drive: Drive, ends: FloatArray) -> float:
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    points, weights = np.polynomial.legendre.leggauss(8)
    value = drive.value(middle[:, np.newaxis] + half[:, np.newaxis] * points)
    return float((half[:, np.newaxis] * weights * value**2).sum())


def _stretches(problem: Problem, record: Record) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return steps and times, s, between which the power of the coil has one sign."""
    begins, finishes = record.nodes[:-1, 0], record.nodes[1:, 0]
    rows = np.flatnonzero(finishes > begins)
    begins, finishes = begins[rows], finishes[rows]
    times = begins[:, np.newaxis] + (finishes - begins)[:, np.newaxis] * _SAMPLES
    times = np.minimum(times, np.nextafter(finishes, -np.inf)[:, np.newaxis])
    sign = _signs(problem, record, times.ravel()).reshape(times.shape)
    low, high = times[:, :-1], times[:, 1:]
    crossed = sign[:, :-1] * sign[:, 1:] < 0
    before, left, right = sign[:, :-1][crossed], low[crossed], high[crossed]
    for _ in range(_BISECTIONS if left.size else 0):
        middle = 0.5 * (left + right)
        same = _signs(problem, record, middle) == before
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    zero_row, zero_column = np.nonzero(sign[:, 1:-1] == 0.0)
    cut_rows = np.concatenate([np.nonzero(crossed)[0], zero_row])
    cuts = np.concatenate([right, times[zero_row, zero_column + 1]])
    which = np.concatenate([np.arange(rows.size), cut_rows])
    starts = np.concatenate([begins, cuts])
    order = np.lexsort((starts, which))
    which, starts = which[order], starts[order]
    last = np.append(which[1:] != which[:-1], True)
    ends = np.where(last, finishes[which], np.append(starts[1:], 0.0))
    return rows[which], starts, ends


def _signs(problem: Problem, record: Record, times: FloatArray) -> FloatArray:
    table = problem.resample(record, times)
    return np.sign(coil_power(problem.hammer, table[:, 0], table[:, 1], table[:, 3]))
