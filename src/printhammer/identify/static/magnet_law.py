"""The force of magnet and spring together, equations (3) and (4), as a law to be fitted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.identify.tables import Readings
    from printhammer.support.arrays import FloatArray


class TotalLaw:
    """Force of magnet and spring at measured displacements, m, and currents, A, shape (m,).

    With the position b of the backstop, m, p = [F0, Am, Bm, Bs, As]; without it p = [C, Am, Bm, K] and the
    force is C - K x - (Am - Bm I)^2 / sqrt(x). A current that is NaN says that there is no magnet. `zero` is
    what the sensor shows at x = 0, m; None where it is fitted too, and then it is the last of p.
    """

    def __init__(
        self, x: FloatArray, current: FloatArray, position: float | None, zero: float | None
    ) -> None:
        self.x, self.position, self.zero = x, position, zero
        self.magnet = np.isfinite(current)
        self.current = np.where(self.magnet, current, 0.0)
        self.parameters = (4 if position is None else 5) + (zero is None)

    def value(self, p: FloatArray) -> FloatArray:
        """Return the force, N."""
        x = self._place(p)
        pull: FloatArray = (p[1] - p[2] * self.current) ** 2 / np.sqrt(x)
        if self.position is None:
            force: FloatArray = p[0] - p[3] * x - pull
        else:
            spring = p[3] * (1.0 - (x - self.position) / p[4])
            force = np.where(self.magnet, p[0] - pull, 0.0) + spring
        return force

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return the derivatives by the parameters."""
        x, magnet = self._place(p), self.magnet.astype(np.float64)
        left = p[1] - p[2] * self.current
        pull = [-2.0 * left / np.sqrt(x) * magnet, 2.0 * left * self.current / np.sqrt(x) * magnet]
        if self.position is None:
            columns = [magnet, *pull, -x]
        else:
            travel = x - self.position
            columns = [magnet, *pull, 1.0 - travel / p[4], p[3] * travel / (p[4] * p[4])]
        if self.zero is None:
            columns.append(-self._slope(p))
        return np.column_stack(columns)

    def spread(self, p: FloatArray) -> FloatArray:
        """Return the components of the variance: force with and without magnet, displacement, current."""
        magnet = self.magnet.astype(np.float64)
        by_current = 2.0 * p[2] * (p[1] - p[2] * self.current) / np.sqrt(self._place(p)) * magnet
        return np.column_stack([magnet, 1.0 - magnet, (self._slope(p) * magnet) ** 2, by_current**2])

    def at(self, p: FloatArray, x: FloatArray, current: FloatArray) -> FloatArray:
        """Return the force at displacements in m, from x = 0, and currents."""
        return TotalLaw(x, current, self.position, 0.0).value(p)

    def richer(self, p: FloatArray, *, by_current: bool) -> dict[str, FloatArray]:
        """Return terms that equation (3) lacks, by what they would mean."""
        x, magnet, current = self._place(p), self.magnet.astype(np.float64), self.current
        place = "the pull does not follow the inverse root of the displacement"
        square = "the pull does not follow the square of Am - Bm I"
        terms = {place: magnet / x}
        if by_current:
            terms |= {square: current**2 / np.sqrt(x), f"{place} at larger currents": current**2 / x}
        return terms

    def _place(self, p: FloatArray) -> FloatArray:
        zero = p[-1] if self.zero is None else self.zero
        # A step of the fit may not take the nearest row beyond the place where the law ends.
        place: FloatArray = np.maximum(self.x - zero, 1e-3 * self.x.min())
        return place

    def _slope(self, p: FloatArray) -> FloatArray:
        x = self._place(p)
        pull = np.where(self.magnet, 0.5 * (p[1] - p[2] * self.current) ** 2 / x**1.5, 0.0)
        slope: FloatArray = pull - (p[3] if self.position is None else p[3] / p[4])
        return slope


def start_of(table: Readings, levels: int, zero: float) -> FloatArray:
    """Return C, Am, Bm and K to begin with, from a fit that is linear in Am^2, Am Bm and Bm^2.

    `levels` is the number of different currents, 0 for very many, `zero` what the sensor shows at x = 0, m.

    Raises
    ------
    InputError
        The force does not behave as one of a magnet whose pull a current weakens.
    """
    x, current, force = (table.values[name] for name in ("displacement", "current", "force"))
    root = 1.0 / np.sqrt(x - zero)
    columns = [np.ones_like(x), -(x - zero), -root, current * root]
    if levels != 2:
        columns.append(-current * current * root)
    c, k, square, twice = _least_absolute(np.column_stack(columns), force)[:4]
    if square <= 0.0:
        raise InputError(
            f"{table.path}: at 0 A the force falls toward the magnet by no inverse root, expected a pull,"
            " negative forces near the magnet and less of it farther away"
        )
    am = math.sqrt(square)
    strongest = float(current[np.argmax(np.abs(current))])
    bm = twice / (2.0 * am)
    if levels == 2:
        bm = (am - math.sqrt(max(square - twice * strongest, 0.0))) / strongest
    if bm <= 0.0:
        raise InputError(
            f"{table.path}: the pull grows with the current, expected currents counted positive where they"
            " weaken it"
        )
    return np.array([c, am, bm, k])


def _least_absolute(columns: FloatArray, data: FloatArray) -> FloatArray:
    """Return the coefficients with the least sum of absolute residuals, which outliers hardly move."""
    length = np.linalg.norm(columns, axis=0)
    rows = columns / length
    scaled = np.linalg.lstsq(rows, data, rcond=None)[0]
    small = 1e-9 * float(np.abs(data).max())
    for _ in range(30):
        weight = 1.0 / np.sqrt(np.maximum(np.abs(data - rows @ scaled), small))
        scaled = np.linalg.lstsq(rows * weight[:, None], data * weight, rcond=None)[0]
    coefficients: FloatArray = scaled / length
    return coefficients
