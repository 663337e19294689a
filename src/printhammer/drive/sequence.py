"""Drive with a separate waveform for each firing, such as wider pulses or pulses with a brake pulse."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Sequence
from copy import copy
from typing import Any, Self

import numpy as np

from printhammer.drive.base import Drive, Overlap
from printhammer.drive.input import read_number, read_start, read_times
from printhammer.drive.segments import evaluate, largest, largest_sum, stacked
from printhammer.drive.text import FORMAT, column_text, document, waveform_text
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray, IntArray

__all__ = ["PulseSequence"]


class PulseSequence(Drive):
    """Pulses at given times, each with its own waveform.

    A sequence of equal waveforms is equal to the `PulseTrain` with the same times. If the exponentials of all
    waveforms have at most two different rates, as in rectangles of common rise and decay, an ensemble runs as
    fast as with a single waveform; widths and amplitudes may differ.

    Parameters
    ----------
    waveforms
        Waveform of each firing; all currents or all forces.
    at
        Firing times [s], ascending, one for each waveform.
    overlap
        "add": overlapping pulses add up; "replace": each firing cuts off the preceding pulse.
    start
        Shift of the firing times, s.

    Raises
    ------
    InputError
        `waveforms` is empty, contains something other than waveforms, an endless waveform, or both currents
        and forces; the numbers of times and waveforms differ; or a time is negative, not finite, duplicate or
        descending.
    """

    _largest: float

    def __init__(
        self,
        waveforms: Iterable[Waveform],
        at: Iterable[float | str],
        overlap: Overlap = "add",
        start: float | str = 0.0,
    ) -> None:
        fired = _validate(waveforms)
        times = read_times(at) + read_start(start)
        if times.size != len(fired):
            raise InputError(
                f"{times.size} firing times",
                expected=f"one per waveform, {len(fired)}",
                key="firing times",
            )
        super().__init__(fired[0], times, overlap, None)
        self._place(fired)

    @property
    def waveform(self) -> Waveform:
        """Waveform of the first firing."""
        return self._waveform

    @property
    def waveforms(self) -> tuple[Waveform, ...]:
        """Waveforms of all firings."""
        return self._waveforms

    @property
    def uniform(self) -> bool:
        """Whether all firings have the same waveform."""
        return len(self._tables) == 1

    @property
    def fingerprint(self) -> str:
        """Hexadecimal digest of the drive; equal drives have equal digests."""
        plain = super().fingerprint
        if len(self._tables) == 1:
            return plain
        digest = hashlib.sha256(plain.encode())
        for table in self._tables:
            digest.update(f"{table.shape}".encode())
            digest.update((table + 0.0).tobytes())
        digest.update(self._which.tobytes())
        return digest.hexdigest()

    @property
    def largest_pulse(self) -> float:
        """Largest absolute value of a single pulse, A or N."""
        if math.isnan(self._largest):
            self._largest = max(largest(table) for table in self._tables)
        return self._largest

    @property
    def peak(self) -> float:
        """Largest absolute value of the total current [A] or force [N]; exact if pulses do not overlap."""
        if self._waveform.replaces:
            return self.largest_pulse
        whole = np.append(self._ends()[:-1] <= self._times[1:], True)
        if self._overlap == "replace":
            highest = max(largest(self._tables[k]) for k in np.unique(self._which[whole]))
            if highest == self.largest_pulse:
                return highest
        elif whole.all():
            return self.largest_pulse
        edges = [np.add.outer(self._times[self._which == k], t[:, 0]) for k, t in enumerate(self._tables)]
        return largest_sum(np.unique(np.concatenate([some.ravel() for some in edges])), self.value)

    def scaled(self, factor: float) -> Self:
        """Return a copy of the drive with its currents, forces or voltages scaled by `factor`."""
        number = read_number(factor, "1", "factor")
        scaled = {id(waveform): waveform.scaled(number) for waveform in self._waveforms}
        result = copy(self)
        result._place([scaled[id(waveform)] for waveform in self._waveforms])
        return result

    def with_times(self, times: Iterable[float | str]) -> PulseSequence:
        """Return a drive with the same waveforms at new firing times [s], one for each waveform.

        Raises
        ------
        InputError
            The numbers of times and waveforms differ, or a time is negative, not finite, duplicate or
            descending.
        """
        return PulseSequence(self._waveforms, times, self._overlap)

    def to_toml(self) -> str:
        """Return the text of a drive file, from which `read_drive` parses an equal drive."""
        names = [f"pulse-{number + 1}" for number in range(len(self._tables))]
        first = np.unique(self._which, return_index=True)[1]
        shapes = {names[k]: waveform_text(self._waveforms[i]) for k, i in enumerate(first.tolist())}
        table = {"at": column_text(self._times, "s"), "waveforms": [names[k] for k in self._which]}
        tables = {"sequence": table, **{f"waveforms.{name}": shape for name, shape in shapes.items()}}
        return document({"format": FORMAT, "overlap": self._overlap}, tables)

    def _place(self, waveforms: Sequence[Waveform]) -> None:
        """Store the waveforms: their distinct segment tables, and the index of each firing's table."""
        numbers: dict[bytes, int] = {}
        tables: list[FloatArray] = []
        supports: list[float] = []
        known: dict[int, int] = {}
        for waveform in waveforms:
            if id(waveform) in known:
                continue
            segments = waveform.segments()
            # Adding 0.0 turns -0.0 into 0.0.
            content = (segments + 0.0).tobytes()
            if content not in numbers:
                numbers[content] = len(tables)
                tables.append(segments)
                supports.append(waveform.support)
            known[id(waveform)] = numbers[content]
        self._waveforms = tuple(waveforms)
        self._waveform = self._waveforms[0]
        self._segments = tables[0]
        self._tables = tables
        self._supports = supports
        # Computed on first use.
        self._largest = math.nan
        self._which = np.array([known[id(waveform)] for waveform in waveforms], dtype=np.int64)
        rows, self._pieces = stacked(tables)
        self._rows = np.array(rows, dtype=np.int64)[self._which]
        self._rows.flags.writeable = False

    def _begins(self) -> IntArray:
        return self._rows

    def _ends(self) -> FloatArray:
        ends: FloatArray = self._times + np.array(self._supports)[self._which]
        return ends

    def _reach(self) -> int:
        if self._overlap == "replace":
            return 1
        after = np.searchsorted(self._times, self._ends(), side="left")
        return int((after - np.arange(len(self._times))).max())

    def _values(self, time: FloatArray, pulse: IntArray) -> FloatArray:
        moments, numbers = np.ravel(time), np.ravel(pulse)
        result = np.zeros(moments.shape)
        # Group pulses of the same waveform: each table is evaluated once.
        order = np.argsort(self._which[numbers], kind="stable")
        bounds = np.searchsorted(self._which[numbers[order]], np.arange(len(self._tables) + 1))
        for k in np.flatnonzero(np.diff(bounds)):
            own = order[bounds[k] : bounds[k + 1]]
            result[own] = evaluate(self._tables[k], moments[own], self._times[numbers[own]])
        return result.reshape(np.shape(time))

    def _shapes(self) -> str:
        return f"{len(self._tables)} waveform{'s' if len(self._tables) > 1 else ''} of {self.quantity}"


def _validate(waveforms: Any) -> list[Waveform]:
    """Check that all waveforms of a sequence end and drive the same quantity; return a list."""
    try:
        fired = [] if isinstance(waveforms, Waveform) else list(waveforms)
    except TypeError:
        fired = []
    if not fired:
        raise InputError.of("waveforms", waveforms, "a list of waveforms, one a firing")
    seen: set[int] = set()
    for number, waveform in enumerate(fired):
        if id(waveform) in seen:
            continue
        seen.add(id(waveform))
        if not isinstance(waveform, Waveform):
            raise InputError.of(f"waveforms[{number}]", waveform, "a waveform")
        if not math.isfinite(waveform.support):
            raise InputError(
                f"waveforms[{number}] is a {waveform.shape}",
                key=f"waveforms[{number}]",
                expected="a waveform that ends",
            )
        if waveform.quantity != fired[0].quantity:
            raise InputError(
                f"waveforms[{number}] is a {waveform.quantity}",
                key=f"waveforms[{number}]",
                expected=f"a {fired[0].quantity} like the first",
            )
    return fired
