"""Approach phase of the motion fit: multiple shooting with penalised gaps between segments.

Gaps between the segments are allowed, but penalised; the penalty rises during the iteration. Each segment
thus helps to correct a wrong constant by itself, before errors can grow from contact to contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.shots.shooting import Chain, Shooting
from printhammer.results import Declared, part
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

_WIDE: Final = 10.0  # Arbitrary
"""Initial width of the gap penalty, relative to the largest gap; a gap of this width weighs like all data."""
_NARROW: Final = 0.001
"""Width of the gap penalty, normalised by stroke and typical speed, at which the approach ends; arbitrary."""
_RISE: Final = 0.3  # Factor on the width of the gap penalty after a successful step; arbitrary
_LONGEST: Final = 0.3  # Arbitrary
"""Largest change per step: relative for a constant, normalised by stroke and typical speed for a state."""
_HALVINGS: Final = 6  # Maximum number of step halvings; arbitrary
_TRIES: Final = 2
"""Maximum number of Gauss-Newton steps at each width of the gap penalty; arbitrary."""


class Prior(Declared, eq=False):
    """Gaussian prior of a subset of the fitted parameters: mean and covariance."""

    which: IntArray = part("indices of the parameters, shape (k,)")
    mean: FloatArray = part("mean, SI, shape (k,)")
    covariance: FloatArray = part("covariance, SI, shape (k, k)")


class Priors:
    """Independent Gaussian priors in whitened form; each parameter is measured in units of its scale."""

    def __init__(self, priors: Sequence[Prior], scales: FloatArray) -> None:
        self.scales = scales
        self._white = []
        for prior in priors:
            size = scales[prior.which]
            try:
                factor = np.linalg.cholesky(prior.covariance / np.outer(size, size))
            except np.linalg.LinAlgError:
                raise InputError(
                    "the priors from currents and earlier fits have no positive definite covariance",
                    expected="currents without outliers, and tables that separate the constants",
                ) from None
            self._white.append((prior, np.linalg.inv(factor)))

    def residuals(self, values: FloatArray) -> list[FloatArray]:
        """Return the whitened residuals of each prior at parameter values, SI."""
        return [
            white @ ((prior.mean - values[prior.which]) / self.scales[prior.which])
            for prior, white in self._white
        ]

    def rows(self, columns: int) -> list[FloatArray]:
        """Return the whitened Jacobian of each prior, with `columns` columns, one per parameter."""
        blocks = []
        for prior, white in self._white:
            row = np.zeros((len(prior.which), columns))
            row[:, prior.which] = white
            blocks.append(row)
        return blocks


def largest_gap(chains: Sequence[Chain], units: FloatArray) -> float:
    """Return the largest gap between segments in all chains, normalised by `units`.

    `units` are the stroke [m] and a typical speed [m/s].
    """
    return max((float(np.abs(chain.gaps / units).max()) for chain in chains if chain.gaps.size), default=0.0)


class Approach:
    """Damped Gauss-Newton minimisation of data misfit, prior misfit and gap penalty.

    Samples that are spikes of the record are excluded from the data misfit.
    """

    def __init__(
        self,
        shooting: Shooting,
        priors: Priors,
        spikes: Sequence[BoolArray],
    ) -> None:
        self.shooting = shooting
        self.priors = priors
        self.keep = [(~rows).astype(np.float64) for rows in spikes]

    def run(self, values: FloatArray, states: Sequence[FloatArray]) -> tuple[FloatArray, list[FloatArray]]:
        """Improve parameter values, SI, and the joint states of each shot by minimisation.

        The returned values and states are the initial guess of the fit without gaps.
        """
        values, states = values.copy(), list(states)
        chains = self.shooting.chains(values, states, derivatives=True)
        width = 0.0 if chains is None else _WIDE * largest_gap(chains, self.shooting.units)
        while width > _NARROW and chains is not None:
            left = zip(self._left(chains), self.keep, strict=True)
            scales = np.maximum([float(np.sqrt(row @ row / keep.sum())) for row, keep in left], 1e-16)
            for _ in range(_TRIES):
                cost = self._cost(values, chains, scales, width)
                step = self._step(values, chains, scales, width)
                length = min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-300))
                for _ in range(_HALVINGS):
                    new, moved = self._moved(values, states, length * step)
                    trial = self.shooting.chains(new, moved, derivatives=True)
                    if trial is not None and self._cost(new, trial, scales, width) < cost:
                        break
                    length *= 0.5
                else:
                    break
                values, states, chains = new, moved, trial
                if float(np.abs(step).max()) < 0.1 * width:
                    break
            width *= _RISE
        return values, states

    def _moved(
        self, values: FloatArray, states: Sequence[FloatArray], step: FloatArray
    ) -> tuple[FloatArray, list[FloatArray]]:
        count = len(values)
        first, moved = count, []
        for state in states:
            change = step[first : first + state.size].reshape(state.shape) * self.shooting.units
            first += state.size
            moved.append(state + change)
        return values + step[:count] * self.shooting.parameters.scales, moved

    def _left(self, chains: Sequence[Chain]) -> list[FloatArray]:
        return [
            (shot.x - self.shooting.shown(number, chain.motion)) * keep
            for number, (shot, chain, keep) in enumerate(
                zip(self.shooting.shots, chains, self.keep, strict=True)
            )
        ]

    def _cost(self, values: FloatArray, chains: Sequence[Chain], scales: FloatArray, width: float) -> float:
        total = sum(float(off @ off) for off in self.priors.residuals(values))
        for left, chain, scale in zip(self._left(chains), chains, scales, strict=True):
            gaps = chain.gaps / self.shooting.units / width
            total += float(left @ left) / scale**2 + len(left) * float((gaps * gaps).sum())
        return total

    def _step(
        self, values: FloatArray, chains: Sequence[Chain], scales: FloatArray, width: float
    ) -> FloatArray:
        """Compute the Gauss-Newton step of parameters and joint states.

        The step of a parameter is in units of its scale, the step of a joint state in `Shooting.units`.
        `scales` are the residual scales of the shots, m, and `width` is the width of the gap penalty.
        """
        count = len(values)
        size = count + sum(chain.gaps.size for chain in chains)
        units = self.shooting.units
        rows, right = [], []
        first = count
        for shot, (left, chain, scale) in enumerate(zip(self._left(chains), chains, scales, strict=True)):
            _shown, derivatives = self.shooting.opened(shot, chain)
            keep = self.keep[shot] / scale
            row = np.zeros((len(left), size))
            row[:, :count] = derivatives[:, :count] * keep[:, np.newaxis]
            row[:, first : first + chain.gaps.size] = derivatives[:, count:] * keep[:, np.newaxis]
            rows.append(row)
            right.append(left / scale)
            weight = np.sqrt(len(left)) / width
            joints = len(chain.gaps)
            for joint in range(joints):
                row = np.zeros((2, size))
                row[:, :count] = chain.end_by_parameter[joint] / units[:, np.newaxis]
                here = first + 2 * joint
                row[:, here : here + 2] = -np.eye(2)
                if joint > 0:
                    row[:, here - 2 : here] = chain.end_by_state[joint] * units / units[:, np.newaxis]
                rows.append(row * weight)
                right.append(-chain.gaps[joint] / units * weight)
            first += chain.gaps.size
        rows += self.priors.rows(size)
        right += self.priors.residuals(values)
        design, wanted = np.concatenate(rows), np.concatenate(right)
        sizes = np.sqrt((design * design).sum(axis=0))
        sizes[sizes == 0.0] = 1.0
        design /= sizes
        inverse = np.linalg.pinv(design.T @ design, rcond=1e-12, hermitian=True)
        return np.asarray(inverse @ (design.T @ wanted) / sizes)
