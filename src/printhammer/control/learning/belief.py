"""What a learner believes of a unit: constants that explain its readings, and how well they are known.

The constants are in standard deviations of the production, so that before any reading each is 0 with a
standard deviation of 1. Where the posterior probability (Bayes) is largest, found by the method of Levenberg
and Marquardt, there is a mode; its covariance is that of the normal distribution that touches it there
(Laplace). Readings may be explained in more than one way: a belief has modes, each with its probability. A
reading that nothing explains counts for little: errors have the distribution of Student's t.

Readings of a hammer that is fired while it still moves bend sharply with the constants, and a search that
starts far away gets caught. It therefore begins where readings count by what is smooth in them, and lets
them count for more from level to level; it ends at the last level that explains the readings.
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

LEVELS: Final = (1.0, 0.3, 0.1, 0.03, 0.0)  # How much of what is not smooth in a reading counts as noise
_NEAR: Final = (0.1, 0.0)  # The same where the search begins at what was believed before
_MODES: Final = 4  # At most
_SHARE: Final = 0.01  # Probability below which a mode is left out, in parts of that of the best
_CARE: Final = 1.3  # By how much wider than it says a covariance is taken to be, where harm may be done
_FREEDOM: Final = 4.0  # Degrees of freedom of Student's t
_LOST: Final = 12.0  # What a dot that is seen but not predicted adds to the objective, twice
_STEP: Final = 0.1  # Of the differences by which a search finds its way, in standard deviations
_FINE: Final = 0.01  # Of those that say how well constants are known: what explains readings is bent
_ITERATIONS: Final = 10  # At most, at a level
_STILL: Final = 0.03  # Step at which a level is over, in standard deviations
_GAIN: Final = 0.01  # Of the objective, below which a step is none
_OUTLIER: Final = 5.0  # Largest residual that counts in the misfit, in standard deviations; arbitrary
_EXPLAINED: Final = 2.0  # Mean square of what is left of readings, in variances, that explains them


@dataclass(frozen=True)
class Evidence:
    """Readings of a unit, in parts of the limits, arrays of shape (readings,); NaN where nothing was seen."""

    value: FloatArray
    noise: FloatArray  # Standard deviation
    rough: FloatArray  # Root of the mean square of what is not smooth in a reading

    def at(self, level: float) -> FloatArray:
        """Return the standard deviations that count at a level."""
        return np.asarray(np.hypot(self.noise, level * self.rough))


@dataclass(frozen=True)
class Mode:
    """Constants that explain the readings, in standard deviations."""

    mean: FloatArray  # The most probable ones, (constants,)
    covariance: FloatArray  # (constants, constants)
    predicted: FloatArray  # Readings of a unit with these constants, (readings,)
    level: float  # At which the readings are explained
    objective: float  # Less the logarithm of the probability density, but for a constant
    misfit: float = 0.0  # RMS of the residuals of the readings, in standard deviations of their noise

    def apart(self, other: Mode) -> float:
        """Return how far another mode is off, in standard deviations of this one."""
        off = other.mean - self.mean
        return float(np.sqrt(off @ np.linalg.solve(self.covariance, off) / off.size))


@dataclass(frozen=True)
class Belief:
    """What is believed of a unit: modes, the most probable first, and their probabilities."""

    modes: tuple[Mode, ...]
    weights: FloatArray  # (modes,)

    @classmethod
    def of(cls, ends: Sequence[Mode]) -> Belief:
        """Return the belief in the modes at which searches ended; those that are the same count once."""
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
        """Return means and standard deviations of the constants over all modes, (constants,) each."""
        means = np.array([mode.mean for mode in self.modes])
        spread = np.array([np.diag(mode.covariance) for mode in self.modes])
        mean = self.weights @ means
        return np.asarray(mean), np.sqrt(self.weights @ (spread + (means - mean) ** 2))

    def draw(self, count: int, seed: int) -> FloatArray:
        """Return constants that a careful mind holds for possible, (count, constants).

        Standard deviations count `_CARE` times, and the probability of a mode by its root: a normal
        distribution that touches another one is too narrow where that is bent.
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
    """Return what the evidence says of a unit; asks for the readings of units.

    Searches begin at what was believed `before`; where there is nothing, or none of them ends at the finest
    level, at each of `starts` too.
    """
    ends = yield from together([_descend(evidence, start, _NEAR) for start in before])
    if not any(end.level == LEVELS[-1] for end in ends):
        ends += yield from together([_descend(evidence, start, LEVELS) for start in starts])
    return Belief.of(ends)


class _Place(NamedTuple):
    """Where a search is."""

    constants: FloatArray  # (constants,)
    shown: FloatArray  # (readings,)
    slopes: FloatArray  # (readings, constants); NaN where a dot is lost
    fresh: bool  # Whether the slopes are differences made here


def _descend(evidence: Evidence, start: FloatArray, levels: Sequence[float]) -> Search[Mode]:
    ((shown,),) = yield [start[None]]
    place, level, misfit = (yield from _look(start, shown)), levels[0], np.inf
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
    # What is not explained is as much of a reason to doubt as noise is.
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


def _look(constants: FloatArray, shown: FloatArray) -> Search[_Place]:
    """Return a place with the slopes there, by differences."""
    (moved,) = yield [constants + _STEP * np.eye(constants.size)]
    return _Place(constants, shown, np.asarray((moved - shown).T / _STEP), fresh=True)


def _objective(places: FloatArray, shown: FloatArray, value: FloatArray, noise: FloatArray) -> FloatArray:
    """Return what is least where constants are most probable, for each of (M, constants)."""
    rest = (value - shown) / noise
    each = (_FREEDOM + 1.0) * np.log1p(rest**2 / _FREEDOM)
    lost = np.isfinite(value) & ~np.isfinite(shown)
    each = np.where(lost, _LOST, np.nan_to_num(each))
    return np.asarray(0.5 * (places**2).sum(axis=1) + 0.5 * each.sum(axis=1))


def _normal(place: _Place, value: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the inverse of the covariance, and the direction in which the probability grows."""
    rest = value - place.shown
    known = np.isfinite(rest) & np.isfinite(place.slopes).all(axis=1)
    rest, slopes = np.where(known, rest, 0.0), np.where(known[:, None], place.slopes, 0.0)
    weight = (_FREEDOM + 1.0) / (_FREEDOM + (rest / noise) ** 2) / noise**2
    normal = slopes.T @ (weight[:, None] * slopes) + np.eye(place.constants.size)
    return normal, slopes.T @ (weight * rest) - place.constants


def _size(rest: FloatArray) -> float:
    """Return the standard deviation of what is left of readings, as their median tells it."""
    known = np.abs(rest[np.isfinite(rest)])
    return 1.4826 * float(np.median(known)) if known.size else 0.0


def _climb(value: FloatArray, noise: FloatArray, place: _Place) -> Search[_Place]:
    """Return where constants are most probable near a place."""
    damping = 0.1
    for _ in range(_ITERATIONS):
        # Far away all readings are wrong, and none of them counts for little.
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
            place = yield from _look(place.constants, place.shown)
            continue
        # Broyden: what the step itself shows of the slopes.
        move = places[k] - place.constants
        surprise = np.nan_to_num(readings[k] - place.shown - place.slopes @ move)
        slopes = place.slopes + surprise[:, None] * (move / (move @ move))
        place = _Place(places[k], readings[k], slopes, fresh=False)
        damping = max(0.3 * tried[k], 1e-4)
        if float(np.abs(move).max()) < _STILL:
            break
    return place
