"""Compensation tables: feedforward of dots that are fired before the hammer has come to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.drive import (
    COLUMNS,
    JUMP,
    ROUNDING,
    Settings,
    checked_size,
    driven_by,
    entries_of,
    growing_text,
    histories,
    history_text,
    number_of,
    numbers_before,
    print_pulse,
    pulses_of,
    sequence,
)
from printhammer.control.table.formats import HEAD, OPTIONAL, columns, csv_head, read_table
from printhammer.control.table.header import (
    NANOSECOND,
    bits_of,
    header_text,
    look_ahead,
    size_of,
    whole_ticks,
)
from printhammer.drive.input import read_positive
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import nominal
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.declare import Column
from printhammer.results.files import csv_text, frame, plain
from printhammer.results.provenance import versions
from printhammer.results.result import Entries
from printhammer.results.summary import Cells, Grid, Summary
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.files import read_text, write_file

if TYPE_CHECKING:
    import pandas as pd

_NEAR: Final = 1e-9  # Rounding tolerance: relative for a rate, in s for a time; arbitrary
_CELLS: Final = "rate history"
ANY_UNIT: Final = "any"
"""Serial number that matches every unit, so that a table learned on one unit can drive other units."""


class CompensationTable(Result, rows=_CELLS, endings=(".csv", ".json", ".h", ".nc", ".zarr", ".parquet")):
    """Pulse width and advance as a function of the last gaps between dots, by rate and history.

    A dot with history h is fired `advance` before its slot, with a pulse of `width`. In the gap before the
    dot, `brake_delay` after the slot of the preceding dot, a brake pulse of `brake_width` stops the
    returning armature so that it does not rebound. The last dot is followed by the brake pulse of the entry
    "rest". Arrays have one column for each of the (reach + 1)**gaps history numbers, see
    `printhammer.control.table.drive`; the Dataset has one column for each distinct history.

    Raises
    ------
    InputError
        The values are not a valid table: a width is not positive, the rates do not ascend, or a firing would
        precede the end of the previous pulse.
    """

    hammer: str = part("name of the hammer that the table is made for")
    fingerprint: str = part("fingerprint of this hammer")
    rates: FloatArray = coordinate("Hz", "slot rate", "rate", name="rate", more="ascending")
    gaps: int = scalar("1", "number of gaps in a history")
    reach: int = scalar("1", "longest gap that counts, slots", more="a longer gap counts as rest")
    advance: FloatArray = column(
        "s",
        "time from the firing to the slot of the dot",
        _CELLS,
        more="negative if the dot is fired after its slot",
    )
    width: FloatArray = column("s", "width of the print pulse", _CELLS)
    brake_delay: FloatArray = column(
        "s",
        "time from the slot of the preceding dot to the brake pulse",
        _CELLS,
        more="0 without a brake pulse",
    )
    brake_width: FloatArray = column("s", "width of the brake pulse, 0 for none", _CELLS)
    deviation: FloatArray = column(
        "1",
        "largest deviation of force or arrival in tuning, as a fraction of the limits",
        _CELLS,
        more="NaN if unknown; 1 is exactly on the limit",
    )
    multiplier: FloatArray = column(
        "1",
        "multiplier of a small error from dot to dot where the history repeats",
        _CELLS,
        more="the geometric mean over a repetition; negative: the error alternates; NaN if unknown; see"
        " `printhammer.control.table.multipliers`",
    )
    largest_current: float = scalar("A", "current limit of the tuning")
    driver: str = scalar("", "driver of the coil, see `printhammer.control.table.drive`", default="own")
    serial: str = scalar(
        "", "serial number of the unit that the table was learned on", more="empty for all units", default=""
    )

    def __post_init__(self) -> None:
        checked_size(self.gaps, self.reach)
        rates = np.asarray(self.rates)
        if rates.ndim != 1 or not rates.size or not np.isfinite(rates).all() or rates[0] <= 0.0:
            raise InputError("rates: expected positive numbers, at least one", key="rates")
        if (np.diff(rates) <= 0.0).any():
            raise InputError("rates: expected ascending numbers", key="rates")
        shape = rates.size, entries_of(self.gaps, self.reach)
        for name in (*COLUMNS, "deviation", "multiplier"):
            if np.shape(getattr(self, name)) != shape:
                raise InputError(
                    f"{name}: an array of shape {np.shape(getattr(self, name))}", key=name, expected=shape
                )
        for row, rate in enumerate(rates.tolist()):
            for history in histories(self.gaps, self.reach):
                self._check(row, rate, history)

    def _check(self, row: int, rate: float, history: Sequence[int]) -> None:
        """Check an entry: values in range, and no pulse before the end of the previous pulse."""
        number = number_of(history, self.reach)
        values = {name: float(getattr(self, name)[row, number]) for name in COLUMNS}
        where = f"rate {rate:g} Hz, history {'-'.join(map(str, history))}"
        for name, value in values.items():
            if not np.isfinite(value):
                raise InputError.of(name, value, "a number", file=where, unit="s")
        if values["width"] <= 0.0:
            raise InputError.of("width", values["width"], "a positive number", file=where, unit="s")
        for name in ("brake_delay", "brake_width"):
            if values[name] < 0.0:
                raise InputError.of(name, values[name], "a number not below 0", file=where, unit="s")
        before = numbers_before(history, self.reach)
        # The preceding dot may have been fired late; its pulse must be over before the next pulse begins.
        over = float((self.width[row, before] - self.advance[row, before]).max())
        if values["brake_width"] > 0.0:
            if values["brake_delay"] < over - _NEAR:
                raise InputError.of(
                    "brake_delay",
                    values["brake_delay"],
                    f"a brake pulse after that of the dot before, which ends at {over:.6g} s",
                    file=where,
                    unit="s",
                )
            over = values["brake_delay"] + values["brake_width"]
        begun = history[0] / rate - values["advance"]
        if history[0] and begun < over - _NEAR:
            raise InputError(
                (
                    f"{where}: advance = {values['advance']!r} s fires {begun:.6g} s after the slot of the"
                    " dot before"
                ),
                file=where,
                key="advance",
                value=values["advance"],
                expected=f"a firing after its pulses have ended, at {over:.6g} s",
            )

    @property
    def worst(self) -> FloatArray:
        """Largest deviation at each rate, as a fraction of the limits, shape (rates,); NaN where unknown."""
        return np.asarray(self.deviation.max(axis=1))

    def at(self, rate: float | str) -> Settings:
        """Interpolate the table at a rate [Hz] or text with a unit.

        Between two rates of the table, each entry is interpolated linearly in the period. Where the brake
        pulses of the two entries differ, or one fires before a rebound and the other after it, the nearer
        entry is used unchanged.
        """
        asked = read_positive(rate, "Hz", "rate")
        low, high = float(self.rates[0]), float(self.rates[-1])
        if not low * (1.0 - _NEAR) <= asked <= high * (1.0 + _NEAR):
            span = f"{low:g} Hz" if low == high else f"{low:g} Hz to {high:g} Hz"
            raise InputError(
                f"rate = {asked:g} Hz: the table for {self.hammer!r} is made for {span}",
                key="rate",
                value=asked,
            )
        after = int(np.clip(np.searchsorted(self.rates, asked), 1, max(1, self.rates.size - 1)))
        first, second = after - 1, min(after, self.rates.size - 1)
        periods = 1.0 / self.rates[[first, second]]
        share = 0.0 if first == second else float((periods[0] - 1.0 / asked) / (periods[0] - periods[1]))
        share = min(max(share, 0.0), 1.0)
        low_row, high_row = (
            Settings(*(values[row] for values in self._times.values())) for row in (first, second)
        )
        return mixed(low_row, high_row, share)

    def fired_by(self, driver: str, hammer: Hammer) -> CompensationTable:
        """Return a copy for the coil driver `driver`, with dots that arrive as with the hammer's own driver.

        The present pulses must be tuned for `driver`; all are shifted by the difference between the flight
        times from rest with either driver.
        """
        if driver == self.driver:
            return self
        own = nominal(hammer, tolerance=DISPLAY_TOLERANCE).flight_time
        driven = driven_by(hammer, driver, self.largest_current)
        return self.delayed(own - nominal(driven, tolerance=DISPLAY_TOLERANCE).flight_time, driver, hammer)

    def delayed(self, later: float, driver: str, hammer: Hammer) -> CompensationTable:
        """Return a copy with all pulses delayed by `later` [s], labelled with a hammer and its driver."""
        delay = np.where(self.brake_width > 0.0, self.brake_delay + later, self.brake_delay)
        return replace(
            self,
            fingerprint=hammer.fingerprint,
            hammer=hammer.name,
            advance=self.advance - later,
            brake_delay=delay,
            driver=driver,
        )

    def strategy(self, hammer: Hammer, serial: str | None = None) -> TableStrategy:
        """Return the table as a drive strategy; see `printhammer.printing.dots.strategy.Strategy`.

        Parameters
        ----------
        hammer : Hammer
            The hammer for which the table was tuned. The strategy may then drive hammers that differ
            from this hammer.
        serial : str, optional
            Serial number of the driven unit; `ANY_UNIT` drives any unit with a table that was learned on one
            unit. A table that was not learned is valid for every unit.

        Raises
        ------
        InputError
            The table was tuned for a hammer with another fingerprint, was learned on another unit, or has
            pulses that exceed `largest_current`.
        """
        if self.serial and serial not in (self.serial, ANY_UNIT):
            unit = "no serial" if serial is None else f"serial = {serial!r}"
            raise InputError(
                f"serial = {unit}: the table was learned on unit {self.serial!r}",
                key="unit",
                value=unit,
                expected=f"this serial, or {ANY_UNIT!r} to drive another unit with it",
            )
        self.check_hammer(hammer)
        return TableStrategy(self, hammer)

    def check_hammer(self, hammer: Hammer) -> None:
        """Raise `InputError` unless the table was tuned for `hammer`."""
        if hammer.fingerprint != self.fingerprint:
            raise InputError(
                f"{hammer.path}: the table is made for another hammer, {self.hammer!r} of fingerprint"
                f" {self.fingerprint[:12]}",
                file=hammer.path,
                key="hammer",
                expected=f"{hammer.fingerprint[:12]}",
            )

    def drive(self, hammer: Hammer, slots: Sequence[int], rate: float | str) -> Drive:
        """Return the drive that prints dots in the slots with the ascending indices `slots`.

        Slot 0 is at `printhammer.printing.dots.strategy.FIRST_SLOT`. `hammer` and `rate` are as for
        `strategy` and `at`.
        """
        return self.strategy(hammer)(hammer, [tuple(slots)], read_positive(rate, "Hz", "rate"))[0]

    @property
    def title(self) -> str:
        """One-line title with the name of the hammer for which the table was tuned."""
        return f"compensation table for {self.hammer}"

    def summary(self) -> Summary:
        """Tabulate the entries at the highest rate, one row per history."""
        every = histories(self.gaps, self.reach)
        places = [number_of(history, self.reach) for history in every]
        advance, width, delay, brake, worst, growth = (
            getattr(self, name)[-1, places] for name in (*COLUMNS, "deviation", "multiplier")
        )
        columns = [
            Cells("gaps before", [history_text(history) for history in every], left=True),
            Cells("advance", advance, "s"),
            Cells("width", width, "s"),
            Cells("brake after", np.where(brake > 0.0, delay, np.nan), "s"),
            Cells("brake", np.where(brake > 0.0, brake, np.nan), "s"),
            Cells("known ahead\n[slots]", self.look_ahead[-1, places]),
            Cells("multiplier\nif repeated", growth, "", ".3f"),
            Cells("worst,\nof the limits", 100.0 * worst, "%", ".1f"),
        ]
        low, high, count = self.rates[0], self.rates[-1], self.rates.size
        span = f"{low:g} Hz to {high:g} Hz, {count} rates, at " if count > 1 else ""
        growing = growing_text(self.multiplier, self.rates, self.gaps, self.reach)
        return Summary(
            [Grid(columns, f"Table for {span}{high:g} Hz", most=12), *(["", growing] if growing else [])]
        )

    @property
    def look_ahead(self) -> IntArray:
        """Number of slots by which a dot must be known in advance, shape (rates, entries)."""
        times = {name: getattr(self, name) for name in COLUMNS}
        return look_ahead(times, self.rates, self.gaps, self.reach)

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the table: name and fingerprint of its hammer, and the software versions."""
        return {"hammer": self.hammer, "hammer_fingerprint": self.fingerprint, **versions()}

    def entries(self) -> Entries:
        """Return the Dataset variables, indexed by distinct history; a history is text such as "1-2-rest"."""
        every = histories(self.gaps, self.reach)
        numbers = [number_of(history, self.reach) for history in every]
        arrays = {
            name: (note, values[:, numbers] if note.kind == "column" else values)
            for name, (note, values) in super().entries().items()
        }
        meaning = "gaps to the dots before in slots, the latest first"
        note = Column("", meaning, ("history",), "coordinate", name="history")
        return {**arrays, "history": (note, np.array([history_text(history) for history in every]))}

    def to_dataframe(self) -> pd.DataFrame:
        """Return a data frame with one row per rate and history, and a column for each gap."""
        entries = self.entries()
        texts = np.array([text.split("-") for text in entries.pop("history")[1]])
        arrays: list[Any] = [(("rate",), self.rates), *((("history",), gap) for gap in texts.T)]
        arrays += [(note.dims, values) for note, values in entries.values() if note.kind == "column"]
        named = dict(zip(columns(self.gaps), arrays, strict=True))
        return frame(named, self.ROWS, plain(self.attributes))

    def to_csv(self) -> str:
        """Render the table as CSV text."""
        table = self.to_dataframe()
        # Metadata as comment lines, then numbers with the fewest digits that restore the same floats.
        rows = str(table.to_csv(index=False, header=False, lineterminator="\n"))
        return csv_head(self._head) + csv_text(table.iloc[:0]) + rows

    def to_header(self, tick: float | str = NANOSECOND, budget: int | None = None) -> str:
        """Render the table as a C header.

        Parameters
        ----------
        tick : float or str, optional
            Timer tick, s, or text with a unit: a whole number of nanoseconds; by default 1 ns. With longer
            ticks, times are 16-bit integers if they fit.
        budget : int, optional
            Largest size of the arrays, bytes.

        Raises
        ------
        InputError
            The tick is not a whole number of nanoseconds, or the table exceeds the budget.
        """
        unit, size = checked_tick(tick), self.size(tick)
        if budget is not None and size > budget:
            raise InputError(
                f"budget = {budget} bytes: the table takes {size}",
                key="budget",
                value=budget,
                expected="a larger budget, a longer tick, a shorter history, a shorter reach, or fewer rates",
            )
        rounded = self.quantised(unit)
        return header_text(self._head, self.rates, rounded._times, rounded.multiplier, unit)

    def size(self, tick: float | str = NANOSECOND) -> int:
        """Return the size, in bytes, of the C header's arrays for a timer tick (s, or text with a unit)."""
        bits = bits_of(self._times, checked_tick(tick))
        return size_of(self.rates.size, entries_of(self.gaps, self.reach), bits)

    def quantised(self, tick: float | str) -> CompensationTable:
        """Return a copy with times rounded to a timer tick (s, or text), and deviations set to NaN.

        The multipliers are unknown too, unless no time changes by more than 1 ns; see
        `printhammer.control.table.multipliers.with_multipliers`.
        """
        times: dict[str, Any] = whole_ticks(
            self._times, self.rates, self.gaps, self.reach, checked_tick(tick)
        )
        unknown = np.full_like(self.deviation, np.nan)
        moved = max(float(np.abs(times[name] - values).max()) for name, values in self._times.items())
        growth = self.multiplier if moved < NANOSECOND else unknown
        return replace(self, **times, deviation=unknown, multiplier=growth)

    @property
    def _times(self) -> dict[str, FloatArray]:
        return {name: getattr(self, name) for name in COLUMNS}

    @property
    def _head(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in (*HEAD, *OPTIONAL)}

    def save(self, path: str | Path) -> None:
        """Write the table in the format of the file suffix, such as a C header (.h), atomically.

        `load_table` reads CSV and JSON files.

        Raises
        ------
        InputError
            The suffix is not one of `ENDINGS`, or the file cannot be written.
        """
        texts = {".csv": self.to_csv, ".h": self.to_header}
        suffix = Path(path).suffix.lower()
        if suffix in texts:
            write_file(Path(path), texts[suffix]())
        else:
            super().save(path)


def mixed(first: Settings, second: Settings, share: float) -> Settings:
    """Interpolate linearly between two table settings, with weight `share` on the second setting.

    Where the brake pulses of two entries differ, or one fires before a rebound and the other after it, the
    nearer entry is used unchanged.
    """
    apart = np.abs(first.advance - second.advance) > JUMP
    apart |= (first.brake_delay != second.brake_delay) | (first.brake_width != second.brake_width)
    part = np.where(apart, float(share > 0.5), share)

    def between(low: FloatArray, high: FloatArray) -> FloatArray:
        # This form reproduces both end points to the last bit.
        upper = np.where(part == 1.0, high, (1.0 - part) * low + part * high)
        return np.asarray(np.where(part == 0.0, low, upper))

    return Settings(*map(between, first, second))


def checked_tick(tick: float | str) -> float:
    """Convert a tick to seconds; raise `InputError` unless the tick is a whole number of nanoseconds."""
    asked = read_positive(tick, "s", "tick")
    count = round(asked / NANOSECOND)
    if count < 1 or abs(asked / NANOSECOND - count) > _NEAR * count:
        raise InputError.of("tick", tick, "a whole number of nanoseconds")
    return count * NANOSECOND


class TableStrategy:
    """A compensation table as a drive strategy, created by `CompensationTable.strategy`.

    The pulses have the waveform of the table's hammer, with the widths of the table.
    """

    name = "table"

    def __init__(self, table: CompensationTable, hammer: Hammer) -> None:
        self.table = table
        driven = driven_by(hammer, table.driver, table.largest_current)
        self._pulse, widest = print_pulse(driven, table.largest_current)
        for name in ("width", "brake_width"):
            largest = float(getattr(table, name).max())
            if largest > widest * (1.0 + ROUNDING):
                raise InputError(
                    f"the table for {table.hammer!r} has a {name} of {largest:.9g} s",
                    key=name,
                    expected=f"at most {widest:.9g} s, so that the current is at most"
                    f" {table.largest_current:g} A",
                )

    def __call__(self, _hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> list[Drive]:
        """Return a drive for each pattern; the driven hammer does not affect the drives.

        Raises
        ------
        InputError
            The rate is outside the table, or a firing would precede the end of the previous pulse.
        """
        speed, table = read_positive(rate, "Hz", "rate"), self.table
        settings = table.at(speed)
        known: dict[tuple[float, float, float], Waveform] = {}
        every = (pulses_of(settings, table.gaps, table.reach, slots, speed) for slots in patterns)
        return [sequence(pulses, self._pulse, known) for pulses in every]


@checked
def load_table(path: str | Path) -> CompensationTable:
    """Read a compensation table from CSV or JSON; every value is restored to the last bit.

    Raises
    ------
    InputError
        The file cannot be read or is not a valid table; the message names file, key, value and expectation.
    """
    target = Path(path)
    if target.suffix.lower() not in (".csv", ".json"):
        raise InputError(f"{target}: expected a table whose name ends in .csv or .json", file=target)
    text = read_text(target, "the table")
    try:
        return CompensationTable(**read_table(text, target.suffix.lower()))
    except InputError as error:
        raise error.within(target) from None
