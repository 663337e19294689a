"""Lyapunov exponents as tables and files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from printhammer.chaos.exponents.chart import LyapunovChart
    from printhammer.chaos.exponents.lyapunov import Lyapunov

SUFFIXES: Final = (".csv", ".nc", ".json")
"""Endings of the files that hold exponents."""

_ORDER: Final = np.array([1, 2], np.int32)
_PER_FIRING: Final = "1/firing"

COLUMNS: Final = {
    "total": (_PER_FIRING, "sum of the exponents"),
    "total_error": (_PER_FIRING, "its standard error"),
    "dimension": ("1", "Kaplan-Yorke dimension"),
    "dimension_error": ("1", "its standard error"),
    "k": ("1", "K of the 0-1 test"),
}
"""Units and meanings of what is known of each train beside its exponents, by name."""

NAMES: Final = {
    "verdict": "verdict on the points",
    "growth": "what the largest exponent alone says",
    "zero_one": "verdict of the 0-1 test",
    "status": "how the run ended",
}
"""Meanings of what is told of each train in words."""


def lyapunov_dataset(found: Lyapunov) -> xr.Dataset:
    """Return the exponents of one train as a Dataset.

    Parameters
    ----------
    found : Lyapunov
        The exponents.

    Returns
    -------
    xarray.Dataset
        `factor` over `firing` and `exponent` (1 or 2), the growth up to the firing from the one before; `x`
        and `v` over `firing`, the first of which has no growth, NaN; `running` and `running_error` over
        `count`, the number of firings averaged over. Exponents, dimension, K, verdict and provenance are in
        the attributes.
    """
    import xarray as xr

    points = found.points
    counts, means, errors = found.running()
    growth = np.concatenate([np.full((1, 2), np.nan), found.factors])
    pair = ("firing", "exponent")
    data: dict[str, Any] = {
        "factor": (
            pair,
            growth,
            {"units": "1", "long_name": "logarithm of the growth since the firing before"},
        ),
        "x": ("firing", points.x, {"units": "m", "long_name": "displacement"}),
        "v": ("firing", points.v, {"units": "m/s", "long_name": "velocity"}),
        "running": (("count", "exponent"), means, {"units": _PER_FIRING, "long_name": "running estimate"}),
        "running_error": (
            ("count", "exponent"),
            errors,
            {"units": _PER_FIRING, "long_name": "standard error of the running estimate"},
        ),
    }
    coords = {
        "firing": (
            "firing",
            points.firing.astype(np.int32),
            {"units": "1", "long_name": "number of the firing"},
        ),
        "count": (
            "count",
            counts.astype(np.int32),
            {"units": "1", "long_name": "number of firings averaged over"},
        ),
        "exponent": (
            "exponent",
            _ORDER,
            {"units": "1", "long_name": "number of the exponent, largest first"},
        ),
    }
    known = {key: value for key, value in points.provenance.items() if value is not None}
    zero_one = {} if found.zero_one is None else {"k": found.zero_one.k, "zero_one": found.zero_one.verdict}
    attrs = {
        "title": f"Lyapunov exponents of {found.hammer.name}, fired every {found.period:.9g} s",
        "exponents": found.exponents,
        "standard_errors": found.standard_errors,
        "exponents_per_second": found.per_second,
        "total": found.total,
        "total_error": found.total_error,
        "dimension": found.dimension,
        "dimension_error": found.dimension_error,
        "growth": found.growth,
        "smooth": int(found.smooth),
        **zero_one,
        **known,
    }
    return xr.Dataset(data, coords=coords, attrs=attrs)


def chart_dataset(chart: LyapunovChart) -> xr.Dataset:
    """Return the exponents of many trains as a Dataset.

    Parameters
    ----------
    chart : LyapunovChart
        The exponents.

    Returns
    -------
    xarray.Dataset
        Over `period` [s], `exponents` and `standard_errors` also over `exponent` (1 or 2), per firing; sum,
        dimension, K, and verdicts and statuses in words; provenance in the attributes.
    """
    import xarray as xr

    pair = ("period", "exponent")
    data: dict[str, Any] = {
        "exponents": (pair, chart.exponents, {"units": _PER_FIRING, "long_name": "Lyapunov exponents"}),
        "standard_errors": (
            pair,
            chart.standard_errors,
            {"units": _PER_FIRING, "long_name": "standard errors"},
        ),
    }
    for name, (unit, meaning) in COLUMNS.items():
        data[name] = ("period", getattr(chart, name), {"units": unit, "long_name": meaning})
    for name, meaning in NAMES.items():
        data[name] = ("period", np.array(getattr(chart, name), dtype=np.str_), {"long_name": meaning})
    smooth = {"units": "1", "long_name": "whether the motion has a derivative"}
    data["smooth"] = ("period", chart.smooth.astype(np.int8), smooth)
    coords = {
        "period": ("period", chart.period, {"units": "s", "long_name": "time between firings"}),
        "exponent": (
            "exponent",
            _ORDER,
            {"units": "1", "long_name": "number of the exponent, largest first"},
        ),
    }
    title = f"Lyapunov exponents of {chart.hammer.name}"
    return xr.Dataset(data, coords=coords, attrs={"title": title, **provenance(chart)})


def provenance(chart: LyapunovChart) -> dict[str, Any]:
    """Return where a chart comes from: fingerprints, versions, tolerance."""
    import numba

    from printhammer import __version__

    return {
        "hammer": chart.hammer.name,
        "hammer_fingerprint": chart.hammer.fingerprint,
        "waveform": repr(chart.drive.waveform),
        "overlap": chart.drive.overlap,
        "first": chart.first,
        "last": chart.last,
        "tolerance": repr(chart.tolerance),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def chart_table(chart: LyapunovChart) -> pd.DataFrame:
    """Return a chart as a table, a row for each train, units in the column names; provenance in `attrs`."""
    import pandas as pd

    columns: dict[str, Any] = {"period [s]": chart.period}
    for k in (0, 1):
        columns[f"exponent {k + 1} [{_PER_FIRING}]"] = chart.exponents[:, k]
        columns[f"standard error {k + 1} [{_PER_FIRING}]"] = chart.standard_errors[:, k]
    for name, (unit, _meaning) in COLUMNS.items():
        columns[name if unit == "1" else f"{name} [{unit}]"] = getattr(chart, name)
    for name in NAMES:
        columns[name] = list(getattr(chart, name))
    columns["smooth"] = chart.smooth
    table = pd.DataFrame(columns)
    table.attrs.update(provenance(chart))
    return table


def save_lyapunov(chart: LyapunovChart, path: str | Path) -> None:
    """Write a chart as CSV, NetCDF or JSON, by the end of the name; whole or not at all.

    Infinite numbers are strings in JSON, which knows none, and what is not known is null.

    Raises
    ------
    InputError
        The name ends in none of them, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind == ".csv":
        write_file(target, chart_table(chart).to_csv(index=False, float_format="%.17g"))
    elif kind == ".nc":
        write_dataset(target, chart_dataset(chart))
    elif kind == ".json":
        trains = [
            {name: _plain(value) for name, value in row.items()}
            for row in chart_table(chart).to_dict(orient="records")
        ]
        write_file(
            target, json.dumps({**provenance(chart), "trains": trains}, indent=2, allow_nan=False) + "\n"
        )
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")


def _plain(value: Any) -> Any:
    """Return a number as JSON can hold it."""
    if not isinstance(value, float) or np.isfinite(value):
        return value
    return None if np.isnan(value) else str(value)
