"""Readings as quadratic functions of the constants of a hammer: to start a search, and to plan with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray

_RIDGE: Final = 1e-3  # Of the regression: mean square of a coefficient that is nothing but noise


@dataclass(frozen=True)
class Surrogate:
    """A reading as a quadratic function of constants, in standard deviations, and what that leaves over."""

    constant: float
    slope: FloatArray  # (constants,)
    curvature: FloatArray  # (constants, constants), symmetric
    rest: float  # Root of the mean square of what is not quadratic

    @classmethod
    def of(cls, rows: FloatArray, values: FloatArray) -> Surrogate:
        """Return the regression of values (members,) on constants (members, constants); NaN left out."""
        known = np.isfinite(values)
        size = rows.shape[1]
        upper = np.triu_indices(size)
        own = rows[known]
        terms = np.concatenate([np.ones((len(own), 1)), own, own[:, upper[0]] * own[:, upper[1]]], axis=1)
        normal = terms.T @ terms + _RIDGE * np.eye(terms.shape[1])
        factors = np.linalg.solve(normal, terms.T @ values[known])
        rest = values[known] - terms @ factors
        curvature = np.zeros((size, size))
        curvature[upper] = factors[size + 1 :]
        freedom = max(len(own) - terms.shape[1], 1)
        return cls(
            float(factors[0]),
            factors[1 : size + 1],
            curvature + curvature.T,
            float(np.sqrt(rest @ rest / freedom)),
        )

    def value(self, rows: FloatArray) -> FloatArray:
        """Return the reading for constants (M, constants)."""
        bent = 0.5 * np.einsum("mi,ij,mj->m", rows, self.curvature, rows)
        return np.asarray(self.constant + rows @ self.slope + bent)

    def gradient(self, rows: FloatArray) -> FloatArray:
        """Return its derivatives by the constants, (M, constants)."""
        return np.asarray(self.slope + rows @ self.curvature)
