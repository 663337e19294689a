"""The Dataset of a frequency-time map: its variables, their units, and files that hold it.

Computed and measured maps have the same layout. `displacement` [m] lies over the dimensions `rate` [Hz] and
`time` [s, from the first firing on]; what the firings did lies over `rate` and `firing`, and is only known of
computed maps. A missing number is NaN.
"""

from __future__ import annotations

import shutil
import tempfile
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from warnings import catch_warnings, simplefilter

import numpy as np

from printhammer.errors import InputError
from printhammer.support.outputs import write_dataset

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy.typing as npt
    import xarray as xr

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

ZARR: Final = ".zarr"
FILES: Final = (".nc", ZARR)
"""Endings of the files that a map is written to."""

UNITS: Final = {
    "rate": ("Hz", "firing rate"),
    "time": ("s", "time from the first firing"),
    "firing": ("1", "number of the firing"),
    "displacement": ("m", "displacement of the armature"),
    "fired_at": ("s", "time of the firing"),
    "struck": ("1", "whether the firing made a dot"),
    "flight_time": ("s", "time from firing to touch of the pack"),
    "peak_force": ("N", "largest pack force of the dot"),
    "status": ("1", "how the run ended"),
}
"""Units and meanings of the variables of a map, by name."""

DIMENSIONS: Final = {
    "displacement": ("rate", "time"),
    "fired_at": ("rate", "firing"),
    "struck": ("rate", "firing"),
    "flight_time": ("rate", "firing"),
    "peak_force": ("rate", "firing"),
    "status": ("rate",),
}
"""Dimensions of the variables of a map, by name."""

PLACES: Final = {"backstop": "backstop_m", "pack": "pack_front_m", "platen": "platen_m"}
"""Attributes of a map that hold the positions of the hammer, m, by the names of the places."""


def map_dataset(
    rates: npt.ArrayLike,
    times: npt.ArrayLike,
    variables: Mapping[str, npt.NDArray[Any]],
    attributes: Mapping[str, Any],
    notes: Mapping[str, Mapping[str, str]] | None = None,
) -> xr.Dataset:
    """Return a map as a Dataset.

    Parameters
    ----------
    rates : array, shape (R,)
        Firing rates, Hz.
    times : array, shape (T,)
        Times from the first firing, s.
    variables : mapping
        Arrays by name, SI, of the dimensions in `DIMENSIONS`; `displacement` among them.
    attributes : mapping
        Attributes of the set: texts and numbers.
    notes : mapping, optional
        Further attributes of single variables, by name.

    Returns
    -------
    xarray.Dataset
        With `units` and `long_name` in the attributes of every variable and coordinate.
    """
    import xarray as xr

    more = notes or {}

    def entry(name: str, dimensions: tuple[str, ...], values: npt.NDArray[Any]) -> Any:
        unit, meaning = UNITS[name]
        return dimensions, values, {"units": unit, "long_name": meaning, **more.get(name, {})}

    coordinates = {
        "rate": entry("rate", ("rate",), np.asarray(rates, dtype=np.float64)),
        "time": entry("time", ("time",), np.asarray(times, dtype=np.float64)),
    }
    if "fired_at" in variables:
        firings = np.arange(variables["fired_at"].shape[1], dtype=np.int32)
        coordinates["firing"] = entry("firing", ("firing",), firings)
    data = {name: entry(name, DIMENSIONS[name], values) for name, values in variables.items()}
    return xr.Dataset(data, coords=coordinates, attrs=dict(attributes))


def places_of(chart: xr.Dataset) -> dict[str, float]:
    """Return the positions that a map knows of "backstop", "pack" and "platen", m, in this order."""
    return {name: float(chart.attrs[key]) for name, key in PLACES.items() if key in chart.attrs}


def failed_rates(chart: xr.Dataset) -> dict[str, list[float]]:
    """Return the rates of a map, Hz, at which the run did not reach its end, by the name of the status."""
    if "status" not in chart:
        return {}
    codes = str(chart["status"].attrs.get("codes", ""))
    names = dict(part.split(" ", 1) for part in codes.split(", ") if " " in part)
    found: dict[str, list[float]] = {}
    for code, rate in zip(chart["status"].values.tolist(), chart["rate"].values.tolist(), strict=True):
        if code != 0:
            found.setdefault(names.get(str(code), str(code)), []).append(rate)
    return found


def hammer_attributes(hammer: Hammer) -> dict[str, Any]:
    """Return what a map says about its hammer: name, fingerprint, how its constants came about, places."""
    statuses = {constant.status for constant in hammer.constants.values()}
    guessed = [status for status in ("reconstructed", "assumed") if status in statuses]
    places = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
    return {
        "hammer": hammer.name,
        "hammer_fingerprint": hammer.fingerprint,
        "hammer_constants": f"in part {' and '.join(guessed)}" if guessed else "measured or stated",
        **{PLACES[name]: float(place) for name, place in places.items() if place is not None},
    }


def save_map(chart: xr.Dataset, path: str | Path) -> None:
    """Write a map as NetCDF (.nc) or as a Zarr store (.zarr); what was there stays if anything fails.

    Raises
    ------
    InputError
        The name ends in neither, the file cannot be written, or zarr is not installed.
    """
    target = Path(path)
    if target.suffix.lower() == ZARR:
        _save_zarr(chart, target)
    elif target.suffix.lower() == ".nc":
        write_dataset(target, chart)
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(FILES)}")


def _save_zarr(chart: xr.Dataset, target: Path) -> None:
    need_zarr(target)
    if target.exists() and not (target / "zarr.json").is_file():
        raise InputError(f"{target}: expected a new store, this is no Zarr store")
    draft: Path | None = None
    try:
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
        with catch_warnings():
            # Metadata in one place spare readers a warning; each array has its own as well.
            simplefilter("ignore", UserWarning)
            chart.to_zarr(draft / target.name, mode="w", zarr_format=3, consolidated=True)
        if target.exists():
            target.rename(draft / "before")
        (draft / target.name).rename(target)
    except OSError as error:
        raise InputError(f"{target}: the store cannot be written ({error.strerror or error})") from None
    finally:
        if draft is not None:
            if (draft / "before").exists() and not target.exists():
                (draft / "before").rename(target)
            with suppress(OSError):
                shutil.rmtree(draft)


def need_zarr(path: Path) -> None:
    """Make sure that zarr is there.

    Raises
    ------
    InputError
        It is not installed.
    """
    if find_spec("zarr") is None:
        raise InputError(f"{path}: Zarr stores need zarr, which the extra printhammer[sweep] installs")


def matching(chart: xr.Dataset, other: xr.Dataset) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the rows of two maps that have the same rate, up to a part in 10^9."""
    here, there = chart["rate"].values, other["rate"].values
    nearest = np.abs(here[:, np.newaxis] - there).argmin(axis=1)
    same = np.isclose(here, there[nearest], rtol=1e-9, atol=0.0)
    return np.flatnonzero(same), nearest[same]


def on_times(chart: xr.Dataset, row: int, times: FloatArray) -> FloatArray:
    """Return the displacement of one rate of a map, m, at other times, s; NaN beside gaps and outside."""
    return interpolated(chart["time"].values, chart["displacement"].values[row], times)


def interpolated(at: npt.ArrayLike, values: npt.ArrayLike, times: FloatArray) -> FloatArray:
    """Join samples by straight lines; NaN outside, and between a sample that is NaN and its neighbours.

    Parameters
    ----------
    at : array, shape (n,)
        Times of the samples, s, ascending.
    values : array, shape (n,)
        Samples, NaN for a gap.
    times : array, shape (m,)
        Times, s, at which the value is wanted.

    Returns
    -------
    array, shape (m,)
        The values; where a time is that of a sample, the sample itself.
    """
    known, samples = np.asarray(at, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if known.size == 0:
        return np.full(len(times), np.nan)
    right = np.clip(np.searchsorted(known, times), 0, known.size - 1)
    left = np.maximum(right - 1, 0)
    way = known[right] - known[left]
    share = np.divide(times - known[left], way, out=np.ones(len(times)), where=way > 0.0)
    result = samples[left] + share * (samples[right] - samples[left])
    exact = known[right] == times
    result[exact] = samples[right[exact]]
    result[(times < known[0]) | (times > known[-1])] = np.nan
    return result
