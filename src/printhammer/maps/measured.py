"""Measured frequency-time maps: displacement records at several firing rates, from CSV, NetCDF or Zarr.

Hendriks (1983) hoped for them: "It is hoped that similar plots, derived from experimental displacement plots,
will become available in the future."
"""

from __future__ import annotations

from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError, missing_extra
from printhammer.maps.layout import interpolated, map_dataset
from printhammer.maps.records import RateRecord, checked, read_records
from printhammer.results.files import need_for
from printhammer.support.arrays import FloatArray
from printhammer.units import to_si

if TYPE_CHECKING:
    import xarray as xr

MOST_TIMES: Final = 8192
"""Number of times of a common grid above which it is made coarser."""

_CLASSIC, _HDF5 = b"CDF", b"\x89HDF"
_SI: Final = {"rate": "Hz", "time": "s", "displacement": "m"}


def load_measured_map(path: str | Path, *, times: npt.ArrayLike | None = None) -> xr.Dataset:
    """Read a measured map, in the layout of `printhammer.frequency_map`.

    Parameters
    ----------
    path : path
        A CSV file, see `printhammer.maps.records`; or a NetCDF file or Zarr store with the variables `rate`,
        `time` and `displacement`, each with its unit in the attribute `units`, any unit. There,
        `displacement` lies over `rate` and one more dimension, and `time` over that one, or over both where
        every rate has times of its own.
    times : array, optional
        Times from the first firing, s, ascending, to which the records are brought by straight lines between
        samples. By default those of the samples if all rates have the same ones; otherwise even ones, as
        close as the samples of the closest record.

    Returns
    -------
    xarray.Dataset
        `displacement` [m, float32] over `rate` [Hz] and `time` [s]; NaN in gaps, and before and after a
        record. What the firings did is not known.

    Raises
    ------
    InputError
        The file cannot be read or holds something else; the message names file, column and line.
    """
    source = Path(path)
    stored = source.suffix.lower() == ".zarr" or _magic(source).startswith((_CLASSIC, _HDF5))
    records = _stored_records(source) if stored else read_records(source)
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
    # Room for the last bit, so that even samples make the grid that they are on.
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
                f"{what}: {where}: rate {rate:.9g} Hz has no times or is given twice",
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
        # Metadata in one place are there or not; each array's own always are.
        options: dict[str, Any] = {"engine": "zarr", "consolidated": False}
    elif _magic(path).startswith(_CLASSIC):
        options = {"engine": "scipy"}
    else:
        options = {"engine": "h5netcdf"}
        if find_spec("h5netcdf") is None or find_spec("h5py") is None:
            raise missing_extra(f"{path}: NetCDF-4 files need h5netcdf and h5py", "netcdf")
    try:
        return xr.open_dataset(path, decode_times=False, **options)
    except Exception as error:  # noqa: BLE001 - the backends raise what they like
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: the measured map cannot be read ({reason[:200]})", file=path) from None


def _variable(stored: xr.Dataset, what: str, name: str) -> FloatArray:
    if name not in stored.variables:
        there = ", ".join(map(str, stored.variables)) or "nothing"
        raise InputError(f"{what}: expected the variable {name}, there is {there}", file=what, key=name)
    unit = stored[name].attrs.get("units")
    if not isinstance(unit, str):
        raise InputError(
            f"{what}: {name} is expected to carry its unit in the attribute units, such as {_SI[name]!r}",
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
            f"{what}: {name} is expected to hold numbers that can be read", file=what, key=name
        ) from None
    if np.isinf(values).any():
        raise InputError(
            f"{what}: {name} is expected to hold finite numbers, or nan for a gap", file=what, key=name
        )
    return values
