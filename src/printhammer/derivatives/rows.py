"""Periodic orbits of rows of dots, and their Floquet multipliers over one repetition of the pulses.

A drive that fires the same pulses for every dot of a row has a strobe map, from the state at one firing to
the state at the next; for a row that repeats after n dots, the map leads from one firing to the n-th firing
after it. A row of equal dots is a fixed point of this map. The eigenvalues of the derivative at the fixed
point are its Floquet multipliers, the factors by which a small deviation grows from dot to dot: with a
multiplier outside the unit circle, a long row leaves the fixed point even if its first dots meet their
target.

The fixed points of many rows are computed at once by Newton's method, with derivatives from central
differences of neighbouring runs in one ensemble.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from printhammer.derivatives.states import components
from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.run.effort import Effort
from printhammer.run.ensemble import Ensemble, Strobes
from printhammer.run.start import initial_state
from printhammer.support.arrays import BoolArray, FloatArray

FIRING: Final = 12  # Arbitrary
"""Default index of the firing where the map starts; by then a row from rest is near the fixed point."""

MORE: Final = 4  # Arbitrary
"""Number of dots after the firing where the map starts, so that the end of the row has no effect."""

DOTS: Final = FIRING + MORE
"""Shortest row for the default `FIRING`, in dots."""

_SPACING: Final = 1e-5  # Finite-difference step of the state, in its scales; arbitrary
# Largest tolerance of a run. A derivative's error is the run's error divided by the step; in velocity the
# error scales with the flight speed, but the step with travel / period, 150 times smaller for a relay.
# Arbitrary.
_TOLERANCE: Final = 1e-9
_CLOSED: Final = 1e-6
"""Distance between a scaled state and its image below which an orbit counts as closed; arbitrary."""
_LONGEST_STEP: Final = 0.1  # Longest Newton step, in scales of the state; arbitrary
# Norm of the derivative below which the map is contracting and steps are not clipped; arbitrary, well below 1
_CONTRACTING: Final = 0.3
_ITERATIONS: Final = 12  # Iteration limit; arbitrary


def row_multipliers(
    hammers: Sequence[Hammer],
    drives: Sequence[Drive],
    effort: Effort,
    *,
    closed: bool = True,
    firing: int = FIRING,
    repeats: Sequence[int] | None = None,
) -> FloatArray:
    """Compute the leading Floquet multiplier of each of several rows of dots, shape (rows,).

    Parameters
    ----------
    hammers, drives : sequences
        One hammer and one drive per row. A drive starts from rest and has at least four repetitions more than
        `firing`; from one repetition before `firing` onward, the firings and their intervals repeat.
    effort : Effort
        Tolerance, at most `_TOLERANCE`, and threads.
    closed : bool, optional
        Whether to find the fixed point by Newton's method; otherwise the derivative is evaluated at the state
        that the row from rest reaches, which is near the fixed point if the preceding dots are good.
    firing : int, optional
        Index of the firing at which the map starts. If the first dots are compensated, the row starts at the
        fixed point, so that the state is closer to the fixed point at an early firing than at a late firing.
    repeats : sequence of int, optional
        Number of dots after which each row repeats, at most `firing`; by default 1, equal dots.

    Returns
    -------
    array
        The multiplier of largest absolute value over one repetition: with its sign if it is real (negative:
        an error alternates), else its absolute value. NaN if the row is not a periodic orbit: a run ends
        early, Newton's method does not converge, or a pulse is fired while the armature moves out of the
        pack.
    """
    if not hammers:
        return np.zeros(0)
    maps = _Maps(hammers, drives, effort, firing, [1] * len(drives) if repeats is None else repeats)
    z, jacobian = maps.start, np.full((len(hammers), 2, 2), np.nan)
    open_ = np.flatnonzero(np.isfinite(z).all(axis=1))
    for _ in range(_ITERATIONS if closed else 1):
        if not open_.size:
            break
        image, jacobian[open_] = maps.images(open_, z[open_])
        defect = image - z[open_]
        size = np.abs(defect).max(axis=1)
        jacobian[open_[np.isnan(size)]] = np.nan
        left = size > _CLOSED
        open_, defect = open_[left], defect[left]
        step = (np.linalg.pinv(np.eye(2) - jacobian[open_]) @ defect[:, :, np.newaxis])[:, :, 0]
        contracts = np.abs(jacobian[open_]).max(axis=(1, 2)) < _CONTRACTING
        longest = np.abs(step).max(axis=1, keepdims=True)
        # For a contracting map the full Newton step is safe, even if it leads from a bounce to rest.
        allowed = np.where(contracts, np.inf, _LONGEST_STEP)[:, np.newaxis]
        z[open_] += step * np.minimum(1.0, allowed / np.maximum(longest, _CLOSED))
    if closed:
        jacobian[open_] = np.nan
    return leading(jacobian)


def leading(jacobians: FloatArray) -> FloatArray:
    """Compute the dominant eigenvalue of each 2 x 2 matrix, shape (rows,); NaN propagates.

    A real eigenvalue keeps its sign; a complex pair is represented by its absolute value.
    """
    known = np.asarray(np.isfinite(jacobians).all(axis=(1, 2)))
    values = np.linalg.eigvals(np.where(known[:, None, None], jacobians, 0.0))
    largest = values[np.arange(len(values)), np.abs(values).argmax(axis=1)]
    signed = np.where(largest.imag == 0.0, largest.real, np.abs(largest))
    return np.asarray(np.where(known, signed, np.nan), np.float64)


class _Maps:
    """Strobe maps of many rows of dots, as functions of scaled states, shape (rows, 2)."""

    def __init__(
        self,
        hammers: Sequence[Hammer],
        drives: Sequence[Drive],
        effort: Effort,
        firing: int,
        repeats: Sequence[int],
    ) -> None:
        self.hammers, self.drives, self.effort = hammers, drives, effort
        moments = []
        for drive, dots in zip(drives, repeats, strict=True):
            least = firing + MORE * dots
            if len(drive.times) < least:
                raise InputError.of("drive", len(drive.times), f"a row of {least} dots or more")
            moments.append(drive.times[firing - dots : firing + dots + 1 : dots])
        self.times = np.array(moments)
        period = (self.times[:, 2] - self.times[:, 1]) / np.asarray(repeats)
        way = np.array([_travel(hammer) for hammer in hammers])
        self.scales = np.stack([way, way / period], axis=1)
        self.lowest = np.array([StaticForce(hammer).limits[0] for hammer in hammers])
        strobes = self._run(None, np.zeros(len(hammers)), self.times[:, :2], hammers, drives)
        states = np.stack([strobes.x, strobes.v], axis=2)
        states[_with_memory(strobes)] = np.nan
        # If errors alternate in sign, the midpoint of two states is nearer to the fixed point.
        self.start = np.asarray(states.mean(axis=1) / self.scales)
        self.current = None if strobes.electric is None else strobes.electric[:, -1]

    def images(self, rows: Any, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the images of scaled states under the maps of given rows, and their derivatives.

        `rows` are the indices of n rows of dots, and `z` holds one state for each, shape (n, 2). The images
        have the shape (n, 2), the derivatives (n, 2, 2).
        """
        steps = _SPACING * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
        count, places = len(steps), np.repeat(rows, len(steps))
        floor = np.stack([self.lowest[rows] / self.scales[rows, 0], np.full(len(rows), -np.inf)], axis=1)
        # On a rigid backstop, and behind it, the difference is one-sided.
        shifted = (np.maximum(z, floor)[:, np.newaxis] + steps) * self.scales[rows][:, np.newaxis]
        shifted[:, :, 0] = np.maximum(shifted[:, :, 0], self.lowest[rows, np.newaxis])
        apart = shifted[:, [1, 3]] - shifted[:, [2, 4]]
        apart = np.stack([apart[:, 0, 0], apart[:, 1, 1]], axis=1) / self.scales[rows]
        states = shifted.reshape(-1, 2)
        images = np.full((len(places), 2), np.nan)
        able = np.array(
            [_is_possible(self.hammers[k], state) for k, state in zip(places, states, strict=True)]
        )
        able = np.repeat(able.reshape(-1, count).all(axis=1), count)
        if able.any():
            own = places[able]
            begun = states[able] if self.current is None else np.hstack([states[able], self.current[own]])
            hammers, drives = [self.hammers[k] for k in own], [self.drives[k] for k in own]
            strobes = self._run(begun, self.times[own, 1], self.times[own, 2:], hammers, drives)
            ends = np.stack([strobes.x[:, 0], strobes.v[:, 0]], axis=1)
            ends[_with_memory(strobes)[:, 0]] = np.nan
            images[able] = ends / self.scales[own]
            if strobes.electric is not None and self.current is not None:
                # The current decays faster than the motion: an update after each Newton step suffices.
                middle = np.flatnonzero(able)[::count] // count
                self.current[rows[middle]] = strobes.electric[::count, 0]
        groups = np.asarray(images.reshape(-1, count, 2))
        differences = np.stack([groups[:, k] - groups[:, k + 1] for k in (1, 3)], axis=2)
        return groups[:, 0], differences / apart[:, np.newaxis]

    def _run(
        self,
        states: FloatArray | None,
        starts: FloatArray,
        moments: FloatArray,
        hammers: Sequence[Hammer],
        drives: Sequence[Drive],
    ) -> Strobes:
        ensemble = Ensemble(
            hammers,
            list(drives),
            moments[:, -1],
            states=states,
            starts=starts,
            tolerance=min(self.effort.tolerance, _TOLERANCE),
        )
        result = ensemble.run(strobes=list(moments), threads=self.effort.threads)
        assert result.strobes is not None
        return result.strobes


def _travel(hammer: Hammer) -> float:
    """Return the distance from the rest position to the front of the pack, m."""
    if hammer.front is None:
        raise InputError(
            f"{hammer.path}: the hammer has no pack", file=hammer.path, key="pack", expected="one"
        )
    return hammer.front - hammer.rest


def _is_possible(hammer: Hammer, state: FloatArray) -> bool:
    """Whether a displacement [m] and a velocity [m/s] are a valid initial state of a hammer."""
    try:
        initial_state(hammer, state.tolist())
    except InputError:
        return False
    return True


def _with_memory(strobes: Strobes) -> BoolArray:
    """Return a mask of the strobes with a pack memory, at which (x, v) is not the complete state."""
    return np.array([[components(mode) > 2 for mode in row] for row in strobes.branch.tolist()])
