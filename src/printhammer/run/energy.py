"""Energies of a run: work of the coil, and the ledger of work, losses and stored energies.

The ledger balances the work of the coil with the losses in pack and backstop and the stored energy.
"""

from __future__ import annotations

import itertools
import math
from importlib import import_module
from typing import Any, Final

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.kernel.model import layout
from printhammer.kernel.readout.energy import TERMS, write_ledger
from printhammer.parts import absent
from printhammer.results import Declared, scalar
from printhammer.run.problem import Problem, Record
from printhammer.run.supply import linkage, winding_of
from printhammer.support.arrays import FloatArray

_SAMPLES: Final = np.array([*np.linspace(0.0, 1.0, 9)[:-1], 1.0 - 1e-9])
_BISECTIONS: Final = 52  # Number of bisections: the bits of a double's mantissa
_HALVINGS: Final = 12  # Iteration limit of the step halving; arbitrary
_HEAT_ERROR: Final = 1e-13  # Relative error at which the heat integral has converged; arbitrary


class CoilWork(Declared):
    """Work of the coil over a run. The coil power is (Fm(x, I) - Fm(x, 0)) v, with the magnet force Fm."""

    net: float = scalar("J", "integral of the power", more="`coil_work` of the energy ledger")
    positive: float = scalar(
        "J",
        "integral of the power where it is positive",
        more="the energy from a supply that cannot take energy back",
    )
    squared_current: float = scalar("A^2 s", "integral of the squared current")
    heat: float | None = scalar(
        "J",
        "heat of the coil: resistance times integral of the squared current",
        more="None for a hammer without `coil.resistance`",
    )

    @property
    def given_back(self) -> float:
        """Energy that the armature returns to the coil, J: positive work minus net work."""
        return self.positive - self.net


def coil_power(hammer: Hammer, x: FloatArray, v: FloatArray, magnet: FloatArray) -> FloatArray:
    """Return the power [W] of the coil from displacement [m], velocity [m/s] and magnet force [N]."""
    static = StaticForce(hammer)
    unexcited = np.array([static.magnet(place) for place in x.ravel().tolist()]).reshape(x.shape)
    return np.asarray((magnet - unexcited) * v)


def coil_work_of(problem: Problem, record: Record) -> CoilWork:
    """Integrate the coil power along a run, separately over intervals of positive and negative power.

    The quadrature is that of the ledger. Steps in which the power changes sign are split at the zero, so that
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
    """Integrate the square of the current of a drive, in A^2 s, from one time [s] to another."""
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
    """Split integration steps where the coil power changes sign.

    Return three arrays with one entry for each piece: index of the step, start [s] and end [s].
    """
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


_POINTS, _PIECES = 10, 8
"""Gauss points per subinterval of the quadrature over the current, and number of subintervals; arbitrary."""


class Ledger(Declared):
    """Energy ledger of a run, J: work, losses, and changes of kinetic and stored energy."""

    coil_work: float = scalar("J", "integral of (Fm(x, I) - Fm(x, 0)) v dt")
    drive_work: float = scalar("J", "work of a drive that is a force")
    pack_loss: float = scalar("J", "minus the integral of Fp v dt")
    backstop_loss: float = scalar(
        "J", "minus the integral of Fe v dt, plus the energy lost in impacts on a rigid backstop"
    )
    damping_loss: float = scalar(
        "J", "minus the integral of v dt times damping of the armature and of contacts"
    )
    supply_work: float = scalar("J", "energy delivered by a voltage supply")
    copper_loss: float = scalar("J", "heat of the coil under a voltage drive")
    driver_loss: float = scalar("J", "heat in the supply's resistance and the diodes")
    eddy_loss: float = scalar("J", "heat of the shorted turn")
    field: float = scalar(
        "J",
        "change of the magnetic energy due to the current",
        more="plus the change of a reservoir capacitor's energy",
    )
    electric_residual: float = scalar(
        "J",
        "supply work minus losses minus coil work minus field",
        more="numerical error of the electric balance; exactly 0 unless a voltage drives the coil",
    )
    kinetic: float = scalar("J", "change of kinetic energy from start to end")
    stored: float = scalar(
        "J", "change of stored energy from start to end", more="magnet at zero current, spring, Hertz"
    )
    throughput: float = scalar("J", "sum of the integrals of the absolute power of all works and losses")
    residual: float = scalar(
        "J",
        "work minus losses minus changes of kinetic and stored energy",
        more="numerical error of the balance, since each term has its own quadrature",
    )


def increments_of(problem: Problem, record: Record) -> FloatArray:
    """Integrate powers over each step of a run; return the energies [J], shape (steps, 5).

    The columns are the work of the coil, the work of the drive, and the losses in pack, backstop and damping.
    Under a voltage drive, four more columns contain the work of the supply, and the losses in coil, driver
    and shorted turn.
    """
    times = record.nodes[:, 0]
    return problem.quadratures(record, np.arange(len(times) - 1), times[:-1], times[1:])


def stored_energy(hammer: Hammer, x: float) -> float:
    """Return the energy stored in magnet (at zero current), spring and backstop at `x` [m], J."""
    origin = hammer.origin
    total = 0.0
    for source, name in ((hammer.magnet, "magnet_energy"), (hammer.spring, "spring_energy")):
        if source is not None:
            total += _function(source, name)(np.array(source.packed(origin)), x)
    if hammer.backstop is not None and x < hammer.backstop.position:
        constants = np.array(hammer.backstop.packed(origin))
        total += _function(hammer.backstop, "backstop_energy")(
            constants, math.sqrt(hammer.backstop.position - x)
        )
    return total


def field_energy(problem: Problem, record: Record, row: int) -> float:
    """Return the magnetic energy due to the current, plus the energy of the supply's capacitor, J.

    The energies are those at the node `row` of the record. With the flux linkage lambda(i), the field energy
    is i lambda minus the integral of lambda over the current from 0 to i, computed by Gauss quadrature.
    """
    hammer = problem.hammer
    constants = problem.constants
    node = record.nodes[row]
    table = problem.resample(record, node[:1].copy())[0]
    x, current, main, turn = float(node[1]), float(table[10]), float(node[5]), float(node[6])
    coil = winding_of(hammer)
    total = 0.5 * constants[layout.CAPACITANCE] * float(node[7]) ** 2 / constants[layout.COILS]
    if coil.leakage is not None:
        total += 0.5 * coil.leakage * current * current
        main, current = turn, float(table[2])
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    pieces = np.linspace(0.0, current, _PIECES + 1)
    below = 0.0
    for low, high in itertools.pairwise(pieces.tolist()):
        places = 0.5 * (low + high) + 0.5 * (high - low) * points
        values = [linkage(hammer, x, place) for place in places.tolist()]
        below += 0.5 * (high - low) * float(weights @ np.array(values))
    return float(total + current * main - below)


def _function(part: Any, name: str) -> Any:
    return getattr(import_module(part.module), name, None) or getattr(absent, name)


def ledger_of(problem: Problem, record: Record, increments: FloatArray) -> Ledger:
    """Compute the ledger of a run from the result of `increments_of`."""
    sums = [float(math.fsum(column)) for column in increments.T]
    field = 0.0
    if problem.laws.circuit:
        field = field_energy(problem, record, -1) - field_energy(problem, record, 0)
    # Without back-EMF the supply does not provide the work of the coil.
    linked = problem.laws.circuit and winding_of(problem.hammer).back_emf
    start, end = record.nodes[0], record.nodes[-1]
    hammer = problem.hammer
    stored = stored_energy(hammer, float(end[1])) - stored_energy(hammer, float(start[1]))
    throughput = float(np.abs(increments).sum())
    terms = [0.0] * len(TERMS)
    write_ledger(start.tolist(), end.tolist(), hammer.mass, [*sums, throughput], stored, field, linked, terms)
    return Ledger(*terms)
