"""Quench maps as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.drive.text import inline, waveform_text
from printhammer.errors import InputError
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from printhammer.chaos.basins.quench import QuenchMap


def quench_dataset(found: QuenchMap) -> xr.Dataset:
    """Return a quench map as a Dataset.

    Parameters
    ----------
    found : QuenchMap
        The map.

    Returns
    -------
    xarray.Dataset
        Over `gap` [s] and `width` [s]: `struck`, `peak` [m], `peak_share`, `force` [N], `force_ratio`,
        `flight_time` [s], `flight_gain` [s] and `status`; provenance in the attributes.
    """
    import numba
    import xarray as xr

    from printhammer import __version__

    def entry(values: Any, unit: str, meaning: str) -> Any:
        return ("gap", "width"), values, {"units": unit, "long_name": meaning}

    data = {
        "struck": entry(found.struck, "1", "whether the second firing made a dot"),
        "peak": entry(found.peak, "m", "largest local maximum after the second firing"),
        "peak_share": entry(found.peak_share, "1", "second peak, 0 at the backstop and 1 at the pack"),
        "force": entry(found.force, "N", "largest pack force of the second dot"),
        "force_ratio": entry(found.force_ratio, "1", "force of the second dot over that of the first alone"),
        "flight_time": entry(found.flight_time, "s", "flight time of the second dot"),
        "flight_gain": entry(found.flight_gain, "s", "how much shorter the second dot flies"),
        "status": entry(found.status, "1", "how the run ended"),
    }
    coordinates = {
        "gap": ("gap", found.gaps, {"units": "s", "long_name": "time between the two firings"}),
        "width": ("width", found.widths, {"units": "s", "long_name": "width of the second pulse"}),
    }
    attributes = {
        "title": f"quench map of {found.hammer.name}",
        "hammer": found.hammer.name,
        "hammer_fingerprint": found.hammer.fingerprint,
        "first_pulse": inline(waveform_text(found.waveform)),
        "overlap": "add",
        "single_force": found.single_force,
        "single_flight_time": found.single_flight_time,
        "tail": found.tail,
        "tolerance": repr(float(found.tolerance)),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def quench_table(found: QuenchMap) -> pd.DataFrame:
    """Return the cells as a table, a row each."""
    import pandas as pd

    chart = quench_dataset(found)
    columns: dict[str, Any] = {
        "gap [s]": np.repeat(found.gaps, len(found.widths)),
        "width [s]": np.tile(found.widths, len(found.gaps)),
    }
    for name in chart:
        unit = chart[name].attrs["units"]
        columns[str(name) if unit == "1" else f"{name} [{unit}]"] = chart[name].values.reshape(-1)
    table = pd.DataFrame(columns)
    table.attrs.update(chart.attrs)
    return table


def save_quench(found: QuenchMap, path: str | Path) -> None:
    """Write a quench map as NetCDF (.nc) or CSV (.csv), whole or not at all.

    Raises
    ------
    InputError
        The name ends in neither, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    if target.suffix.lower() == ".nc":
        chart = quench_dataset(found)
        # The classic NetCDF format has no truth values.
        write_dataset(target, chart.assign(struck=chart["struck"].astype(np.int8)))
    elif target.suffix.lower() == ".csv":
        write_file(target, quench_table(found).to_csv(index=False, float_format="%.17g"))
    else:
        raise InputError(f"{target}: expected a name that ends in .nc or .csv")
