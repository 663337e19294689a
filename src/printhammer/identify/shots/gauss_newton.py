"""Constrained Gauss-Newton iteration on chains of segments, and its diagnostics.

Every step solves the linearised problem in which all gaps between segments are closed, and is shortened until
the data misfit or the gap is smaller than at all earlier steps (a filter method: R. Fletcher and S. Leyffer,
Math. Program. 91 (2002) 239). While the constants are far off, only spikes of the records are excluded; near
the solution, outliers are excluded by their residuals.

Diagnostics: degenerate constants, weakly determined constants, and held constants that could be fitted too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.noise import memory_factor, outliers_of, spikes_of
from printhammer.identify.result import Profile, student
from printhammer.identify.shots.approach import Approach, Prior, Priors, largest_gap
from printhammer.identify.shots.shooting import Chain, Shooting
from printhammer.results import Declared, part
from printhammer.support.arrays import BoolArray, FloatArray

_DEGENERATE: Final = 1e5  # Arbitrary
"""Condition number above which difference quotients no longer separate the columns of a Jacobian."""
_TIED: Final = 0.98
"""Absolute correlation above which two constants are reported as hardly separable; arbitrary."""
_WEAK: Final = 0.1
"""Relative standard error above which a constant is reported as weakly determined; arbitrary."""
_SHARE: Final = 0.02  # Arbitrary
"""Smallest relative component of the degenerate direction with which a constant is reported."""


def condition_number(design: FloatArray) -> float:
    """Return the condition number of a Jacobian with normalised columns; infinite if a column is 0."""
    sizes = np.sqrt((design * design).sum(axis=0))
    if not sizes.all():
        return float("inf")
    values, _vectors = singular(design / sizes)
    return float(values[-1] / values[0]) if values[0] > 0.0 else float("inf")


def singular(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute singular values, ascending, and right singular vectors as columns, of a tall matrix.

    Both are computed from the small normal matrix, which is accurate for condition numbers up to 1e7.
    """
    squares, vectors = np.linalg.eigh(matrix.T @ matrix)
    return np.sqrt(np.maximum(squares, 0.0)), vectors


def refuse_degenerate(where: str, design: FloatArray, names: Sequence[str]) -> None:
    """Raise `InputError` if a joint change of several constants leaves the motion unchanged.

    `where` names the files; `design` is the whitened Jacobian, shape (m, p).
    """
    sizes = np.sqrt((design * design).sum(axis=0))
    blind = [name for name, size in zip(names, sizes, strict=True) if size == 0.0]
    if blind:
        raise InputError(
            f"{where}: the records do not depend on {blind[0]}",
            file=where,
            key="free",
            expected="this constant to be held",
        )
    values, vectors = singular(design / sizes)
    if values[0] * _DEGENERATE > values[-1]:
        return
    direction = np.abs(vectors[:, 0])
    tied = [name for name, part in zip(names, direction, strict=True) if part > _SHARE * direction.max()]
    listed = tied[0] if len(tied) == 1 else f"{', '.join(tied[:-1])} and {tied[-1]}"
    raise InputError(
        (f"{where}: a motion cannot separate {listed}: a joint change leaves the records unchanged"),
        file=where,
        key="free",
        expected="at least one of them to be held",
    )


def tied_constants(names: Sequence[str], values: FloatArray, covariance: FloatArray) -> list[str]:
    """Return one sentence per highly correlated pair of constants and per weakly determined constant."""
    errors = np.sqrt(np.diag(covariance))
    sentences = []
    for i, name in enumerate(names):
        for j in range(i):
            correlation = covariance[i, j] / (errors[i] * errors[j])
            if abs(correlation) > _TIED:
                sentences.append(f"{names[j]} and {name} are hardly separable: correlation {correlation:.4f}")
    for name, value, error in zip(names, values, errors, strict=True):
        if error > _WEAK * abs(value):
            sentences.append(f"{name} is determined to only {100.0 * error / abs(value):.2g} %")
    return sentences


def weak(values: FloatArray, covariance: FloatArray) -> list[int]:
    """Return the indices of the weakly determined constants, whose relative standard error is large."""
    errors = np.sqrt(np.diag(covariance))
    return [int(i) for i in np.flatnonzero(errors > _WEAK * np.abs(values))]


def changes_if_fitted(
    design: FloatArray, columns: FloatArray, names: Sequence[str], residuals: FloatArray
) -> list[tuple[str, float, float]]:
    """Estimate, for each held constant, how it would change if it alone were fitted in addition.

    `design`, shape (m, p), is the Jacobian of the fit, `residuals`, shape (m,), are its residuals, and
    `columns`, shape (m, q), are the derivatives per relative change of each held constant; all are whitened
    by the standard errors of the data. The result lists the name, the relative standard error and the best
    relative change of each held constant.
    """
    basis, _r = np.linalg.qr(design)
    further = []
    for name, column in zip(names, columns.T, strict=True):
        own = column - basis @ (basis.T @ column)
        size = float(own @ own)
        if size > 1e-12 * float(column @ column):
            further.append((name, size**-0.5, float(own @ residuals) / size))
    return further


_MOST_STEPS: Final = 40  # Iteration limit of the Gauss-Newton method; arbitrary
_FULL: Final = 0.4
"""Largest relative change of a constant in one Gauss-Newton step; arbitrary."""
_SHORTEST: Final = 1e-3  # Smallest step fraction of the damping; arbitrary
_EXACT: Final = 1e-11
"""Relative change of all constants below which a fit to exact data has converged; arbitrary."""
_NEAR, _DONE = 1.0, 1e-3  # Arbitrary
"""Step sizes, in standard errors, below which outliers are excluded and below which the fit has converged."""
_NARROW, _CLOSED = 1e-2, 1e-8  # Arbitrary
"""Gap sizes, normalised, below which outliers are excluded and below which the fit has converged."""
_FLOOR: Final = 1e-7
"""Noise floor, as a fraction of the stroke; smaller residuals are never outliers. Arbitrary."""
_LEAST: Final = 1e-16  # Arbitrary
"""Standard deviation, m, that is assumed for the noise of exact data, so that their weight is finite."""
_REACH: Final = 3.0
"""Half-width of a profile likelihood, in standard errors; arbitrary."""
_POINTS: Final = 7
"""Number of points of a profile likelihood; arbitrary."""
_LOST: Final = 1e-7
"""Relative singular value below which rounding errors dominate a direction; arbitrary."""
_NO_MOTION: Final = "the simulated hammer does not move, so that the records cannot be compared"


class Solution(Declared, eq=False):
    """Result of the Gauss-Newton iteration: parameters, covariance, joint states and residual scales."""

    values: FloatArray = part("parameters, SI, shape (p,)")
    covariance: FloatArray = part("covariance of the parameters, SI, shape (p, p)")
    states: list[FloatArray] = part("states at the joints of each shot")
    shown: list[FloatArray] = part("modelled readings of each record, m, shape (n,)")
    by_parameter: list[FloatArray] = part(
        "derivatives of the readings per unit of each parameter's scale, shape (n, p)"
    )
    outliers: list[BoolArray] = part("masks of the excluded samples")
    scales: FloatArray = part("standard deviation of the residuals, m, shape (shots,)")
    memories: FloatArray = part("variance factors due to autocorrelated residuals, shape (shots,)")
    design: FloatArray = part("whitened Jacobian of data and priors, per unit of each parameter's scale")
    cost: float = part("weighted sum of squares, prior included")


class GaussNewton:
    """Gauss-Newton fit of the parameters of a `Shooting`; `robust` excludes outliers."""

    def __init__(self, shooting: Shooting, priors: Sequence[Prior], *, robust: bool) -> None:
        self.shooting = shooting
        self.priors = Priors(priors, shooting.parameters.scales)
        self.robust = robust
        self.data = [shot.x for shot in shooting.shots]
        self.spikes = [
            spikes_of(shot.x, shot.noise) if robust else np.zeros(len(shot.x), bool)
            for shot in shooting.shots
        ]
        self.floor = _FLOOR * shooting.stroke

    def design(self, values: FloatArray, states: Sequence[FloatArray]) -> FloatArray:
        """Return the whitened Jacobian of data and priors, shape (m, p), at parameter values, SI."""
        chains = self.shooting.chains(values, states, derivatives=True)
        if chains is None:
            raise InputError(_NO_MOTION, key="motion")
        parts = [self.shooting.condensed(shot, chain) for shot, chain in enumerate(chains)]
        return self._linear_problem(values, parts, near=False).design

    def solve(
        self,
        values: FloatArray,
        states: Sequence[FloatArray],
        held: BoolArray | None = None,
        noise: Solution | None = None,
    ) -> Solution:
        """Fit the parameters, starting from values, SI, and joint states of each shot, shape (j, 2).

        Parameters in the mask `held` do not change. If `noise`, a nearby solution, is passed, its outliers
        and noise scales are reused.
        """
        scales = self.shooting.parameters.scales
        # Profiles pass the noise of a nearby solution and skip the approach.
        if noise is None:
            values, states = Approach(self.shooting, self.priors, self.spikes).run(values, states)
        free = np.ones(len(values), bool) if held is None else ~held
        values, states = values.copy(), [state.copy() for state in states]
        chains = self.shooting.chains(values, states, derivatives=True)
        near = noise is not None
        passed: list[tuple[float, float]] = []
        for _ in range(_MOST_STEPS):
            if chains is None:
                raise InputError(_NO_MOTION, key="motion")
            parts = [self.shooting.condensed(shot, chain) for shot, chain in enumerate(chains)]
            here = self._linear_problem(values, parts, near=near, noise=noise)
            step = np.zeros(len(values))
            step[free], errors = _solve_step(here.design[:, free], here.residuals)
            in_errors = np.abs(step[free]) / np.maximum(errors, 1e-300)
            gap = largest_gap(chains, self.shooting.units)
            small = bool((in_errors < _DONE).all()) or bool((np.abs(step) < _EXACT).all())
            if near and small and gap < _CLOSED:
                return self._solution(values, states, parts, here)
            was_near, near = near, near or (bool((in_errors < _NEAR).all()) and gap < _NARROW) or small
            if near and not was_near:
                passed = []
            length = min(1.0, _FULL / max(float(np.abs(step).max()), 1e-300))
            passed.append((self._cost(values, chains, here), gap))
            while True:
                new = values + length * step * scales
                moved = [
                    state + length * (part[2] + part[3] @ step)
                    for state, part in zip(states, parts, strict=True)
                ]
                trial = self.shooting.chains(new, moved, derivatives=True)
                if trial is not None and (
                    near
                    or self._accepted(
                        passed, self._cost(new, trial, here), largest_gap(trial, self.shooting.units)
                    )
                ):
                    break
                length *= 0.5
                if length < _SHORTEST:
                    raise InputError(
                        "the fit does not converge",
                        key="fit",
                        expected="initial guesses nearer to the true constants",
                    )
            values, states, chains = new, moved, trial
        raise InputError(f"the fit has not converged after {_MOST_STEPS} steps", key="fit")

    def _linear_problem(
        self,
        values: FloatArray,
        parts: Sequence[tuple[FloatArray, ...]],
        *,
        near: bool,
        noise: Solution | None = None,
    ) -> _Weighted:
        """Linearise data and priors; return their whitened residuals and Jacobian.

        `parts` are the linear models of the shots, from `Shooting.condensed`. If the iterate is `near` the
        solution, outliers are excluded by their residuals. `noise` is as in `solve`.
        """
        rows, residuals, outliers, scales, memories = [], [], [], [], []
        for shot, (x, (shown, jacobian, *_rest)) in enumerate(zip(self.data, parts, strict=True)):
            left = x - shown
            out = outliers_of(left, self.floor) if self.robust and near else np.zeros(len(left), bool)
            if noise is not None:
                out, scale, memory = noise.outliers[shot], noise.scales[shot], noise.memories[shot]
            else:
                if self.robust and not near:
                    # Far from the solution a misfit is no outlier; only spikes of the record itself are
                    # excluded.
                    out = self.spikes[shot]
                scale = max(float(np.sqrt(np.mean(left[~out] ** 2))), _LEAST)
                memory = memory_factor(np.where(out, 0.0, left)) if near else 1.0
            keep = np.where(out, 0.0, 1.0)
            size = scale * np.sqrt(memory)
            rows.append(jacobian * (keep / size)[:, np.newaxis])
            residuals.append(left * keep / size)
            outliers.append(out)
            scales.append(scale)
            memories.append(memory)
        rows += self.priors.rows(len(values))
        residuals += self.priors.residuals(values)
        return _Weighted(
            np.concatenate(rows), np.concatenate(residuals), outliers, np.array(scales), np.array(memories)
        )

    def _cost(self, values: FloatArray, chains: Sequence[Chain], here: _Weighted) -> float:
        """Compute the weighted sum of squares of data and priors, with the residual scales of `here`."""
        total = 0.0
        for shot, chain in enumerate(chains):
            left = self.data[shot] - self.shooting.shown(shot, chain.motion)
            left = left[~self.spikes[shot]]
            total += float(left @ left) / here.scales[shot] ** 2
        for off in self.priors.residuals(values):
            total += float(off @ off)
        return total

    @staticmethod
    def _accepted(passed: Sequence[tuple[float, float]], cost: float, gap: float) -> bool:
        return all(cost < (1.0 - 1e-4) * old or gap < 0.95 * wide for old, wide in passed)

    def _solution(
        self,
        values: FloatArray,
        states: list[FloatArray],
        parts: Sequence[tuple[FloatArray, ...]],
        here: _Weighted,
    ) -> Solution:
        scales = self.shooting.parameters.scales
        inverse = np.linalg.pinv(here.design.T @ here.design, hermitian=True)
        return Solution(
            values=values,
            covariance=inverse * np.outer(scales, scales),
            states=states,
            shown=[part[0] for part in parts],
            by_parameter=[part[1] for part in parts],
            outliers=here.outliers,
            scales=here.scales,
            memories=here.memories,
            design=here.design,
            cost=float(here.residuals @ here.residuals),
        )

    def profile(self, solution: Solution, which: int, degrees_of_freedom: float) -> Profile:
        """Compute the profile likelihood of the parameter with index `which`, and its 95 % interval.

        The noise scales are taken from the solution, with the given degrees of freedom. The profile ends
        where no fit converges, or where the parameter would change its sign.
        """
        error = float(np.sqrt(solution.covariance[which, which]))
        best = solution.values[which]
        held = np.zeros(len(solution.values), bool)
        held[which] = True
        increases = {best: 0.0}
        for side in (-1.0, 1.0):
            values, states = solution.values, solution.states
            for number in range(1, _POINTS // 2 + 1):
                place = best + side * _REACH * error * number / (_POINTS // 2)
                if place * best <= 0.0:
                    break
                start = values.copy()
                start[which] = place
                try:
                    other = self.solve(start, states, held=held, noise=solution)
                except InputError:
                    break
                increases[place] = max(other.cost - solution.cost, 0.0)
                values, states = other.values, other.states
        places = np.array(sorted(increases))
        increase = np.array([increases[place] for place in places])
        # The square root of the increase is nearly linear, in units of standard errors.
        roots, reach = np.sqrt(increase) * np.sign(places - best), student(degrees_of_freedom)
        low = float(np.interp(-reach, roots, places)) if roots[0] < -reach else -np.inf
        high = float(np.interp(reach, roots, places)) if roots[-1] > reach else np.inf
        return Profile(places, increase, (low, high))


@dataclass(frozen=True, eq=False)
class _Weighted:
    """Linearised problem of one Gauss-Newton step: whitened rows and residuals, outliers, residual scales."""

    design: FloatArray
    residuals: FloatArray
    outliers: list[BoolArray]
    scales: FloatArray
    memories: FloatArray


def _solve_step(design: FloatArray, residuals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least-squares step and the standard errors of the parameters, in units of their scales."""
    sizes = np.sqrt((design * design).sum(axis=0))
    sizes[sizes == 0.0] = 1.0
    values, vectors = singular(design / sizes)
    keep = values > _LOST * values[-1]
    inverse = vectors * np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    step = inverse @ (inverse.T @ ((design / sizes).T @ residuals)) / sizes
    errors = np.sqrt((inverse * inverse).sum(axis=1)) / sizes
    return step, errors
