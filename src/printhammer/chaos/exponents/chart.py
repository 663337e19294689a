"""Lyapunov exponents of many trains: how a hammer behaves against the time between firings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from printhammer.chaos.exponents.lyapunov import EXPONENT, FIRINGS, PER_FIRING, TRANSIENT, exponents_of_train
from printhammer.chaos.strobe.train import Train
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.results import Column, Result, column, coordinate, part, provenance, scalar
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import Regime, regimes_of
from printhammer.support.threads import Progress, mapped

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import pandas as pd

    from printhammer.chaos.exponents.lyapunov import Lyapunov
    from printhammer.drive.base import Overlap
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import BoolArray, FloatArray


class LyapunovChart(Result, rows="period"):
    """Lyapunov exponents against the period of the train; arrays of one row for each train."""

    hammer: Hammer = part("the hammer", more="the first one where there are several")
    drive: Drive = part("the drive of the first train")
    period: FloatArray = coordinate("s", "time between firings", "period")
    first: int = scalar("1", "first of the firings between which growth counts")
    last: int = scalar("1", "last of them")
    tolerance: float = part("tolerance of the integration")
    exponents: FloatArray = column(
        PER_FIRING, "Lyapunov exponents", "period exponent", more="as for `Lyapunov`"
    )
    standard_errors: FloatArray = column(PER_FIRING, "standard errors", "period exponent")
    total: FloatArray = column(PER_FIRING, "sum of the exponents", "period")
    total_error: FloatArray = column(PER_FIRING, "its standard error", "period")
    dimension: FloatArray = column("1", "Kaplan-Yorke dimension", "period")
    dimension_error: FloatArray = column("1", "its standard error", "period")
    k: FloatArray = column("1", "K of the 0-1 test", "period", more="nan where there are too few points")
    verdict: tuple[str, ...] = column("", "verdict on the points", "period")
    growth: tuple[str, ...] = column("", "what the largest exponent alone says", "period")
    zero_one: tuple[str, ...] = column("", "verdict of the 0-1 test", "period")
    status: tuple[str, ...] = column("", "how the run ended", "period")
    smooth: BoolArray = column("1", "whether the motion has a derivative", "period", dtype=np.int8)

    @property
    def title(self) -> str:
        """One line that says what the exponents are of."""
        return f"Lyapunov exponents of {self.hammer.name}"

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the exponents come from: fingerprint, waveform, tolerance, versions."""
        waveform, overlap = self.drive.waveform, self.drive.overlap
        return provenance(hammer=self.hammer, waveform=waveform, overlap=overlap, tolerance=self.tolerance)

    @classmethod
    def of(cls, trains: Sequence[Lyapunov]) -> LyapunovChart:
        """Make a chart of results for single trains; InputError where there are none."""
        if not trains:
            raise InputError("periods: expected at least one train")
        points = trains[0].points
        firings = int(points.firing[0]), int(points.firing[-1])
        rows = [_row(train) for train in trains]
        return _chart(points.hammer, points.drive, firings, points.tolerance, rows)

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return all columns over `period`, and both exponents side by side."""
        return {**super().entries(), "exponent": EXPONENT}

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row for each train, the exponents side by side."""
        table = super().to_dataframe()
        for k in (1, 0):
            table.insert(1, f"standard error {k + 1} [{PER_FIRING}]", self.standard_errors[:, k])
            table.insert(1, f"exponent {k + 1} [{PER_FIRING}]", self.exponents[:, k])
        return table


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
    threads, progress
        As for `printhammer.chaos.strobes`.

    Returns
    -------
    LyapunovChart
        A row for each train, and the same that each has alone, to the last bit.

    Raises
    ------
    InputError
        As for `lyapunov`, or numbers of hammers and periods that do not fit together.
    """
    counts = read_count(firings, "firings"), read_count(transient, "transient", least=0)
    regimes = regimes_of(hammers, periods, waveform=waveform, overlap=overlap)
    trains = [Train.of(regime.at_firings, sum(counts) + 1) for regime in regimes]
    # Only a row is kept of each train, so that memory does not grow with their length.
    rows = mapped(lambda train: _row(exponents_of_train(train, counts, tolerance)), trains, threads, progress)
    first = counts[1] + 1
    return _chart(trains[0].hammer, trains[0].drive, (first, first + counts[0]), tolerance, rows)


def _row(train: Lyapunov) -> dict[str, Any]:
    """Return what a chart keeps of a train."""
    named = ("period", "exponents", "standard_errors", "total", "total_error", "dimension", "dimension_error")
    test = train.zero_one
    return {name: getattr(train, name) for name in (*named, "growth", "status", "smooth")} | {
        "k": math.nan if test is None else test.k,
        "verdict": train.verdict.name,
        "zero_one": "undecided" if test is None else test.verdict,
    }


def _chart(
    hammer: Hammer, drive: Drive, firings: tuple[int, int], tolerance: float, rows: list[dict[str, Any]]
) -> LyapunovChart:
    columns: dict[str, Any] = {}
    for name in rows[0]:
        cells = tuple(row[name] for row in rows)
        columns[name] = cells if isinstance(cells[0], str) else np.array(cells)
    first, last = firings
    return LyapunovChart(hammer=hammer, drive=drive, first=first, last=last, tolerance=tolerance, **columns)
