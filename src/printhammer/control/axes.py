"""Compensation tables along one axis: rail voltage, coil temperature, pack distance or pack thickness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.pulses import current_bound, of_width
from printhammer.control.table.compensation import CompensationTable, TableStrategy, checked_tick, mixed
from printhammer.control.table.drive import (
    COLUMNS,
    Settings,
    driven_by,
    of_force,
    print_pulse,
    with_pulse,
)
from printhammer.control.table.formats import HEAD, OPTIONAL
from printhammer.control.table.header import NANOSECOND, bits_of, header_text, size_of
from printhammer.control.table.multipliers import history_multipliers
from printhammer.control.table.tuning import tune
from printhammer.drive.input import read_number
from printhammer.errors import InputError, located
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.variability import Perturbation, perturbed
from printhammer.results import save_dataset
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
)
from printhammer.run.effort import DISPLAY, Effort
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.support.files import write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_MILLIONTH: Final = 1e-6  # Resolution of axis values other than lengths in a C header; arbitrary


@dataclass(frozen=True)
class Axis:
    """Axis of a family of compensation tables: an operating condition, e.g. rail voltage."""

    unit: str
    meaning: str
    change: Callable[[Hammer, float], Hammer]


def _on_rail(hammer: Hammer, value: float) -> Hammer:
    """Return a copy of the hammer whose driver has the rail voltage `value` [V]."""
    _check_driver(hammer, "rail")
    return hammer.replace("waveform.voltage", value)


def _warm(hammer: Hammer, value: float) -> Hammer:
    """Return a copy of the hammer with the coil temperature `value` [degC]."""
    _check_driver(hammer, "temperature")
    return hammer.replace("coil.temperature", value)


def _check_driver(hammer: Hammer, axis: str) -> None:
    if not hasattr(hammer.waveform, "voltage"):
        raise InputError.of(
            "axis", axis, "a hammer whose [waveform] is a driver on a rail, such as 'rail'", file=hammer.path
        )


AXES: Final = {
    "rail": Axis("V", "voltage of the supply", _on_rail),
    "temperature": Axis("degC", "temperature of the coil", _warm),
    "gap": Axis(
        "m",
        "distance by which pack and platen move away",
        lambda hammer, value: perturbed(hammer, Perturbation(travel=value)),
    ),
    "forms": Axis(
        "1",
        "relative change of the thickness of the pack",
        lambda hammer, value: perturbed(hammer, Perturbation(forms=value)),
    ),
}


@dataclass(frozen=True)
class AxisTables:
    """Compensation tables at ascending values of an operating condition (the axis), with interpolation."""

    axis: str
    values: tuple[float, ...]
    tables: tuple[CompensationTable, ...]

    def at(self, value: float | str) -> CompensationTable:
        """Interpolate the tables linearly at an axis value, entry by entry.

        Where the entries of the two neighbouring tables belong to different solution branches (see
        `printhammer.control.table.compensation.mixed`), the entry of the nearer table is used unchanged.
        """
        asked = read_number(value, AXES[self.axis].unit, self.axis)
        least, most = self.values[0], self.values[-1]
        if not least <= asked <= most:
            raise InputError(
                f"{self.axis} = {asked:g}: the tables are made for {least:g} to {most:g}",
                key=self.axis,
                value=asked,
            )
        after = int(np.clip(np.searchsorted(self.values, asked), 1, len(self.values) - 1))
        first, second = self.tables[after - 1 : after + 1]
        share = (asked - self.values[after - 1]) / (self.values[after] - self.values[after - 1])
        low, high = (Settings(*(getattr(table, name) for name in COLUMNS)) for table in (first, second))
        times: dict[str, Any] = mixed(low, high, share)._asdict()
        unknown = np.full_like(first.deviation, np.nan)
        return replace(first, **times, deviation=unknown, multiplier=unknown)

    def strategy(self, hammer: Hammer, value: float | str) -> TableStrategy:
        """Return the drive strategy for an axis value, with the table and the pulses of that value.

        `hammer` is the hammer for which the tables were tuned.
        """
        table = self.at(value)
        table.check_hammer(hammer)
        place = read_number(value, AXES[self.axis].unit, self.axis)
        other = AXES[self.axis].change(hammer, place)
        pulse = other.waveform
        if pulse is not None and pulse.quantity == "voltage":
            other = with_pulse(other, of_width(pulse, float(table.width[0, 0])))
        return TableStrategy(table, other)

    def to_header(self, tick: float | str = NANOSECOND, budget: int | None = None) -> str:
        """Render the tables as a C header with arrays indexed `[value][rate][history]`.

        Axis values that are lengths are in nanometres, other axis values in millionths of the SI unit. A C
        function interpolates between them.
        """
        unit, first = checked_tick(tick), self.tables[0]
        rounded = self.quantised(unit).tables
        times = {name: np.stack([getattr(table, name) for table in rounded]) for name in COLUMNS}
        size = self.size(tick)
        if budget is not None and size > budget:
            raise InputError(
                f"budget = {budget} bytes: the tables take {size}",
                key="budget",
                value=budget,
                expected="a larger budget or fewer",
            )
        scale = NANOSECOND if AXES[self.axis].unit == "m" else _MILLIONTH
        head = {name: getattr(first, name) for name in (*HEAD, *OPTIONAL)}
        along = self.axis, np.rint(np.array(self.values) / scale)
        growth = np.stack([table.multiplier for table in rounded])
        return header_text(head, first.rates, times, growth, unit, along)

    def quantised(self, tick: float | str) -> AxisTables:
        """Return a copy with all times rounded to multiples of a timer tick (s, or text with a unit)."""
        return replace(self, tables=tuple(table.quantised(tick) for table in self.tables))

    def with_multipliers(self, hammer: Hammer, effort: Effort = DISPLAY) -> AxisTables:
        """Return a copy with the dot-to-dot multipliers of all histories in each table.

        The multipliers are computed for the hammer at the axis value of the table; see
        `printhammer.control.table.multipliers`.
        """
        change = AXES[self.axis].change
        tables = [
            replace(
                table,
                multiplier=history_multipliers(
                    table, self.strategy(hammer, value), change(hammer, value), effort.quiet
                ),
            )
            for value, table in zip(self.values, self.tables, strict=True)
        ]
        return replace(self, tables=tuple(tables))

    def size(self, tick: float | str = NANOSECOND) -> int:
        """Return the size, in bytes, of the C header's arrays for a timer tick (s, or text with a unit)."""
        times = {name: np.stack([getattr(table, name) for table in self.tables]) for name in COLUMNS}
        bits, first = bits_of(times, checked_tick(tick)), self.tables[0]
        return size_of(first.rates.size, times[COLUMNS[0]].shape[-1], bits, len(self.values))

    def to_dataframe(self) -> pd.DataFrame:
        """Return the rows of all tables as a data frame, with the axis value as first column."""
        import pandas as pd

        head = f"{self.axis} [{AXES[self.axis].unit}]"
        parts = [table.to_dataframe() for table in self.tables]
        for part, value in zip(parts, self.values, strict=True):
            part.insert(0, head, value)
        return pd.concat(parts, ignore_index=True)

    def to_dataset(self) -> xr.Dataset:
        """Return all tables as a Dataset, with the axis as first dimension."""
        import xarray as xr

        along = xr.DataArray(np.array(self.values), dims=self.axis, name=self.axis)
        along.attrs = {"units": AXES[self.axis].unit, "long_name": AXES[self.axis].meaning}
        parts = [table.to_dataset() for table in self.tables]
        return xr.concat(parts, along, combine_attrs="drop_conflicts")

    def save(self, path: str | Path, *, tick: float | str = NANOSECOND, budget: int | None = None) -> None:
        """Write the tables as a C header (.h), or as .csv, .json, .nc, .zarr or .parquet, by the file suffix.

        In a header, times are whole multiples of `tick` [s], and the arrays must fit into `budget` bytes.
        """
        suffix = Path(path).suffix.lower()
        if suffix == ".h":
            write_file(Path(path), self.to_header(tick, budget))
        elif suffix == ".csv":
            write_file(Path(path), str(self.to_dataframe().to_csv(index=False, lineterminator="\n")))
        else:
            save_dataset(self.to_dataset(), path)

    def summary(self) -> Summary:
        """Tabulate width and advance from rest and the largest deviation of a dot, one row per axis value."""
        columns = [
            Cells(self.axis, self.values, AXES[self.axis].unit, ".6g"),
            Cells("width from rest", [float(table.width[0, 0]) for table in self.tables], "s"),
            Cells("advance from rest", [float(table.advance[0, 0]) for table in self.tables], "s"),
            Cells(
                "worst,\nof the limits",
                [100.0 * float(table.deviation.max()) for table in self.tables],
                "%",
                ".1f",
            ),
        ]
        title = f"Tables along the {self.axis} at {self.tables[0].rates[0]:g} Hz"
        return Summary([Grid(columns, title, most=24)])


def tune_along(
    hammer: Hammer,
    axis: str,
    values: Sequence[float | str],
    *,
    rate: float | str,
    driver: str = "own",
    largest_current: float | str | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> AxisTables:
    """Tune a table for each axis value, so that every dot equals the nominal hammer's single-pulse dot.

    Parameters
    ----------
    hammer, rate, driver, largest_current, progress, options
        As for `printhammer.tune`.
    axis : str
        Name of the axis, a key of `AXES`.
    values : sequence of float or str
        Ascending values, SI, or text with units; at least two.

    Raises
    ------
    InputError
        The axis is unknown or the values do not ascend; for other errors see `printhammer.tune`.
    """
    if axis not in AXES:
        raise InputError.of("axis", axis, f"one of {', '.join(AXES)}")
    places = tuple(read_number(value, AXES[axis].unit, axis) for value in values)
    if len(places) < 2 or any(second <= first for first, second in pairwise(places)):
        raise InputError.of(axis, list(values), "two values or more that ascend")
    largest = current_bound(hammer, largest_current)
    design = driven_by(hammer, driver, largest)
    known, own = nominal(design, tolerance=DISPLAY_TOLERANCE), nominal(hammer, tolerance=DISPLAY_TOLERANCE)
    fired = []
    for place in places:
        with located(f"{axis} = {place:g} {AXES[axis].unit}", key=axis):
            other = AXES[axis].change(design, place)
            pulse: Any = other.waveform
            fired.append(of_force(other, pulse, known.force, 0.5 * pulse.width, 1.5 * pulse.width))
            print_pulse(fired[-1], largest)
    tables = []
    for number, other in enumerate(fired):

        def count(step: int, total: int, done: int = number) -> None:
            if progress is not None:
                progress(done * total + step, len(fired) * total)

        table = tune(other, rate=rate, largest_current=largest, progress=count, **options)
        later = own.flight_time - nominal(other, tolerance=DISPLAY_TOLERANCE).flight_time
        tables.append(table.delayed(later, driver, hammer))
    return AxisTables(axis, places, tuple(tables))
