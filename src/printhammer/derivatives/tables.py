"""Sensitivities and spreads as Datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.derivatives.dots import DOT_QUANTITIES, RUN_QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.derivatives.sensitivities import Sensitivities, Spread


def _coordinates(found: Sensitivities) -> dict[str, Any]:
    """Return the coordinates, units and meanings of quantities and constants among them."""
    number = {"units": "1", "long_name": "number of the firing, from 0"}
    return {
        "dot": ("dot", np.arange(len(found.dots), dtype=np.int32), number),
        "quantity": ("quantity", list(found.quantities)),
        "quantity_unit": ("quantity", [DOT_QUANTITIES[name][0] for name in found.quantities]),
        "quantity_meaning": ("quantity", [DOT_QUANTITIES[name][1] for name in found.quantities]),
        "energy": ("energy", list(found.run_quantities)),
        "energy_meaning": ("energy", [RUN_QUANTITIES[name][1] for name in found.run_quantities]),
        "constant": ("constant", list(found.constants)),
        "constant_unit": ("constant", list(found.units)),
        "constant_meaning": ("constant", list(found.meanings)),
    }


def sensitivity_dataset(found: Sensitivities) -> xr.Dataset:
    """Return sensitivities as a Dataset, see `Sensitivities.to_dataset`."""
    import xarray as xr

    table = ("dot", "quantity", "constant")
    own = "quantity_unit"
    per = "quantity_unit / constant_unit"
    change = "change of a quantity with a constant"
    part = "change of a quantity in parts of it for a change of a constant in parts of it"
    data: dict[str, Any] = {
        "value": (table[:2], found.dots, {"units": own, "long_name": "value"}),
        "derivative": (table, found.derivatives, {"units": per, "long_name": change}),
        "logarithmic": (table, found.logarithmic, {"units": "1", "long_name": part}),
        "run_value": (("energy",), found.run, {"units": "J", "long_name": "energy of the run"}),
        "run_derivative": (
            ("energy", "constant"),
            found.run_derivatives,
            {"units": "J / constant_unit", "long_name": change},
        ),
        "run_logarithmic": (
            ("energy", "constant"),
            found.run_logarithmic,
            {"units": "1", "long_name": part},
        ),
        "constant_value": (
            ("constant",),
            found.values,
            {"units": "constant_unit", "long_name": "value of a constant"},
        ),
    }
    title = f"sensitivities of {found.hammer.name}"
    return xr.Dataset(data, coords=_coordinates(found), attrs={"title": title, **found.provenance})


def spread_dataset(spread: Spread) -> xr.Dataset:
    """Return how tolerances show as a Dataset, see `Spread.to_dataset`."""
    import xarray as xr

    found = spread.sensitivities
    independent = "standard deviation for independent constants"
    extreme = "deviation with all constants at their worst ends"
    own, table = "quantity_unit", ("dot", "quantity")
    data: dict[str, Any] = {
        "value": (table, found.dots, {"units": own, "long_name": "value"}),
        "deviation": (table, spread.deviation, {"units": own, "long_name": independent}),
        "worst": (table, spread.worst, {"units": own, "long_name": extreme}),
        "contribution": (
            (*table, "constant"),
            spread.dots,
            {"units": own, "long_name": "deviation that one constant alone makes"},
        ),
        "run_value": (("energy",), found.run, {"units": "J", "long_name": "energy of the run"}),
        "run_deviation": (("energy",), spread.run_deviation, {"units": "J", "long_name": independent}),
        "run_worst": (("energy",), spread.run_worst, {"units": "J", "long_name": extreme}),
        "spread": (
            ("constant",),
            spread.spreads,
            {"units": "1", "long_name": "relative spread of a constant"},
        ),
    }
    title = f"spread of what {found.hammer.name} prints"
    return xr.Dataset(data, coords=_coordinates(found), attrs={"title": title, **found.provenance})
