"""Magnet given by a measured table of forces F(x, I).

    Fm = S(x, I),  S the bicubic spline through the table

Source: the measurement named in the file; equation (3) of the paper is one fit to such a table. The file is
a CSV with one line a point and units in its heading (`displacement [mm],current [A],force [N]`), a complete
grid in any order, 0 A within its currents. Validity: the displacements and currents of the table. Outside
it the functions return NaN rather than extrapolate, which a run reports as the range left. Weakness: a
spline through measured points also follows their noise, and its third derivative jumps between cells.

Packed constants: c = [nx, ni, x[nx], current[ni], coefficients[nx - 1][ni - 1][4][4], energy[nx - 1][5]];
within a cell F = sum over p, q of coefficients[p][q] (x - x[i])^p (I - current[j])^q.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from printhammer.errors import InputError
from printhammer.parts.base import MagnetPart, register
from printhammer.parts.magnet._force_table import ForceTable, gather, packed_spline, read_csv
from printhammer.support.constants import folder_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the force of the table, N; NaN outside it."""
    nx = int(c[0])
    ni = int(c[1])
    if not (c[2] <= x <= c[1 + nx] and c[2 + nx] <= current <= c[1 + nx + ni]):
        return math.nan
    i = 0
    high = nx - 1
    while high - i > 1:
        middle = (i + high) // 2
        if c[2 + middle] <= x:
            i = middle
        else:
            high = middle
    j = 0
    high = ni - 1
    while high - j > 1:
        middle = (j + high) // 2
        if c[2 + nx + middle] <= current:
            j = middle
        else:
            high = middle
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

    It is zero at the smallest displacement of the table.
    """
    nx = int(c[0])
    ni = int(c[1])
    if not c[2] <= x <= c[1 + nx]:
        return math.nan
    i = 0
    high = nx - 1
    while high - i > 1:
        middle = (i + high) // 2
        if c[2 + middle] <= x:
            i = middle
        else:
            high = middle
    dx = x - c[2 + i]
    k = 2 + nx + ni + 16 * (nx - 1) * (ni - 1) + 5 * i
    return float(c[k] + dx * (c[k + 1] + dx * (c[k + 2] + dx * (c[k + 3] + dx * c[k + 4]))))


@register
class TableMagnet(MagnetPart):
    """Force table read from a CSV file.

    Raises
    ------
    InputError
        The file or its grid cannot be used.
    """

    law: ClassVar[str] = "table"

    file: str = Field(description="CSV file of the table, relative to the file that names it")
    _table: ForceTable = PrivateAttr()

    @model_validator(mode="wrap")
    @classmethod
    def _load(cls, data: Any, handler: Callable[[Any], Self], info: ValidationInfo) -> Self:
        if not isinstance(data, dict):
            return handler(data)
        table = info.context.get("table") if isinstance(info.context, dict) else None
        if table is None and isinstance(data.get("file"), str):
            table = read_csv(folder_of(info) / data["file"])
        made = handler(data)
        if table is not None:
            made._table = table
        return made

    @classmethod
    def from_arrays(
        cls, x: Sequence[float], current: Sequence[float], force: Sequence[Sequence[float]], file: str = ""
    ) -> Self:
        """Make the part from arrays.

        Parameters
        ----------
        x, current : sequence of float
            Displacements, m, and currents, A.
        force : sequence of sequence of float
            Forces, N, shape (len(x), len(current)).
        file : str, optional
            File name, only remembered.

        Raises
        ------
        InputError
            If the arrays do not make a grid.
        """
        if len(force) != len(x) or any(len(line) != len(current) for line in force):
            raise InputError(
                f"force table: expected {len(x)} rows of {len(current)} forces, one for each x and current"
            )
        rows = [
            (float(a), float(b), float(f))
            for a, line in zip(x, force, strict=True)
            for b, f in zip(current, line, strict=True)
        ]
        return cls.model_validate({"file": file}, context={"table": gather(rows, "force table")})

    @property
    def table(self) -> ForceTable:
        """The measured points."""
        return self._table

    @property
    def domain(self) -> tuple[float, float]:
        """Displacements of the table, `(x_min, x_max)` in m."""
        return (self._table.x[0], self._table.x[-1])

    @property
    def current_range(self) -> tuple[float, float]:
        """Currents of the table, A."""
        return (self._table.current[0], self._table.current[-1])

    def content(self) -> Mapping[str, Any]:
        """Return the points, which belong to the identity of the magnet: x, m; current, A; force, N."""
        return {"x": self._table.x, "current": self._table.current, "force": self._table.force}

    @cached_property
    def _packed(self) -> tuple[float, ...]:
        return packed_spline(self._table)

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the spline as the module states."""
        return self._packed
