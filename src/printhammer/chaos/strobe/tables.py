"""Strobe points as tables and files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.run.ensemble import MODE_NAMES
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from printhammer.chaos.strobe.points import Strobe

COLUMNS: Final = {
    "t": ("s", "time"),
    "x": ("m", "displacement"),
    "v": ("m/s", "velocity"),
    "branch": ("1", "mode of motion"),
    "memory": ("m", "latest local maximum inside the pack"),
}
"""Units and meanings of what is known of each point, by name."""

SUFFIXES: Final = (".csv", ".nc", ".json")
"""Endings of the files that hold points."""


def strobe_dataset(strobe: Strobe) -> xr.Dataset:
    """Return strobe points as a Dataset.

    Parameters
    ----------
    strobe : Strobe
        The points.

    Returns
    -------
    xarray.Dataset
        Over `firing`, the number of the firing, 1 for the very first: `t` [s], `x` [m], `v` [m/s], `branch`
        and `memory` [m]; units and long names in the attributes of each, provenance and verdict in those of
        the set.
    """
    import xarray as xr

    data: dict[str, Any] = {}
    for name, (unit, meaning) in COLUMNS.items():
        values = getattr(strobe, name)
        # The classic NetCDF format has no longer integers.
        kept = values.astype(np.int32) if name == "branch" else values
        data[name] = ("firing", kept, {"units": unit, "long_name": meaning})
    data["branch"][2]["codes"] = ", ".join(f"{code} {name}" for code, name in enumerate(MODE_NAMES))
    number = ("firing", strobe.firing.astype(np.int32), {"units": "1", "long_name": "number of the firing"})
    title = f"strobe points of {strobe.hammer.name}, every {strobe.period:.9g} s"
    known = {key: value for key, value in strobe.provenance.items() if value is not None}
    return xr.Dataset(data, coords={"firing": number}, attrs={"title": title, **known})


def strobe_table(strobe: Strobe) -> pd.DataFrame:
    """Return strobe points as a table, columns such as "x [m]", branches by name; provenance in `attrs`."""
    import pandas as pd

    columns: dict[str, Any] = {"firing": strobe.firing}
    for name, (unit, _meaning) in COLUMNS.items():
        columns[name if unit == "1" else f"{name} [{unit}]"] = getattr(strobe, name)
    columns["branch"] = [MODE_NAMES[code] if code >= 0 else "" for code in strobe.branch]
    table = pd.DataFrame(columns)
    table.attrs.update(strobe.provenance)
    return table


def save_strobe(strobe: Strobe, path: str | Path) -> None:
    """Write strobe points as CSV, NetCDF or JSON, by the end of the name; whole or not at all.

    JSON alone holds the verdict beside the points; NetCDF has it in the attributes.

    Raises
    ------
    InputError
        The name ends in none of them, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind == ".csv":
        write_file(target, strobe_table(strobe).to_csv(index=False, float_format="%.17g"))
    elif kind == ".nc":
        write_dataset(target, strobe_dataset(strobe))
    elif kind == ".json":
        columns = strobe_table(strobe).astype(object).where(lambda table: table.notna(), None)
        found = {**strobe.provenance, "points": columns.to_dict(orient="list")}
        write_file(target, json.dumps(found, indent=2, allow_nan=False) + "\n")
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")
