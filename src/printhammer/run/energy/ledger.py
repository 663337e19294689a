"""The energy ledger of a run: what the coil gave, what pack and backstop took, what is stored."""

from __future__ import annotations

import itertools
import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.kernel.model import layout
from printhammer.parts import absent
from printhammer.results import Declared, scalar
from printhammer.run.supply import linkage, winding_of

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.problem import Problem, Record
    from printhammer.support.arrays import FloatArray


_POINTS, _PIECES = 10, 8
"""Points of the quadrature over the current, and pieces of it."""


class Ledger(Declared):
    """Energies of one run, J."""

    coil_work: float = scalar("J", "integral of (Fm(x, I) - Fm(x, 0)) v dt")
    drive_work: float = scalar("J", "work of a drive that is a force")
    pack_loss: float = scalar("J", "minus the integral of Fp v dt")
    backstop_loss: float = scalar(
        "J", "minus the integral of Fe v dt, and what impacts on a rigid backstop take"
    )
    damping_loss: float = scalar("J", "minus the integral of the damping force of the armature times v dt")
    supply_work: float = scalar("J", "energy that the supply of a voltage has given")
    copper_loss: float = scalar("J", "heat of the coil under a voltage")
    driver_loss: float = scalar("J", "heat in the supply's resistance and the diodes")
    eddy_loss: float = scalar("J", "heat of the shorted turn")
    field: float = scalar(
        "J", "change of the magnetic energy that goes with the current", more="of a reservoir as well"
    )
    electric_residual: float = scalar(
        "J",
        "supply work minus losses minus coil work minus field",
        more="0 but for numerical errors, and 0 unless a voltage drives the coil",
    )
    kinetic: float = scalar("J", "change of kinetic energy from start to end")
    stored: float = scalar(
        "J", "change of stored energy likewise", more="magnet at zero current, spring, Hertz"
    )
    throughput: float = scalar("J", "sum of the integrals of the absolute power of all works and losses")
    residual: float = scalar(
        "J",
        "work minus losses minus changes",
        more="0 but for numerical errors, since each term has a quadrature of its own",
    )


def increments_of(problem: Problem, record: Record) -> FloatArray:
    """Return the integrals of power [J] in every step: coil, drive force, pack, backstop and damping loss.

    Under a voltage also supply, and losses in coil, driver and shorted turn.
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
    """Return the energy of the magnetic field that goes with the current at a node, and of a reservoir, J.

    E = i lambda - integral of lambda over the current from 0 to i, by Gauss's quadrature.
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
    """Add up a run, given what `increments_of` returns for it."""
    sums = [float(math.fsum(column)) for column in increments.T]
    coil, force, pack, backstop, damping = sums[:5]
    supply, copper, driver, eddy = sums[5:] or (0.0, 0.0, 0.0, 0.0)
    field = 0.0
    if problem.laws.circuit:
        field = field_energy(problem, record, -1) - field_energy(problem, record, 0)
    # Without back-EMF the work of the coil is not the supply's.
    linked = problem.laws.circuit and winding_of(problem.hammer).back_emf
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
        supply_work=supply,
        copper_loss=copper,
        driver_loss=driver,
        eddy_loss=eddy,
        field=field,
        electric_residual=supply - copper - driver - eddy - field - (coil if linked else 0.0),
        kinetic=kinetic,
        stored=stored,
        throughput=float(np.abs(increments).sum()),
        residual=coil + force - pack - backstop - damping - kinetic - stored,
    )
