"""Quality reports and safe rates as tables and files."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.dots.judging import FAULTS
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.limits import Limits
    from printhammer.printing.rates.quality import Quality
    from printhammer.printing.rates.safe_rate import SafeRate

SUFFIXES: Final = (".nc", ".csv", ".json")
"""Endings of the files that hold a result."""

_SPREADS: Final = {"flight_time": "s", "force": "N", "indentation": "m", "arrival": "s", "placement": "m"}


def provenance(hammer: Hammer, tolerance: float) -> dict[str, Any]:
    """Return where a result comes from, for the attributes of a Dataset."""
    import numba

    from printhammer import __version__

    return {
        "hammer": hammer.name,
        "hammer_fingerprint": hammer.fingerprint,
        "tolerance": repr(float(tolerance)),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def limits_text(limits: Limits) -> str:
    """Return limits in words."""
    return (
        f"force within {100.0 * limits.force:g} %, arrival within {1e6 * limits.arrival:g} us,"
        f" {limits.extra_contacts} extra contacts"
    )


def safe_rate_dataset(found: SafeRate) -> xr.Dataset:
    """Return a safe rate as a Dataset.

    Parameters
    ----------
    found : SafeRate
        From `printhammer.safe_rate`.

    Returns
    -------
    xarray.Dataset
        Over `rate` [Hz]: `passed`, `force_low`, `force_high` [1], `arrival_low`, `arrival_high` [s], `lost`,
        `extra_contacts` and `cycle_run`; the safe rate, what fails first and provenance in the attributes.
    """
    import xarray as xr

    def entry(name: str, unit: str, meaning: str) -> Any:
        values = getattr(found, name)
        # The classic NetCDF format has no truth values and no longer integers.
        kept = values.astype({"b": np.int8, "i": np.int32}.get(values.dtype.kind, values.dtype))
        return "rate", kept, {"units": unit, "long_name": meaning}

    data = {
        "passed": entry("passed", "1", "whether all dots are within limits"),
        "force_low": entry("force_low", "1", "least deviation of a force from that of the single pulse"),
        "force_high": entry("force_high", "1", "largest deviation of a force from that of the single pulse"),
        "arrival_low": entry("arrival_low", "s", "earliest arrival, less slot time and nominal flight time"),
        "arrival_high": entry("arrival_high", "s", "latest arrival, less slot time and nominal flight time"),
        "lost": entry("lost", "1", "number of lost dots"),
        "extra_contacts": entry("extra_contacts", "1", "number of extra contacts"),
        "cycle_run": entry("cycle_run", "1", "whether the cycle was run after the patterns from rest"),
    }
    attributes = {
        "title": f"safe rate of {found.hammer.name}",
        "strategy": found.strategy,
        "limits": limits_text(found.limits),
        "safe_rate": found.rate,
        "first_failure": "" if found.failure is None else found.failure.text,
        "single_force": found.nominal.force,
        "single_flight_time": found.nominal.flight_time,
        "peak_drive": found.peak_drive,
        "step": found.step,
        **provenance(found.hammer, found.tolerance),
    }
    rates = {"rate": ("rate", found.rates, {"units": "Hz", "long_name": "slots per second"})}
    return xr.Dataset(data, coords=rates, attrs=attributes)


def quality_dataset(found: Quality) -> xr.Dataset:
    """Return a quality report as a Dataset.

    Parameters
    ----------
    found : Quality
        From `printhammer.quality`.

    Returns
    -------
    xarray.Dataset
        Over `dot`: `slot`, `flight_time` [s], `force` [N], `indentation` [m], `arrival_deviation` [s],
        `lost`, `extra_contacts` and `fault`; the figures of the report and provenance in the attributes.
    """
    import xarray as xr

    def entry(name: str, unit: str, meaning: str) -> Any:
        values = getattr(found, name)
        kept = values.astype({"b": np.int8, "i": np.int32}.get(values.dtype.kind, values.dtype))
        return "dot", kept, {"units": unit, "long_name": meaning}

    data = {
        "slot": entry("slot", "1", "number of the slot"),
        "flight_time": entry("flight_time", "s", "from firing to touch"),
        "force": entry("force", "N", "largest pack force"),
        "indentation": entry("indentation", "m", "largest indentation"),
        "arrival_deviation": entry("arrival_deviation", "s", "touch less slot time and nominal flight time"),
        "lost": entry("lost", "1", "whether the firing made no dot"),
        "extra_contacts": entry("extra_contacts", "1", "further pack contacts"),
        "fault": entry("fault", "1", "first fault of the dot, -1 for a good one"),
    }
    data["fault"][2]["codes"] = ", ".join(f"{code} {name}" for code, name in enumerate(FAULTS))
    attributes = {
        "title": f"quality of {found.hammer.name} at {found.rate:g} Hz",
        **{key: value for key, value in figures_of(found).items() if value is not None},
        **provenance(found.hammer, found.tolerance),
    }
    return xr.Dataset(data, attrs=attributes)


def figures_of(found: Quality) -> dict[str, Any]:
    """Return the figures of a report by names that end in their units, SI; None for what is not known."""
    result: dict[str, Any] = {
        "strategy": found.strategy,
        "rate_Hz": found.rate,
        "pattern": "".join("1" if dot else "0" for dot in found.wanted),
        "judged_from_slot": found.judged_from,
        "limits": limits_text(found.limits),
        "status": found.status,
        "dots": len(found.slot),
        "within_limits": int((found.fault < 0).sum()),
        "missing": found.missing,
        "extra_contacts": int(found.extra_contacts.sum()),
        "single_force_N": found.nominal.force,
        "single_flight_time_s": found.nominal.flight_time,
    }
    for name, unit in _SPREADS.items():
        spread = getattr(found, f"{name}_spread")
        for part in ("mean", "deviation", "low", "high", "peak_to_peak"):
            value = getattr(spread, part)
            result[f"{name}_{part}_{unit}"] = None if math.isnan(value) else value
    result |= {
        "pitch_m": found.pitch,
        "dot_matrix_tolerance": int(found.dot_matrix),
        "engraved_tolerance": int(found.engraved),
        "backstop_touches_per_dot": found.wear.touches / found.fired,
        "backstop_impulse_per_dot_N_s": found.backstop_impulse,
        "backstop_loss_per_dot_J": found.backstop_loss,
        "backstop_largest_speed_m_per_s": found.wear.largest_speed,
        "backstop_largest_force_N": found.wear.largest_force,
        "work_per_dot_J": found.work,
        "mean_power_W": found.mean_power,
        "mean_heat_W": found.mean_heat,
    }
    return result


def save_result(found: Quality | SafeRate, path: str | Path) -> None:
    """Write a result as NetCDF (.nc), CSV (.csv) or JSON (.json), whole or not at all.

    Parameters
    ----------
    found : Quality, SafeRate, ToleranceYield or DampingStudy
        What has `to_dataset`.
    path : path
        The end of the name decides.

    Raises
    ------
    InputError
        The name ends in none of them, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    kind = target.suffix.lower()
    chart = found.to_dataset()
    if kind == ".nc":
        write_dataset(target, chart)
    elif kind == ".csv":
        table = chart.to_dataframe().reset_index()
        units = {name: chart[name].attrs.get("units", "1") for name in chart.variables}
        named = {name: f"{name} [{unit}]" for name, unit in units.items() if unit != "1"}
        write_file(target, table.rename(columns=named).to_csv(index=False, float_format="%.17g"))
    elif kind == ".json":
        columns = {str(name): _plain(chart[name].values.tolist()) for name in chart.variables}
        content = {**_plain(chart.attrs), "columns": columns}
        write_file(target, json.dumps(content, indent=2, allow_nan=False) + "\n")
    else:
        raise InputError(f"{target}: expected a name that ends in one of {', '.join(SUFFIXES)}")


def _plain(value: Any) -> Any:
    """Return what JSON holds: None for numbers that are not finite."""
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
