"""Coil work of optimised bursts as a function of the dot rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from printhammer.control.least_work.burst import NoBurstError, least_work
from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
)
from printhammer.support.arrays import FloatArray, IntArray, TextArray

FOUND = "ok"
NOT_FOUND = "no current found"


class LeastWorkRates(Result):
    """Coil work of optimised bursts, by dot rate; NaN where no current was found."""

    hammer: Hammer = part("driven hammer")
    rates: FloatArray = coordinate("Hz", "dot rate", "rate", name="rate")
    count: int = scalar("1", "number of dots of each burst", name="dots")
    net_ratio: FloatArray = column("1", "net coil work over the energy absorbed by the pack", "rate")
    positive_ratio: FloatArray = column("1", "positive coil work over the absorbed energy", "rate")
    bound_ratio: FloatArray = column("1", "lower bound on the positive work over the absorbed energy", "rate")
    squared_current: FloatArray = column("A^2 s", "integral of the squared current", "rate")
    adequate: IntArray = column("1", "number of adequate dots", "rate")
    status: TextArray = column(
        "", "whether a current was found", "rate", more="a failed search does not prove that none exists"
    )

    @property
    def title(self) -> str:
        """One-line title with the name of the hammer."""
        return f"bursts of least work of {self.hammer.name}"

    def summary(self) -> Summary:
        """Tabulate dots, coil work and the lower bound on the coil work of each burst, one row per rate."""
        columns = [
            self.cells("rates", "rate", ".6g"),
            Cells("adequate dots", [f"{adequate} of {self.count}" for adequate in self.adequate]),
            self.cells("net_ratio", "W", ".4f"),
            self.cells("positive_ratio", "W+", ".4f"),
            self.cells("bound_ratio", "least W+", ".4f"),
            Cells("", ["" if status == FOUND else str(status) for status in self.status]),
        ]
        return Summary([Grid(columns)])


def least_work_rates(
    hammer: Hammer,
    rates: Sequence[float | str],
    *,
    dots: int = 3,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> LeastWorkRates:
    """Optimise a burst of least coil work at each of several dot rates.

    Parameters
    ----------
    hammer : Hammer
        The hammer to drive.
    rates : sequence of float or str
        Dot rates [Hz] or text with a unit.
    dots : int, optional
        Number of dots of each burst.
    progress : callable, optional
        Called with the number of finished rates and the total number.
    **options
        As for `least_work`.

    Returns
    -------
    LeastWorkRates
        Coil work as a fraction of the energy absorbed by the pack, at each rate; a failed search raises no
        exception.
    """
    if isinstance(rates, str) or not len(rates):
        raise InputError.of("rates", rates, "at least one rate in a sequence")
    asked = np.array([read_positive(rate, "Hz", "rate") for rate in rates])
    rows: list[tuple[float, float, float, float, int, str]] = []
    for number, rate in enumerate(asked.tolist()):
        try:
            burst = least_work(hammer, rate, dots=dots, **options)
        except NoBurstError:
            rows.append((np.nan, np.nan, np.nan, np.nan, 0, NOT_FOUND))
        else:
            ratios = burst.net_ratio, burst.positive_ratio, burst.bound_ratio
            rows.append((*ratios, burst.work.squared_current, burst.adequate, FOUND))
        if progress is not None:
            progress(number + 1, asked.size)
    net, positive, least, squared, adequate, status = zip(*rows, strict=True)
    return LeastWorkRates(
        hammer=hammer,
        rates=asked,
        count=int(dots),
        net_ratio=np.array(net),
        positive_ratio=np.array(positive),
        bound_ratio=np.array(least),
        squared_current=np.array(squared),
        adequate=np.array(adequate, dtype=np.int64),
        status=np.array(status, dtype="U16"),
    )
