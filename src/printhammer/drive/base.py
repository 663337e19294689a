"""Base class of drives: a waveform, its firing times, and a rule for overlapping pulses."""

from __future__ import annotations

import hashlib
from copy import copy
from typing import Any, ClassVar, Final, Literal, Self, get_args

import numpy as np
import numpy.typing as npt

from printhammer.drive.input import checked_times, read_number
from printhammer.drive.segments import evaluate, largest, largest_sum, stacked
from printhammer.drive.text import FORMAT, column_text, document, waveform_text
from printhammer.drive.waveforms.base import QuantityName
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray, IntArray

Overlap = Literal["add", "replace"]
OVERLAPS: Final = get_args(Overlap)


class Drive:
    """Waveform with its firing times, immutable; most subclasses are in `printhammer.drive.trains`.

    Two drives are equal if their segment tables, firing times, overlap rules and quantities are equal.
    """

    bounded: ClassVar[bool] = False
    """Whether `largest_pulse` is a stated bound instead of the computed maximum of the segments."""

    def __init__(
        self, waveform: Waveform, times: npt.ArrayLike, overlap: Overlap = "add", period: float | None = None
    ) -> None:
        if not isinstance(waveform, Waveform):
            raise InputError.of("waveform", waveform, "a waveform, such as hammer.waveform")
        if overlap not in OVERLAPS:
            raise InputError.of("overlap", overlap, "'add' or 'replace'")
        self._waveform = waveform
        self._overlap: Overlap = "replace" if waveform.replaces else overlap
        self._period = period
        self._times = checked_times(times)
        self._segments = waveform.segments()
        self._pieces = stacked([self._segments])[1]

    @property
    def waveform(self) -> Waveform:
        """Waveform of every firing or, for a sequence, of the first firing."""
        return self._waveform

    @property
    def times(self) -> FloatArray:
        """Firing times [s], ascending, read-only."""
        return self._times

    @property
    def uniform(self) -> bool:
        """Whether all firings have the same waveform."""
        return True

    @property
    def overlap(self) -> Overlap:
        """Rule for overlapping pulses: "add" or "replace"; pulses of a voltage always replace each other."""
        return self._overlap

    @property
    def period(self) -> float | None:
        """Time between firings, or period of the force, s; None if the times between firings differ."""
        return self._period

    @property
    def quantity(self) -> QuantityName:
        """Driven quantity: "current" (A), "force" (N) or "voltage" (V)."""
        return self._waveform.quantity

    @property
    def end(self) -> float:
        """Time after which the drive is zero, s; possibly infinite."""
        return float(self._ends().max())

    @property
    def fingerprint(self) -> str:
        """Hexadecimal digest of the drive; equal drives have equal digests."""
        digest = hashlib.sha256(f"{self.quantity} {self.overlap} {self._segments.shape}".encode())
        if self.quantity == "voltage":
            digest.update(repr(self._waveform.supply()).encode())
        # Adding 0.0 turns -0.0 into 0.0, so that equal numbers have equal digests.
        for array in (self._segments, self._times):
            digest.update((array + 0.0).tobytes())
        return digest.hexdigest()

    def segments(self) -> FloatArray:
        """Return the segment table of the waveform (see `printhammer.drive.segments`), SI, read-only."""
        return self._segments

    def kernel_arrays(self) -> tuple[FloatArray, IntArray, FloatArray, bool, bool]:
        """Return the arrays of the drive for the kernel.

        Returns
        -------
        tuple
            In this order: firing times [s]; for each firing, the index of the first row of its segment table
            in the stacked tables; the segment tables, stacked by `printhammer.drive.segments.stacked`;
            whether each pulse replaces the preceding pulse, instead of being added; whether the drive is a
            force.
        """
        return self._times, self._begins(), self._pieces, self._overlap == "replace", self.quantity == "force"

    @property
    def overlapping(self) -> int:
        """Largest number of simultaneous pulses; 1 if each firing replaces the previous pulse."""
        if self._overlap == "replace":
            return 1
        ended = np.searchsorted(np.sort(self._ends()), self._times, side="right")
        return int((np.arange(len(self._times)) - ended).max()) + 1

    def value(self, t: npt.ArrayLike) -> FloatArray:
        """Return the total current [A] or force [N] at times t [s]; right-continuous, 0 before any firing."""
        time = np.asarray(t, dtype=np.float64)
        latest = np.searchsorted(self._times, time, side="right") - 1
        total = np.where(np.isnan(time), np.nan, 0.0)
        for lag in range(self._reach()):
            pulse = latest - lag
            total = np.where(pulse >= 0, total + self._values(time, np.maximum(pulse, 0)), total)
        return total

    @property
    def largest_pulse(self) -> float:
        """Largest absolute value of a single pulse, A or N."""
        return largest(self._segments)

    @property
    def peak(self) -> float:
        """Largest absolute value of the total current [A] or force [N]; exact if pulses do not overlap."""
        several = self.overlapping
        if several == 1:
            return self.largest_pulse
        # Once `several` pulses overlap, an even train is periodic until it ends.
        count = several + 1 if self._period is not None else len(self._times)
        shortest = Drive(self._waveform, self._times[:count], self._overlap)
        return largest_sum(np.unique(np.add.outer(shortest.times, self._segments[:, 0])), shortest.value)

    def scaled(self, factor: float) -> Self:
        """Return a copy of the drive with its current, force or voltage scaled by `factor`."""
        return self._with_waveform(self._waveform.scaled(read_number(factor, "1", "factor")))

    def to_toml(self) -> str:
        """Return the text of a drive file, from which `read_drive` parses an equal drive."""
        name, table = self._table()
        tables = {name: table}
        if name != "sine":
            tables["waveform"] = waveform_text(self._waveform)
        return document({"format": FORMAT, "overlap": self._overlap}, tables)

    def _table(self) -> tuple[str, dict[str, Any]]:
        return "times", {"at": column_text(self._times, "s")}

    def _with_waveform(self, waveform: Waveform) -> Self:
        result = copy(self)
        result._waveform = waveform
        result._segments = waveform.segments()
        result._pieces = stacked([result._segments])[1]
        return result

    def _begins(self) -> IntArray:
        """Return, for each firing, the index of its segment table's first row in the stacked tables."""
        return np.zeros(len(self._times), np.int64)

    def _ends(self) -> FloatArray:
        """Return the end times of the pulses, s."""
        ends: FloatArray = self._times + self._waveform.support
        return ends

    def _reach(self) -> int:
        """Return the largest number of firings whose pulses may be active at the same time."""
        return self.overlapping

    def _values(self, time: FloatArray, pulse: IntArray) -> FloatArray:
        """Return the values [A or N] of the pulses with given indices at given times [s]."""
        return evaluate(self._segments, time, self._times[pulse])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Drive):
            return NotImplemented
        return (
            (self.quantity, self.overlap) == (other.quantity, other.overlap)
            and self._waveform.supply() == other._waveform.supply()
            and np.array_equal(self._times, other._times)
            and np.array_equal(self._begins(), other._begins())
            and np.array_equal(self._pieces, other._pieces)
        )

    def __hash__(self) -> int:
        return hash(self.fingerprint)

    def __repr__(self) -> str:
        count, first, last = len(self._times), self._times[0], self._times[-1]
        fired = f"1 firing at {1e3 * first:.6g} ms"
        if count > 1:
            fired = f"{count} firings from {1e3 * first:.6g} to {1e3 * last:.6g} ms"
        return f"<{type(self).__name__}: {self._shapes()}, {fired}, overlap {self._overlap}>"

    def _shapes(self) -> str:
        """Describe the waveforms for `repr`."""
        return f"{self._waveform.shape} {self.quantity}"
