"""To what trains from rest settle over the plane of two constants, in the lanes of an ensemble."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.chaos.strobe.train import States, Train, run_trains
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray, IntArray

GRID_TOLERANCE: Final = 1e-9
"""Tolerance of the trains."""

_FIRINGS: Final = 300
_JUDGED: Final = 64


def settled_plane(
    regime: Regime,
    names: tuple[str, str],
    bounds: tuple[tuple[float, float], tuple[float, float]],
    grid: tuple[int, int],
    threads: int | None,
) -> tuple[tuple[FloatArray, FloatArray], IntArray]:
    """Return the values of both constants, and after how many firings trains from rest repeat there.

    0 where one does not repeat, -1 where its run stopped; shape (n, m) for m values of the first constant and
    n of the second. InputError where the numbers of values are negative.
    """
    if min(grid) < 0:
        raise InputError(f"grid = {grid!r}, expected two numbers of values, not negative")
    axes = (np.linspace(*bounds[0], grid[0]), np.linspace(*bounds[1], grid[1]))
    settled = np.zeros((grid[1], grid[0]), dtype=np.int64)
    judged = np.arange(_FIRINGS - _JUDGED + 1, _FIRINGS + 1)
    for row, value in enumerate(axes[1]):
        moved = regime.with_(names[1], float(value))
        regimes = [moved.with_(names[0], float(first)) for first in axes[0]]
        trains = [Train.of(at.at_firings, _FIRINGS) for at in regimes]
        every, _ = run_trains(trains, judged, GRID_TOLERANCE, None, threads=threads)
        settled[row] = [
            _period(states, train) if states.status == "ok" else -1
            for train, states in zip(trains, every, strict=True)
        ]
    return axes, settled


def _period(states: States, train: Train) -> int:
    """Return after how many firings a train repeats, 0 where that is not known."""
    ends_at = states.settled(train, states.distances(train))
    return 0 if ends_at is None or ends_at.period is None else ends_at.period
