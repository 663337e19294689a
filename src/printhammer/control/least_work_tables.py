"""Bursts of least work as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.run.coil_work import coil_power
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.control.least_work import LeastWork

SUFFIXES: Final = (".nc", ".csv")
"""Endings of the files that hold a burst: all of it, or the current alone, as a sampled waveform."""


def least_work_dataset(found: LeastWork) -> xr.Dataset:
    """Return a burst as a Dataset.

    Parameters
    ----------
    found : LeastWork
        The burst.

    Returns
    -------
    xarray.Dataset
        Over `time` [s]: `x` [m], `v` [m/s], `current` [A], `power` [W] of the coil; over `dot`, the contacts
        with the pack: `touch` [s], `force` [N], `pack_loss` [J]; works, ledger and provenance in the
        attributes.
    """
    import numba
    import xarray as xr

    from printhammer import __version__

    motion, work, ledger = found.motion, found.work, found.ledger

    def entry(dimension: str, values: Any, unit: str, meaning: str) -> Any:
        return dimension, values, {"units": unit, "long_name": meaning}

    power = coil_power(found.hammer, motion.x, motion.v, motion.force["magnet"])
    touches = [contact.t_in for contact in found.contacts]
    forces = [np.nan if c.peak_force is None else c.peak_force for c in found.contacts]
    losses = [contact.loss for contact in found.contacts]
    data = {
        "x": entry("time", motion.x, "m", "displacement"),
        "v": entry("time", motion.v, "m/s", "velocity"),
        "current": entry("time", motion.current, "A", "coil current"),
        "power": entry("time", power, "W", "power of the coil"),
        "touch": entry("dot", np.array(touches), "s", "touch of the pack"),
        "force": entry("dot", np.array(forces), "N", "largest pack force"),
        "pack_loss": entry("dot", np.array(losses), "J", "energy that the pack absorbed"),
    }
    coordinates = {
        "time": entry("time", motion.t, "s", "time"),
        "dot": entry("dot", np.arange(1, len(touches) + 1, dtype=np.int32), "1", "number of the dot"),
    }
    attributes = {
        "title": f"burst of least work of {found.hammer.name}",
        "hammer": found.hammer.name,
        "hammer_fingerprint": found.hammer.fingerprint,
        "drive_fingerprint": found.drive.fingerprint,
        "rate": found.rate,
        "least_force": found.force,
        "largest_current": found.largest,
        "largest_slew": found.slew,
        "least": found.least,
        "shape": found.shape,
        "adequate_dots": found.adequate,
        "net_work": work.net,
        "positive_work": work.positive,
        "squared_current": work.squared_current,
        "bound_of_positive_work": found.bound.burst(found.count),
        "pack_loss_of_all": ledger.pack_loss,
        "backstop_loss": ledger.backstop_loss,
        "ledger_residual": ledger.residual,
        "ledger_throughput": ledger.throughput,
        "rest_time": found.rest_time,
        "status": motion.status,
        "tolerance": repr(float(found.tolerance)),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
    if work.heat is not None:
        attributes["heat"] = work.heat
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def current_csv(found: LeastWork) -> str:
    """Return the current of a burst as the text of a sampled waveform.

    To be joined by straight lines; fired once, it does what the drive of the burst does.
    """
    from printhammer.units import from_si

    rows = ["time [us],current [A]"]
    for time, value in zip(*found.nodes, strict=True):
        rows.append(f"{from_si(time, 's', 'us'):.17g},{value:.17g}")
    return "\n".join(rows) + "\n"


def save_least_work(found: LeastWork, path: str | Path) -> None:
    """Write a burst as NetCDF (.nc), or its current as a sampled waveform (.csv), whole or not at all.

    Raises
    ------
    InputError
        The name ends in neither, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    if target.suffix.lower() == ".nc":
        write_dataset(target, least_work_dataset(found))
    elif target.suffix.lower() == ".csv":
        write_file(target, current_csv(found))
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")
