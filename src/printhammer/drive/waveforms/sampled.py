"""Sampled waveforms: measured records of a current or force.

Records are validated samples, read from tables with units in the heading.
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
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import folder_of

_UNITS: Final[dict[str, str]] = {name: si for si, name in QUANTITY_UNITS.items()}
_HEADINGS: Final = "'time [us],current [A]' or 'time [us],force [N]'"
_EDGE: Final = 1e-9  # Duration of an edge between recorded levels, s; arbitrary, shorter than any driver's


@dataclass(frozen=True)
class Samples:
    """Samples in SI: times since the firing, values, and the driven quantity."""

    times: tuple[float, ...]
    values: tuple[float, ...]
    quantity: QuantityName


def checked(times: npt.ArrayLike, values: npt.ArrayLike, quantity: QuantityName, what: str) -> Samples:
    """Validate the times and values of a sampled waveform; return them as `Samples`.

    `what` names the waveform or its file in error messages.

    Raises
    ------
    InputError
        There are fewer than two samples, times and values differ in number, a sample is not finite, or a time
        is negative or does not exceed the preceding time.
    """
    try:
        t = np.asarray(times, dtype=np.float64)
        y = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{what}: the samples", expected="numbers", file=what, key="samples") from None
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
                f"{what}: {name} {column[bad[0]]} of sample {bad[0] + 1}",
                expected="finite",
                file=what,
                key=name,
            )
    if t[0] < 0.0:
        raise InputError(
            f"{what}: first time {t[0]:.9g} s",
            expected="0 or later (the firing is at 0)",
            file=what,
            key="time",
        )
    bad = np.flatnonzero(np.diff(t) <= 0.0)
    if len(bad):
        k = int(bad[0]) + 1
        order = f"{t[k]:.9g} s (sample {k + 1}) follows {t[k - 1]:.9g} s"
        raise InputError(f"{what}: {order}", file=what, key="times", expected="strictly increasing times")
    if quantity not in _UNITS:
        raise InputError.of("quantity", quantity, "current or force", file=what)
    return Samples(tuple(t.tolist()), tuple(y.tolist()), quantity)


def read_csv(path: Path) -> Samples:
    """Read a record from a table of time and current or force.

    The firing is at time 0 of the record. Samples before time 0 are cut off; the drive must be zero there. A
    level that a logic analyser recorded at its edges holds from one edge to the next.

    Raises
    ------
    InputError
        The file cannot be read, is empty, lacks units, contains something other than finite numbers at
        increasing times, or the drive is not zero before time 0.
    """
    # Most hammers have no table; the reader of tables takes time to import.
    from printhammer.support.tables.readings import read_table

    what = str(path)
    table = read_table(path, {"time": "s"}, optional=_UNITS, what="the sampled waveform")
    table.check_times()
    driven = [name for name in table.values if name != "time"]
    if len(driven) != 1:
        raise InputError(
            f"{what}: columns {', '.join(map(repr, table.values))}",
            file=what,
            key="columns",
            expected=_HEADINGS,
        )
    quantity: QuantityName = driven[0]  # type: ignore[assignment]
    times, values = table.values["time"], table.values[quantity]
    table.check_before(times, quantity)
    if quantity in table.levels:
        times, values = _held(times, values)
    return checked(times[times >= 0.0], values[times >= 0.0], quantity, what)


def _held(times: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Add a sample of each logic level just before the next sample, so that the level holds until then."""
    before = times[1:] - min(_EDGE, 0.5 * float(np.diff(times).min()))
    order = np.argsort(times := np.concatenate([times, before]))
    return times[order], np.concatenate([values, values[:-1]])[order]


Interpolation = Literal["pchip", "linear"]


class Sampled(Waveform):
    """Measured record: interpolated samples, zero before the first sample and after the last.

    The file is a CSV with units in its heading, ``time [us],current [A]`` or ``time [us],force [N]``; times
    are measured from the firing, are not negative, and increase. Between samples the curve is a straight
    line or a shape-preserving cubic (PCHIP: Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238, with
    the slopes of Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300), which is once continuously
    differentiable and does not overshoot.
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
        """Create a sampled waveform from arrays, SI; `file` is stored as a name only, not read."""
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
        """Return a copy with all samples scaled by `factor`."""
        return self.from_samples(
            self.times, self.values * factor, quantity=self.quantity, interpolation=self.interpolation
        )

    def content(self) -> dict[str, FloatArray]:
        """Return the samples for the digest of the waveform: times [s] and values [A or N]."""
        return {"times": self.times, "values": self.values}
