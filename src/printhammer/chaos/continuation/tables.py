"""Branches of periodic orbits as tables and files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.continuation.events import KINDS
from printhammer.errors import InputError
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    import xarray as xr

    from printhammer.chaos.continuation.branch import Branch

SUFFIXES: Final = (".csv", ".nc", ".json")
"""Endings of the files that hold branches."""

OF_ORBIT: Final = {
    "stable": ("1", "whether all small changes of the state die out"),
    "backstop_contacts": ("1", "backstop contacts in a period of the orbit"),
    "pack_contacts": ("1", "pack contacts in a period of the orbit"),
    "printed": ("1", "firings of a period that make a dot"),
    "lost": ("1", "firings of a period that make no dot"),
    "coil_work": ("J", "work of the coil in a period of the orbit"),
    "drive_work": ("J", "work of a drive that is a force in a period of the orbit"),
    "pack_loss": ("J", "energy that the pack takes in a period of the orbit"),
    "backstop_loss": ("J", "energy that the backstop takes in a period of the orbit"),
    "residual": ("1", "distance from itself after a period, in half-widths of the window"),
}
"""Units and meanings of what is known of each orbit, by name."""

OF_FIRING: Final = {
    "x": ("m", "displacement at the section"),
    "v": ("m/s", "velocity at the section"),
    "flight_time": ("s", "from the firing to the touch of the pack"),
    "impact_speed": ("m/s", "velocity at the touch of the pack"),
    "peak_force": ("N", "largest pack force"),
}
"""Units and meanings of what is known of each firing of an orbit, by name."""

_WHOLE: Final = ("stable", "backstop_contacts", "pack_contacts", "printed", "lost")


def branch_dataset(branch: Branch) -> xr.Dataset:
    """Return a branch as a Dataset.

    Returns
    -------
    xarray.Dataset
        Over `orbit`, in order along the branch, `firing` and `multiplier`: the constant under the name
        `value`, states, multipliers, contacts, dots and energies; over `event`: what happens on the way.
        Units and long names in the attributes of each, provenance and both ends in those of the set.
    """
    return branches_dataset([branch]).isel(branch=0, drop=True).assign_attrs(_attributes(branch))


def _attributes(branch: Branch) -> dict[str, Any]:
    title = f"period-{branch.firings} orbits of {branch.regime.hammer.name} along {branch.parameter}"
    return {"title": title, **branch.provenance}


def branches_dataset(branches: Sequence[Branch]) -> xr.Dataset:
    """Return branches along the same constant as one Dataset over `branch`, filled up with NaN or -1."""
    import xarray as xr

    most = max((len(branch) for branch in branches), default=0)
    firings = max((branch.firings for branch in branches), default=0)
    # At least one column: a dimension of length 0 has another meaning in the classic NetCDF format.
    events = max(1, *(len(branch.events) for branch in branches)) if branches else 1
    count = len(branches)
    unit = branches[0].unit if branches else "1"
    name = branches[0].parameter if branches else ""
    value = np.full((count, most), np.nan)
    data: dict[str, Any] = {}
    for i, branch in enumerate(branches):
        value[i, : len(branch)] = branch.values
    data["value"] = (("branch", "orbit"), value, {"units": unit, "long_name": name})
    for key, (si, meaning) in OF_ORBIT.items():
        table = np.full((count, most), np.nan)
        for i, branch in enumerate(branches):
            table[i, : len(branch)] = getattr(branch, key)
        # The classic NetCDF format has no longer integers.
        kept = np.where(np.isnan(table), -1, table).astype(np.int32) if key in _WHOLE else table
        data[key] = (("branch", "orbit"), kept, {"units": si, "long_name": meaning})
    for key, (si, meaning) in OF_FIRING.items():
        cube = np.full((count, most, firings), np.nan)
        for i, branch in enumerate(branches):
            cube[i, : len(branch), : branch.firings] = getattr(branch, key)
        data[key] = (("branch", "orbit", "firing"), cube, {"units": si, "long_name": meaning})
    for part in ("real", "imag"):
        cube = np.full((count, most, 2), np.nan)
        for i, branch in enumerate(branches):
            cube[i, : len(branch)] = getattr(branch.multipliers, part)
        attributes = {"units": "1", "long_name": f"{part} part of the multipliers"}
        data[f"multiplier_{part}"] = (("branch", "orbit", "multiplier"), cube, attributes)
    kinds, places = np.full((count, events), -1, np.int32), np.full((count, events), np.nan)
    for i, branch in enumerate(branches):
        for j, event in enumerate(branch.events):
            kinds[i, j], places[i, j] = KINDS.index(event.kind), event.value
    codes = ", ".join(f"{code} {kind}" for code, kind in enumerate(KINDS))
    what = {"units": "1", "long_name": "what happens on the way", "codes": codes}
    data["event_kind"] = (("branch", "event"), kinds, what)
    data["event_value"] = (("branch", "event"), places, {"units": unit, "long_name": name})
    for key, told in (
        ("firings", "firings after which the orbits repeat"),
        ("closed", "whether the branch is a closed loop"),
    ):
        whole = np.array([getattr(branch, key) for branch in branches], dtype=np.int32)
        data[key] = ("branch", whole, {"units": "1", "long_name": told})
    first = branches[0].provenance if branches else {}
    shared = {key: first[key] for key in first if key not in ("firings", "closed", "first_end", "last_end")}
    ends = {f"branch_{i}": branch.message for i, branch in enumerate(branches)}
    return xr.Dataset(data, attrs={"title": f"branches of periodic orbits along {name}", **shared, **ends})


def branches_table(branches: Sequence[Branch]) -> pd.DataFrame:
    """Return branches as a table, a row for each orbit and firing, columns such as "x [m]"."""
    import pandas as pd

    tables = []
    for number, branch in enumerate(branches):
        count, firings = len(branch), branch.firings
        columns: dict[str, Any] = {
            "branch": np.full(count * firings, number),
            "orbit": np.repeat(np.arange(count), firings),
            "firing": np.tile(np.arange(firings), count),
            f"{branch.parameter} [{branch.unit}]": np.repeat(branch.values, firings),
        }
        for key, (si, _) in OF_FIRING.items():
            columns[f"{key} [{si}]"] = getattr(branch, key).reshape(-1)
        for key, (si, _) in OF_ORBIT.items():
            columns[key if si == "1" else f"{key} [{si}]"] = np.repeat(getattr(branch, key), firings)
        for j in range(2):
            columns[f"multiplier_{j}_real"] = np.repeat(branch.multipliers[:, j].real, firings)
            columns[f"multiplier_{j}_imag"] = np.repeat(branch.multipliers[:, j].imag, firings)
        columns["contacts"] = np.repeat(np.array(branch.contacts, dtype=object), firings)
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def save_branches(branches: Sequence[Branch], path: str | Path) -> None:
    """Write branches as CSV, NetCDF or JSON, by the end of the name; whole or not at all.

    Raises
    ------
    InputError
        The name ends in none of them, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind == ".csv":
        write_file(target, branches_table(branches).to_csv(index=False, float_format="%.17g"))
    elif kind == ".nc":
        write_dataset(target, branches_dataset(branches))
    elif kind == ".json":
        write_file(target, json.dumps([_as_dict(branch) for branch in branches], indent=2) + "\n")
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")


def _as_dict(branch: Branch) -> dict[str, Any]:
    table = branches_table([branch]).drop(columns="branch").astype(object)
    rows = table.where(table.notna(), None).to_dict(orient="list")
    events = [
        {
            "kind": event.kind,
            "value": event.value,
            "what": event.told,
            "after": event.after,
            "contacts": list(event.contacts),
            "located": event.sharp,
        }
        for event in branch.events
    ]
    stable = [list(pair) for pair in branch.stable_ranges]
    return {**branch.provenance, "unit": branch.unit, "stable": stable, "events": events, "orbits": rows}
