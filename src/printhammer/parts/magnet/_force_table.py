"""A measured force table F(x, I): checks, reading from CSV, bicubic spline."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from printhammer.errors import InputError, located
from printhammer.support.sheets import finite, read_sheet, split_heading

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

COLUMNS: dict[str, str] = {"displacement": "m", "current": "A", "force": "N"}
"""Columns of the CSV file and their SI units."""

_HEADING = "displacement [mm],current [A],force [N]"


@dataclass(frozen=True)
class ForceTable:
    """Forces on a complete grid, SI."""

    x: tuple[float, ...]
    """Displacements, ascending, m."""
    current: tuple[float, ...]
    """Currents, ascending, 0 within their range, A."""
    force: tuple[tuple[float, ...], ...]
    """`force[i][j]` at `x[i]` and `current[j]`, N."""


def gather(rows: Iterable[tuple[float, float, float]], what: str) -> ForceTable:
    """Make a table of points in any order: displacement, m, current, A, and force, N.

    Messages begin with `what`.

    Raises
    ------
    InputError
        A point is not finite, given twice or missing, there are fewer than two displacements or currents, or
        0 A lies outside the currents.
    """
    points: dict[tuple[float, float], float] = {}
    for x, current, force in rows:
        if not (math.isfinite(x) and math.isfinite(current) and math.isfinite(force)):
            raise InputError(
                f"{what}: the point {x!r} m, {current!r} A, {force!r} N is expected to be finite"
            )
        if (x, current) in points:
            raise InputError(f"{what}: the point {x:.9g} m, {current:.9g} A is given twice, expected once")
        points[x, current] = force
    xs = sorted({x for x, _ in points})
    currents = sorted({current for _, current in points})
    for name, values in (("displacements", xs), ("currents", currents)):
        if len(values) < 2:
            raise InputError(f"{what}: {len(values)} different {name}, expected at least 2")
    for x in xs:
        for current in currents:
            if (x, current) not in points:
                raise InputError(
                    f"{what}: the point {x:.9g} m, {current:.9g} A is missing, expected a complete grid of "
                    f"{len(xs)} displacements and {len(currents)} currents"
                )
    if not currents[0] <= 0.0 <= currents[-1]:
        span = f"{currents[0]:.9g} to {currents[-1]:.9g} A"
        raise InputError(f"{what}: the currents go from {span}, expected a range with 0 A in it")
    forces = tuple(tuple(points[x, current] for current in currents) for x in xs)
    return ForceTable(tuple(xs), tuple(currents), forces)


def read_csv(path: Path) -> ForceTable:
    """Read a table from a CSV file with one line a point.

    The heading names the columns with their units, ``displacement [mm],current [A],force [N]``, in any
    order; the points may come in any order. Blank lines and lines that begin with # are passed over.

    Raises
    ------
    InputError
        The file cannot be read, is empty, lacks a unit, holds something else than finite numbers, or no
        complete grid.
    """
    from printhammer.units import to_si

    what = str(path)
    lines = read_sheet(path, "the force table").rows
    if not lines:
        raise InputError(f"{what}: the file is empty, expected the heading {_HEADING!r} and a grid of forces")
    order, units = _heading(lines[0][1], what)
    rows = []
    for number, cells in lines[1:]:
        if len(cells) != len(order):
            raise InputError(f"{what}: line {number} has {len(cells)} cells, expected {len(order)}")
        row = dict(zip(order, (finite(cell, f"{what}: line {number}") for cell in cells), strict=True))
        with located(f"{what}: line {number}"):
            x, current, force = (to_si(row[name], units[name], si) for name, si in COLUMNS.items())
        rows.append((x, current, force))
    return gather(rows, what)


def _heading(cells: Sequence[str], what: str) -> tuple[list[str], dict[str, str]]:
    """Return the columns in order and the unit of each."""
    from printhammer.units import to_si

    units = {}
    for cell in cells:
        name, unit = split_heading(cell)
        name = name.lower()
        if name not in COLUMNS or name in units:
            break
        if not unit:
            raise InputError(
                f"{what}: column {cell.strip()!r} has no unit, expected the heading {_HEADING!r}"
            )
        with located(f"{what}: column {cell.strip()!r}"):
            to_si(1.0, unit, COLUMNS[name])
        units[name] = unit
    if len(units) != len(COLUMNS) or len(cells) != len(COLUMNS):
        listed = ",".join(cell.strip() for cell in cells)
        raise InputError(f"{what}: the heading is {listed!r}, expected {_HEADING!r}")
    return list(units), units


def packed_spline(table: ForceTable) -> tuple[float, ...]:
    """Return the bicubic spline of a table, packed as `printhammer.parts.magnet.table` states.

    Cubic splines with not-a-knot ends along x, then along the current (with two or three points in a
    direction: the line or the parabola through them), so that force, slopes and curvatures are continuous;
    C. de Boor, J. Math. Phys. 41 (1962) 212. The energy is the exact integral of the spline at zero
    current.
    """
    import numpy as np
    from scipy.interpolate import CubicSpline

    x, current = np.array(table.x), np.array(table.current)
    along_x = CubicSpline(x, np.array(table.force), axis=0).c[::-1]  # power of x, x cell, current
    cells = CubicSpline(current, along_x, axis=2).c[::-1]  # power of I, I cell, power of x, x cell
    coefficients = np.transpose(cells, (3, 1, 2, 0))  # x cell, I cell, power of x, power of I
    j = min(max(int(np.searchsorted(current, 0.0, side="right")) - 1, 0), len(current) - 2)
    powers = np.power(0.0 - current[j], np.arange(4))
    at_zero = coefficients[:, j] @ powers
    energy = np.zeros((len(x) - 1, 5))
    energy[:, 1:] = -at_zero / np.arange(1, 5)
    rise = np.sum(energy * np.power(np.diff(x)[:, None], np.arange(5)), axis=1)
    energy[1:, 0] = np.cumsum(rise)[:-1]
    parts = (x, current, coefficients.ravel(), energy.ravel())
    return (float(len(x)), float(len(current)), *np.concatenate(parts).tolist())
