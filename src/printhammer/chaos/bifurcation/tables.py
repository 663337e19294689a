"""Bifurcation diagrams as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.text import inline, waveform_text
from printhammer.errors import InputError
from printhammer.hammer.names import PERIOD, RATE
from printhammer.run.ensemble import MODE_NAMES
from printhammer.support.constants import quantities
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from printhammer.chaos.bifurcation.diagram import Bifurcation
    from printhammer.run.regime import Regime

SUFFIXES: Final = (".nc", ".csv")
"""Endings of the files that hold a diagram."""

_FORCE: Final = {
    "drive.amplitude": ("N", "amplitude of the force"),
    "drive.phase": ("rad", "phase of the force"),
}


def meaning_of(regime: Regime, name: str) -> tuple[str, str]:
    """Return SI unit and meaning of a parameter; see `printhammer.run.regime.Regime.with_`."""
    if name == PERIOD:
        return "s", "time between firings" if regime.drive is None else "period of the force"
    if name == RATE:
        return "Hz", "firing rate" if regime.drive is None else "frequency of the force"
    if name in _FORCE:
        return _FORCE[name]
    if name.startswith("waveform.") and regime.waveform is not None:
        field = name.removeprefix("waveform.")
        note = quantities(type(regime.waveform))[field]
        return regime.waveform.unit if note.also else note.si, note.meaning
    constant = regime.hammer.constants[name]
    return constant.si_unit, constant.meaning


def provenance_of(regime: Regime, tolerance: float) -> dict[str, Any]:
    """Return where a result comes from: fingerprints, drive, tolerance, versions."""
    import numba

    from printhammer import __version__

    fired = regime.fired
    return {
        "hammer": regime.hammer.name,
        "hammer_fingerprint": regime.hammer.fingerprint,
        "waveform": inline(waveform_text(fired)),
        "overlap": regime.overlap,
        "tolerance": repr(float(tolerance)),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def bifurcation_dataset(diagram: Bifurcation) -> xr.Dataset:
    """Return a diagram as a Dataset.

    Parameters
    ----------
    diagram : Bifurcation
        The diagram.

    Returns
    -------
    xarray.Dataset
        Over `direction`, `column` and `firing`: `x` [m], `v` [m/s] and `branch`; over `direction` and
        `column`: `verdict`, `cycle`, `distance`, `exponent`, `standard_error` and `status`; over `column`:
        the coordinate `value`, in the unit of its attributes, and `level`. Provenance is in the attributes.
    """
    import xarray as xr

    unit, meaning = meaning_of(diagram.regime, diagram.parameter)
    every, each = ("direction", "column", "firing"), ("direction", "column")
    codes = ", ".join(f"{code} {name}" for code, name in enumerate(MODE_NAMES))

    def entry(dims: Any, values: Any, unit: str, meaning: str, **more: str) -> Any:
        return dims, values, {"units": unit, "long_name": meaning, **more}

    data = {
        "x": entry(every, diagram.x, "m", "displacement"),
        "v": entry(every, diagram.v, "m/s", "velocity"),
        "branch": entry(every, diagram.branch, "1", "mode of motion", codes=codes),
        "verdict": entry(each, diagram.verdicts, "1", "verdict"),
        "cycle": entry(
            each, diagram.cycles.astype(np.int32), "1", "firings after which states repeat, 0 for none"
        ),
        "distance": entry(
            each, diagram.distances, "1", "distance of states a period apart, half-widths of the window"
        ),
        "exponent": entry(each, diagram.exponents, "1", "largest exponent of the strobe map, per firing"),
        "standard_error": entry(each, diagram.standard_errors, "1", "standard error of the exponent"),
        "status": entry(each, diagram.status, "1", "how the run ended"),
        "level": entry("column", diagram.levels.astype(np.int32), "1", "refinement, 0 for a given value"),
    }
    coordinates = {
        "direction": entry("direction", np.array(diagram.directions), "1", "how the state was carried"),
        "value": entry("column", diagram.values, unit, meaning, parameter=diagram.parameter),
        "firing": entry("firing", diagram.firing.astype(np.int32), "1", "number of the firing"),
    }
    attributes = {
        "title": f"bifurcation diagram of {diagram.regime.hammer.name} in {diagram.parameter}",
        "parameter": diagram.parameter,
        **({} if diagram.parameter in (PERIOD, RATE) else {"period": diagram.regime.period}),
        "phase": diagram.phase,
        "trains_run_again": diagram.carried,
        **provenance_of(diagram.regime, diagram.tolerance),
    }
    return xr.Dataset(data, coords=coordinates, attrs=attributes)


def bifurcation_table(diagram: Bifurcation) -> pd.DataFrame:
    """Return the trains of a diagram as a table, a row each: direction, value, verdict and evidence."""
    import pandas as pd

    unit, _meaning = meaning_of(diagram.regime, diagram.parameter)
    head = diagram.parameter if unit == "1" else f"{diagram.parameter} [{unit}]"
    count = len(diagram.values)
    table = pd.DataFrame(
        {
            "direction": np.repeat(np.array(diagram.directions), count),
            head: np.tile(diagram.values, len(diagram.directions)),
            "verdict": diagram.verdicts.reshape(-1),
            "cycle": diagram.cycles.reshape(-1),
            "distance": diagram.distances.reshape(-1),
            "exponent per firing": diagram.exponents.reshape(-1),
            "standard error": diagram.standard_errors.reshape(-1),
            "status": diagram.status.reshape(-1),
            "level": np.tile(diagram.levels, len(diagram.directions)),
        }
    )
    table.attrs.update(bifurcation_dataset(diagram).attrs)
    return table


def save_bifurcation(diagram: Bifurcation, path: str | Path) -> None:
    """Write a diagram: the states as NetCDF (.nc), or the verdicts as CSV (.csv); whole or not at all.

    Raises
    ------
    InputError
        The name ends in neither, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    if target.suffix.lower() == ".nc":
        write_dataset(target, bifurcation_dataset(diagram))
    elif target.suffix.lower() == ".csv":
        write_file(target, bifurcation_table(diagram).to_csv(index=False, float_format="%.17g"))
    else:
        raise InputError(f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}")
