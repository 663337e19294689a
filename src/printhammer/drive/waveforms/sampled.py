"""Sampled waveforms: measured records of a current or force.

Records are validated samples, from arrays or from CSV files with units in the heading.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from printhammer.drive.segments import POLYNOMIAL, table
from printhammer.drive.waveforms.base import QUANTITY_UNITS, QuantityName, Waveform
from printhammer.errors import InputError, located
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import folder_of
from printhammer.support.sheets import finite, read_sheet, split_heading

_UNITS: Final = {name: si for si, name in QUANTITY_UNITS.items()}
_HEADINGS: Final = "'time [us],current [A]' or 'time [us],force [N]'"


@dataclass(frozen=True)
class Samples:
    """Samples in SI: times since the firing, values, and the driven quantity."""

    times: tuple[float, ...]
    values: tuple[float, ...]
    quantity: QuantityName


def checked(times: npt.ArrayLike, values: npt.ArrayLike, quantity: QuantityName, what: str) -> Samples:
    """Validate samples and return them as a record.

    Raises
    ------
    InputError
        Fewer than two samples, different lengths, a sample not finite, a time negative or not above the one
        before.
    """
    try:
        t = np.asarray(times, dtype=np.float64)
        y = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"{what}: the samples are expected to be numbers", file=what, key="samples"
        ) from None
    if t.ndim != 1 or t.shape != y.shape:
        raise InputError(
            f"{what}: {t.size} times and {y.size} values",
            file=what,
            key="time",
            expected="one value for each time",
        )
    if len(t) < 2:
        raise InputError(f"{what}: {len(t)} samples", file=what, key="time", expected="at least 2")
    for name, column in (("time", t), ("value", y)):
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise InputError(
                f"{what}: {name} {column[bad[0]]} of sample {bad[0] + 1} is expected to be finite",
                file=what,
                key=name,
            )
    if t[0] < 0.0:
        raise InputError(
            f"{what}: first time {t[0]:.9g} s is expected to be 0 or later (the firing is at 0)",
            file=what,
            key="time",
        )
    bad = np.flatnonzero(np.diff(t) <= 0.0)
    if len(bad):
        k = int(bad[0]) + 1
        order = f"{t[k]:.9g} s (sample {k + 1}) follows {t[k - 1]:.9g} s"
        raise InputError(
            f"{what}: times are expected to increase strictly, but {order}", file=what, key="times"
        )
    if quantity not in _UNITS:
        raise InputError.of("quantity", quantity, "current or force", file=what, said=" is expected to be")
    return Samples(tuple(t.tolist()), tuple(y.tolist()), quantity)


def read_csv(path: Path) -> Samples:
    """Read a record from a CSV file.

    Its columns are ``time [unit]`` and ``current [unit]`` or ``force [unit]``. Blank lines and lines that
    begin with # are skipped.

    Raises
    ------
    InputError
        The file cannot be read, is empty, lacks units, or holds anything but finite numbers at increasing
        times.
    """
    what = str(path)
    rows = read_sheet(path, "the sampled waveform").rows
    if not rows:
        raise InputError(
            f"{what}: the file is empty",
            file=what,
            key="samples",
            expected=f"the heading {_HEADINGS} and at least 2 samples",
        )
    time_unit, name, unit = _heading(rows[0][1], what)
    columns: tuple[list[float], list[float]] = ([], [])
    for line, row in rows[1:]:
        if len(row) != 2:
            raise InputError(
                f"{what}: line {line} has {len(row)} cells", file=what, key=f"line {line}", expected="2"
            )
        for cell, column in zip(row, columns, strict=True):
            column.append(finite(cell, f"{what}: line {line}"))
    return checked(
        _converted(columns[0], time_unit, "s", what),
        _converted(columns[1], unit, _UNITS[name], what),
        name,
        what,
    )


def _heading(cells: list[str], what: str) -> tuple[str, QuantityName, str]:
    """Return the unit of time, the driven quantity, and its unit."""
    if len(cells) != 2:
        raise InputError(
            f"{what}: {len(cells)} columns", file=what, key="columns", expected=f"the 2 columns {_HEADINGS}"
        )
    names, units = zip(*map(split_heading, cells), strict=True)
    for cell, unit in zip(cells, units, strict=True):
        if not unit:
            raise InputError(
                f"{what}: heading {cell.strip()!r} is expected to carry its unit, such as 'time [us]'",
                file=what,
                key=cell.strip(),
            )
    names = tuple(name.lower() for name in names)
    for quantity in _UNITS:
        if names == ("time", quantity):
            return units[0], quantity, units[1]
    raise InputError(
        f"{what}: columns {names[0]!r} and {names[1]!r}", file=what, key="columns", expected=_HEADINGS
    )


def _converted(column: list[float], unit: str, si: str, what: str) -> list[float]:
    """Convert a column to SI."""
    from printhammer.units import to_si

    with located(what):
        to_si(1.0, unit, si)
        return [to_si(number, unit, si) for number in column]


Interpolation = Literal["pchip", "linear"]


class Sampled(Waveform):
    """Measured record: interpolated samples, zero before the first and from the last on.

    The file is a CSV with units in its heading, ``time [us],current [A]`` or ``time [us],force [N]``; times
    count from the firing, are not negative and increase. Between samples the curve is a shape-preserving
    cubic (PCHIP: Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238, with the slopes of Fritsch and
    Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300), once continuously differentiable and without overshoot,
    or a straight line.
    """

    shape: ClassVar[str] = "sampled"
    file: str = Field(description="CSV file of the record, relative to the file that names it")
    interpolation: Interpolation = "pchip"
    _record: Samples = PrivateAttr()

    @model_validator(mode="wrap")
    @classmethod
    def _load(cls, data: Any, handler: Callable[[Any], Self], info: ValidationInfo) -> Self:
        if isinstance(data, cls) or not isinstance(data, dict):
            return handler(data)
        record = info.context.get("record") if isinstance(info.context, dict) else None
        if record is None and isinstance(data.get("file"), str):
            record = read_csv(folder_of(info) / data["file"])
        if record is None:
            return handler(data)
        made = handler({**data, "quantity": record.quantity})
        made._record = record
        return made

    @classmethod
    def from_samples(
        cls,
        times: npt.ArrayLike,
        values: npt.ArrayLike,
        *,
        quantity: QuantityName = "current",
        interpolation: Interpolation = "pchip",
        file: str = "",
    ) -> Self:
        """Create a sampled waveform from arrays, SI; `file` is stored as its name only."""
        record = checked(times, values, quantity, "sampled waveform")
        fields = {"file": file, "interpolation": interpolation}
        return cls.model_validate(fields, context={"record": record})

    @property
    def times(self) -> FloatArray:
        """Times of the samples since the firing, s."""
        return np.array(self._record.times)

    @property
    def values(self) -> FloatArray:
        """Samples, A or N."""
        return np.array(self._record.values)

    def segments(self) -> FloatArray:
        """Return the segment table: one cubic or straight line between neighbouring samples."""
        t, y = self.times, self.values
        if self.interpolation == "linear":
            slope = np.diff(y) / np.diff(t)
            cubics = np.stack([y[:-1], slope, 0.0 * slope, 0.0 * slope], axis=1)
        else:
            from scipy.interpolate import PchipInterpolator

            # Slopes whose inverse overflows are set to zero.
            with np.errstate(over="ignore"):
                cubics = np.asarray(PchipInterpolator(t, y).c)[::-1].T
        starts = t[:-1].tolist()
        rows = [(start, POLYNOMIAL, *cubic) for start, cubic in zip(starts, cubics.tolist(), strict=True)]
        return table(rows, float(t[-1]))

    def scaled(self, factor: float) -> Self:
        """Return a copy scaled by `factor`."""
        return self.from_samples(
            self.times, self.values * factor, quantity=self.quantity, interpolation=self.interpolation
        )

    def content(self) -> dict[str, FloatArray]:
        """Return the samples, part of the identity of the waveform: times, s, and values, A or N."""
        return {"times": self.times, "values": self.values}
