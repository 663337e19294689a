"""Layout of a frequency-time map as a Dataset: variables, units and attributes.

Computed and measured maps have the same layout. The variable `displacement` [m] has the dimensions `rate`
[Hz] and `time` [s, from the first firing]; the dots have the dimensions `rate` and `firing`, and exist in
computed maps only. A missing number is NaN.
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
"""Unit, meaning and dimensions of each variable of a map, by name."""

PLACES: Final = {"backstop": "backstop_m", "pack": "pack_front_m", "platen": "platen_m"}
"""Attributes of a map that hold the positions of backstop, pack and platen, m, by surface."""


def map_dataset(
    rates: npt.ArrayLike,
    times: npt.ArrayLike,
    variables: Mapping[str, npt.NDArray[Any]],
    attributes: Mapping[str, Any],
    notes: Mapping[str, Mapping[str, str]] | None = None,
) -> xr.Dataset:
    """Build the Dataset of a map over rates, Hz, and times from the first firing, s.

    `variables` are arrays in SI by name, including `displacement`, with the dimensions of `LAYOUT`.
    `attributes` belong to the Dataset; `notes` are attributes of single variables, by name.
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
    """Return the positions of backstop, pack and platen stored in a map, m, by name; absent ones omitted."""
    return {name: float(chart.attrs[key]) for name, key in PLACES.items() if key in chart.attrs}


def failed_rates(chart: xr.Dataset) -> dict[str, list[float]]:
    """Return the rates of the runs that stopped early, Hz, by the name of their status."""
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
    """Return the map attributes that describe a hammer: origin of its constants, and surface positions."""
    statuses = {constant.status for constant in hammer.constants.values()}
    guessed = [status for status in ("reconstructed", "assumed") if status in statuses]
    places = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
    return {
        **({} if hammer.strike == "dot" else {"strike": hammer.strike}),
        "hammer_constants": f"in part {' and '.join(guessed)}" if guessed else "measured or stated",
        **{PLACES[name]: float(place) for name, place in places.items() if place is not None},
    }


def matching(chart: xr.Dataset, other: xr.Dataset) -> tuple[IntArray, IntArray]:
    """Return the row indices of the rates that two maps share, up to a relative difference of 1e-9."""
    here, there = chart["rate"].values, other["rate"].values
    nearest = np.abs(here[:, np.newaxis] - there).argmin(axis=1)
    same = np.isclose(here, there[nearest], rtol=1e-9, atol=0.0)
    return np.flatnonzero(same), nearest[same]


def on_times(chart: xr.Dataset, row: int, times: FloatArray) -> FloatArray:
    """Interpolate the displacement at one rate, m, at given times, s; NaN in gaps and outside the record."""
    return interpolated(chart["time"].values, chart["displacement"].values[row], times)


def interpolated(at: npt.ArrayLike, values: npt.ArrayLike, times: FloatArray) -> FloatArray:
    """Interpolate samples linearly at given times; NaN outside, and next to a NaN sample.

    The samples are taken at ascending times `at`, s. At the time of a sample, the result equals the sample.
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
    # Tolerance for rounding: times at the ends of the samples are not beyond them.
    room = 1e-12 * max(abs(known[0]), abs(known[-1]))
    result[(times < known[0] - room) | (times > known[-1] + room)] = np.nan
    return result
