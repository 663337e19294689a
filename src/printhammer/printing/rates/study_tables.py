"""Tolerance yields and damping studies as Datasets."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.printing.rates.quality_tables import limits_text, provenance

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.printing.rates.damping import DampingStudy
    from printhammer.printing.rates.tolerance import ToleranceYield


def yield_dataset(found: ToleranceYield) -> xr.Dataset:
    """Return a tolerance yield as a Dataset.

    Parameters
    ----------
    found : ToleranceYield
        From `printhammer.tolerance_yield`.

    Returns
    -------
    xarray.Dataset
        Over `member` and `constant`: `factor`; over `member`: `passed`, `safe_rate` [Hz], `single_force` [N],
        `single_flight_time` [s] and `status`; share, spreads and provenance in the attributes.
    """
    import xarray as xr

    def entry(values: Any, unit: str, meaning: str) -> Any:
        return "member", values, {"units": unit, "long_name": meaning}

    data = {
        "factor": (
            ("member", "constant"),
            found.factors,
            {"units": "1", "long_name": "constant over that of the design; of the front, its distance"},
        ),
        "passed": entry(found.passed.astype(np.int8), "1", "whether every pattern is within limits"),
        "safe_rate": entry(found.safe_rates, "Hz", "safe rate"),
        "single_force": entry(found.single_force, "N", "force of the single-pulse dot"),
        "single_flight_time": entry(found.single_flight_time, "s", "flight time of the single-pulse dot"),
        "status": entry(found.status, "1", "what became of the hammer"),
    }
    attributes = {
        "title": f"tolerance yield of {found.hammer.name}",
        "strategy": found.strategy,
        "limits": limits_text(found.limits),
        "judged_by": found.judged_by,
        "spreads": json.dumps(dict(found.spreads)),
        "seed": found.seed,
        "share": found.share,
        "first_rate": float(found.grid[0]),
        "last_rate": float(found.grid[-1]),
        "step": float(found.grid[1] - found.grid[0]) if len(found.grid) > 1 else 0.0,
        **provenance(found.hammer, found.tolerance),
    }
    if not math.isnan(found.rate):
        attributes["rate"] = found.rate
    keys = {"constant": ("constant", list(found.spreads), {"long_name": "what varies"})}
    return xr.Dataset(data, coords=keys, attrs=attributes)


def damping_dataset(found: DampingStudy) -> xr.Dataset:
    """Return a damping study as a Dataset.

    Parameters
    ----------
    found : DampingStudy
        From `printhammer.damping_study`.

    Returns
    -------
    xarray.Dataset
        Over `material`: `kind`, `label`, `status` and the numbers of the study, by their names there; limits
        and provenance in the attributes.
    """
    import xarray as xr

    columns = {
        "amplitude": ("1", "factor on the amplitude of the waveform"),
        "peak_current": ("A", "largest current"),
        "force": ("N", "single-pulse force"),
        "flight_time": ("s", "single-pulse flight time"),
        "settle_out": ("s", "settle-out time"),
        "rebounds": ("1", "rebounds higher than a hundredth of the stroke"),
        "highest": ("1", "highest rebound, in parts of the stroke"),
        "restitution": ("1", "speed after the first touch of the backstop over the speed before"),
        "impulse": ("N s", "change of momentum at the backstop after a single pulse"),
        "loss": ("J", "energy that the backstop takes after a single pulse"),
        "backstop_force": ("N", "largest backstop force"),
        "coil_work": ("J", "net work of the coil in a single pulse"),
        "safe_rate": ("Hz", "safe rate"),
    }
    data: dict[str, Any] = {
        "kind": ("material", [one.kind for one in found.materials], {"long_name": "what is exchanged"}),
        "label": ("material", [one.label for one in found.materials], {"long_name": "for what"}),
        "status": ("material", found.status, {"long_name": "what became of it"}),
    }
    for name, (unit, meaning) in columns.items():
        data[name] = ("material", getattr(found, name), {"units": unit, "long_name": meaning})
    attributes = {
        "title": f"damping study of {found.hammer.name}",
        "limits": limits_text(found.limits),
        "current_limit": found.current_limit,
        "single_force": found.nominal.force,
        "first_rate": float(found.grid[0]),
        "last_rate": float(found.grid[-1]),
        "step": float(found.grid[1] - found.grid[0]) if len(found.grid) > 1 else 0.0,
        **provenance(found.hammer, found.tolerance),
    }
    return xr.Dataset(data, attrs=attributes)
