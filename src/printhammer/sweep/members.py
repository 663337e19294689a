"""Members of a sweep: hammer, drive, initial state and end time, from a row of axis values."""

from __future__ import annotations

import tomllib
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from printhammer.drive.batch import PulseTrains, firings_of
from printhammer.drive.file import drive_of
from printhammer.drive.text import FORMAT, document
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import RATE
from printhammer.results import Declared, part, scalar
from printhammer.run.waits import longest_waveforms, windows_of
from printhammer.run.window import Window, end_of
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.sweep.axes import COUNTS, Axis

KINDS: Final = ("train", "times", "burst", "sequence", "sine")
"""Tables of a drive file that define the firing times."""

_OF_DRIVE: Final = ("waveform", "drive", "at")
"""Targets of axes that change the drive: its waveform, its timing, or one firing time."""


@dataclass(frozen=True)
class Member:
    """One run of a sweep: hammer, drive, end time [s], initial displacement [m] and velocity [m/s]."""

    hammer: Hammer
    drive: Drive
    end: float
    state: tuple[float, float]


class Members(NamedTuple):
    """Several runs of a sweep: the fields of `Member`, with one entry per run.

    `states` has the shape (members, 2). `windows` are the windows that determine the ends of the runs; None
    if the spec states a duration.
    """

    hammers: list[Hammer]
    drives: Sequence[Drive]
    ends: FloatArray
    states: FloatArray
    windows: list[Window] | None


class Base(Declared):
    """Settings common to all members, sufficient to build the members on another machine."""

    hammer: Hammer = part("the hammer, before the axes change it")
    drive: Mapping[str, Any] = part("tables of the drive file; its waveform only where an axis changes it")
    waveform: Waveform | None = part(
        "waveform of the drive; None if the hammer's waveform is fired, or if an axis changes the waveform"
    )
    folder: Path = part("folder of the files that the drive refers to")
    state: tuple[float | None, float | None] = part(
        "displacement [m] and velocity [m/s] at the start; None for the value at rest"
    )
    duration: float | None = scalar("s", "end of the runs")
    tolerance: float = part("error allowed in one step")
    axes: tuple[Axis, ...] = part("axes, in the order of the values in a row")

    @property
    def kind(self) -> str:
        """Name of the drive table with the firing times, such as "train"; empty if there is no such table."""
        return next((name for name in KINDS if name in self.drive), "")


@dataclass
class Maker:
    """Builder of members from rows of axis values; equal hammers and drives are built once.

    Raises
    ------
    InputError
        Raised by `member` if the values yield no valid hammer or drive, or a hammer without a rest state.
    """

    base: Base
    _hammers: dict[tuple[float, ...], Hammer] = field(default_factory=dict)
    _standards: dict[int, tuple[Waveform | None, Hashable]] = field(default_factory=dict)
    _drives: dict[tuple[Hashable, ...], Drive] = field(default_factory=dict)

    def member(self, row: Sequence[float]) -> Member:
        """Build the member with the given axis values, SI, one value for each axis."""
        hammer = self._hammer(row)
        drive = self._drive(row, hammer)
        end = self.base.duration
        if end is None:
            end = end_of(hammer, drive)
        return Member(hammer, drive, end, self._state(row, hammer))

    def members(self, rows: FloatArray, threads: int | None = None) -> tuple[IntArray, Members]:
        """Return the indices of the rows of axis values that yield valid members, and these members."""
        which: list[int] = []
        hammers: list[Hammer] = []
        states: list[tuple[float, float]] = []
        single: list[Drive] = []
        trains = self._trains(rows)
        for i, row in enumerate(rows.tolist()):
            try:
                hammer = self._hammer(row)
                drive = None if trains is not None else self._drive(row, hammer)
                states.append(self._state(row, hammer))
            except InputError:
                continue
            which.append(i)
            hammers.append(hammer)
            if drive is not None:
                single.append(drive)
        chosen = np.array(which, dtype=np.int64)
        drives = single if trains is None else trains.take(chosen)
        windows = None
        if self.base.duration is not None:
            ends = np.full(len(chosen), self.base.duration)
        else:
            waits, flights = windows_of(hammers, longest_waveforms(drives), threads)
            ends = firings_of(drives).last + waits
            windows = [Window(*each) for each in zip(waits.tolist(), flights.tolist(), strict=True)]
        return chosen, Members(hammers, drives, ends, np.array(states).reshape(-1, 2), windows)

    def _trains(self, rows: FloatArray) -> PulseTrains | None:
        """Return the drives of all rows as a batch; None unless all are trains that differ only in rate."""
        base, changed = self.base, [axis for axis in self.base.axes if axis.target in _OF_DRIVE]
        if base.kind != "train" or [axis.field for axis in changed] != [RATE] or "waveform" in base.drive:
            return None
        fired = base.waveform if base.waveform is not None else base.hammer.waveform
        own = base.waveform is None and any(axis.field.startswith("waveform.") for axis in base.axes)
        if fired is None or own:
            return None
        rates = rows[:, base.axes.index(changed[0])]
        try:
            first = self._drive(rows[0], base.hammer)
            overlap, start = first.overlap, float(first.times[0])
            return PulseTrains.at_rates(fired, rates, len(first.times), overlap, start)
        except InputError:
            # If the batch is invalid, rows are built one by one, to keep the valid rows.
            return None

    def _state(self, row: Sequence[float], hammer: Hammer) -> tuple[float, float]:
        x, v = self.base.state
        for axis, value in zip(self.base.axes, row, strict=True):
            if axis.target == "state":
                x, v = (float(value), v) if axis.field == "x" else (x, float(value))
        if x is None:
            x = hammer.rest
        return x, v or 0.0

    def _of(self, row: Sequence[float], *targets: str) -> dict[Axis, float]:
        pairs = zip(self.base.axes, row, strict=True)
        return {axis: float(value) for axis, value in pairs if axis.target in targets}

    def _hammer(self, row: Sequence[float]) -> Hammer:
        changes = {axis.field: value for axis, value in self._of(row, "hammer").items()}
        if not changes:
            return self.base.hammer
        key = tuple(changes.values())
        if key not in self._hammers:
            self._hammers[key] = self.base.hammer.replace(changes, source="axis of a sweep")
        return self._hammers[key]

    def _drive(self, row: Sequence[float], hammer: Hammer) -> Drive:
        changes = self._of(row, *_OF_DRIVE)
        key = (*changes.values(), self._standard(hammer)[1])
        if key in self._drives:
            return self._drives[key]
        tables = {
            name: dict(table) if isinstance(table, dict) else table for name, table in self._tables.items()
        }
        kind = self.base.kind
        for axis, value in changes.items():
            quantity = {"value": value, "unit": axis.note.si}
            if axis.target == "waveform":
                name, _, constant = axis.field.rpartition(".")
                if name:
                    own = dict(tables["waveforms"][name])
                    tables["waveforms"][name] = {**own, constant: quantity}
                else:
                    tables["waveform"][constant] = quantity
            elif axis.target == "drive":
                tables[kind][axis.field] = int(value) if axis.field in COUNTS else quantity
            else:
                times = list(tables[kind]["at"])
                times[int(axis.field)] = quantity
                tables[kind]["at"] = times
        self._drives[key] = drive_of(tables, self._standard(hammer)[0], folder=self.base.folder)
        return self._drives[key]

    @cached_property
    def _tables(self) -> dict[str, Any]:
        """Tables of the drive file, before the axes change them."""
        head: dict[str, Any] = {"format": FORMAT}
        head |= {name: value for name, value in self.base.drive.items() if not isinstance(value, Mapping)}
        tables = {name: table for name, table in self.base.drive.items() if isinstance(table, Mapping)}
        return tomllib.loads(document(head, tables))

    def _standard(self, hammer: Hammer) -> tuple[Waveform | None, Hashable]:
        """Return the waveform that the drive fires with a hammer, and a hashable key of the waveform; cached.

        Equal waveforms have equal keys. The waveform is that of the drive, by default that of the hammer.
        """
        if id(hammer) not in self._standards:
            fired = self.base.waveform if self.base.waveform is not None else hammer.waveform
            does = None if fired is None else (fired.quantity, fired.segments().tobytes())
            self._standards[id(hammer)] = fired, does
        return self._standards[id(hammer)]
