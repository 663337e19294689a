"""Tables over displacement and current: validation, reading from CSV, bicubic spline, and base class."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, Self

from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from printhammer.errors import InputError
from printhammer.parts.base import MagnetPart
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import folder_of

UNITS: Final = {"force": "N", "linkage": "Wb"}
"""SI unit of each quantity that a table may hold."""


@dataclass(frozen=True)
class Grid:
    """Values of one quantity on a complete grid of displacements and currents, SI."""

    x: tuple[float, ...]
    """Displacements, ascending, m."""
    current: tuple[float, ...]
    """Currents, ascending, with 0 A inside their range, A."""
    values: tuple[tuple[float, ...], ...]
    """Values of the quantity, SI: `values[i][j]` at `x[i]` and `current[j]`."""


def gather(rows: Iterable[tuple[float, float, float]], what: str, quantity: str) -> Grid:
    """Collect points, given in any order, in a complete grid.

    A point is a displacement [m], a current [A] and the value of `quantity` in SI. Error messages begin with
    `what`.

    Raises
    ------
    InputError
        A point is not finite, repeated or missing, there are fewer than two displacements or currents, or 0 A
        lies outside the range of currents.
    """
    points: dict[tuple[float, float], float] = {}
    for x, current, value in rows:
        if not (math.isfinite(x) and math.isfinite(current) and math.isfinite(value)):
            raise InputError(
                f"{what}: the point {x!r} m, {current!r} A, {value!r} {UNITS[quantity]}",
                expected="finite numbers",
                file=what,
                key="point",
            )
        if (x, current) in points:
            raise InputError(
                f"{what}: the point {x:.9g} m, {current:.9g} A occurs twice",
                file=what,
                key="point",
                expected="once",
            )
        points[x, current] = value
    xs = sorted({x for x, _ in points})
    currents = sorted({current for _, current in points})
    for name, values in (("displacements", xs), ("currents", currents)):
        if len(values) < 2:
            raise InputError(
                f"{what}: {len(values)} different {name}", file=what, key=name, expected="at least 2"
            )
    for x in xs:
        for current in currents:
            if (x, current) not in points:
                raise InputError(
                    f"{what}: the point {x:.9g} m, {current:.9g} A is missing",
                    file=what,
                    key="point",
                    expected=f"a complete grid of {len(xs)} displacements and {len(currents)} currents",
                )
    if not currents[0] <= 0.0 <= currents[-1]:
        span = f"{currents[0]:.9g} to {currents[-1]:.9g} A"
        raise InputError(
            f"{what}: the currents go from {span}",
            file=what,
            key="current",
            expected="a range with 0 A in it",
        )
    measured = tuple(tuple(points[x, current] for current in currents) for x in xs)
    return Grid(tuple(xs), tuple(currents), measured)


def read_csv(path: Path, quantity: str) -> Grid:
    """Read a table of one quantity of `UNITS` from a CSV file with one point per line.

    The heading names the columns with their units, ``displacement [mm],current [A],force [N]``, in any
    order; the points may come in any order.

    Raises
    ------
    InputError
        The file cannot be read, is empty, lacks a unit, contains anything but finite numbers, or does not
        contain a complete grid.
    """
    # Most hammers have no table; the reader of tables takes time to import.
    from printhammer.support.tables.readings import read_table

    columns = {"displacement": "m", "current": "A", quantity: UNITS[quantity]}
    table = read_table(path, columns, what=f"the {quantity} table")
    points = zip(*(table.values[name].tolist() for name in columns), strict=True)
    return gather(points, str(path), quantity)


def bicubic(table: Grid) -> FloatArray:
    """Return the coefficients of the bicubic spline through a table.

    The axes of the result are, in this order: the x cell, the I cell, the power of x and the power of I, both
    measured from the lower corner of the cell. The spline is a cubic spline with not-a-knot ends along x, and
    then along the current (with two or three points in a direction, the line or the parabola through them),
    so that values, slopes and curvatures are continuous; C. de Boor, J. Math. Phys. 41 (1962) 212.
    """
    import numpy as np
    from scipy.interpolate import CubicSpline

    x, current = np.array(table.x), np.array(table.current)
    along_x = CubicSpline(x, np.array(table.values), axis=0).c[::-1]  # Axes: power of x, x cell, current
    cells = CubicSpline(current, along_x, axis=2).c[::-1]  # Axes: power of I, I cell, power of x, x cell
    coefficients: FloatArray = np.transpose(cells, (3, 1, 2, 0))
    return coefficients


def cell_at_zero(table: Grid) -> tuple[int, float]:
    """Return the index of the interval of currents around 0 A, and the offset of 0 A from its start, A."""
    import numpy as np

    current = table.current
    j = min(max(int(np.searchsorted(current, 0.0, side="right")) - 1, 0), len(current) - 2)
    return j, 0.0 - current[j]


class GridMagnet(MagnetPart):
    """Base class of magnets whose law is a spline through a table from a CSV file."""

    quantity: ClassVar[str]
    """Quantity of the table: a key of `UNITS`, such as "force"."""

    file: str = Field(description="CSV file of the table, relative to the file that names it")
    _table: Grid = PrivateAttr()

    @model_validator(mode="wrap")
    @classmethod
    def _load(cls, data: Any, handler: Callable[[Any], Self], info: ValidationInfo) -> Self:
        if not isinstance(data, dict):
            return handler(data)
        table = info.context.get("table") if isinstance(info.context, dict) else None
        if table is None and isinstance(data.get("file"), str):
            path = folder_of(info) / data["file"]
            table = read_csv(path, cls.quantity)
            cls.check(table, str(path))
        made = handler(data)
        if table is not None:
            made._table = table
        return made

    @classmethod
    def check(cls, table: Grid, where: str) -> None:
        """Raise InputError for a table that the law cannot use; error messages begin with `where`."""

    @classmethod
    def from_arrays(
        cls, x: Sequence[float], current: Sequence[float], values: Sequence[Sequence[float]], file: str = ""
    ) -> Self:
        """Create the magnet from arrays instead of a CSV file.

        Parameters
        ----------
        x, current : sequence of float
            Displacements [m] and currents [A].
        values : sequence of sequence of float
            Forces [N], or flux linkages [Wb], shape (len(x), len(current)).
        file : str, optional
            Name of a CSV file, stored but not read.
        """
        what = f"{cls.quantity} table"
        if len(values) != len(x) or any(len(line) != len(current) for line in values):
            raise InputError(
                f"{what}: expected {len(x)} rows of {len(current)} {cls.quantity}s, one for each x and"
                " current",
                file=what,
                key="rows",
            )
        rows = [
            (float(a), float(b), float(value))
            for a, line in zip(x, values, strict=True)
            for b, value in zip(current, line, strict=True)
        ]
        table = gather(rows, what, cls.quantity)
        cls.check(table, what)
        return cls.model_validate({"file": file}, context={"table": table})

    @property
    def table(self) -> Grid:
        """Table of the measured points."""
        return self._table

    @property
    def domain(self) -> tuple[float, float]:
        """Range of displacements of the table, `(x_min, x_max)` in m."""
        return (self._table.x[0], self._table.x[-1])

    @property
    def current_range(self) -> tuple[float, float]:
        """Range of currents of the table, A."""
        return (self._table.current[0], self._table.current[-1])

    def content(self) -> Mapping[str, Any]:
        """Return the entries of the table for the digest of the hammer: x, current and values, SI."""
        return {"x": self._table.x, "current": self._table.current, self.quantity: self._table.values}
