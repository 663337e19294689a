"""Printed pages as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.dots.judging import FAULTS
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from printhammer.printing.page.page import Page

_GOOD = "none"


def page_dataset(page: Page) -> xr.Dataset:
    """Return a page as a Dataset.

    Parameters
    ----------
    page : Page
        The page.

    Returns
    -------
    xarray.Dataset
        Over `dot`: `line`, `wire`, `slot`, `run`, `lost`, `fault`, `x` and `y` [m], `placement_error` [m],
        `arrival_deviation` [s], `flight_time` [s], `peak_force` [N], `force_ratio`, `indentation` [m],
        `darkness`, `extra_contacts`; over `extra`: `extra_of`, `extra_x` and `extra_y` [m], `extra_force`
        [N]; over `member`: `run_line`, `run_wire`, `status`. Lines, wires and slots count from 0. Provenance
        in the attributes.
    """
    import numba
    import xarray as xr

    from printhammer import __version__

    across, down = page.places
    extra_across, extra_down = page.extra_places
    faults = np.array([*FAULTS, _GOOD], "U16")[page.fault]
    over_dots = {
        "line": (page.line, "1", "print line"),
        "wire": (page.wire, "1", "wire, the topmost one is 0"),
        "slot": (page.slot, "1", "slot"),
        "run": (page.run, "1", "whether the run came so far"),
        "lost": (page.lost, "1", "whether the firing made no dot"),
        "fault": (faults, "1", "first fault, by the limits"),
        "x": (across, "m", "place of the dot, from the middle of slot 0 to the right"),
        "y": (down, "m", "place of the dot, from the topmost wire down"),
        "placement_error": (page.placement_error, "m", "place less wanted place, along the line"),
        "arrival_deviation": (page.arrival_deviation, "s", "touch less slot time and nominal flight time"),
        "flight_time": (page.flight_time, "s", "from firing to touch"),
        "peak_force": (page.peak_force, "N", "largest pack force"),
        "force_ratio": (page.force_ratio, "1", "largest pack force over that of the single pulse"),
        "indentation": (page.indentation, "m", "largest indentation"),
        "darkness": (page.darkness, "1", "share of the light that does not come back"),
        "extra_contacts": (page.extra_contacts, "1", "further pack contacts"),
    }
    over_extras = {
        "extra_of": (page.extra_of, "1", "dot that the extra contact belongs to"),
        "extra_x": (extra_across, "m", "place of the extra contact, as x"),
        "extra_y": (extra_down, "m", "place of the extra contact, as y"),
        "extra_force": (page.extra_force, "N", "largest pack force of the extra contact"),
    }
    over_runs = {
        "run_line": (page.run_line, "1", "print line of the run"),
        "run_wire": (page.run_wire, "1", "wire of the run"),
        "status": (page.status, "1", "how the run ended"),
    }
    data: dict[str, Any] = {
        name: (dimension, values, {"units": unit, "long_name": meaning})
        for dimension, group in (("dot", over_dots), ("extra", over_extras), ("member", over_runs))
        for name, (values, unit, meaning) in group.items()
    }
    head, limits = page.head, page.limits
    attributes = {
        "title": f"page printed by {page.hammer.name}",
        "hammer": page.hammer.name,
        "hammer_fingerprint": page.hammer.fingerprint,
        "pattern": page.pattern.name,
        "lines": page.pattern.lines,
        "wires": page.pattern.wires,
        "slots": page.pattern.slots,
        "rate": page.rate,
        "strategy": page.strategy,
        "wire_pitch": head.wire_pitch,
        "pitch": head.pitch,
        "line_pitch": head.line_pitch,
        "wire_diameter": head.wire_diameter,
        "density": head.density,
        "nominal_force": page.nominal.force,
        "nominal_flight_time": page.nominal.flight_time,
        "limit_force": limits.force,
        "limit_arrival": limits.arrival,
        "limit_extra_contacts": limits.extra_contacts,
        "tolerance": repr(float(page.tolerance)),
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
    return xr.Dataset(data, attrs=attributes)


def page_table(page: Page) -> pd.DataFrame:
    """Return the wanted dots as a table, a row each."""
    import pandas as pd

    chart = page_dataset(page)
    columns: dict[str, Any] = {}
    for name, values in chart.items():
        if values.dims == ("dot",):
            unit = values.attrs["units"]
            columns[str(name) if unit == "1" else f"{name} [{unit}]"] = values.values
    table = pd.DataFrame(columns)
    table.attrs.update(chart.attrs)
    return table


def save_page(page: Page, path: str | Path) -> None:
    """Write the dots of a page as NetCDF (.nc) or CSV (.csv), whole or not at all.

    Raises
    ------
    InputError
        The name ends in neither, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    if target.suffix.lower() == ".nc":
        chart = page_dataset(page)
        # The classic NetCDF format has no truth values.
        truths = {name: values.astype(np.int8) for name, values in chart.items() if values.dtype == np.bool_}
        write_dataset(target, chart.assign(truths))
    elif target.suffix.lower() == ".csv":
        write_file(target, page_table(page).to_csv(index=False, float_format="%.17g"))
    else:
        raise InputError(f"{target}: expected a name that ends in .nc or .csv")
