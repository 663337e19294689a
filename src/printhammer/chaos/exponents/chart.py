"""Lyapunov exponents of many trains: how a hammer behaves against the time between firings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from printhammer.chaos.exponents.lyapunov import FIRINGS, TRANSIENT, exponents_of_train
from printhammer.chaos.strobe.points import transient_of
from printhammer.chaos.strobe.train import Train
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import regimes_of
from printhammer.support.threads import in_threads, thread_count

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import xarray as xr

    from printhammer.chaos.exponents.lyapunov import Lyapunov
    from printhammer.chaos.strobe.points import Strobe
    from printhammer.drive.base import Overlap
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray
    from printhammer.support.threads import Progress


@dataclass(frozen=True)
class LyapunovChart:
    """Lyapunov exponents against the period of the train; arrays of one row for each train.

    Attributes
    ----------
    hammer : Hammer
        The hammer, the first one where there are several.
    drive : Drive
        The drive of the first train.
    period : array, shape (m,)
        Times between firings, s.
    first, last : int
        Firings between which growth counts.
    tolerance : float
        Tolerance of the integration.
    exponents, standard_errors : array, shape (m, 2)
        As for `Lyapunov`.
    total, total_error, dimension, dimension_error : array, shape (m,)
        As for `Lyapunov`.
    k : array, shape (m,)
        K of the 0-1 test; NaN where there are too few points.
    verdict, zero_one : tuple of str
        Verdicts on the points and of the 0-1 test.
    growth : tuple of str
        What the largest exponent alone says.
    status : tuple of str
        How the runs ended.
    smooth : bool array, shape (m,)
        As for `Lyapunov`.
    """

    hammer: Hammer
    drive: Drive
    period: FloatArray
    first: int
    last: int
    tolerance: float
    exponents: FloatArray
    standard_errors: FloatArray
    total: FloatArray
    total_error: FloatArray
    dimension: FloatArray
    dimension_error: FloatArray
    k: FloatArray
    verdict: tuple[str, ...]
    zero_one: tuple[str, ...]
    growth: tuple[str, ...]
    status: tuple[str, ...]
    smooth: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, found: Sequence[Lyapunov]) -> LyapunovChart:
        """Make a chart of results for single trains.

        Raises
        ------
        InputError
            There are none.
        """
        if not found:
            raise InputError("periods: expected at least one train")
        return _chart(found[0].points, [_row(one) for one in found])

    def to_dataset(self) -> xr.Dataset:
        """Return the chart as a Dataset over `period`, with units and provenance in the attributes."""
        from printhammer.chaos.exponents.tables import chart_dataset

        return chart_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw exponents and K against the period; returns a matplotlib figure."""
        return import_module("printhammer.figures.chaos.lyapunov").plot_chart(self, **options)


def lyapunovs(
    hammers: Hammer | Regime | Sequence[Hammer | Regime],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    *,
    firings: SupportsIndex = FIRINGS,
    transient: SupportsIndex = TRANSIENT,
    waveform: Waveform | None = None,
    overlap: Overlap | None = None,
    tolerance: float = TOLERANCE,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LyapunovChart:
    """Return the Lyapunov exponents of many trains from rest, computed on all cores; see `lyapunov`.

    Parameters
    ----------
    hammers, periods, waveform, overlap
        Hammers or regimes and how they are fired, see `printhammer.run.regime.regimes_of`.
    firings, transient, tolerance
        As for `lyapunov`, for all trains.
    threads : int, optional
        By default as many as there are cores; the results do not depend on it.
    progress : callable, optional
        Called now and then with the number of trains that are done and of all.

    Returns
    -------
    LyapunovChart
        A row for each train, and the same that each has alone, to the last bit.

    Raises
    ------
    InputError
        As for `lyapunov`, or numbers of hammers and periods that do not fit together.
    """
    counts = read_count(firings, "firings"), transient_of(transient)
    regimes = regimes_of(hammers, periods, waveform=waveform, overlap=overlap)
    trains = [Train.of(regime.at_firings, sum(counts) + 1) for regime in regimes]
    # Only a row is kept of each train, so that memory does not grow with their length.
    rows: dict[int, dict[str, Any]] = {}
    begun: dict[int, Strobe] = {}

    def work(begin: int, end: int) -> None:
        for i in range(begin, end):
            found = exponents_of_train(trains[i], counts, tolerance)
            rows[i] = _row(found)
            if i == 0:
                begun[0] = found.points

    in_threads([work], [len(trains)], thread_count(threads), progress)
    return _chart(begun[0], [rows[i] for i in range(len(trains))])


def _row(found: Lyapunov) -> dict[str, Any]:
    """Return what a chart keeps of a train."""
    return {
        "period": found.period,
        "exponents": found.exponents,
        "standard_errors": found.standard_errors,
        "total": found.total,
        "total_error": found.total_error,
        "dimension": found.dimension,
        "dimension_error": found.dimension_error,
        "k": math.nan if found.zero_one is None else found.zero_one.k,
        "verdict": found.verdict.name,
        "zero_one": "undecided" if found.zero_one is None else found.zero_one.verdict,
        "growth": found.growth,
        "status": found.status,
        "smooth": found.smooth,
    }


def _chart(points: Strobe, rows: list[dict[str, Any]]) -> LyapunovChart:
    named = ("verdict", "zero_one", "growth", "status")
    columns: dict[str, Any] = {
        name: tuple(row[name] for row in rows) if name in named else np.array([row[name] for row in rows])
        for name in rows[0]
    }
    return LyapunovChart(
        hammer=points.hammer,
        drive=points.drive,
        first=int(points.firing[0]),
        last=int(points.firing[-1]),
        tolerance=points.tolerance,
        **columns,
    )
