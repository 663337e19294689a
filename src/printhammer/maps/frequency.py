"""Frequency-time map: displacement during a burst of pulses, against time and firing rate.

Figs. 8 and 9 of F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), show bursts of nine
pulses at gradually rising rates.

Computed and measured maps are Datasets of the same layout. The variable `displacement` [m] has the dimensions
`rate` [Hz] and `time` [s, from the first firing]; the dots have the dimensions `rate` and `firing`, and exist
in computed maps only. Missing values are NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.drive.base import Overlap
from printhammer.drive.batch import PulseTrains
from printhammer.drive.input import PULSES, read_array, read_count
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Facts, Summary
from printhammer.results.declare import Column
from printhammer.results.files import dataset_of
from printhammer.results.provenance import provenance
from printhammer.run.effort import DEFAULT, Effort, Keywords, computation
from printhammer.run.plain.posing import CYCLE
from printhammer.run.regime import waveform_of
from printhammer.run.window import scaled_rate, wait_of
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
    "status": Column("1", "status of the run", ("rate",), dtype=np.int32),
}
"""Unit, meaning and dimensions of each variable of a map, by name."""

PLACES: Final = {"backstop": "backstop_m", "pack": "pack_front_m", "platen": "platen_m"}
"""Names of the map attributes with the positions of backstop, pack and platen, m, by surface."""


def map_dataset(
    rates: npt.ArrayLike,
    times: npt.ArrayLike,
    variables: Mapping[str, npt.NDArray[Any]],
    attributes: Mapping[str, Any],
    notes: Mapping[str, Mapping[str, str]] | None = None,
) -> xr.Dataset:
    """Build the Dataset of a map over firing rates [Hz] and times since the first firing [s].

    `variables` maps the names of variables, including `displacement`, to arrays in SI units with the
    dimensions listed in `LAYOUT`. `attributes` are the attributes of the Dataset; `notes` maps the name of a
    variable to the attributes of that variable.
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
    """Return the positions [m] of backstop, pack and platen that a map states, keyed by surface."""
    return {name: float(chart.attrs[key]) for name, key in PLACES.items() if key in chart.attrs}


def failed_rates(chart: xr.Dataset) -> dict[str, list[float]]:
    """Return the firing rates [Hz] of the runs that ended early, grouped by the status of the run."""
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
    """Return the map attributes that describe a hammer: status of its constants, and surface positions."""
    statuses = {constant.status for constant in hammer.constants.values()}
    guessed = [status for status in ("reconstructed", "assumed") if status in statuses]
    places = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
    return {
        **({} if hammer.strike == "dot" else {"strike": hammer.strike}),
        "hammer_constants": f"in part {' and '.join(guessed)}" if guessed else "measured or stated",
        **{PLACES[name]: float(place) for name, place in places.items() if place is not None},
    }


def matching(chart: xr.Dataset, other: xr.Dataset) -> tuple[IntArray, IntArray]:
    """Find the firing rates that two maps share, up to a relative difference of 1e-9.

    Returns the row indices of these rates in `chart` and in `other`.
    """
    here, there = chart["rate"].values, other["rate"].values
    nearest = np.abs(here[:, np.newaxis] - there).argmin(axis=1)
    same = np.isclose(here, there[nearest], rtol=1e-9, atol=0.0)
    return np.flatnonzero(same), nearest[same]


def on_times(chart: xr.Dataset, row: int, times: FloatArray) -> FloatArray:
    """Interpolate one row of a map, the displacement [m] at one firing rate, at given times [s].

    The result is NaN in gaps of the row, and before its first and after its last time.
    """
    return interpolated(chart["time"].values, chart["displacement"].values[row], times)


def interpolated(at: npt.ArrayLike, values: npt.ArrayLike, times: FloatArray) -> FloatArray:
    """Interpolate the samples `values`, taken at the ascending times `at` [s], linearly at `times` [s].

    At the time of a sample the result equals the sample. It is NaN before the first and after the last
    sample, and between two samples if one of the two is NaN.
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
    # Allow for rounding: a time at an end of the samples is not outside.
    room = 1e-12 * max(abs(known[0]), abs(known[-1]))
    result[(times < known[0] - room) | (times > known[-1] + room)] = np.nan
    return result


LOWEST: Final = 500.0
"""Default lowest rate of a map, Hz, as in Figs. 8 and 9; lower for a slower device."""

HIGHEST: Final = 2000.0
"""Default highest rate of a map, Hz, as in Figs. 8 and 9; lower for a slower device."""

RATES: Final = 512
"""Default number of rates of a map; arbitrary."""

TIMES: Final = 512
"""Default number of times of a map; arbitrary."""

TAIL: Final = 1e-3
"""Default time simulated after the last firing at the lowest rate, s; longer for slow devices. Arbitrary."""

MOST_CELLS: Final = 200_000_000
"""Largest number of rates times times of a map, to catch typing errors in rates and times; arbitrary."""


@computation
def frequency_map(
    hammer: Hammer,
    rates: npt.ArrayLike | None = None,
    *,
    pulses: SupportsIndex = PULSES,
    times: npt.ArrayLike | None = None,
    waveform: Waveform | None = None,
    overlap: Overlap = "add",
    effort: Effort = DEFAULT,
    **_keywords: Unpack[Keywords],
) -> xr.Dataset:
    """Compute the frequency-time map of a hammer: displacement against time and firing rate, and the dots.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    rates : array, optional
        Firing rates [Hz] or text with units, ascending; by default 512 from 500 Hz to 2 kHz for a
        flight time of 0.28 ms, lower for a slower device; see `printhammer.run.window.time_scale`.
    pulses : int, optional
        Number of firings at each rate.
    times : array or int, optional
        Times from the first firing, s or text with units, ascending; or their number, spread evenly from the
        first firing to 1 ms after the last firing at the lowest rate, or longer for a slow device; by default
        512.
    waveform : Waveform, optional
        Waveform of every firing; by default that of the hammer.
    overlap : str, optional
        "add": overlapping pulses add up; "replace": each firing cuts off the preceding pulse.

    Returns
    -------
    xarray.Dataset
        Over `rate` [Hz] and `time` [s]: `displacement` [m, float32], NaN after the end of a run that ended
        early. Over `rate` and `firing`: `fired_at` [s], `struck`, `flight_time` [s] and `peak_force` [N] of
        the dot, NaN for a lost dot. Over `rate`: `status`, 0 for a complete run; the codes are in the
        attributes of `status`. The attributes of the Dataset contain the provenance.
    """
    from printhammer.run.ensemble import Ensemble

    fired = waveform_of(hammer, waveform)
    grid = _rates(default_rates(hammer, fired) if rates is None else rates)
    count = read_count(pulses, "pulses")
    moments = _times(times, (count - 1) / float(grid[0]) + tail_of(hammer, fired))
    if grid.size * moments.size > MOST_CELLS:
        raise InputError(
            f"{grid.size} rates x {moments.size} times",
            key="rates",
            expected=f"at most {MOST_CELLS} displacements in a map",
        )
    drives = PulseTrains.at_rates(fired, grid, count, overlap)
    ends = np.maximum(moments[-1], (count - 1) / grid + wait_of(hammer, fired))
    runs = Ensemble(hammer, drives, ends, tolerance=effort.tolerance)
    result = runs.run(dots=True, times=moments, **effort.running)
    dots, x = result.dots, result.x
    assert dots is not None
    assert x is not None
    named = {0: "ok", **dict(zip(result.status.tolist(), result.status_names, strict=True))}
    codes = ", ".join(f"{code} {name}" for code, name in sorted(named.items()))
    variables: dict[str, npt.NDArray[Any]] = {
        "displacement": x,
        "fired_at": np.where(dots.fired, dots.fired_at, np.nan),
        "struck": dots.struck,
        "flight_time": dots.flight_time,
        "peak_force": dots.peak_force,
        "status": result.status.astype(np.int32),
    }
    attributes = {
        "title": f"frequency-time map of {hammer.name}, bursts of {count} pulses",
        "pulses": count,
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        **hammer_attributes(hammer),
        **provenance(hammer=hammer, waveform=fired, overlap=overlap, tolerance=effort.tolerance),
    }
    return map_dataset(grid, moments, variables, attributes, {"status": {"codes": codes}})


def tail_of(hammer: Hammer, waveform: Waveform) -> float:
    """Return the default time [s] for which a map continues after the last firing at its lowest rate.

    For a slow device the time is extended to cover the response to the last firing.
    """
    wait = wait_of(hammer, waveform)
    return wait if wait > CYCLE else TAIL


def rms_difference(computed: xr.Dataset, measured: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    """Compute the RMS difference in displacement between two maps, at each firing rate that they share.

    Parameters
    ----------
    computed, measured : xarray.Dataset
        Maps to compare. Displacements are interpolated linearly at the times of the map with the larger time
        spacing.

    Returns
    -------
    rates : array, shape (n,)
        Rates common to both maps, Hz.
    difference : array, shape (n,)
        Root mean square of the difference of the two displacements [m], over the times at which both are
        known; NaN if no such time exists.
    """
    rows, others = matching(computed, measured)
    times = max((chart["time"].values for chart in (measured, computed)), key=_spacing)
    rms = np.full(len(rows), np.nan)
    for k, (row, other) in enumerate(zip(rows.tolist(), others.tolist(), strict=True)):
        difference = on_times(computed, row, times) - on_times(measured, other, times)
        known = np.isfinite(difference)
        if known.any():
            rms[k] = np.sqrt(np.mean(np.square(difference[known])))
    return computed["rate"].values[rows], rms


def summary_of(chart: xr.Dataset, beside: xr.Dataset | None = None) -> Summary:
    """Summarise a computed map: its size, its dots, the first lost dot, and the status of the runs.

    If a measured map `beside` is given, the summary includes the RMS difference between the two maps.
    """
    rates, time = chart["rate"].values, chart["time"].values
    fired = np.isfinite(chart["fired_at"].values)
    lost = fired & ~chart["struck"].values
    dots = f"{int(fired.sum())} fired, {int((fired & ~lost).sum())} struck, {int(lost.sum())} lost"
    if lost.any():
        row = int(np.argmax(lost.any(axis=1)))
        dots += f"; the first at {rates[row]:.6g} Hz, firing {int(np.argmax(lost[row])) + 1}"
    failed = int((chart["status"].values != 0).sum())
    rows = [
        (
            "map",
            (
                f"{rates.size} rates from {rates[0]:g} to {rates[-1]:g} Hz, {chart.attrs['pulses']} pulses,"
                f" {time.size} times up to {1e3 * float(time[-1]):.4g} ms"
            ),
        ),
        ("dots", dots),
        ("status", f"{failed} of {rates.size} runs did not reach their end" if failed else "ok"),
        ("measured", None if beside is None else _difference(chart, beside)),
    ]
    return Summary([Facts(rows)]).worded(chart.attrs.get("strike", "dot"))


def _difference(chart: xr.Dataset, beside: xr.Dataset) -> str:
    both, difference = rms_difference(chart, beside)
    known = difference[np.isfinite(difference)]
    said = "not known, no rate is in both maps"
    if known.size:
        said = (
            f"RMS {1e6 * float(np.median(known)):.3g} µm (median of {known.size} rates),"
            f" {1e6 * float(known.max()):.3g} µm at {both[np.nanargmax(difference)]:.6g} Hz"
        )
    return f"{beside['rate'].size} rates; difference {said}"


def _spacing(times: FloatArray) -> float:
    return float(np.median(np.diff(times))) if times.size > 1 else np.inf


def default_rates(hammer: Hammer, waveform: Waveform | None = None, count: int = RATES) -> FloatArray:
    """Return the default firing rates of a map [Hz], `count` evenly spaced values.

    The rates extend from 500 Hz to 2 kHz; for devices slower than the hammer of the paper both ends are
    lower.
    """
    lowest, highest = (scaled_rate(hammer, rate, waveform) for rate in (LOWEST, HIGHEST))
    return np.linspace(lowest, highest, count)


def _rates(rates: npt.ArrayLike) -> FloatArray:
    grid = np.atleast_1d(read_array(rates, "rates", "numbers, Hz", "Hz"))
    if grid.ndim != 1 or grid.size == 0:
        raise InputError(
            f"rates: an array of shape {grid.shape}", key="rates", expected="a list of at least one rate, Hz"
        )
    odd = grid[~(np.isfinite(grid) & (grid > 0.0))]
    if odd.size:
        raise InputError(f"rates: {odd[0]:.9g} Hz", key="rates", expected="finite numbers greater than 0 Hz")
    falling = np.flatnonzero(np.diff(grid) <= 0.0)
    if falling.size:
        before, after = grid[falling[0] : falling[0] + 2]
        raise InputError(
            f"rates: {after:.9g} Hz follows {before:.9g} Hz", key="rates", expected="ascending rates"
        )
    return grid


def _times(times: npt.ArrayLike | None, end: float) -> FloatArray:
    if times is None:
        return np.linspace(0.0, end, TIMES)
    if np.ndim(times) == 0:
        count: Any = times
        if isinstance(count, bool) or int(count) != count or count < 2:
            raise InputError.of("times", count, "a whole number of at least 2, or the times, s")
        if count > MOST_CELLS:
            raise InputError.of("times", count, f"at most {MOST_CELLS}")
        return np.linspace(0.0, end, int(count))
    grid = read_array(times, "times", "times, s", "s")
    if grid.ndim != 1 or grid.size == 0 or not np.isfinite(grid).all():
        raise InputError("times: expected a list of finite numbers, s", key="times")
    if grid[0] < 0.0 or (np.diff(grid) <= 0.0).any() or grid[-1] <= 0.0:
        raise InputError(
            "times: expected ascending times, s, not negative, the last one greater than 0 s", key="times"
        )
    return grid
