"""Lyapunov exponents of the stroboscopic map: the mean growth rates of small perturbations.

From firing to firing the tangent flow (docs/tangent.md) stretches one direction of the plane of displacement
and velocity and contracts the other. The means of the logarithms of both factors are the exponents
lambda_1 >= lambda_2; their sum is the mean logarithm of the determinant. A third exponent, that of the memory
of the pack, is minus infinity. The flow in time has these exponents divided by the period, and a zero
exponent in the direction of the flow.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.exponents.zero_one import FEWEST, ZeroOne, zero_one
from printhammer.chaos.strobe.points import Strobe, strobe_of
from printhammer.chaos.strobe.train import States, Train, exponents_of, is_memoryless, run_trains
from printhammer.chaos.strobe.verdict import FORGETS, SIGNIFICANT, Verdict, verdict
from printhammer.derivatives.states import Exponent, standard_error
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Result, derived, part, scalar
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    judged,
    styled,
)
from printhammer.run.effort import Effort
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import Firing, Regime
from printhammer.run.supply import current_of
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray, IntArray

FIRINGS: Final = 1000
"""Default number of firings over which the growth of perturbations is averaged; arbitrary."""

TRANSIENT: Final = 1000
"""Default number of firings to discard before growth is averaged; arbitrary."""

PER_FIRING: Final = "1/firing"
"""Unit of Lyapunov exponents, for columns and scalars."""

EXPONENT: Final = (
    Column("1", "number of the exponent, largest first", ("exponent",), "coordinate", name="exponent"),
    np.array([1, 2], np.int32),
)
"""Coordinate of the Dataset that numbers the exponents, largest first."""

_GROWTH: Final = ("firing", "exponent")
_RUNNING: Final = ("count", "exponent")
_COUNTS: Final = 100  # Default number of running estimates; arbitrary
_CYCLES: Final = 8
"""Smallest number of whole cycles from which a standard error is computed; arbitrary."""


def dimension_text(value: float, error: float) -> str:
    """Format a dimension with its standard error; a dash if the dimension is unknown."""
    if math.isnan(value):
        return "–"
    return f"{value:.4g} ± {error:.1g}" if error else f"{value:.4g}"


def verdict_text(verdict: str) -> str:
    """Format a classification for a summary, with a style that marks "undecided"."""
    return judged(verdict != "undecided", verdict.replace("period-", "period "))


class Lyapunov(Result, rows="firing exponent"):
    """Lyapunov exponents of one train, with the classifications by strobe points and by the 0-1 test."""

    points: Strobe = part(
        "strobe points at the firings between which growth is averaged, with their classification",
        more="the classification is based on recurrence and on the largest exponent",
    )
    exponents: FloatArray = scalar(
        PER_FIRING,
        "Lyapunov exponents, the largest one first",
        more="minus infinity if the motion forgets its past, nan if the run ended early",
    )
    standard_errors: FloatArray = scalar(
        PER_FIRING, "standard errors of the exponents", more="infinite for fewer than eight firings"
    )
    total: float = scalar(
        PER_FIRING,
        "sum of the exponents",
        more="the mean logarithm of the determinant of the map",
    )
    total_error: float = scalar(PER_FIRING, "standard error of the sum")
    dimension: float = scalar(
        "1", "Kaplan-Yorke dimension of the attractor", more="nan if unknown, see `kaplan_yorke`"
    )
    dimension_error: float = scalar("1", "standard error of the dimension")
    factors: FloatArray = part(
        "logarithms of the growth from each firing to the next", more="shape (n, 2)", repr=False
    )
    smooth: bool = scalar(
        "1", "whether the motion has a derivative; False if it passes a touch without velocity"
    )
    zero_one: ZeroOne | None = part(
        "result of the 0-1 test of the strobe points", more="None for fewer than 100 points", repr=False
    )

    @property
    def title(self) -> str:
        """Title of the exponents, with the name of the hammer and the firing period."""
        return f"Lyapunov exponents of {self.hammer.name}, fired every {self.period:.9g} s"

    def summary(self) -> Summary:
        """Summarise exponents, dimension, and the classifications by strobe points and 0-1 test."""
        rows: list[FactRow] = [("period", f"{self.period:.9g} s")]
        for k in (0, 1):
            each, error, second = (
                float(values[k]) for values in (self.exponents, self.standard_errors, self.per_second)
            )
            known = f"{each:+.4g} ± {error:.2g} per firing, {second:+.4g} per second"
            rows.append((f"exponent {k + 1}", FORGETS if each == -math.inf else known))
        test = self.zero_one
        agree = {
            True: "the exponent and the 0-1 test agree",
            False: styled("bad", "the exponent and the 0-1 test disagree"),
            None: "the exponent or the 0-1 test is undecided",
        }
        kink = "the motion passes a touch without velocity, where it has no derivative"
        rows += [
            (
                "sum",
                None if self.total == -math.inf else f"{self.total:+.6g} ± {self.total_error:.2g} per firing",
            ),
            ("dimension", dimension_text(self.dimension, self.dimension_error)),
            ("0-1 test", "–" if test is None else f"{verdict_text(test.verdict)}: {test.phrase}"),
            ("because", (test.reason or None) if test is not None else None),
            ("verdict", verdict_text(self.verdict.name)),
            ("because", self.verdict.reason or None),
            ("comparison", agree[self.agree]),
            ("remark", None if self.smooth else kink),
        ]
        return Summary([Facts(rows)])

    @property
    def hammer(self) -> Hammer:
        """Hammer to which the exponents belong."""
        return self.points.hammer

    @property
    def period(self) -> float:
        """Time between firings, s."""
        return self.points.period

    @property
    def status(self) -> str:
        """Status of the run: "ok", or the reason for its early end."""
        return self.points.status

    @property
    def ok(self) -> bool:
        """Whether the run was completed."""
        return self.points.ok

    @property
    def verdict(self) -> Verdict:
        """Classification of the motion by its strobe points, with the evidence."""
        if self.points.verdict is None:
            raise ValueError("the points have not been classified")
        return self.points.verdict

    @property
    @derived("1/s", "exponents per second", name="exponents_per_second")
    def per_second(self) -> FloatArray:
        """Exponents per second, 1/s, shape (2,)."""
        return self.exponents / self.period

    @property
    def cycle(self) -> int:
        """Number of firings per term of the error estimate: the period of a periodic train, else 1."""
        return cycle_of(self.verdict.period, len(self.factors))

    @property
    @derived("", "classification by the largest exponent alone")
    def growth(self) -> str:
        """Classification by the largest exponent alone: "chaotic", "regular" or "undecided"."""
        return _growth(float(self.exponents[0]), float(self.standard_errors[0]), self.smooth)

    @property
    def agree(self) -> bool | None:
        """Whether the exponent and the 0-1 test agree; None if either is undecided."""
        other = "undecided" if self.zero_one is None else self.zero_one.verdict
        return None if "undecided" in (self.growth, other) else self.growth == other

    def running(self, counts: npt.ArrayLike | None = None) -> tuple[IntArray, FloatArray, FloatArray]:
        """Compute running estimates of the exponents over the first firings, to show their convergence.

        Parameters
        ----------
        counts : int array, optional
            Numbers of firings, at least 1, rounded to whole cycles; by default about a hundred, spaced
            logarithmically.

        Returns
        -------
        counts : int array, shape (k,)
            Numbers of firings after rounding.
        means : array, shape (k, 2)
            Exponents over these numbers of firings.
        errors : array, shape (k, 2)
            Standard errors of the exponents.
        """
        q = self.cycle
        whole = whole_cycles(self.factors, q)
        n = q * len(whole)
        if counts is None:
            counts = np.geomspace(q, n, min(_COUNTS, len(whole)))
        asked = np.atleast_1d(np.asarray(counts, dtype=np.float64))
        if asked.size and not (asked.min() >= 1.0 and asked.max() <= n):
            raise InputError.of("counts", counts, f"numbers of firings from 1 to {n}")
        some = np.unique(np.maximum((asked / q).round(), 1.0).astype(np.int64))
        means = np.cumsum(whole, axis=0)[some - 1] / some[:, np.newaxis]
        errors = [[standard_error(whole[:cycles, k]) for k in (0, 1)] for cycles in some]
        return q * some, means, np.array(errors).reshape(-1, 2)

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the strobe points, which also applies to the exponents."""
        return self.points.provenance

    def notes(self) -> dict[str, Any]:
        """Return the classifications, for the attributes of the Dataset."""
        second = {} if self.zero_one is None else {"k": self.zero_one.k, "zero_one": self.zero_one.verdict}
        return {**second, "phase": self.points.phase, **self.points.notes()}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: growth and states over `firing`, running estimates over `count`.

        The growth of the first firing is NaN.
        """
        counts, means, errors = self.running()
        own = self.points.entries()
        factors = np.concatenate([np.full((1, 2), np.nan), self.factors])
        number = Column("1", "number of firings averaged over", ("count",), "coordinate", dtype=np.int32)
        entries: dict[str, tuple[Column, Any]] = {
            "factor": (Column("1", "logarithm of the growth since the firing before", _GROWTH), factors),
            **{name: own[name] for name in ("x", "v", "firing")},
            "running": (Column(PER_FIRING, "running estimate", _RUNNING), means),
            "running_error": (Column(PER_FIRING, "standard error of the running estimate", _RUNNING), errors),
            "count": (number, counts),
            "exponent": EXPONENT,
        }
        return {name: (replace(note, name=name), values) for name, (note, values) in entries.items()}


@checked
def lyapunov(
    hammer: Hammer | Regime,
    *,
    firings: SupportsIndex = FIRINGS,
    transient: SupportsIndex = TRANSIENT,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
    **firing: Unpack[Firing],
) -> Lyapunov:
    """Compute the Lyapunov exponents of a train, with standard errors, and the 0-1 test for comparison.

    Two tangent vectors are integrated along the motion and orthonormalised at every step (G. Benettin, L.
    Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15 (1980) 9 and 21); they start up to a hundred
    firings before the first firing of the average, to align with the directions of growth. Standard errors
    are estimated for autocorrelated series, by overlapping batch means
    (`printhammer.derivatives.states.standard_error`); for a periodic train, from whole cycles.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime; a hammer requires the keywords of `printhammer.Regime.of`. Growth is measured
        from firing to firing, independent of the phase.
    firings : int, optional
        Number of firings over which growth is averaged.
    transient : int, optional
        Number of firings to discard before growth is averaged.
    state, tolerance, **firing
        As for `printhammer.strobe`.

    Returns
    -------
    Lyapunov
        Exponents with a status; a run that ends early raises no exception.
    """
    counts = read_count(firings, "firings"), read_count(transient, "transient", least=0)
    train = Train.of(Regime.of(hammer, **firing).at_firings, sum(counts) + 1, state)
    return exponents_of_train(train, counts, tolerance)


def kaplan_yorke(factors: FloatArray) -> tuple[float, float]:
    """Compute the Kaplan-Yorke dimension of a map of the plane, and its standard error.

    D = 1 - lambda_1/lambda_2 if lambda_1 > 0 > lambda_1 + lambda_2, 2 if areas do not shrink, 0 if lambda_1 <
    0 (J. L. Kaplan and J. A. Yorke, Lect. Notes Math. 730 (1979) 204). The standard error is that of the mean
    of (gradient of D) x (growth), which includes the correlation of the two exponents. The flow in time has
    one dimension more.

    Parameters
    ----------
    factors : array, shape (n, 2)
        Logarithms of the growth from step to step, the larger exponent first.

    Returns
    -------
    dimension, error : float
        Dimension and its standard error; both are NaN unless the largest exponent differs from zero by three
        standard errors.
    """
    one, two = (float(mean) for mean in factors.mean(axis=0))
    sign = _growth(one, standard_error(factors[:, 0]), True)
    if sign == "undecided":
        return math.nan, math.nan
    if sign == "regular":
        return 0.0, 0.0
    if one + two >= 0.0:
        return 2.0, 0.0
    if math.isinf(two):
        return 1.0, 0.0
    return 1.0 - one / two, standard_error(one / two**2 * factors[:, 1] - factors[:, 0] / two)


def cycle_of(period: int | None, firings: int) -> int:
    """Return the period of a train if its firings cover enough whole periods to average over, else 1."""
    return period if period is not None and firings >= _CYCLES * period else 1


def whole_cycles(factors: FloatArray, cycle: int) -> FloatArray:
    """Average logarithmic growth factors, shape (n, 2), over each cycle of `cycle` firings.

    The result has the shape (n // cycle, 2). An incomplete first cycle is dropped.
    """
    return np.asarray(factors[len(factors) % cycle :].reshape(-1, cycle, 2).mean(axis=1))


def _growth(value: float, error: float, smooth: bool) -> str:
    if math.isnan(value) or not smooth:
        return "undecided"
    # A motion that forgets its past has infinite negative growth and no scatter.
    if value == -math.inf or value < -SIGNIFICANT * error:
        return "regular"
    return "chaotic" if value > SIGNIFICANT * error else "undecided"


def exponents_of_train(train: Train, counts: tuple[int, int], tolerance: float) -> Lyapunov:
    """Compute the Lyapunov exponents of a train.

    `counts` contains the number of firings to average over, and the number of firings to discard before.
    """
    first = counts[1] + 1
    last = first + counts[0]
    (exponent,) = exponents_of([train], (first, last), Effort(tolerance, threads=1))
    points = _points(train, first, last, exponent, tolerance)
    factors = np.column_stack([exponent.factors, exponent.second_factors])
    judged = points.verdict
    if judged is not None and judged.exponent == -math.inf and exponent.ok:
        # Between two rests a long run may leave its cycle; the sum over a cycle is minus infinity.
        none = np.full(len(exponent.factors), -math.inf)
        exponent = replace(exponent, factors=none, second_factors=none)
    whole = whole_cycles(factors, cycle_of(None if judged is None else judged.period, len(factors)))
    total = whole.sum(axis=1)
    values, errors, total_error = np.full(2, np.nan), np.full(2, np.nan), math.nan
    dimension = math.nan, math.nan
    if exponent.ok:
        values = whole.mean(axis=0)
        errors = np.array([standard_error(whole[:, k]) for k in (0, 1)])
        total_error = standard_error(total)
    if exponent.ok and exponent.smooth:
        dimension = kaplan_yorke(whole)
    return Lyapunov(
        points=points,
        exponents=values,
        standard_errors=errors,
        total=float(values.sum()),
        total_error=total_error,
        dimension=dimension[0],
        dimension_error=dimension[1],
        factors=factors,
        smooth=exponent.smooth,
        zero_one=zero_one(points) if len(points.x) >= FEWEST else None,
    )


def _points(train: Train, first: int, last: int, exponent: Exponent, tolerance: float) -> Strobe:
    """Build the strobe points, from firing `first` to `last`, of the run that computed the exponents.

    The strobe points include the classification of the motion.
    """
    firing = np.arange(first, last + 1)
    x, v, mode, memory, *electric = exponent.states.T
    branch = np.where(np.isfinite(mode), np.nan_to_num(mode), -1).astype(np.int64)
    current = None
    if electric:
        rows = zip(x, *electric[:2], strict=True)
        current = np.array([current_of(train.hammer, *(float(number) for number in row)) for row in rows])
    states = States(train.times(firing), x, v, branch, memory, exponent.status, current)
    stopped = "" if exponent.ok else exponent.status
    distances = states.distances(train)
    ends_at = None if stopped else states.settled(train, distances)
    if is_memoryless(train.regime) and not stopped:
        # One period at a time, so that rounding does not grow with time.
        _states, (judged,) = run_trains([train], firing, (first, last), Effort(tolerance, threads=1))
    else:
        judged = verdict(distances, (first, last), tolerance, exponent, stopped, ends_at)
    return strobe_of(train, firing, states, tolerance, judged)
