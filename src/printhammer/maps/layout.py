"""The Dataset of a frequency-time map: its variables, their units, and files that hold it.

Computed and measured maps have the same layout. `displacement` [m] lies over the dimensions `rate` [Hz] and
`time` [s, from the first firing on]; what the firings did lies over `rate` and `firing`, and is only known of
computed maps. A missing number is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.hammer.hammer import Hammer
from printhammer.results.declare import Column
from printhammer.results.files import dataset_of
from printhammer.support.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    import xarray as xr

_FIRED: Final = ("rate", "firing")

LAYOUT: Final = {
    "rate": Column("Hz", "firing rate", ("rate",), "coordinate", dtype=np.float64),
    "time": Column("s", "time from the first firing", ("time",), "coordinate", dtype=np.float64),
    "firing": Column("1", "number of the firing", ("firing",), "coordinate", dtype=np.int32),
    "displacement": Column("m", "displacement of the armature", ("rate", "time")),
    "fired_at": Column("s", "time of the firing", _FIRED),
    "struck": Column("1", "whether the firing made a dot", _FIRED),
    "flight_time": Column("s", "time from firing to touch of the pack", _FIRED),
    "peak_force": Column("N", "largest pack force of the dot", _FIRED),
    "status": Column("1", "how the run ended", ("rate",), dtype=np.int32),
}
"""Unit, meaning and dimensions of the variables of a map, by name."""

PLACES: Final = {"backstop": "backstop_m", "pack": "pack_front_m", "platen": "platen_m"}
"""Attributes of a map that hold the positions of the hammer, m, by the names of the places."""


def map_dataset(
    rates: npt.ArrayLike,
    times: npt.ArrayLike,
    variables: Mapping[str, npt.NDArray[Any]],
    attributes: Mapping[str, Any],
    notes: Mapping[str, Mapping[str, str]] | None = None,
) -> xr.Dataset:
    """Return a map as a Dataset over rates, Hz, and times from the first firing, s.

    The variables are arrays by name, SI, of the dimensions in `LAYOUT`, `displacement` among them; the
    attributes those of the set, the notes further ones of single variables, by name.
    """
    more = notes or {}
    values: dict[str, Any] = {"rate": rates, "time": times, **variables}
    if "fired_at" in variables:
        values["firing"] = np.arange(variables["fired_at"].shape[1])
    return dataset_of(
        {name: (replace(LAYOUT[name], attrs=more.get(name)), array) for name, array in values.items()},
        attributes,
    )


def places_of(chart: xr.Dataset) -> dict[str, float]:
    """Return the positions that a map knows of "backstop", "pack" and "platen", m, in this order."""
    return {name: float(chart.attrs[key]) for name, key in PLACES.items() if key in chart.attrs}


def failed_rates(chart: xr.Dataset) -> dict[str, list[float]]:
    """Return the rates of a map, Hz, at which the run did not reach its end, by the name of the status."""
    if "status" not in chart:
        return {}
    codes = str(chart["status"].attrs.get("codes", ""))
    names = dict(part.split(" ", 1) for part in codes.split(", ") if " " in part)
    failed: dict[str, list[float]] = {}
    for code, rate in zip(chart["status"].values.tolist(), chart["rate"].values.tolist(), strict=True):
        if code != 0:
            failed.setdefault(names.get(str(code), str(code)), []).append(rate)
    return failed


def hammer_attributes(hammer: Hammer) -> dict[str, Any]:
    """Return what a map says about its hammer: how its constants came about, and its places."""
    statuses = {constant.status for constant in hammer.constants.values()}
    guessed = [status for status in ("reconstructed", "assumed") if status in statuses]
    places = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
    return {
        "hammer_constants": f"in part {' and '.join(guessed)}" if guessed else "measured or stated",
        **{PLACES[name]: float(place) for name, place in places.items() if place is not None},
    }


def matching(chart: xr.Dataset, other: xr.Dataset) -> tuple[IntArray, IntArray]:
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

    The samples lie `at` ascending times, s. At the time of a sample the value is the sample itself.
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
