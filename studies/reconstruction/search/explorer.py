"""Differential evolution in the region in which all claims except Fig. 11 hold.

The verdicts on Fig. 11 change abruptly between neighbouring points, so the whole region has to be sampled. As
in differential evolution (Storn & Price 1997), a scaled difference of two points is added to a third point:
such steps adapt to the shape of the region, however narrow it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray

CHEAP: Final = (
    "return_from_everywhere",
    "single_pulse_stroke",
    "integrator_comparison",
    "release_margin",
    "settle_out",
    "two_pulses_660us",
    "two_pulses_700us",
    "second_dot_lost",
)
"""Claims that define the region; claims without a weight in the search are ignored."""

MOST: Final = 3000  # Largest number of points of the region that are kept; arbitrary

_FEW: Final = 24
_NEARLY: Final = 0.3
_NOISE: Final = 0.003
_TRIES: Final = 4


class Explorer:
    """Points of the region, and proposals for new ones; `weights` are those of the claims in the search."""

    def __init__(self, weights: dict[str, float], rng: np.random.Generator) -> None:
        self._names = [name for name in CHEAP if name in weights]
        self._rng = rng
        self._inside: list[dict[str, Any]] = []
        self._nearest: list[dict[str, Any]] = []

    def note(self, rows: list[dict[str, Any]]) -> None:
        """Store points in the region; while the region has few points, also store those of smallest loss."""
        for row in rows:
            if row["constants"] is None:
                continue
            excess = sum(row["losses"].get(name, 1.0) for name in self._names)
            if excess <= _NEARLY:
                self._inside.append(row)
        if len(self._inside) < _FEW:
            self._nearest = sorted([*self._nearest, *rows], key=lambda row: float(row["total"]))[:_FEW]
        if len(self._inside) > MOST:
            # Drop the oldest points.
            del self._inside[: len(self._inside) - MOST]

    def ask(self, count: int) -> list[FloatArray]:
        """Propose `count` new points to evaluate."""
        known = self._inside if len(self._inside) >= _FEW else [*self._inside, *self._nearest]
        proposed = []
        for _ in range(count):
            few = self._rng.integers(len(known), size=_TRIES)
            base = min((known[i] for i in few), key=lambda row: float(row["total"]))
            first, second = (known[i] for i in self._rng.integers(len(known), size=2))
            stride = self._rng.choice([0.2, 0.5, 1.0])
            change = stride * (np.array(first["point"]) - np.array(second["point"]))
            noise = _NOISE * self._rng.standard_normal(len(change))
            point = np.array(base["point"]) + change + noise
            # Points outside the ranges are reflected at the bounds.
            proposed.append(
                np.clip(np.where(point < 0.0, -point, np.where(point > 1.0, 2.0 - point, point)), 0, 1)
            )
        return proposed
