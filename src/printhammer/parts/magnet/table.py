"""Magnet given by a measured table of forces F(x, I).

    Fm = S(x, I),    lambda = integral of dS/dI from the smallest displacement to x

S is the bicubic spline through the table. The linkage follows from the force (same coenergy), except for the
linkage at the smallest displacement, which the constant inductance of the coil represents.

    [magnet]
    law = "table"
    file = "forces.csv"

Source: the measurement named in the file; equation (3) of the paper is one fit to such a table. The file is a
CSV file with one point per line and units in the heading (`displacement [mm],current [A],force [N]`), a
complete grid in any order, with 0 A inside the range of currents. Validity: the displacements and currents of
the table. Outside the table the functions return NaN rather than extrapolate, which a run reports as the
range left.
Weakness: a spline through measured points also follows their noise, and its third derivative jumps between
cells; the linkage follows the noise of its slope along the current.

Packed constants: c = [nx, ni, x[nx], current[ni], coefficients[nx - 1][ni - 1][4][4], energy[nx - 1][5],
linkage[nx - 1][ni - 1][3]]; within a cell F = sum over p, q of coefficients[p][q] (x - x[i])^p (I -
current[j])^q, and at x[i] the linkage is the sum over q of linkage[q] (I - current[j])^q.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, ClassVar

from printhammer.parts.base import register
from printhammer.parts.magnet._grid import Grid, GridMagnet, bicubic, cell_at_zero
from printhammer.parts.samples import cell_of
from printhammer.support.arrays import FloatArray


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the magnetic force interpolated in the table, N; NaN outside the table."""
    nx = int(c[0])
    ni = int(c[1])
    if not (c[2] <= x <= c[1 + nx] and c[2 + nx] <= current <= c[1 + nx + ni]):
        return math.nan
    i = cell_of(c, 2, nx, x)
    j = cell_of(c, 2 + nx, ni, current)
    dx = x - c[2 + i]
    di = current - c[2 + nx + j]
    cell = 2 + nx + ni + 16 * (i * (ni - 1) + j)
    force = 0.0
    for p in range(3, -1, -1):
        k = cell + 4 * p
        force = force * dx + (c[k] + di * (c[k + 1] + di * (c[k + 2] + di * c[k + 3])))
    return float(force)


def magnet_energy(c: Any, x: float) -> float:
    """Return the potential energy at zero current, J; NaN outside the table.

    The energy is zero at the smallest displacement of the table.
    """
    nx = int(c[0])
    ni = int(c[1])
    if not c[2] <= x <= c[1 + nx]:
        return math.nan
    i = cell_of(c, 2, nx, x)
    dx = x - c[2 + i]
    k = 2 + nx + ni + 16 * (nx - 1) * (ni - 1) + 5 * i
    return float(c[k] + dx * (c[k + 1] + dx * (c[k + 2] + dx * (c[k + 3] + dx * c[k + 4]))))


def _linkage(c: Any, x: float, j: int) -> tuple[float, float, float]:
    """Return the linkage at `x` as a polynomial in the current: coefficients of powers 0 to 2.

    The polynomial holds in the interval `j` of the currents of the table; its variable is the current minus
    the current at the start of the interval.
    """
    nx = int(c[0])
    ni = int(c[1])
    i = cell_of(c, 2, nx, x)
    dx = x - c[2 + i]
    cell = 2 + nx + ni + 16 * (i * (ni - 1) + j)
    k = 2 + nx + ni + (nx - 1) * (16 * (ni - 1) + 5) + 3 * (i * (ni - 1) + j)
    level = 0.0
    rise = 0.0
    bend = 0.0
    for p in range(3, -1, -1):
        share = 1.0 / (p + 1)
        level = level * dx + share * c[cell + 4 * p + 1]
        rise = rise * dx + share * c[cell + 4 * p + 2]
        bend = bend * dx + share * c[cell + 4 * p + 3]
    return c[k] + dx * level, c[k + 1] + 2.0 * dx * rise, c[k + 2] + 3.0 * dx * bend


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return the flux linkage minus its value at the smallest displacement, Wb; NaN outside the table."""
    nx = int(c[0])
    ni = int(c[1])
    if not (c[2] <= x <= c[1 + nx] and c[2 + nx] <= current <= c[1 + nx + ni]):
        return math.nan
    j = cell_of(c, 2 + nx, ni, current)
    di = current - c[2 + nx + j]
    level, rise, bend = _linkage(c, x, j)
    return float(level + di * (rise + di * bend))


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return the derivative of the force, dF/dI, N/A, which equals d(linkage)/dx; NaN outside the table."""
    nx = int(c[0])
    ni = int(c[1])
    if not (c[2] <= x <= c[1 + nx] and c[2 + nx] <= current <= c[1 + nx + ni]):
        return math.nan
    i = cell_of(c, 2, nx, x)
    j = cell_of(c, 2 + nx, ni, current)
    dx = x - c[2 + i]
    di = current - c[2 + nx + j]
    cell = 2 + nx + ni + 16 * (i * (ni - 1) + j)
    emf = 0.0
    for p in range(3, -1, -1):
        k = cell + 4 * p
        emf = emf * dx + (c[k + 1] + di * (2.0 * c[k + 2] + di * 3.0 * c[k + 3]))
    return float(emf)


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return the derivative of `magnet_linkage` with respect to current, H; NaN outside the table."""
    nx = int(c[0])
    ni = int(c[1])
    if not (c[2] <= x <= c[1 + nx] and c[2 + nx] <= current <= c[1 + nx + ni]):
        return math.nan
    j = cell_of(c, 2 + nx, ni, current)
    _, rise, bend = _linkage(c, x, j)
    return float(rise + 2.0 * bend * (current - c[2 + nx + j]))


def magnet_current(c: Any, x: float, linkage: float, inductance: float) -> float:
    """Return the current [A] for the flux linkage of magnet and series inductance; NaN outside the table.

    A current beyond the table by a rounding error is clipped to the end of the table.
    """
    nx = int(c[0])
    ni = int(c[1])
    if not c[2] <= x <= c[1 + nx]:
        return math.nan
    low = 0
    high = ni - 1
    while high - low > 1:
        middle = (low + high) // 2
        if _linkage(c, x, middle)[0] + inductance * c[2 + nx + middle] <= linkage:
            low = middle
        else:
            high = middle
    level, rise, bend = _linkage(c, x, low)
    rest = linkage - level - inductance * c[2 + nx + low]
    rise += inductance
    square = rise * rise + 4.0 * bend * rest
    if not (rise >= 0.0 and square > 0.0):
        return math.nan
    current = c[2 + nx + low] + 2.0 * rest / (rise + math.sqrt(square))
    least = c[2 + nx]
    largest = c[1 + nx + ni]
    slack = 1e-9 * (largest - least)
    if not least - slack <= current <= largest + slack:
        return math.nan
    return float(min(max(current, least), largest))


@register
class TableMagnet(GridMagnet):
    """Magnet given by a table of forces from a CSV file."""

    law: ClassVar[str] = "table"
    quantity: ClassVar[str] = "force"

    @cached_property
    def _packed(self) -> tuple[float, ...]:
        return _packed_spline(self._table)

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the packed table and splines, in the order stated by the module."""
        return self._packed


def _packed_spline(table: Grid) -> tuple[float, ...]:
    """Return the packed constants, in the order stated by the module.

    They contain the table, the spline of the force, and two integrals of the spline along x: the energy at
    zero current and the flux linkage.
    """
    import numpy as np

    x, current = np.array(table.x), np.array(table.current)
    coefficients = bicubic(table)
    j, place = cell_at_zero(table)
    at_zero = coefficients[:, j] @ np.power(place, np.arange(4))
    energy = _integral(x, -at_zero)
    slope = coefficients[..., 1:] * np.arange(1.0, 4.0)  # Axes: x cell, I cell, power of x, power of I
    linkage = _integral(x, np.swapaxes(slope, 2, 3))[..., 0]  # Axes: x cell, I cell, power of I
    parts = (x, current, coefficients.ravel(), energy.ravel(), linkage.ravel())
    return (float(len(x)), float(len(current)), *np.concatenate(parts).tolist())


def _integral(x: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the coefficients of the integral of a cubic spline from its first knot, shape (cells, ..., 5).

    `slope` holds the coefficients of the spline, shape (cells, ..., 4), and `x` its knots. The last axis is
    the power of the distance from the start of a cell.
    """
    import numpy as np

    whole = np.zeros((*slope.shape[:-1], 5))
    whole[..., 1:] = slope / np.arange(1, 5)
    width = np.diff(x).reshape(-1, *[1] * (slope.ndim - 1))
    rise = np.sum(whole * np.power(width, np.arange(5)), axis=-1)
    whole[1:, ..., 0] = np.cumsum(rise, axis=0)[:-1]
    return whole
