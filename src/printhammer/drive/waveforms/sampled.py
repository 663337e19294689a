"""A sampled waveform: a measured record of current or force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from printhammer.drive.segments import POLYNOMIAL, table
from printhammer.drive.waveforms.base import QuantityName, Waveform
from printhammer.drive.waveforms.record import Samples, checked, read_csv
from printhammer.support.constants import folder_of

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from printhammer.support.arrays import FloatArray

Interpolation = Literal["pchip", "linear"]


class Sampled(Waveform):
    """A measured record: samples joined by a curve, zero before the first and from the last on.

    The file is a CSV with units in its heading, ``time [us],current [A]`` or ``time [us],force [N]``; times
    are counted from the firing, are not negative and increase. Between samples the curve is a
    shape-preserving cubic (PCHIP: Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238, with the slopes
    of Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300), once continuously differentiable and
    without overshoot, or a straight line.

    Raises
    ------
    InputError
        The file or the samples cannot be used.
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
        """Make a sampled waveform from arrays, SI; `file` is only remembered."""
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

            # Slopes so small that their inverse overflows become zero, as they should.
            with np.errstate(over="ignore"):
                cubics = np.asarray(PchipInterpolator(t, y).c)[::-1].T
        starts = t[:-1].tolist()
        rows = [(start, POLYNOMIAL, *cubic) for start, cubic in zip(starts, cubics.tolist(), strict=True)]
        return table(rows, float(t[-1]))

    def scaled(self, factor: float) -> Self:
        """Return the same record with every sample multiplied by a factor."""
        return self.from_samples(
            self.times, self.values * factor, quantity=self.quantity, interpolation=self.interpolation
        )

    def content(self) -> dict[str, FloatArray]:
        """Return the samples, which belong to the identity of the waveform: times, s, and values, A or N."""
        return {"times": self.times, "values": self.values}
