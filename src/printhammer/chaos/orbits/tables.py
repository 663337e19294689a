"""Periodic orbits as tables and files."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.orbits.orbit import KINDS
from printhammer.errors import InputError
from printhammer.run.ensemble import MODE_NAMES
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    import xarray as xr

    from printhammer.chaos.orbits.orbit import Orbit
    from printhammer.chaos.orbits.search import Orbits
    from printhammer.run.regime import Regime

SUFFIXES: Final = (".csv", ".nc", ".json")
"""Endings of the files that hold orbits."""

OF_ORBIT: Final = {
    "firings": ("1", "firings after which the motion repeats"),
    "period": ("s", "time after which the motion repeats"),
    "kind": ("1", "what becomes of small changes of the state"),
    "backstop_contacts": ("1", "backstop contacts in a period of the orbit"),
    "pack_contacts": ("1", "pack contacts in a period of the orbit"),
    "printed": ("1", "dots that the firings of a period make"),
    "lost": ("1", "firings of a period that make no dot"),
    "coil_work": ("J", "work of the coil in a period of the orbit"),
    "drive_work": ("J", "work of a drive that is a force in a period of the orbit"),
    "pack_loss": ("J", "energy that the pack takes in a period of the orbit"),
    "backstop_loss": ("J", "energy that the backstop takes in a period of the orbit"),
    "margin": ("1", "signed nearness of a grazing, in units of the way from backstop to pack"),
    "smooth": ("1", "whether the motion has a derivative"),
    "residual": ("1", "distance from itself after a period, in half-widths of the window"),
    "phase": ("1", "part of the drive's period from the first firing to the section"),
    "section_x": ("m", "displacement at the section"),
    "section_v": ("m/s", "velocity at the section"),
}
"""Units and meanings of what is known of an orbit, by name."""

OF_FIRING: Final = {
    "x": ("m", "displacement at the firing"),
    "v": ("m/s", "velocity at the firing"),
    "branch": ("1", "mode of motion at the firing"),
    "memory": ("m", "latest local maximum inside the pack"),
    "flight_time": ("s", "from the firing to the touch of the pack"),
    "peak_force": ("N", "largest pack force of the dot"),
}
"""Units and meanings of what is known of each firing, by name."""

_MULTIPLIERS: Final = ("multiplier_real", "multiplier_imag")


def provenance_of(regime: Regime, tolerance: float) -> dict[str, Any]:
    """Return where orbits of a regime come from: fingerprints, versions, tolerance."""
    import numba

    from printhammer import __version__

    drive = regime.train(1)[0]
    return {
        "hammer": regime.hammer.name,
        "hammer_fingerprint": regime.hammer.fingerprint,
        "waveform": f"{regime.fired.shape} {regime.fired.quantity}",
        "drive_fingerprint": drive.fingerprint,
        "drive_period": regime.period,
        "overlap": regime.overlap,
        "tolerance": repr(tolerance),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def orbit_dataset(orbit: Orbit) -> xr.Dataset:
    """Return one orbit as a Dataset over `firing` and `multiplier`; see `orbits_dataset`."""
    title = f"{orbit.name} of {orbit.regime.hammer.name}, every {orbit.regime.period:.9g} s"
    return _dataset([orbit], {"title": title, **orbit.provenance}).isel(orbit=0)


def orbits_dataset(orbits: Orbits) -> xr.Dataset:
    """Return orbits as a Dataset.

    Parameters
    ----------
    orbits : Orbits
        The orbits.

    Returns
    -------
    xarray.Dataset
        Over `orbit`, `firing` (0 for the first of an orbit; NaN, or -1 for the mode, beyond its last) and
        `multiplier`: states at the firings, dots, and per orbit kind, multipliers, contacts and energies;
        units and long names in the attributes of each, provenance in those of the set.
    """
    title = f"periodic orbits of {orbits.regime.hammer.name}, every {orbits.regime.period:.9g} s"
    return _dataset(orbits.found, {"title": title, **orbits.provenance})


def _dataset(found: Sequence[Orbit], attributes: dict[str, Any]) -> xr.Dataset:
    import xarray as xr

    most = max((orbit.firings for orbit in found), default=0)
    data: dict[str, Any] = {}
    for name, (unit, meaning) in OF_ORBIT.items():
        values = np.array([_of_orbit(orbit, name) for orbit in found], dtype=np.float64)
        whole = unit == "1" and name not in ("margin", "residual", "phase")
        # The classic NetCDF format has no longer integers.
        kept = values.astype(np.int32) if whole else values
        data[name] = ("orbit", kept, {"units": unit, "long_name": meaning})
    data["kind"][2]["codes"] = ", ".join(f"{code} {name}" for code, name in enumerate(KINDS))
    for name, (unit, meaning) in OF_FIRING.items():
        rows = np.full((len(found), most), np.nan)
        for row, orbit in zip(rows, found, strict=True):
            values = _of_firings(orbit, name)
            row[: len(values)] = values
        kept = np.where(np.isnan(rows), -1, rows).astype(np.int32) if name == "branch" else rows
        data[name] = (("orbit", "firing"), kept, {"units": unit, "long_name": meaning})
    data["branch"][2]["codes"] = ", ".join(f"{code} {name}" for code, name in enumerate(MODE_NAMES))
    multipliers = np.array([orbit.multipliers for orbit in found], np.complex128).reshape(-1, 2)
    for name, part in zip(_MULTIPLIERS, (multipliers.real, multipliers.imag), strict=True):
        told = {"units": "1", "long_name": f"{name.partition('_')[2]} part of the multipliers"}
        data[name] = (("orbit", "multiplier"), part.copy(), told)
    number = {"units": "1", "long_name": "number of the orbit, of the firing, of the multiplier"}
    coordinates = {
        "orbit": ("orbit", np.arange(len(found), dtype=np.int32), number),
        "firing": ("firing", np.arange(most, dtype=np.int32), number),
        "multiplier": ("multiplier", np.arange(2, dtype=np.int32), number),
    }
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def _of_orbit(orbit: Orbit, name: str) -> float:
    if name == "kind":
        return KINDS.index(orbit.kind)
    if name in ("coil_work", "drive_work", "pack_loss", "backstop_loss"):
        return math.nan if orbit.energy is None else float(getattr(orbit.energy, name))
    if name.startswith("section_"):
        return float(orbit.section["xv".index(name[-1])])
    return float(getattr(orbit, name))


def _of_firings(orbit: Orbit, name: str) -> Any:
    return getattr(orbit, {"flight_time": "flight_times", "peak_force": "peak_forces"}.get(name, name))


def orbits_table(found: Sequence[Orbit]) -> pd.DataFrame:
    """Return orbits as a table, a row for each firing of each, columns such as "x [m]"."""
    import pandas as pd

    rows: list[dict[str, Any]] = []
    for number, orbit in enumerate(found):
        shared: dict[str, Any] = {"orbit": number}
        for name, (unit, _meaning) in OF_ORBIT.items():
            value: Any = _of_orbit(orbit, name)
            whole = unit == "1" and name not in ("margin", "residual", "phase")
            shared[_head(name, unit)] = int(value) if whole else value
        shared["kind"] = orbit.kind
        for k, multiplier in enumerate(orbit.multipliers):
            shared |= {
                f"{name} {k + 1}": part for name, part in zip(_MULTIPLIERS, _parts(multiplier), strict=True)
            }
        columns = {name: _of_firings(orbit, name) for name in OF_FIRING}
        for k in range(orbit.firings):
            row = {**shared, "firing": k}
            for name, (unit, _meaning) in OF_FIRING.items():
                row[_head(name, unit)] = columns[name][k] if k < len(columns[name]) else math.nan
            row["branch"] = MODE_NAMES[orbit.branch[k]] if orbit.branch[k] >= 0 else ""
            rows.append(row)
    heads = ["orbit", *(_head(name, unit) for name, (unit, _meaning) in OF_ORBIT.items())]
    heads += [f"{name} {k}" for k in (1, 2) for name in _MULTIPLIERS]
    heads += ["firing", *(_head(name, unit) for name, (unit, _meaning) in OF_FIRING.items())]
    return pd.DataFrame(rows, columns=heads)


def _head(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _parts(number: complex) -> tuple[float, float]:
    return float(number.real), float(number.imag)


def save_orbits(orbits: Orbits, path: str | Path) -> None:
    """Write orbits as CSV, NetCDF or JSON, by the end of the name; whole or not at all.

    JSON and NetCDF tell of the search beside the orbits.

    Raises
    ------
    InputError
        The name ends in none of them, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind == ".csv":
        write_file(target, orbits_table(orbits.found).to_csv(index=False, float_format="%.17g"))
    elif kind == ".nc":
        write_dataset(target, orbits_dataset(orbits))
    elif kind == ".json":
        columns = orbits_table(orbits.found).astype(object).where(lambda table: table.notna(), None)
        found = {**orbits.provenance, "orbits": columns.to_dict(orient="records")}
        write_file(target, json.dumps(found, indent=2, allow_nan=False) + "\n")
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")
