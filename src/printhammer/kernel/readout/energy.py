"""Energy ledger of a run, from the energies of its steps and the states at its ends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    CAPACITANCE,
    COILS,
    COUPLED,
    ELECTRIC,
    INDUCTANCE,
    LEAKAGE,
    MAGNET,
    PACK,
    POSITION,
    SPRING,
    TURN_RESISTANCE,
)
from printhammer.kernel.readout.sums import exact_sum

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import (
        HAS_CIRCUIT,
        backstop_energy,
        magnet_energy,
        magnet_linkage,
        spring_energy,
    )

TERMS = (
    "coil_work",
    "drive_work",
    "pack_loss",
    "backstop_loss",
    "damping_loss",
    "supply_work",
    "copper_loss",
    "driver_loss",
    "eddy_loss",
    "field",
    "electric_residual",
    "kinetic",
    "stored",
    "throughput",
    "residual",
)
"""Terms of the ledger in the order of :func:`write_ledger`; see `printhammer.run.energy.Ledger`."""

FIELD, ELECTRIC_RESIDUAL, KINETIC, STORED, THROUGHPUT, RESIDUAL = range(9, 15)

_VALUE, _CURRENT = 2, 10
"""Columns of the drive's value, with a circuit the magnetising current [A], and of the coil current [A] in
the table of `resample`."""

_POINTS = (
    0.14887433898163122,
    0.4333953941292472,
    0.6794095682990244,
    0.8650633666889845,
    0.9739065285171717,
)
"""Positive points of the ten-point Gauss-Legendre quadrature."""
_WEIGHTS = (
    0.2955242247147528,
    0.2692667193099965,
    0.219086362515982,
    0.1494513491505804,
    0.06667134430868814,
)
"""Weights of the `_POINTS` of the ten-point Gauss-Legendre quadrature."""
_PIECES = 8
"""Number of subintervals of the quadrature over the current."""


def write_sums(increments: Any, work: Any, out: Any) -> None:
    """Write to `out` the exact sum of each column of `increments` [J] and, as last element, the throughput.

    The throughput is the sum of the absolute values of all elements. `increments` is the result of
    `quadratures` for each step; `work`, shape (`PARTIALS`,), is working space.
    """
    columns = increments.shape[1]
    out[columns] = 0.0
    for column in range(columns):
        out[column] = exact_sum(increments, column, work)
        for row in range(increments.shape[0]):
            out[columns] += abs(increments[row, column])


def write_ledger(
    first: Any,
    last: Any,
    mass: float,
    sums: Any,
    stored: float,
    field: float,
    linked: bool,
    out: Any,
) -> None:
    """Write the terms of the ledger [J] to `out`, shape (15,).

    Parameters
    ----------
    first, last : float64 array
        First and last node of the run.
    mass : float
        Mass of the armature [kg].
    sums : float64 array, shape (6,), with a circuit (10,)
        Result of `write_sums`.
    stored, field : float
        Changes of the stored energy and of the energy of magnetic field and capacitor [J].
    linked : bool
        Whether the supply provides the work of the coil, as it does with back-EMF.
    """
    terms = len(sums) - 1
    for k in range(9):
        out[k] = sums[k] if k < terms else 0.0
    out[FIELD] = field
    out[ELECTRIC_RESIDUAL] = out[5] - out[6] - out[7] - out[8] - field - (out[0] if linked else 0.0)
    kinetic = 0.5 * mass * (last[2] * last[2] - first[2] * first[2])
    out[KINETIC], out[STORED], out[THROUGHPUT] = kinetic, stored, sums[terms]
    out[RESIDUAL] = out[0] + out[1] - out[2] - out[3] - out[4] - kinetic - stored


def stored_at(x: float, hammer: Any) -> float:
    """Return the energy [J] stored in magnet (without current), spring and backstop at position `x` [m]."""
    total = magnet_energy(hammer[MAGNET:], x) + spring_energy(hammer[SPRING:PACK], x)
    if x < hammer[POSITION]:
        total += backstop_energy(hammer[BACKSTOP_PART:MAGNET], math.sqrt(hammer[POSITION] - x))
    return total


def linkage_at(x: float, current: float, hammer: Any) -> float:
    """Return the main flux linkage of the coil [Wb], without leakage, for a magnetising current [A]."""
    own = hammer[INDUCTANCE] * current
    if hammer[COUPLED] != 0.0:
        own += magnet_linkage(hammer[MAGNET:], x, current)
    return float(own)


def field_at(node: Any, row: Any, hammer: Any) -> float:
    """Return the energy [J] of the magnetic field due to the current, and of the reservoir, at a node.

    With the flux linkage lambda(i), the field energy is i lambda minus the integral of lambda over the
    current from 0 to i. `row` is the row of the table of `resample` at the time of the node.
    """
    x, current, main, turn, charge = (
        node[1],
        row[_CURRENT],
        node[ELECTRIC],
        node[ELECTRIC + 1],
        node[ELECTRIC + 2],
    )
    total = 0.0
    if hammer[CAPACITANCE] > 0.0:
        total = 0.5 * hammer[CAPACITANCE] * charge * charge / hammer[COILS]
    if hammer[TURN_RESISTANCE] > 0.0:
        total += 0.5 * hammer[LEAKAGE] * current * current
        main, current = turn, row[_VALUE]
    below = 0.0
    half = 0.5 * current / _PIECES
    for piece in range(_PIECES):
        middle = (2 * piece + 1) * half
        for k in range(5):
            pair = linkage_at(x, middle - half * _POINTS[k], hammer) + linkage_at(
                x, middle + half * _POINTS[k], hammer
            )
            below += half * _WEIGHTS[k] * pair
    return float(total + current * main - below)


def write_energies(nodes: Any, ends: Any, hammer: Any, mass: float, sums: Any, out: Any) -> None:
    """Write the energy ledger of a run [J] to `out`, shape (15,), in the order of `TERMS`.

    Parameters
    ----------
    nodes : float64 array, shape (n, 5), with a circuit (n, 9)
        Nodes of the run.
    ends : float64 array, shape (2, 10), with a circuit (2, 15)
        Table of `resample` at the times of the first and the last node.
    hammer : float64 array
        Parameter array.
    mass, sums
        As in `write_ledger`.
    """
    first, last = nodes[0], nodes[nodes.shape[0] - 1]
    stored = stored_at(last[1], hammer) - stored_at(first[1], hammer)
    field, linked = 0.0, False
    if HAS_CIRCUIT:
        field = field_at(last, ends[1], hammer) - field_at(first, ends[0], hammer)
        linked = hammer[COUPLED] != 0.0
    write_ledger(first, last, mass, sums, stored, field, linked, out)
