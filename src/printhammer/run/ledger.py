"""The energy ledger of a run: what the coil gave, what pack and backstop took, what is stored."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.parts import absent
from printhammer.results import Declared, scalar

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.problem import Problem, Record
    from printhammer.support.arrays import FloatArray


class Ledger(Declared):
    """Energies of one run, J."""

    coil_work: float = scalar("J", "integral of (Fm(x, I) - Fm(x, 0)) v dt")
    drive_work: float = scalar("J", "work of a drive that is a force")
    pack_loss: float = scalar("J", "minus the integral of Fp v dt")
    backstop_loss: float = scalar(
        "J", "minus the integral of Fe v dt, and what impacts on a rigid backstop take"
    )
    damping_loss: float = scalar("J", "minus the integral of the damping force of the armature times v dt")
    kinetic: float = scalar("J", "change of kinetic energy from start to end")
    stored: float = scalar(
        "J", "change of stored energy likewise", more="magnet at zero current, spring, Hertz"
    )
    throughput: float = scalar(
        "J", "sum of the integrals of the absolute power of coil, drive force, pack, backstop and damping"
    )
    residual: float = scalar(
        "J",
        "work minus losses minus changes",
        more="0 but for numerical errors, since each term has a quadrature of its own",
    )


def increments_of(problem: Problem, record: Record) -> FloatArray:
    """Return the integrals of power [J] in every step: coil, drive force, pack, backstop and damping loss."""
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


def _function(part: Any, name: str) -> Any:
    return getattr(import_module(part.module), name, None) or getattr(absent, name)


def ledger_of(problem: Problem, record: Record, increments: FloatArray) -> Ledger:
    """Add up a run, given what `increments_of` returns for it."""
    coil, force, pack, backstop, damping = (float(math.fsum(column)) for column in increments.T)
    start, end = record.nodes[0], record.nodes[-1]
    hammer = problem.hammer
    kinetic = float(0.5 * hammer.mass * (end[2] ** 2 - start[2] ** 2))
    stored = stored_energy(hammer, float(end[1])) - stored_energy(hammer, float(start[1]))
    return Ledger(
        coil_work=coil,
        drive_work=force,
        pack_loss=pack,
        backstop_loss=backstop,
        damping_loss=damping,
        kinetic=kinetic,
        stored=stored,
        throughput=float(np.abs(increments).sum()),
        residual=coil + force - pack - backstop - damping - kinetic - stored,
    )
