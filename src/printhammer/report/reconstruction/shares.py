"""Fractions with their binomial confidence intervals."""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist
from typing import Any, Final

from printhammer.results import Declared, part

CONFIDENCE: Final = 0.95  # Normal quantile of the 95 % interval.

_Z: Final = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)


class Share(Declared):
    """Fraction of hammers for which a statement holds: `holds` of `measured`."""

    measured: int = part("number of hammers, at least one")
    holds: int = part("number of those for which it holds")

    @property
    def rate(self) -> float:
        """Fraction of hammers, from 0 to 1."""
        return self.holds / self.measured

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the fraction, after E. B. Wilson, J. Amer. Statist. Assoc. 22 (1927) 209.

        It is the set of probabilities p with ``|rate - p| <= z sqrt(p (1 - p) / n)``; it stays within 0 and
        1, and has a width even if none or all hold.
        """
        n, p = self.measured, self.rate
        middle = p + _Z**2 / (2.0 * n)
        half = _Z * sqrt(p * (1.0 - p) / n + (_Z / (2.0 * n)) ** 2)
        scale = 1.0 + _Z**2 / n
        # The ends are exact if none or all hold.
        low = 0.0 if self.holds == 0 else (middle - half) / scale
        high = 1.0 if self.holds == n else (middle + half) / scale
        return low, high

    def as_dict(self) -> dict[str, Any]:
        """Return the fraction as an entry of `claims.json`: counts, rate and interval."""
        low, high = self.interval
        return {"rate": self.rate, "low": low, "high": high, "measured": self.measured, "holds": self.holds}
