"""Fit the magnet to forces against displacement and current: F0, Am and Bm of equation (3).

  F(x, I) = F0 - (Am - Bm I)^2 / sqrt(x) + Bs - (Bs / As)(x - b)

Data: the columns ``displacement``, ``current``, ``force``, the static force of magnet and spring together,
positive toward the paper; and, to separate the two forces, a table of the spring alone.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, check_rows, judge, solved
from printhammer.identify.static.spring import start_of as spring_start
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.tables.readings import Readings, read_table


class TotalLaw:
    """Force of magnet and spring at measured displacements [m] and currents [A], shape (m,).

    If the position b of the backstop, m, is known, p = [F0, Am, Bm, Bs, As]; otherwise p = [C, Am, Bm, K] and
    the force is C - K x - (Am - Bm I)^2 / sqrt(x). A NaN current marks a row of the spring alone. `zero` is
    the sensor reading at x = 0, m; if None, the reading is fitted, as the last element of p.
    """

    def __init__(
        self, x: FloatArray, current: FloatArray, position: float | None, zero: float | None
    ) -> None:
        self.x, self.position, self.zero = x, position, zero
        self.magnet = np.isfinite(current)
        self.current = np.where(self.magnet, current, 0.0)
        self.parameters = (4 if position is None else 5) + (zero is None)

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the force of magnet and spring, N."""
        x = self._place(p)
        pull: FloatArray = (p[1] - p[2] * self.current) ** 2 / np.sqrt(x)
        if self.position is None:
            force: FloatArray = p[0] - p[3] * x - pull
        else:
            spring = p[3] * (1.0 - (x - self.position) / p[4])
            force = np.where(self.magnet, p[0] - pull, 0.0) + spring
        return force

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the force with respect to the parameters."""
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

    def variance_columns(self, p: FloatArray) -> FloatArray:
        """Return the variance coefficients of force (with and without magnet), displacement and current."""
        magnet = self.magnet.astype(np.float64)
        by_current = 2.0 * p[2] * (p[1] - p[2] * self.current) / np.sqrt(self._place(p)) * magnet
        return np.column_stack([magnet, 1.0 - magnet, (self._slope(p) * magnet) ** 2, by_current**2])

    def at(self, p: FloatArray, x: FloatArray, current: FloatArray) -> FloatArray:
        """Compute the force at displacements [m], measured from x = 0, and currents [A]."""
        return TotalLaw(x, current, self.position, 0.0).value(p)

    def richer(self, p: FloatArray, *, by_current: bool) -> dict[str, FloatArray]:
        """Return additional terms that equation (3) lacks, shape (m,), keyed by the description of each term.

        With `by_current`, terms that depend on the current are included, which requires more than two
        different currents.
        """
        x, magnet, current = self._place(p), self.magnet.astype(np.float64), self.current
        place = "the pull does not follow the inverse root of the displacement"
        square = "the pull does not follow the square of Am - Bm I"
        terms = {place: magnet / x}
        if by_current:
            terms |= {square: current**2 / np.sqrt(x), f"{place} at larger currents": current**2 / x}
        return terms

    def _place(self, p: FloatArray) -> FloatArray:
        zero = p[-1] if self.zero is None else self.zero
        # An iterate may not move the nearest row beyond x = 0, where the law is singular.
        place: FloatArray = np.maximum(self.x - zero, 1e-3 * self.x.min())
        return place

    def _slope(self, p: FloatArray) -> FloatArray:
        x = self._place(p)
        pull = np.where(self.magnet, 0.5 * (p[1] - p[2] * self.current) ** 2 / x**1.5, 0.0)
        slope: FloatArray = pull - (p[3] if self.position is None else p[3] / p[4])
        return slope


def start_of(table: Readings, levels: int, zero: float) -> FloatArray:
    """Compute initial guesses of C, Am, Bm and K by a fit that is linear in Am^2, Am Bm and Bm^2.

    `levels` is the number of distinct currents, 0 for a continuum; `zero` is the sensor reading at x = 0, m.

    Raises
    ------
    InputError
        The forces do not show a magnet whose pull is weakened by a current.
    """
    x, current, force = (table.values[name] for name in ("displacement", "current", "force"))
    root = 1.0 / np.sqrt(x - zero)
    columns = [np.ones_like(x), -(x - zero), -root, current * root]
    if levels != 2:
        columns.append(-current * current * root)
    c, k, square, twice = _least_absolute(np.column_stack(columns), force)[:4]
    if square <= 0.0:
        raise InputError(
            f"{table.path}: at 0 A the force does not follow an inverse root of the displacement",
            file=table.path,
            key="force",
            expected="a pull: negative forces near the magnet, weaker forces farther away",
        )
    am = math.sqrt(square)
    strongest = float(current[np.argmax(np.abs(current))])
    bm = twice / (2.0 * am)
    if levels == 2:
        bm = (am - math.sqrt(max(square - twice * strongest, 0.0))) / strongest
    if bm <= 0.0:
        raise InputError(
            f"{table.path}: the pull grows with the current",
            file=table.path,
            key="current",
            expected="currents that are positive if they weaken the pull",
        )
    return np.array([c, am, bm, k])


def _least_absolute(columns: FloatArray, data: FloatArray) -> FloatArray:
    """Minimise the sum of absolute residuals by iteratively reweighted least squares; robust to outliers."""
    length = np.linalg.norm(columns, axis=0)
    rows = columns / length
    scaled = np.linalg.lstsq(rows, data, rcond=None)[0]
    small = 1e-9 * float(np.abs(data).max())
    for _ in range(30):
        weight = 1.0 / np.sqrt(np.maximum(np.abs(data - rows @ scaled), small))
        scaled = np.linalg.lstsq(rows * weight[:, None], data * weight, rcond=None)[0]
    coefficients: FloatArray = scaled / length
    return coefficients


_SPARE: Final = 4
"""Smallest number of rows in excess of parameters for which errors and tests are computed; arbitrary."""

_LEVELS: Final = 12
"""Largest number of distinct currents plotted as separate series; arbitrary."""

_COMBINED: Final = "magnet.F0 + spring.Bs (1 + b / spring.As)"
_SLOPE: Final = "spring.Bs / spring.As"
_ZERO: Final = "zero of the displacement"


def fit_magnet(
    path: str | Path,
    *,
    position: float | None = None,
    spring: str | Path | None = None,
    zero: float | None = 0.0,
    robust: bool = True,
    columns: str | None = None,
) -> Fit:
    """Fit the constants of magnet and spring to measured forces.

    The table has the columns ``displacement``, ``current`` and ``force``, of magnet and spring together.
    `spring` is an optional table of the spring alone, with the columns ``displacement`` and ``force``; it
    requires `position`, b, the position of the backstop, m. `zero` is the sensor reading at x = 0, m; None to
    fit it. The result has the constants "magnet.F0", "magnet.Am", "magnet.Bm", "spring.Bs" and "spring.As".
    Without `spring`, the forces determine only "magnet.Am", "magnet.Bm", F0 + Bs (1 + b / As) and Bs / As.
    For the other options, see `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        A table is invalid or too small, its force never releases the armature, or a constant cannot be
        distinguished from zero.
    """
    table = read_table(path, {"displacement": "m", "current": "A", "force": "N"}, columns=columns)
    alone = None if spring is None else read_table(spring, {"displacement": "m", "force": "N"})
    if alone is not None and position is None:
        raise InputError(
            f"{alone.path}: the position of the backstop is missing",
            file=alone.path,
            key="position",
            expected="this position together with a table of the spring",
        )
    data = _data(table, alone)
    x = data.abscissa
    # NaN marks the rows without the magnet.
    current = np.concatenate([table.values["current"], np.full(0 if alone is None else len(alone), math.nan)])
    law = TotalLaw(x, current, position if alone is not None else None, zero)
    check_rows(data, law.parameters + _SPARE, "the constants of the magnet and their errors")
    levels = _check(table, alone, zero or 0.0, position)
    start = start_of(table, levels, zero or 0.0)
    if alone is not None and position is not None:
        travel = alone.values["displacement"] - (zero or 0.0) - position
        pair = spring_start(alone.path, travel, alone.values["force"])
        start[0] -= pair[0] * (1.0 + position / pair[1])
        start = np.array([*start[:3], *pair])
    if zero is None:
        start = np.append(start, 0.0)
    solution = solved(data, law, start, robust=robust)
    _check_release(table, law, solution.p, zero, position)
    p_value, why = judge(solution, law.richer(solution.p, by_current=levels != 2), x, data.series)
    wide, strong = "more rows over a wider span of displacement", "more currents over a wider span"
    remedies = {"magnet.Am": wide, "magnet.Bm": strong, "magnet.F0": wide, "spring.Bs": wide}
    return assemble(
        data,
        law,
        solution,
        _names(alone is not None, zero is None),
        given=_given(position, zero, alone is not None),
        remedies={**remedies, "spring.As": wide},
        indistinct=_indistinct(alone is not None, levels),
        rejected=why,
        p_value=p_value,
    )


def _data(table: Readings, alone: Readings | None) -> Data:
    x, current, force = (table.values[name] for name in ("displacement", "current", "force"))
    series = np.zeros(len(x), dtype=np.int64)
    names: tuple[str, ...] = ("magnet and spring",)
    groups = clusters(current)
    if 1 < groups <= _LEVELS:
        series = group_of(current)
        digits = 2 - math.floor(math.log10(float(np.ptp(current))))
        means = [round(float(np.mean(current[series == group])), digits) for group in range(groups)]
        names = tuple(f"{mean + 0.0:g} A" for mean in means)
    files: tuple[Path, ...] = (table.path,)
    lines = table.lines
    if alone is not None:
        more = len(alone)
        x = np.concatenate([x, alone.values["displacement"]])
        force = np.concatenate([force, alone.values["force"]])
        series = np.concatenate([series, np.full(more, len(names))])
        lines = np.concatenate([lines, alone.lines])
        names, files = (*names, "spring alone"), (table.path, alone.path)
    axes = (("displacement", "m"), ("force", "N"))
    return Data(files, "magnet", x, force, axes, series, names, lines)


def _check(table: Readings, alone: Readings | None, zero: float, position: float | None) -> int:
    """Check that a table allows a fit; return the number of distinct currents, 0 for a continuum."""
    x, current, force = (table.values[name] for name in ("displacement", "current", "force"))
    low = int(np.argmin(x))
    if x[low] <= zero:
        where = f"{table.path}: line {table.lines[low]}: displacement {x[low]:.6g} m"
        raise InputError(
            where,
            file=table.path,
            key="displacement",
            value=x[low],
            expected=f"more than {zero:g} m, where equation (3) ends",
        )
    levels = clusters(current)
    if levels == 1:
        raise InputError(
            f"{table.path}: all forces are at {current[0]:.4g} A",
            file=table.path,
            key="current",
            expected="2 or more currents, to fit magnet.Bm",
        )
    places, needed = clusters(x), 3 if alone is not None else 4
    if 0 < places < needed:
        raise InputError(
            f"{table.path}: {places} different displacements",
            file=table.path,
            key="displacement",
            expected=f"{needed} or more, to separate the pull from the spring force",
        )
    near = x <= max(x.min(), position or 0.0) + 0.02 * np.ptp(x)
    if force[near].max() <= 0.0:
        raise InputError(
            _never(table, float(x[near].max()), float(force[near].max())), file=table.path, key="force"
        )
    return levels


def _never(table: Readings, place: float, force: float) -> str:
    largest = table.values["current"].max()
    return (
        f"{table.path}: the force never releases the armature, at {place:.4g} m it is {force:.3g} N at best,"
        f" expected a positive force at a measured current (up to {largest:.4g} A)"
    )


def _check_release(
    table: Readings, law: TotalLaw, p: FloatArray, zero: float | None, position: float | None
) -> None:
    """Raise `InputError` if no measured current makes the force positive at the rest position."""
    offset = float(p[-1]) if zero is None else zero
    place = float(table.values["displacement"].min()) - offset if position is None else position
    currents = np.unique(table.values["current"])
    best = float(law.at(p, np.full(len(currents), place), currents).max())
    if best <= 0.0:
        raise InputError(_never(table, place, best), file=table.path, key="force")


def _names(with_spring: bool, with_zero: bool) -> list[tuple[str, str, bool]]:
    pull = [("magnet.Am", "N^0.5 m^0.25", True), ("magnet.Bm", "N^0.5 m^0.25/A", True)]
    if with_spring:
        names = [("magnet.F0", "N", True), *pull, ("spring.Bs", "N", True), ("spring.As", "m", True)]
    else:
        names = [(_COMBINED, "N", False), *pull, (_SLOPE, "N/m", False)]
    return [*names, (_ZERO, "m", False)] if with_zero else names


def _given(position: float | None, zero: float | None, with_spring: bool) -> dict[str, str]:
    given = {"backstop.position": f"{position!r} m"} if with_spring else {}
    return given if zero is None or zero == 0.0 else {**given, _ZERO: f"{zero!r} m"}


def _indistinct(with_spring: bool, levels: int) -> list[str]:
    sentences = []
    if not with_spring:
        sentences.append(
            "F0, Bs and As cannot be separated by forces of magnet and spring together: only"
            f" {_COMBINED} and {_SLOPE} are determined; add a table of the spring alone"
        )
    if levels == 2:
        sentences.append(
            "two currents cannot distinguish a current that weakens the pull from one beyond Am / Bm, where"
            " the pull grows again; a weakening current is assumed"
        )
    return sentences


def clusters(values: FloatArray) -> int:
    """Count the clusters of values, separated by gaps of 5 % of the range; 0 if the values are continuous."""
    if float(np.ptp(values)) <= 1e-3 * float(np.abs(values).max()):
        return 1
    groups = 1 + int(group_of(values).max())
    return groups if groups > 1 else 0


def group_of(values: FloatArray) -> IntArray:
    """Assign each value to its cluster; return the cluster indices, ascending with the values."""
    order = np.argsort(values, kind="stable")
    apart = np.diff(values[order]) > 0.05 * float(np.ptp(values))
    group = np.empty(len(values), dtype=np.int64)
    group[order] = np.concatenate([[0], np.cumsum(apart)])
    return group
