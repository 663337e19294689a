"""The energy ledger of a run: what the coil gave, what pack and backstop took, what is stored."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.parts import absent

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.problem import Problem, Record
    from printhammer.support.arrays import FloatArray


@dataclass(frozen=True)
class Ledger:
    """Energies of one run, J.

    Attributes
    ----------
    coil_work : float
        Integral of (Fm(x, I) - Fm(x, 0)) v dt.
    drive_work : float
        Work of a drive that is a force.
    pack_loss : float
        Minus the integral of Fp v dt.
    backstop_loss : float
        Minus the integral of Fe v dt, and what impacts on a rigid backstop take.
    kinetic, stored : float
        Change of kinetic energy and of stored energy (magnet at zero current, spring, Hertz) from start to
        end.
    throughput : float
        Sum of the integrals of the absolute power of coil, drive force, pack and backstop.
    residual : float
        Work minus losses minus changes: 0 but for numerical errors, since each term has a quadrature of its
        own.
    """

    coil_work: float
    drive_work: float
    pack_loss: float
    backstop_loss: float
    kinetic: float
    stored: float
    throughput: float
    residual: float


def increments_of(problem: Problem, record: Record) -> FloatArray:
    """Return the integrals of power [J] over every step: coil, drive force, pack loss, backstop loss."""
    times = record.nodes[:, 0]
    return problem.quadratures(record, np.arange(len(times) - 1), times[:-1], times[1:])


def stored_energy(hammer: Hammer, x: float) -> float:
    """Return the energy stored in magnet (at zero current), spring and backstop at `x` [m], J."""
    origin = hammer.origin
    total = 0.0
    for part, name in ((hammer.magnet, "magnet_energy"), (hammer.spring, "spring_energy")):
        if part is not None:
            total += _function(part, name)(np.array(part.packed(origin)), x)
    if hammer.backstop is not None and x < hammer.backstop.position:
        constants = np.array(hammer.backstop.packed(origin))
        total += _function(hammer.backstop, "backstop_energy")(
            constants, math.sqrt(hammer.backstop.position - x)
        )
    return total


def _function(part: Any, name: str) -> Any:
    return getattr(import_module(part.module), name, None) or getattr(absent, name)


def ledger_of(problem: Problem, record: Record, increments: FloatArray) -> Ledger:
    """Add up a run.

    Parameters
    ----------
    problem, record
        The run.
    increments : array, shape (steps, 4)
        From `increments_of`.
    """
    coil, force, pack, backstop = (float(math.fsum(column)) for column in increments.T)
    start, end = record.nodes[0], record.nodes[-1]
    hammer = problem.hammer
    kinetic = float(0.5 * hammer.mass * (end[2] ** 2 - start[2] ** 2))
    stored = stored_energy(hammer, float(end[1])) - stored_energy(hammer, float(start[1]))
    return Ledger(
        coil_work=coil,
        drive_work=force,
        pack_loss=pack,
        backstop_loss=backstop,
        kinetic=kinetic,
        stored=stored,
        throughput=float(np.abs(increments).sum()),
        residual=coil + force - pack - backstop - kinetic - stored,
    )
