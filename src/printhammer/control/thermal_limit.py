"""The temperature limit of a coil winding, from the maker's dot rates at several ambient temperatures.

On one rail the largest rate is (L - A) / K, with the temperature limit L of the winding, the ambient
temperature A and the temperature rise K per unit of dot rate (`printhammer.control.duty`). L is common to all
rails, K is one constant per rail; both are fitted by least squares to the logarithms of the rates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.control.duty import COLDEST, read_temperature
from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.results import Result, column, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    styled,
)
from printhammer.support.arrays import FloatArray
from printhammer.support.roots import bisect

COLUMNS: Final = {"voltage": "V", "ambient": "degC", "rate": "Hz"}
"""Columns of a file of permitted dot rates, with their SI units."""

_HIGHEST: Final = 1e4  # Upper end of the search for the limit, K above the hottest ambient; arbitrary


class ThermalLimit(Result):
    """Temperature limit of a winding, fitted to rates at several ambient temperatures."""

    limit: float = scalar("degC", "temperature limit of the winding")
    error: float = scalar(
        "K", "standard error of the limit", more="from the residuals; NaN without a spare degree of freedom"
    )
    voltage: FloatArray = column("V", "rail voltage", "row")
    ambient: FloatArray = column("degC", "ambient temperature", "row")
    rate: FloatArray = column("Hz", "largest dot rate, as stated", "row")
    fitted: FloatArray = column("Hz", "largest dot rate, from the fit", "row")
    warming: FloatArray = column("K s", "warming of the winding per hertz of dot rate on this rail", "row")

    @property
    def title(self) -> str:
        """One-line title with the temperature limit."""
        return f"largest temperature of a coil, {self.limit:.4g} degC"

    def summary(self) -> Summary:
        """Tabulate the stated and fitted rates, and state the limit."""
        error = "" if np.isnan(self.error) else f" ± {self.error:.2g}"
        columns = [
            Cells("rail", [each or None for each in self.voltage.tolist()], "V", "g"),
            self.cells("ambient", format="g"),
            self.cells("rate", "stated", "g"),
            self.cells("fitted", "from the limit", ".1f"),
            Cells("1 Hz warms by", self.warming, "K", ".4g"),
        ]
        limit = styled("strong", f"{self.limit:.1f}{error} °C")
        return Summary([f"limit of the winding {limit}", "", Grid(columns)])


def thermal_limit(
    ambient: Sequence[float | str],
    rate: Sequence[float | str],
    voltage: Sequence[float | str] | None = None,
) -> ThermalLimit:
    """Fit the temperature limit of a coil to its largest dot rates.

    Parameters
    ----------
    ambient, rate : sequence of float or str
        Ambient temperatures [degC] and the largest dot rates at these temperatures, Hz.
    voltage : sequence of float or str, optional
        Rail voltages [V] of the rates; by default one common rail.

    Raises
    ------
    InputError
        The sequences differ in length, no rail has rates at two ambient temperatures, or the rates do not
        fall appreciably with the ambient temperature.
    """
    for name, values in (("ambient", ambient), ("rate", rate)):
        if isinstance(values, str) or not np.iterable(values):
            raise InputError.of(name, values, "a sequence of numbers or texts with units")
    cold = np.array([read_temperature(each, "ambient") for each in ambient])
    rates = np.array([read_positive(each, "Hz", "rate") for each in rate])
    rails = np.array([read_number(each, "V", "voltage") for each in voltage or [0.0] * len(cold)])
    if not cold.size == rates.size == rails.size:
        raise InputError(
            f"{cold.size} ambient temperatures, {rates.size} rates and {rails.size} voltages",
            key="rates",
            expected="equal numbers of each",
        )
    _kinds, group = np.unique(rails, return_inverse=True)
    if not any(np.unique(cold[group == each]).size > 1 for each in group):
        raise InputError(
            "expected rates at two ambient temperatures or more of one rail at least", key="rates"
        )

    def centred(values: FloatArray) -> FloatArray:
        sums = np.bincount(group, values)
        return values - (sums / np.bincount(group))[group]

    def off(limit: float) -> FloatArray:
        return centred(np.log(rates) - np.log(limit - cold))

    def slope(limit: float) -> float:
        return float(off(limit) @ centred(1.0 / (limit - cold)))

    # The slope is positive below the limit and negative above it, so bisection finds the limit.
    hottest = float(cold.max())
    low, high = hottest + 1e-6 * (hottest - COLDEST), hottest + _HIGHEST
    if not slope(low) > 0.0 > slope(high):
        raise InputError(
            "the rates", key="rates", expected="rates that fall as the ambient temperature rises"
        )
    limit = bisect(slope, low, high)
    residuals = off(limit)
    spare = cold.size - np.unique(group).size - 1
    steepness = float(np.sum(centred(1.0 / (limit - cold)) ** 2))
    error = math.sqrt(float(residuals @ residuals) / spare / steepness) if spare > 0 else math.nan
    fitted = rates / np.exp(residuals)
    return ThermalLimit(
        limit=limit,
        error=error,
        voltage=rails,
        ambient=cold,
        rate=rates,
        fitted=fitted,
        warming=(limit - cold) / fitted,
    )


def read_rates(path: Path) -> dict[str, list[float]]:
    """Read a table of dot rates for `thermal_limit`, with the `COLUMNS`; the voltages are optional."""
    from printhammer.support.tables.readings import read_table

    wanted = {name: COLUMNS[name] for name in ("ambient", "rate")}
    table = read_table(path, wanted, optional={"voltage": COLUMNS["voltage"]})
    return {name: values.tolist() for name, values in table.values.items()}
