"""Magnet given by a measured table of flux linkages lambda(x, I).

    lambda = S(x, I),    Fm = integral of dS/dx from 0 A to I

S is the bicubic spline through the table. The flux linkage of a coil is measured with the armature held, as
the integral of u - R I after a voltage step. The force follows from the linkage (same coenergy), so there is
no force without current.

    [magnet]
    law = "linkage-table"
    file = "linkages.csv"

Source: the measurement or field computation named in the file, a CSV file with one point per line and units
in the heading (`displacement [mm],current [A],linkage [mWb]`), a complete grid in any order, with 0 A inside
the range of currents. Validity: the displacements and currents of the table; outside it the functions return
NaN, which a run reports as the range left. A linkage that does not increase with the current is rejected,
because it contradicts any coenergy.
Weakness: the force is the slope of a spline through measured points and follows their noise; no hysteresis.

Packed constants: c = [nx, ni, x[nx], current[ni], coefficients[nx - 1][ni - 1][4][4], force[nx - 1][ni -
1][3]]; within a cell lambda = sum over p, q of coefficients[p][q] (x - x[i])^p (I - current[j])^q, and at
current[j] the force is the sum over p of force[p] (x - x[i])^p.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, ClassVar

from printhammer.errors import InputError
from printhammer.parts.base import register
from printhammer.parts.magnet._grid import Grid, GridMagnet, bicubic, cell_at_zero
from printhammer.parts.samples import cell_of


def _inside(c: Any, x: float, current: float) -> bool:
    nx = int(c[0])
    return bool(c[2] <= x <= c[1 + nx] and c[2 + nx] <= current <= c[1 + nx + int(c[1])])


def _along_current(c: Any, x: float, j: int) -> tuple[float, float, float, float]:
    """Return the linkage at `x` as a polynomial in the current: coefficients of powers 0 to 3.

    The polynomial holds in the interval `j` of the currents of the table; its variable is the current minus
    the current at the start of the interval.
    """
    nx = int(c[0])
    i = cell_of(c, 2, nx, x)
    dx = x - c[2 + i]
    k = 2 + nx + int(c[1]) + 16 * (i * (int(c[1]) - 1) + j)
    return (
        c[k] + dx * (c[k + 4] + dx * (c[k + 8] + dx * c[k + 12])),
        c[k + 1] + dx * (c[k + 5] + dx * (c[k + 9] + dx * c[k + 13])),
        c[k + 2] + dx * (c[k + 6] + dx * (c[k + 10] + dx * c[k + 14])),
        c[k + 3] + dx * (c[k + 7] + dx * (c[k + 11] + dx * c[k + 15])),
    )


def _slope_along_current(c: Any, x: float, j: int) -> tuple[float, float, float, float]:
    """Return d(linkage)/dx at `x` as a polynomial in the current: coefficients of powers 0 to 3.

    The polynomial holds in the interval `j` of the currents of the table; its variable is the current minus
    the current at the start of the interval.
    """
    nx = int(c[0])
    i = cell_of(c, 2, nx, x)
    dx = x - c[2 + i]
    k = 2 + nx + int(c[1]) + 16 * (i * (int(c[1]) - 1) + j)
    return (
        c[k + 4] + dx * (2.0 * c[k + 8] + dx * 3.0 * c[k + 12]),
        c[k + 5] + dx * (2.0 * c[k + 9] + dx * 3.0 * c[k + 13]),
        c[k + 6] + dx * (2.0 * c[k + 10] + dx * 3.0 * c[k + 14]),
        c[k + 7] + dx * (2.0 * c[k + 11] + dx * 3.0 * c[k + 15]),
    )


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the magnetic force [N] derived from the linkage; 0 at zero current, NaN outside the table."""
    if not _inside(c, x, current):
        return math.nan
    nx = int(c[0])
    ni = int(c[1])
    i = cell_of(c, 2, nx, x)
    j = cell_of(c, 2 + nx, ni, current)
    dx = x - c[2 + i]
    di = current - c[2 + nx + j]
    k = 2 + nx + ni + 16 * (nx - 1) * (ni - 1) + 3 * (i * (ni - 1) + j)
    a, b, d, e = _slope_along_current(c, x, j)
    # Integration along the current yields the halves, thirds and quarters.
    cell = di * (a + di * (0.5 * b + di * (d / 3.0 + di * 0.25 * e)))
    return float(c[k] + dx * (c[k + 1] + dx * c[k + 2]) + cell)


def magnet_energy(c: Any, x: float) -> float:
    """Return 0 J, the potential energy at zero current, where there is no force; NaN outside the table."""
    return 0.0 if c[2] <= x <= c[1 + int(c[0])] else math.nan


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return the flux linkage interpolated in the table, Wb; NaN outside the table."""
    if not _inside(c, x, current):
        return math.nan
    nx = int(c[0])
    j = cell_of(c, 2 + nx, int(c[1]), current)
    di = current - c[2 + nx + j]
    a, b, d, e = _along_current(c, x, j)
    return float(a + di * (b + di * (d + di * e)))


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return the derivative of the linkage with respect to x, Wb/m; NaN outside the table."""
    if not _inside(c, x, current):
        return math.nan
    nx = int(c[0])
    j = cell_of(c, 2 + nx, int(c[1]), current)
    di = current - c[2 + nx + j]
    a, b, d, e = _slope_along_current(c, x, j)
    return float(a + di * (b + di * (d + di * e)))


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return the differential inductance d(linkage)/dI, H; NaN outside the table."""
    if not _inside(c, x, current):
        return math.nan
    nx = int(c[0])
    j = cell_of(c, 2 + nx, int(c[1]), current)
    di = current - c[2 + nx + j]
    _, b, d, e = _along_current(c, x, j)
    return float(b + di * (2.0 * d + di * 3.0 * e))


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
        if _along_current(c, x, middle)[0] + inductance * c[2 + nx + middle] <= linkage:
            low = middle
        else:
            high = middle
    a, b, d, e = _along_current(c, x, low)
    a += inductance * c[2 + nx + low] - linkage
    b += inductance
    width = c[3 + nx + low] - c[2 + nx + low]
    slack = 1e-9 * (c[1 + nx + ni] - c[2 + nx])
    least = 0.0
    most = width
    di = 0.5 * width
    # Newton steps, safeguarded by bisection; 60 bisections exhaust the bits of a float.
    for _ in range(60):
        value = a + di * (b + di * (d + di * e))
        if value > 0.0:
            most = di
        else:
            least = di
        rise = b + di * (2.0 * d + di * 3.0 * e)
        after = di - value / rise if rise > 0.0 else math.nan
        if not least <= after <= most:
            after = 0.5 * (least + most)
        if after == di:
            break
        di = after
    value = a + di * (b + di * (d + di * e))
    rise = b + di * (2.0 * d + di * 3.0 * e)
    # A residual at an end of the interval may remain.
    if not (rise > 0.0 and abs(value) <= slack * rise):
        return math.nan
    return float(c[2 + nx + low] + di)


@register
class LinkageTableMagnet(GridMagnet):
    """Magnet given by a table of flux linkages from a CSV file.

    Raises
    ------
    InputError
        The file or its grid cannot be used, or the linkage does not increase with the current.
    """

    law: ClassVar[str] = "linkage-table"
    quantity: ClassVar[str] = "linkage"

    @classmethod
    def check(cls, table: Grid, where: str) -> None:
        """Raise InputError unless the linkage and its spline increase with the current."""
        import numpy as np

        ending = "expected one that rises with the current, or there is no coenergy"
        for x, row in zip(table.x, table.values, strict=True):
            for k in range(len(row) - 1):
                if row[k + 1] <= row[k]:
                    raise InputError(
                        f"{where}: at {x:.9g} m the linkage goes from {row[k]:.9g} to {row[k + 1]:.9g} Wb"
                        f" between {table.current[k]:.9g} and {table.current[k + 1]:.9g} A: {ending}",
                        file=where,
                        key="linkage",
                    )
        # Smallest slope of the spline in each current cell, at five positions in each cell along x.
        places = np.linspace(0.0, 1.0, 5) * np.diff(table.x)[:, None]
        powers = np.power(places[..., None], np.arange(4))
        b, d, e = np.einsum("ikp,ijpq->qikj", powers, bicubic(table))[1:]
        widths = np.diff(table.current)
        with np.errstate(divide="ignore", invalid="ignore"):
            turning = np.where(e > 0.0, np.clip(-d / (3.0 * e), 0.0, widths), 0.0)
        for at in (0.0, widths, turning):
            rise = b + at * (2.0 * d + at * 3.0 * e)
            if np.any(rise <= 0.0):
                i, k, j = (int(index) for index in np.argwhere(rise <= 0.0)[0])
                current = table.current[j] + float(np.broadcast_to(at, rise.shape)[i, k, j])
                raise InputError(
                    f"{where}: at {table.x[i] + places[i, k]:.9g} m the spline through the linkages falls"
                    f" about {current:.9g} A: {ending}",
                    file=where,
                    key="linkage",
                )

    @cached_property
    def _packed(self) -> tuple[float, ...]:
        import numpy as np

        table, coefficients = self._table, bicubic(self._table)
        x, current = np.array(table.x), np.array(table.current)
        slope = (
            coefficients[:, :, 1:] * np.arange(1.0, 4.0)[:, None]
        )  # Axes: x cell, I cell, power of x, power of I
        whole = slope / np.arange(1.0, 5.0)
        powers = np.power(np.diff(current)[:, None], np.arange(1, 5))
        rise = np.einsum("ijpq,jq->ijp", whole, powers)
        force = np.concatenate([np.zeros_like(rise[:, :1]), np.cumsum(rise, axis=1)[:, :-1]], axis=1)
        j, place = cell_at_zero(table)
        force -= (force[:, j] + whole[:, j] @ np.power(place, np.arange(1, 5)))[:, None]
        parts = (x, current, coefficients.ravel(), force.ravel())
        return (float(len(x)), float(len(current)), *np.concatenate(parts).tolist())

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the packed table and spline, in the order stated by the module."""
        return self._packed
