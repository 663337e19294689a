"""Lyapunov exponents of many trains against the time between firings; finite-time exponents of a train.

A finite-time exponent is the mean growth over a few successive firings (a stretch) of one train.

The mean growth over n firings depends on where the stretch begins. The mean over all stretches is the
Lyapunov exponent; the standard deviation falls as n^-1/2 if correlations decay fast, and more slowly if a
motion stays near regular orbits for a long time (A. Prasad and R. Ramaswamy, Phys. Rev. E 60 (1999) 2761).
The fraction of stretches with a negative exponent shows how often neighbouring motions converge temporarily,
although the train is chaotic. Limitation: all stretches are taken from one train; regions of the attractor
that the train has not visited do not contribute.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.exponents.lyapunov import (
    EXPONENT,
    FIRINGS,
    PER_FIRING,
    TRANSIENT,
    Lyapunov,
    exponents_of_train,
    lyapunov,
)
from printhammer.chaos.strobe.train import Train
from printhammer.chaos.strobe.verdict import FORGETS
from printhammer.drive.base import Overlap
from printhammer.drive.input import read_count
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Result, column, coordinate, part, provenance, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
)
from printhammer.run.effort import DEFAULT, Effort, Keywords, computation
from printhammer.run.regime import Regime, regimes_of
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd


class LyapunovChart(Result, rows="period"):
    """Lyapunov exponents against the period of the train; every array has one row per train."""

    hammer: Hammer = part("the hammer", more="the first hammer if there are several")
    drive: Drive = part("the drive of the first train")
    period: FloatArray = coordinate("s", "time between firings", "period")
    first: int = scalar("1", "first of the firings between which growth is averaged")
    last: int = scalar("1", "last of the firings between which growth is averaged")
    tolerance: float = part("tolerance of the integration")
    exponents: FloatArray = column(
        PER_FIRING, "Lyapunov exponents", "period exponent", more="as for `Lyapunov`"
    )
    standard_errors: FloatArray = column(PER_FIRING, "standard errors", "period exponent")
    total: FloatArray = column(PER_FIRING, "sum of the exponents", "period")
    total_error: FloatArray = column(PER_FIRING, "standard error of the sum", "period")
    dimension: FloatArray = column("1", "Kaplan-Yorke dimension", "period")
    dimension_error: FloatArray = column("1", "standard error of the dimension", "period")
    k: FloatArray = column("1", "K of the 0-1 test", "period", more="nan for too few points")
    verdict: tuple[str, ...] = column("", "classification by the strobe points", "period")
    growth: tuple[str, ...] = column("", "classification by the largest exponent alone", "period")
    zero_one: tuple[str, ...] = column("", "classification by the 0-1 test", "period")
    status: tuple[str, ...] = column("", "status of the run", "period")
    smooth: BoolArray = column("1", "whether the motion has a derivative", "period", dtype=np.int8)

    @property
    def title(self) -> str:
        """Title of the chart of exponents, with the name of the hammer."""
        return f"Lyapunov exponents of {self.hammer.name}"

    def summary(self) -> Summary:
        """Tabulate exponents and classifications of trains; count how often exponent and 0-1 test agree."""
        from printhammer.chaos.exponents.lyapunov import dimension_text, verdict_text

        pairs = list(zip(self.growth, self.zero_one, strict=True))
        agree = sum(growth == zero_one != "undecided" for growth, zero_one in pairs)
        undecided = sum("undecided" in pair for pair in pairs)
        chaotic = sum(pair == ("chaotic", "chaotic") for pair in pairs)
        tally = (
            f"{len(pairs)} trains: the exponent and the 0-1 test agree on {agree}, {chaotic} of them chaotic;"
            f" they disagree on {len(pairs) - agree - undecided}; on {undecided} one of them is undecided"
        )
        first, second = (
            [
                "none" if each == -np.inf else f"{each:+.4g} ± {error:.2g}"
                for each, error in zip(values, errors, strict=True)
            ]
            for values, errors in zip(self.exponents.T, self.standard_errors.T, strict=True)
        )
        dimensions = zip(self.dimension.tolist(), self.dimension_error.tolist(), strict=True)
        columns = [
            Cells("period", 1e3 * self.period, "ms", ".6g"),
            Cells("exponent 1", first, "1/firing"),
            Cells("exponent 2", second, "1/firing"),
            Cells("dimension", [dimension_text(*each) for each in dimensions], left=True),
            Cells("K", np.round(self.k, 2) + 0.0, "", ".2f"),
            Cells("0-1 test", [verdict_text(each) for each in self.zero_one], left=True),
            Cells("verdict", [verdict_text(each) for each in self.verdict], left=True),
        ]
        resting = int((self.exponents[:, 0] == -np.inf).sum())
        forget = [f"{resting} trains have {FORGETS}"] if resting else []
        return Summary([Grid(columns, most=40), "", tally, *forget])

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the exponents: fingerprint, waveform, tolerance, versions."""
        waveform, overlap = self.drive.waveform, self.drive.overlap
        return provenance(hammer=self.hammer, waveform=waveform, overlap=overlap, tolerance=self.tolerance)

    @classmethod
    def of(cls, trains: Sequence[Lyapunov]) -> LyapunovChart:
        """Combine the results of single trains into a chart; raise InputError for an empty sequence."""
        if not trains:
            raise InputError("periods: expected at least one train", key="periods")
        points = trains[0].points
        firings = int(points.firing[0]), int(points.firing[-1])
        rows = [_row(train) for train in trains]
        return _chart(points.hammer, points.drive, firings, points.tolerance, rows)

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: all columns along `period`, exponents also along `exponent`."""
        return {**super().entries(), "exponent": EXPONENT}

    def to_dataframe(self) -> pd.DataFrame:
        """Convert the chart to a table with one row per train; both Lyapunov exponents are columns."""
        table = super().to_dataframe()
        for k in (1, 0):
            table.insert(1, f"standard error {k + 1} [{PER_FIRING}]", self.standard_errors[:, k])
            table.insert(1, f"exponent {k + 1} [{PER_FIRING}]", self.exponents[:, k])
        return table


@computation
def lyapunovs(
    hammers: Hammer | Regime | Sequence[Hammer | Regime],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    *,
    firings: SupportsIndex = FIRINGS,
    transient: SupportsIndex = TRANSIENT,
    waveform: Waveform | None = None,
    overlap: Overlap | None = None,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[Keywords],
) -> LyapunovChart:
    """Compute the Lyapunov exponents of many trains from rest in parallel; see `lyapunov`.

    Parameters
    ----------
    hammers, periods, waveform, overlap
        Regimes, or hammers with firing periods, waveform and overlap; see
        `printhammer.run.regime.regimes_of`.
    firings, transient
        As for `lyapunov`, for all trains.

    Returns
    -------
    LyapunovChart
        Chart with one row per train, bit-identical to the result of `lyapunov`.
    """
    counts = read_count(firings, "firings"), read_count(transient, "transient", least=0)
    regimes = regimes_of(hammers, periods, waveform=waveform, overlap=overlap)
    trains = [Train.of(regime.at_firings, sum(counts) + 1) for regime in regimes]
    # Only one row per train is stored, so that memory does not grow with the length of the trains.
    rows = effort.mapped(lambda train: _row(exponents_of_train(train, counts, effort.tolerance)), trains)
    first = counts[1] + 1
    return _chart(trains[0].hammer, trains[0].drive, (first, first + counts[0]), effort.tolerance, rows)


def _row(train: Lyapunov) -> dict[str, Any]:
    """Extract the values that a chart shows from the exponents of one train."""
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


LENGTHS: Final = (1, 2, 5, 10, 20, 50)
"""Default numbers of successive firings over which a finite-time exponent is averaged; arbitrary."""
FEWEST: Final = 10
"""Smallest number of finite-time exponents from which a distribution is computed; arbitrary."""
LEVELS: Final = (0.05, 0.25, 0.5, 0.75, 0.95)  # Quantile levels of the distribution; conventional


class FiniteTime(Result, rows="length"):
    """Distribution of the largest exponent over successive stretches of a train, by length of a stretch."""

    lengths: IntArray = coordinate(
        "1", "length of a stretch, in firings", "length", name="length", dtype=np.int32
    )
    level: FloatArray = coordinate("1", "quantile level", "level")
    stretches: IntArray = column("1", "number of stretches", "length", dtype=np.int32)
    mean: FloatArray = column(PER_FIRING, "mean of the exponents of the stretches", "length")
    deviation: FloatArray = column(
        PER_FIRING, "standard deviation of the exponents of the stretches", "length"
    )
    negative: FloatArray = column("1", "fraction of the stretches whose exponent is negative", "length")
    quantiles: FloatArray = column(PER_FIRING, "quantiles of the exponents", "length level", name="quantile")
    values: tuple[FloatArray, ...] = part("exponents of the stretches of each length, 1/firing", repr=False)
    lyapunov: Lyapunov = part("the exponents over the whole train", repr=False)

    @property
    def title(self) -> str:
        """Title of the finite-time exponents, with the name of the hammer."""
        return f"finite-time exponents of {self.lyapunov.hammer.name}"


def finite_time(
    train: Lyapunov | Regime, *, lengths: Sequence[SupportsIndex] = LENGTHS, firings: SupportsIndex = 5000
) -> FiniteTime:
    """Compute the distribution of the finite-time exponents over stretches of a train.

    Parameters
    ----------
    train : Lyapunov or Regime
        Exponents of a train, from `printhammer.lyapunov`; or a regime, whose train from rest is computed.
    lengths : sequence of int, optional
        Numbers of firings in a stretch, ascending.
    firings : int, optional
        For a regime: number of firings over which growth is averaged.

    Returns
    -------
    FiniteTime
        Distribution of the exponents for each length.

    Raises
    ------
    InputError
        The run ended early, lengths do not ascend, or a length has fewer than ten stretches.
    """
    known = train if isinstance(train, Lyapunov) else lyapunov(train, firings=firings)
    wanted = [read_count(length, "lengths") for length in lengths]
    if not wanted or sorted(set(wanted)) != wanted:
        raise InputError.of("lengths", lengths, "numbers of firings, ascending")
    if not known.ok:
        raise InputError(f"the run ended early ({known.status})", key="train", expected="a complete run")
    growth = known.factors[:, 0]
    if len(growth) < FEWEST * wanted[-1]:
        raise InputError(
            f"lengths: {len(growth)} firings contain fewer than {FEWEST} stretches of {wanted[-1]}",
            key="lengths",
            expected=f"at most {len(growth) // FEWEST}",
        )
    values = tuple(growth[: len(growth) // n * n].reshape(-1, n).mean(axis=1) for n in wanted)
    return FiniteTime(
        lengths=np.array(wanted),
        level=np.array(LEVELS),
        stretches=np.array([len(row) for row in values]),
        mean=np.array([row.mean() for row in values]),
        deviation=np.array([row.std(ddof=1) for row in values]),
        negative=np.array([(row < 0.0).mean() for row in values]),
        quantiles=np.array([np.quantile(row, LEVELS) for row in values]),
        values=values,
        lyapunov=known,
    )
