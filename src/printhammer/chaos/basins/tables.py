"""Basins as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.bifurcation.tables import provenance_of
from printhammer.errors import InputError
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from printhammer.chaos.basins.basins import Basins

SUFFIXES: Final = (".nc", ".csv")
"""Endings of the files that hold basins."""


def basins_dataset(found: Basins) -> xr.Dataset:
    """Return basins as a Dataset.

    Parameters
    ----------
    found : Basins
        The basins.

    Returns
    -------
    xarray.Dataset
        Over `v` [m/s] and `x` [m]: `label`, `firings` and `status`; over `attractor`: `verdict`, `share` and
        `standard_error`. Provenance, basin entropy and the meaning of the labels are in the attributes.
    """
    import xarray as xr

    def entry(dims: Any, values: Any, unit: str, meaning: str, **more: str) -> Any:
        return dims, values, {"units": unit, "long_name": meaning, **more}

    share, error = found.shares
    plane = ("v", "x")
    names = ", ".join(f"{k} {attractor.name}" for k, attractor in enumerate(found.attractors, 1))
    codes = f"-2 no state, -1 run ended early, 0 undecided{', ' if names else ''}{names}"
    data = {
        "label": entry(plane, found.labels.astype(np.int32), "1", "attractor", codes=codes),
        "firings": entry(plane, found.firings.astype(np.int32), "1", "firings until it was decided"),
        "status": entry(plane, found.status, "1", "how the run ended"),
        "verdict": entry(
            "attractor", np.array([one.name for one in found.attractors], "U16"), "1", "kind of attractor"
        ),
        "share": entry("attractor", share, "1", "share of the cells that have a state"),
        "standard_error": entry("attractor", error, "1", "standard error of the share"),
    }
    coordinates = {
        "x": entry("x", found.x, "m", "displacement at the first firing"),
        "v": entry("v", found.v, "m/s", "velocity at the first firing"),
        "attractor": entry(
            "attractor",
            np.arange(1, len(found.attractors) + 1, dtype=np.int32),
            "1",
            "number of the attractor",
        ),
    }
    entropy = found.entropy(box=min(4, *found.labels.shape))
    attributes = {
        "title": f"basins of {found.regime.hammer.name}, every {found.regime.period:.9g} s",
        "period": found.regime.period,
        "box": entropy.box,
        "basin_entropy": entropy.entropy,
        "boundary_basin_entropy": entropy.boundary_entropy,
        **provenance_of(found.regime, found.tolerance),
    }
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def basins_table(found: Basins) -> pd.DataFrame:
    """Return the cells as a table, a row each: displacement, velocity, label, attractor, firings, status."""
    import pandas as pd

    names = {-2: "no state", -1: "run ended early", 0: "undecided"}
    names |= {k: attractor.name for k, attractor in enumerate(found.attractors, 1)}
    labels = found.labels.reshape(-1)
    table = pd.DataFrame(
        {
            "x [m]": np.tile(found.x, len(found.v)),
            "v [m/s]": np.repeat(found.v, len(found.x)),
            "label": labels,
            "attractor": [names[label] for label in labels.tolist()],
            "firings": found.firings.reshape(-1),
            "status": found.status.reshape(-1),
        }
    )
    table.attrs.update(basins_dataset(found).attrs)
    return table


def save_basins(found: Basins, path: str | Path) -> None:
    """Write basins as NetCDF (.nc) or CSV (.csv), whole or not at all.

    Raises
    ------
    InputError
        The name ends in neither, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    if target.suffix.lower() == ".nc":
        write_dataset(target, basins_dataset(found))
    elif target.suffix.lower() == ".csv":
        write_file(target, basins_table(found).to_csv(index=False, float_format="%.17g"))
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")
