"""Comparisons of feedback with other ways to drive, as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.errors import InputError
from printhammer.support.outputs import write_dataset

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.control.feedback.comparison import Feedback


def feedback_dataset(found: Feedback) -> xr.Dataset:
    """Return a comparison as a Dataset.

    Parameters
    ----------
    found : Feedback
        The comparison.

    Returns
    -------
    xarray.Dataset
        Over `strategy`, `pattern` and `dot`: `passed`, `force` and `arrival` [s]; over `strategy` and `gap`
        [s]: `gap_force` and `gap_arrival` [s]; over `strategy`: `lost`, `extra_contacts` and `peak_current`
        [A]; over `sample`: `sample_time` [s] and `shown` [m]; provenance in the attributes.
    """
    import numba
    import xarray as xr

    from printhammer import __version__

    def entry(dimensions: Any, values: Any, unit: str, meaning: str) -> Any:
        return dimensions, values, {"units": unit, "long_name": meaning}

    dots, gaps = ("strategy", "pattern", "dot"), ("strategy", "gap")
    data = {
        "passed": entry(dots[:2], found.passed.astype(np.int8), "1", "whether all dots are within limits"),
        "force": entry(dots, found.force, "1", "force less that of the single pulse, in parts of it"),
        "arrival": entry(dots, found.arrival, "s", "arrival less slot time and single-pulse flight time"),
        "gap_force": entry(gaps, found.gap_force, "1", "likewise of the second of two dots"),
        "gap_arrival": entry(gaps, found.gap_arrival, "s", "likewise of the second of two dots"),
        "lost": entry("strategy", found.lost.astype(np.int32), "1", "lost dots"),
        "extra_contacts": entry("strategy", found.extra_contacts.astype(np.int32), "1", "extra contacts"),
        "peak_current": entry("strategy", found.peak_current, "A", "largest absolute value of the current"),
        "sample_time": entry("sample", found.seen.times, "s", "time of a sample in the run shown"),
        "shown": entry("sample", found.seen.shown, "m", "what the sensor showed"),
    }
    coordinates = {
        "strategy": ("strategy", np.array(found.strategies)),
        "gap": entry("gap", found.gaps, "s", "time between two slots"),
    }
    attributes = {
        "title": f"feedback on {found.hammer.name}",
        "hammer": found.hammer.name,
        "hammer_fingerprint": found.hammer.fingerprint,
        "driven_fingerprint": found.driven.fingerprint,
        "rate": found.rate,
        "largest_current": found.driver.current,
        "edge": found.driver.edge,
        "sensor_noise": found.sensor.noise,
        "sensor_delay": found.sensor.delay,
        "sensor_interval": found.sensor.interval,
        "sensor_step": found.sensor.step,
        "sensor_seed": found.sensor.seed,
        "force_limit": found.limits.force,
        "arrival_limit": found.limits.arrival,
        "extra_contacts_limit": found.limits.extra_contacts,
        "pattern_shown": found.seen.pattern,
        "drive_fingerprint_shown": found.seen.motion.drive.fingerprint,
        "tolerance": repr(float(found.tolerance)),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def save_feedback(found: Feedback, path: str | Path) -> None:
    """Write a comparison as NetCDF (.nc), whole or not at all.

    Raises
    ------
    InputError
        The name ends in something else, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    if target.suffix.lower() != ".nc":
        raise InputError(f"{target}: expected a name that ends in .nc")
    write_dataset(target, feedback_dataset(found))
