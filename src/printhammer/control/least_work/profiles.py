"""Currents of a few levels from which searches begin: brake, wait and throw; or hold back and let down.

A few shares, numbers from 0 to 1, make a profile. They are spread evenly, and the best of them are moved,
each for itself, to the best of a cloud of places around it that shrinks. A descent from a poorer start ends
in one or another of many hollows, and the last bits of its numbers, which differ between processors, choose.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.least_work.descent import sobol
from printhammer.control.least_work.slot import node_times

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.support.arrays import FloatArray

PRINTING_SHARES, LANDING_SHARES = 5, 4  # Number of shares of a profile
_SPREAD: Final = 512  # Number of profiles that are spread evenly
_KEPT: Final = 16  # Number of them that are moved
_CLOUD: Final = 32  # Number of places around a profile
_MOVES: Final = 8
_REACH, _SHRINKS = 0.25, 0.7  # Reach of the first cloud, and of the next in parts of it


def printing_profile(
    shares: FloatArray, largest: float, duration: float, arrival: float, nodes: int
) -> FloatArray:
    """Return currents (n, nodes), A, that brake, wait and throw, for shares (n, `PRINTING_SHARES`).

    The largest current is in A; the slot lasts for `duration`, and its dot touches at `arrival`, both in s.
    """
    low, high = np.array([0.0, 0.0, 0.3]), np.array([1.0, 0.6, 1.0])
    released = 0.5 * arrival * shares[:, 3]
    thrown = released + shares[:, 4] * (arrival - released)
    levels = largest * (low + shares[:, :3] * (high - low))
    return _in_steps(levels, np.stack([released, thrown], axis=1), duration, nodes)


def landing_profile(shares: FloatArray, largest: float, duration: float, nodes: int) -> FloatArray:
    """Return currents (n, nodes - 1), A, that hold the armature back, then before the backstop.

    As `printing_profile` for shares (n, `LANDING_SHARES`), without the last node, at which no current flows.
    """
    caught = 0.7 * duration * shares[:, 2]
    landed = caught + shares[:, 3] * (duration - caught)
    levels = largest * np.stack([1.1 * shares[:, 0] - 0.1, shares[:, 1], np.zeros(len(shares))], axis=1)
    return _in_steps(levels, np.stack([caught, landed], axis=1), duration, nodes)[:, :-1]


def refined(
    profile: Callable[[FloatArray], FloatArray],
    badness: Callable[[FloatArray], FloatArray],
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """Return currents (n, nodes) of the best profiles, and how bad they are.

    `profile` returns the currents of shares (n, `count`), `badness` a number for each of many currents.
    """
    places = sobol(count, _SPREAD)
    bad = badness(profile(places))
    kept = np.argsort(bad, kind="stable")[:_KEPT]
    places, bad = places[kept], bad[kept]
    cloud = 2.0 * sobol(count, _CLOUD) - 1.0
    rows = np.arange(_KEPT)
    for move in range(_MOVES):
        near = np.clip(places[:, np.newaxis] + _REACH * _SHRINKS**move * cloud, 0.0, 1.0)
        worth = badness(profile(near.reshape(-1, count))).reshape(_KEPT, _CLOUD)
        best = worth.argmin(axis=1)
        better = worth[rows, best] < bad
        places[better], bad[better] = near[rows, best][better], worth[rows, best][better]
    return profile(places), bad


def _in_steps(levels: FloatArray, edges: FloatArray, duration: float, nodes: int) -> FloatArray:
    """Return the means, over the steps between nodes, of levels (n, k) that change at edges (n, k - 1), s."""
    ends = np.pad(edges, ((0, 0), (1, 1)), constant_values=((0.0, 0.0), (0.0, duration)))
    times = node_times(duration, nodes)
    past = np.clip(times, ends[:, :-1, np.newaxis], ends[:, 1:, np.newaxis]) - ends[:, :-1, np.newaxis]
    return np.asarray(np.diff((levels[:, :, np.newaxis] * past).sum(axis=1), axis=1) / np.diff(times))
