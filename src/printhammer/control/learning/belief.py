"""Maximum a posteriori estimation of a unit's constants, with a Laplace approximation.

The constants are deviations from nominal in prior standard deviations, so the prior is the standard normal
distribution. Each mode of the posterior is found by the Levenberg-Marquardt method (Nocedal and Wright,
*Numerical Optimization*, 2006, section 10.3) with Broyden's rank-one updates of the Jacobian (their section
11.1), and the posterior near it is approximated by a normal distribution (Laplace; MacKay, *Information
Theory, Inference, and Learning Algorithms*, 2003, chapter 27). A belief is a mixture of these normal
distributions, since several sets of constants may explain the readings. Errors follow Student's t
distribution, so that outliers have little weight.

The readings of a hammer that is fired while it still moves are strongly nonlinear in the constants, and a
search that starts far away stops at a local minimum. The estimation is therefore a continuation in the noise:
at the first level, the residual of a quadratic fit of the reading to the constants counts as noise; the
following levels reduce that noise, down to the noise of the sensor. The search ends at the last level that
explains the readings. A mode that no starting point leads to is missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias, TypeVar

import numpy as np

from printhammer.printing.rates.variability import WIDEST
from printhammer.support.arrays import FloatArray
from printhammer.support.threads import Work, together

if TYPE_CHECKING:
    T = TypeVar("T")
    Search: TypeAlias = Work[FloatArray, FloatArray, T]

LEVELS: Final = (1.0, 0.3, 0.1, 0.03, 0.0)
"""Noise levels of the continuation: fractions of the surrogate's residual treated as noise; arbitrary."""
_NEAR: Final = (0.1, 0.0)  # Noise levels of a search that begins at a mode of the previous stage; arbitrary
_MODES: Final = 4  # Maximum number of modes of a belief; arbitrary
_SHARE: Final = 0.01  # Smallest probability of a mode, relative to the most probable mode; arbitrary
_CARE: Final = 1.3
"""Factor on standard deviations in `Belief.draw`; at 1, tables lost dots in 2 of 100 units (decision 22)."""
_FREEDOM: Final = 4.0  # Degrees of freedom of Student's t distribution of the errors; arbitrary
_LOST: Final = 12.0
"""Penalty, in 2 × negative log-likelihood, for an observed dot that is not predicted; arbitrary."""
_STEP: Final = 0.1
"""Finite-difference step of the Jacobian in a search, in prior standard deviations; arbitrary."""
_FINE: Final = 0.01
"""Finite-difference step for the covariance; at 0.1, the covariance was too small (decision 22)."""
_ITERATIONS: Final = 10  # Iteration limit of a level; arbitrary
_STILL: Final = 0.03  # Step size below which a level has converged, in prior standard deviations; arbitrary
_GAIN: Final = 0.01  # Smallest decrease of the objective with which a step is accepted; arbitrary
_OUTLIER: Final = 5.0  # Clip of residuals in the misfit, in standard deviations; arbitrary
_EXPLAINED: Final = 2.0
"""Largest mean square residual, in variances, of a level that explains the readings; arbitrary."""


@dataclass(frozen=True)
class Evidence:
    """Readings of a unit, normalised by the limits, shape (readings,); NaN for a dot not detected."""

    value: FloatArray
    noise: FloatArray  # Standard deviation of each reading
    rough: FloatArray  # RMS residual of the quadratic surrogate of a reading

    def at(self, level: float) -> FloatArray:
        """Compute the standard deviations of the readings at a noise level of the continuation method."""
        return np.asarray(np.hypot(self.noise, level * self.rough))


@dataclass(frozen=True)
class Mode:
    """A mode of the posterior distribution of the constants, with its Laplace approximation."""

    mean: FloatArray  # Constants at the mode, in prior standard deviations, (constants,)
    covariance: FloatArray  # Covariance of the constants, (constants, constants)
    predicted: FloatArray  # Predicted readings of a unit with the constants of the mode, (readings,)
    level: float  # Last level of the continuation that explains the readings
    objective: float  # Negative log posterior density, up to a constant
    misfit: float = 0.0  # RMS of the residuals of the readings, in standard deviations of their noise

    def apart(self, other: Mode) -> float:
        """Compute the RMS Mahalanobis distance of another mode from this mode, per constant."""
        off = other.mean - self.mean
        return float(np.sqrt(off @ np.linalg.solve(self.covariance, off) / off.size))


@dataclass(frozen=True)
class Belief:
    """Posterior distribution of a unit's constants: modes with probabilities, the most probable first."""

    modes: tuple[Mode, ...]
    weights: FloatArray  # Probabilities of the modes, (modes,)

    @classmethod
    def of(cls, ends: Sequence[Mode]) -> Belief:
        """Build a posterior from the modes at which searches ended; duplicate modes are merged."""
        modes: list[Mode] = []
        for end in sorted(ends, key=lambda end: end.objective):
            if all(mode.apart(end) > 1.0 for mode in modes):
                modes.append(end)
        size = np.array([0.5 * np.linalg.slogdet(mode.covariance)[1] - mode.objective for mode in modes])
        order = np.argsort(-size, kind="stable")[:_MODES]
        weights = np.exp(size[order] - size[order[0]])
        kept = weights >= _SHARE
        chosen = tuple(modes[k] for k in order[kept])
        return cls(chosen, weights[kept] / weights[kept].sum())

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Compute the mean and the standard deviation of each constant over all modes."""
        means = np.array([mode.mean for mode in self.modes])
        spread = np.array([np.diag(mode.covariance) for mode in self.modes])
        mean = self.weights @ means
        return np.asarray(mean), np.sqrt(self.weights @ (spread + (means - mean) ** 2))

    def draw(self, count: int, seed: int) -> FloatArray:
        """Draw samples of the constants from a widened posterior distribution, shape (count, constants).

        Standard deviations are multiplied by `_CARE`, and modes are drawn in proportion to the square roots
        of their probabilities: where readings are nonlinear in the constants, the Laplace approximation is
        too narrow.
        """
        normal = _CARE * np.random.default_rng(seed).standard_normal((count, self.modes[0].mean.size))
        shares = np.cumsum(np.sqrt(self.weights))
        which = np.searchsorted(shares, shares[-1] * (np.arange(count) + 0.5) / count)
        roots = [np.linalg.cholesky(mode.covariance) for mode in self.modes]
        rows = [self.modes[k].mean + roots[k] @ row for k, row in zip(which, normal, strict=True)]
        return np.asarray(np.clip(np.array(rows), -WIDEST, WIDEST), np.float64)


def believe(
    evidence: Evidence, starts: Sequence[FloatArray], before: Sequence[FloatArray] = ()
) -> Search[Belief]:
    """Estimate a unit's constants from its readings; yield constants whose readings must be simulated.

    Searches begin at the modes `before` of the previous stage. If there are no such modes, or if none of
    these searches ends at the finest level, searches begin at each of `starts` too.
    """
    ends = yield from together([_descend(evidence, start, _NEAR) for start in before])
    if not any(end.level == LEVELS[-1] for end in ends):
        ends += yield from together([_descend(evidence, start, LEVELS) for start in starts])
    return Belief.of(ends)


class _Iterate(NamedTuple):
    """Iterate of a Levenberg-Marquardt search for a mode."""

    constants: FloatArray  # Constants, in prior standard deviations, (constants,)
    shown: FloatArray  # Predicted readings at these constants, (readings,)
    slopes: FloatArray  # Jacobian of the readings, (readings, constants); NaN where a dot is lost
    fresh: bool  # Whether the Jacobian is by finite differences at this iterate, without Broyden updates


def _descend(evidence: Evidence, start: FloatArray, levels: Sequence[float]) -> Search[Mode]:
    ((shown,),) = yield [start[None]]
    place, level, misfit = (yield from _linearise(start, shown)), levels[0], np.inf
    for finer in levels:
        noise = evidence.at(finer)
        after = yield from _climb(evidence.value, noise, place)
        rest = (evidence.value - after.shown) / noise
        left = float(np.mean(rest[np.isfinite(rest)] ** 2)) if np.isfinite(rest).any() else 0.0
        if np.isfinite(misfit) and left > _EXPLAINED:
            break
        place, level, misfit = after, finer, left
    own = place.constants
    (moved,) = yield [np.concatenate([own + _FINE * np.eye(own.size), own - _FINE * np.eye(own.size)])]
    up, down = np.split(moved, 2)
    place = place._replace(slopes=(up - down).T / (2.0 * _FINE))
    normal = _normal(place, evidence.value, evidence.at(level))[0]
    # A misfit beyond the noise widens the covariance, as an underestimated noise would.
    covariance = np.asarray(max(misfit, 1.0) * np.linalg.inv(normal), np.float64)
    finest = _objective(place.constants[None], place.shown[None], evidence.value, evidence.at(LEVELS[-1]))
    misfit = _misfit(place.shown, evidence)
    return Mode(place.constants, covariance, place.shown, level, float(finest[0]), misfit)


def _misfit(shown: FloatArray, evidence: Evidence) -> float:
    """Compute the RMS of the residuals of the readings, in standard deviations, clipped at `_OUTLIER`.

    An observed dot that the model does not predict counts as an outlier.
    """
    seen = np.isfinite(evidence.value)
    rest = np.abs((evidence.value - shown) / evidence.noise)[seen]
    each = np.minimum(np.nan_to_num(rest, nan=_OUTLIER), _OUTLIER)
    return float(np.sqrt(np.mean(each**2))) if each.size else 0.0


def _linearise(constants: FloatArray, shown: FloatArray) -> Search[_Iterate]:
    """Build the iterate at `constants`, with the Jacobian of the readings by forward differences.

    `shown` are the readings at `constants`; the constants whose readings must be simulated are yielded.
    """
    (moved,) = yield [constants + _STEP * np.eye(constants.size)]
    return _Iterate(constants, shown, np.asarray((moved - shown).T / _STEP), fresh=True)


def _objective(places: FloatArray, shown: FloatArray, value: FloatArray, noise: FloatArray) -> FloatArray:
    """Compute the negative log posterior density for each of M rows of constants, up to a constant.

    `places` contains the constants and `shown` the readings predicted for them; `value` are the measured
    readings, and `noise` their standard deviations.
    """
    rest = (value - shown) / noise
    each = (_FREEDOM + 1.0) * np.log1p(rest**2 / _FREEDOM)
    lost = np.isfinite(value) & ~np.isfinite(shown)
    each = np.where(lost, _LOST, np.nan_to_num(each))
    return np.asarray(0.5 * (places**2).sum(axis=1) + 0.5 * each.sum(axis=1))


def _normal(place: _Iterate, value: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the Gauss-Newton matrix of the objective and its negative gradient, shape (constants,)."""
    rest = value - place.shown
    known = np.isfinite(rest) & np.isfinite(place.slopes).all(axis=1)
    rest, slopes = np.where(known, rest, 0.0), np.where(known[:, None], place.slopes, 0.0)
    weight = (_FREEDOM + 1.0) / (_FREEDOM + (rest / noise) ** 2) / noise**2
    normal = slopes.T @ (weight[:, None] * slopes) + np.eye(place.constants.size)
    return normal, slopes.T @ (weight * rest) - place.constants


def _size(rest: FloatArray) -> float:
    """Estimate the standard deviation of residuals robustly, from their median absolute value."""
    known = np.abs(rest[np.isfinite(rest)])
    return 1.4826 * float(np.median(known)) if known.size else 0.0


def _climb(value: FloatArray, noise: FloatArray, place: _Iterate) -> Search[_Iterate]:
    """Minimise the objective from an iterate by the Levenberg-Marquardt method with Broyden updates."""
    damping = 0.1
    for _ in range(_ITERATIONS):
        # Far from the mode all residuals are large; without this scale all readings would count as outliers.
        wide = noise * max(1.0, _size((value - place.shown) / noise))
        best = _objective(place.constants[None], place.shown[None], value, wide)[0]
        normal, uphill = _normal(place, value, wide)
        tried = [damping * factor for factor in (0.1, 1.0, 10.0, 100.0)]
        moves = [np.linalg.solve(normal + each * np.diag(np.diag(normal)), uphill) for each in tried]
        places = np.clip(place.constants + np.array(moves), -WIDEST, WIDEST)
        (readings,) = yield [places]
        objective = _objective(places, readings, value, wide)
        k = int(np.argmin(objective))
        if not best - objective[k] > _GAIN:
            if place.fresh:
                break
            place = yield from _linearise(place.constants, place.shown)
            continue
        # Broyden's rank-one update: the new Jacobian reproduces the readings after the step.
        move = places[k] - place.constants
        surprise = np.nan_to_num(readings[k] - place.shown - place.slopes @ move)
        slopes = place.slopes + surprise[:, None] * (move / (move @ move))
        place = _Iterate(places[k], readings[k], slopes, fresh=False)
        damping = max(0.3 * tried[k], 1e-4)
        if float(np.abs(move).max()) < _STILL:
            break
    return place
