"""Measured frequency-time maps: displacement records at several firing rates, from CSV, NetCDF or Zarr.

Hendriks (1983) suggested such maps: "It is hoped that similar plots, derived from experimental displacement
plots, will become available in the future."

Two layouts of CSV tables are accepted, each with units in the heading, SI or any other:

- one row per sample: the columns ``rate [Hz],time [us],displacement [um]``, in any order;
- one row per time: ``time [us]``, then one column per rate, such as ``500 Hz [um],1.2 kHz [um]``.

Times are measured from the first firing. Rows may be in any order, and each rate may have different times. An
empty cell, or nan, is a missing value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError, missing_extra
from printhammer.maps.frequency import interpolated, map_dataset
from printhammer.results import Declared, column, scalar
from printhammer.results.files import need_for
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.columns import Columns
from printhammer.support.tables.layout import Heading, Table, read_layout
from printhammer.support.tables.readings import Readings, columns_of, readings_of
from printhammer.units import parse, to_si

if TYPE_CHECKING:
    import xarray as xr

_SI: Final = {"rate": "Hz", "time": "s", "displacement": "m"}
_HEADINGS: Final = (
    "'rate [Hz],time [us],displacement [um]', or 'time [us]' and a column such as '500 Hz [um]' for each rate"
)


class RateRecord(Declared):
    """Displacement samples of a measured map at one firing rate."""

    rate: float = scalar("Hz", "firing rate")
    times: FloatArray = column("s", "times from the first firing, ascending", "sample")
    displacement: FloatArray = column("m", "displacement", "sample", more="NaN for a gap")


def read_records(path: Path, columns: str | None = None) -> list[RateRecord]:
    """Read the displacement records of a CSV table, in ascending order of rate.

    Raises
    ------
    InputError
        The file cannot be read, its heading matches neither layout, a cell is not a number, or a time is
        repeated for one rate.
    """
    told = columns_of(path, columns)
    table = read_layout(path, "the measured map")
    names = list(told.sources) if told else [column.name for column in table.columns]
    if any(name.lower() == "rate" for name in names):
        records = _one_row_a_sample(readings_of(table, _SI, gaps=("displacement",), columns=told))
    else:
        records = _one_column_a_rate(table, names, told)
    return sorted(records, key=lambda record: record.rate)


def checked(
    what: str, rate: float, times: FloatArray, displacement: FloatArray, places: Sequence[str]
) -> RateRecord:
    """Validate the samples at one firing rate [Hz]; return them as a record sorted by time.

    The samples are displacements [m] at `times` [s], in any order. `what` is the name of the file and
    `places` the line or row of each sample in the file; both appear in error messages.

    Raises
    ------
    InputError
        The rate is not positive, a time is repeated, or fewer than two displacements are known.
    """
    if not (math.isfinite(rate) and rate > 0.0):
        raise InputError(
            f"{what}: {places[0]}: rate {rate:.9g} Hz",
            expected="greater than 0 Hz",
            file=what,
            key="rate",
            value=rate,
        )
    order = np.argsort(times, kind="stable")
    at, x = times[order], displacement[order]
    twice = np.flatnonzero(np.diff(at) == 0.0)
    if twice.size:
        first, second = (places[order[twice[0] + k]] for k in (0, 1))
        raise InputError(
            f"{what}: {second}: time {at[twice[0]]:.9g} s at {rate:.9g} Hz occurs before, in {first}",
            file=what,
            key="time",
            expected="one displacement for each time",
        )
    known = int(np.isfinite(x).sum())
    if known < 2:
        raise InputError(
            f"{what}: {known} displacements at {rate:.9g} Hz", file=what, key="rate", expected="at least 2"
        )
    return RateRecord(rate, at, x)


def _one_row_a_sample(table: Readings) -> list[RateRecord]:
    rate, time, x = (table.values[name] for name in _SI)
    records = []
    for value in np.unique(rate):
        rows = np.flatnonzero(rate == value)
        places = [f"line {line}" for line in table.lines[rows]]
        records.append(checked(str(table.path), float(value), time[rows], x[rows], places))
    return records


def _one_column_a_rate(table: Table, names: list[str], told: Columns | None) -> list[RateRecord]:
    rates: dict[str, float] = {}
    for place, name in enumerate(names):
        numbered = told is None and table.clock is not None and place == table.clock.numbers
        if not name or Heading(name).quantity or numbered:
            continue
        try:
            rate = parse(name, "Hz")
        except InputError:
            number = told.sources[name].place if told else place + 1
            raise InputError(
                f"{table.where}: {name!r}, the name of column {number}, is not a firing rate",
                file=table.where,
                key=name,
                value=name,
                expected=f"{_HEADINGS}, or --columns such as 'time=1, 500 Hz={number}*50 um/V'",
            ) from None
        if rate in rates.values():
            raise InputError(
                f"{table.where}: column {name!r}: the rate {rate:.9g} Hz has two columns",
                file=table.where,
                key=name,
            )
        rates[name if told else name.lower()] = rate
    if not rates:
        raise InputError(
            f"{table.where}: no column is named by a rate",
            file=table.where,
            key="rate",
            expected=f"{_HEADINGS}, or --columns such as 'time=1, 500 Hz=2*50 um/V'",
        )
    wanted = {"time": "s", **dict.fromkeys(rates, "m")}
    found = readings_of(table, wanted, gaps=list(rates), columns=told)
    times = found.values["time"]
    places = [f"line {line}" for line in found.lines]
    return [checked(table.where, rate, times, found.values[name], places) for name, rate in rates.items()]


MOST_TIMES: Final = 8192
"""Largest number of times in the common time grid of a map, beyond which the grid is coarsened; arbitrary."""

_CLASSIC, _HDF5 = b"CDF", b"\x89HDF"


def load_measured_map(
    path: str | Path, *, times: npt.ArrayLike | None = None, columns: str | None = None
) -> xr.Dataset:
    """Read a measured map from a file, in the layout of `printhammer.frequency_map`.

    Parameters
    ----------
    path : path
        A CSV file (`printhammer.maps.measured`), or a NetCDF file or Zarr store with the variables `rate`,
        `time` and `displacement`, each with any unit in the attribute `units`. `displacement` has
        the dimension `rate` and a second dimension; `time` has only the second dimension, or both if the
        rates have different times.
    times : array, optional
        Times since the first firing [s], ascending, at which the records are interpolated linearly. By
        default the sample times, if they are the same for all rates; otherwise evenly spaced times, with the
        smallest median sample spacing of any record.
    columns : str, optional
        Declaration of the columns of a CSV file, such as "time=1, 500 Hz=2*50 um/V"; by default the
        declaration in a companion file, or else the heading of the table; see
        `printhammer.support.tables.columns`.

    Returns
    -------
    xarray.Dataset
        `displacement` [m, float32] over `rate` [Hz] and `time` [s]; NaN in gaps of a record, and before its
        start and after its end. The Dataset contains no dots.

    Raises
    ------
    InputError
        The file cannot be read or its content is not a map; the message names file, column and line.
    """
    source = Path(path)
    stored = source.suffix.lower() == ".zarr" or _magic(source).startswith((_CLASSIC, _HDF5))
    records = _stored_records(source) if stored else read_records(source, columns)
    grid = _common_times(records) if times is None else _checked_times(times)
    rows = np.stack([interpolated(record.times, record.displacement, grid) for record in records])
    attributes = {
        "title": f"measured frequency-time map, {source.name}",
        "source": source.name,
        "samples": int(sum(np.isfinite(record.displacement).sum() for record in records)),
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    rates = np.array([record.rate for record in records])
    return map_dataset(rates, grid, {"displacement": rows.astype(np.float32)}, attributes)


def _magic(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4)
    except OSError as error:
        raise InputError(
            f"{path}: the measured map cannot be read ({error.strerror or error})", file=path
        ) from None


def _checked_times(times: npt.ArrayLike) -> FloatArray:
    grid = np.array(times, dtype=np.float64).reshape(-1)
    if not grid.size or not np.isfinite(grid).all() or (np.diff(grid) <= 0.0).any():
        raise InputError("times: expected ascending numbers, s", key="times")
    return grid


def _common_times(records: list[RateRecord]) -> FloatArray:
    first = records[0].times
    if all(np.array_equal(record.times, first) for record in records[1:]):
        return first
    start = min(float(record.times[0]) for record in records)
    end = max(float(record.times[-1]) for record in records)
    closest = min(float(np.median(np.diff(record.times))) for record in records)
    # Allow for rounding, so that the grid of evenly spaced samples is the samples themselves.
    count = int(min(np.ceil((end - start) / closest * (1.0 - 1e-9)), MOST_TIMES - 1)) + 1
    return np.linspace(start, end, count)


def _stored_records(path: Path) -> list[RateRecord]:
    what = str(path)
    with _opened(path) as stored:
        values = {name: _variable(stored, what, name) for name in _SI}
        dimensions = {name: tuple(map(str, stored[name].dims)) for name in _SI}
    rates, times, x = values["rate"], values["time"], values["displacement"]
    over = dimensions["displacement"]
    if len(over) != 2 or "rate" not in over or dimensions["rate"] != ("rate",):
        raise InputError(
            f"{what}: displacement lies over {', '.join(over) or 'nothing'}",
            file=what,
            key="displacement",
            expected="rate and one more dimension",
        )
    if over[0] != "rate":
        x, over = x.T, over[::-1]
    if dimensions["time"] == over[1:]:
        times = np.broadcast_to(times, x.shape)
    elif dimensions["time"] == over[::-1]:
        times = times.T
    elif dimensions["time"] != over:
        raise InputError(
            f"{what}: time lies over {', '.join(dimensions['time']) or 'nothing'}",
            file=what,
            key="time",
            expected=f"{over[1]}, or rate and {over[1]}",
        )
    records: dict[float, RateRecord] = {}
    for row, rate in enumerate(rates):
        known = np.isfinite(times[row])
        where = f"row {row + 1}"
        if not known.any() or float(rate) in records:
            raise InputError(
                f"{what}: {where}: rate {rate:.9g} Hz has no times or occurs twice",
                file=what,
                key=where,
                expected="one record for each rate",
            )
        places = [f"{where}, sample {k + 1}" for k in np.flatnonzero(known)]
        records[float(rate)] = checked(what, float(rate), times[row][known], x[row][known], places)
    return [records[rate] for rate in sorted(records)]


def _opened(path: Path) -> Any:
    import xarray as xr

    if path.suffix.lower() == ".zarr":
        need_for(path)
        # Consolidated metadata may be missing; each array always has metadata.
        options: dict[str, Any] = {"engine": "zarr", "consolidated": False}
    elif _magic(path).startswith(_CLASSIC):
        options = {"engine": "scipy"}
    else:
        options = {"engine": "h5netcdf"}
        if find_spec("h5netcdf") is None or find_spec("h5py") is None:
            raise missing_extra(f"{path}: NetCDF-4 files need h5netcdf and h5py", "netcdf")
    try:
        return xr.open_dataset(path, decode_times=False, **options)
    except Exception as error:  # noqa: BLE001 - the backends raise exceptions of any type
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: the measured map cannot be read ({reason[:200]})", file=path) from None


def _variable(stored: xr.Dataset, what: str, name: str) -> FloatArray:
    if name not in stored.variables:
        there = ", ".join(map(str, stored.variables)) or "nothing"
        raise InputError(f"{what}: expected the variable {name}; the file has {there}", file=what, key=name)
    unit = stored[name].attrs.get("units")
    if not isinstance(unit, str):
        raise InputError(
            f"{what}: {name} has no unit",
            expected=f"the attribute units, such as {_SI[name]!r}",
            file=what,
            key=name,
        )
    try:
        factor = to_si(1.0, unit, _SI[name])
        values = np.asarray(stored[name].values, dtype=np.float64) * factor
    except InputError as error:
        raise error.within(f"{what}: {name}", file=what, key=name) from None
    except (OSError, TypeError, ValueError):
        raise InputError(
            f"{what}: {name}", file=what, key=name, expected="numbers that can be read"
        ) from None
    if np.isinf(values).any():
        raise InputError(f"{what}: {name}", file=what, key=name, expected="finite numbers, or nan for a gap")
    return values
