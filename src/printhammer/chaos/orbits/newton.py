"""Multiple shooting for periodic orbits: damped Newton's method on many orbits at once.

On an unstable orbit an error of the state grows exponentially with the number of firings. So the unknowns are
the states at the starts of several segments, and the end of each segment has to be the start of the next
(multiple shooting; H. B. Keller, Numerical Methods for Two-Point Boundary-Value Problems, Blaisdell 1968).

Images of many states under the strobe map are computed by either of two methods: exactly, with the tangent
flow, or fast, as an ensemble.

The fast method integrates each state and two neighbours, and approximates the derivative by differences,
accurate enough for the first iterations of Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from printhammer.chaos.strobe.map import (
    CURRENT,
    IN_PACK,
    RANGE_LEFT,
    STILL_COIL,
    WITH_MEMORY,
    Image,
    image_of,
    is_possible,
    is_usable,
)
from printhammer.results import Declared, part
from printhammer.run.effort import Effort
from printhammer.run.ensemble import Ensemble
from printhammer.run.regime import Regime
from printhammer.run.supply import current_scale
from printhammer.support.arrays import BoolArray, FloatArray, IntArray, TextArray

CLOSED: Final = ""
"""Status of a closed orbit (empty); any other status is the reason why the orbit does not close."""

STUCK: Final = "comes no closer"
TOO_LONG: Final = "too many iterations"
SINGULAR: Final = "singular derivative"

_LONGEST_STEP: Final = 1.0
"""Largest Newton step, in half-widths of the strobe window; arbitrary."""
_LEAST_SHARE: Final = 2.0**-7
"""Smallest damping factor of a Newton step; arbitrary."""


@dataclass(frozen=True)
class Images:
    """Images of many states under the strobe map, one per row.

    The fields are the image, the derivative of the map, whether the derivative exists, and the reason for a
    failure.
    """

    states: FloatArray
    jacobians: FloatArray
    smooth: BoolArray
    reasons: TextArray

    @classmethod
    def empty(cls, count: int) -> Images:
        """Build a table of `count` images with all values NaN."""
        return cls(
            np.full((count, 2), np.nan),
            np.full((count, 2, 2), np.nan),
            np.zeros(count, np.bool_),
            np.full(count, CLOSED, dtype="U32"),
        )


class StrobeMaps(Protocol):
    """Interface of strobe maps that compute the images of many states at once."""

    def __call__(self, states: FloatArray, firings: IntArray) -> Images:
        """Compute the images of states under the strobe map, with derivatives.

        `states`, shape (n, 2), are displacements [m] and velocities [m/s]; each has its own number of
        firings.
        """


class Guess(Declared):
    """Initial guess of a periodic orbit: states at the starts of segments that nearly close."""

    states: FloatArray = part("states at the starts of the segments, shape (m, 2)")
    firings: IntArray = part("number of firings in each segment, shape (m,)")


class Closing(Guess):
    """Outcome of Newton's method for one initial guess: a closed orbit, or the reason for failure."""

    jacobians: FloatArray = part(
        "derivative of the end of each segment with respect to its start, shape (m, 2, 2)"
    )
    residual: float = part("largest distance of an end from the next start, in half-widths of the window")
    smooth: bool = part("whether the orbit has a derivative")
    reason: str = part("reason why the orbit does not close; empty if it closes")

    @property
    def closed(self) -> bool:
        """Whether Newton's method closed the orbit."""
        return self.reason == CLOSED


def close_orbits(
    maps: StrobeMaps,
    guesses: FloatArray,
    firings: IntArray,
    scales: FloatArray,
    *,
    goal: float,
    enough: float,
    iterations: int,
) -> list[Closing]:
    """Converge n initial guesses of orbits, each of m segments, by damped Newton's method.

    Guesses are the states at the starts of the segments, shape (n, m, 2), and `firings` the numbers of
    firings in the segments, shape (n, m). The scales are the half-widths of the strobe window [m and m/s]. In
    units of the scales, the iteration stops at the residual `goal`; a residual of `enough` is accepted if the
    residual stops decreasing. `iterations` is the maximum number of steps tried per orbit.
    """
    search = _Search(maps, guesses, firings, scales)
    for _ in range(iterations):
        rows = search.step(goal, enough)
        if not rows.size:
            break
    return search.result(enough)


class _Search:
    """Newton iterations of many initial guesses at once; distances in half-widths of the strobe window."""

    def __init__(self, maps: StrobeMaps, guesses: FloatArray, firings: IntArray, scales: FloatArray) -> None:
        count, self.segments = guesses.shape[:2]
        self.maps, self.firings, self.scales = maps, firings, scales
        self.z = guesses / scales
        self.jacobians = np.full((count, self.segments, 2, 2), np.nan)
        self.defects = np.full((count, self.segments, 2), np.nan)
        self.residual = np.full(count, np.inf)
        self.smooth = np.zeros(count, np.bool_)
        self.reasons = np.full(count, TOO_LONG, dtype="U32")
        self.share = np.ones(count)
        self.direction = np.zeros_like(self.z)
        self.open = np.ones(count, np.bool_)
        every = np.arange(count)
        self._take(every, *self._evaluate(self.z, every))
        self.open &= np.isfinite(self.residual)

    def step(self, goal: float, enough: float) -> IntArray:
        """Try one damped Newton step for every unfinished orbit; return the indices of these orbits.

        `goal` and `enough` are the residuals of `close_orbits`.
        """
        self._end(self.open & (self.residual <= goal), CLOSED)
        rows = np.flatnonzero(self.open)
        if not rows.size:
            return rows
        trial = self.z[rows] + self.share[rows, np.newaxis, np.newaxis] * self.direction[rows]
        images, defects, residual, reasons = self._evaluate(trial, rows)
        better = residual < self.residual[rows] * (1.0 - 0.1 * self.share[rows])
        taken = rows[better]
        self.z[taken] = trial[better]
        self._take(taken, images, defects, residual, reasons, better)
        self.share[taken] = np.minimum(2.0 * self.share[taken], 1.0)
        left = rows[~better]
        self.share[left] *= 0.5
        close = self.residual[left] <= enough
        self._end(left[close], CLOSED)
        given_up = ~close & (self.share[left] < _LEAST_SHARE)
        why = np.where(reasons[~better] == CLOSED, STUCK, reasons[~better])
        for row, reason in zip(left[given_up], why[given_up], strict=True):
            self._end(np.array([row]), str(reason))
        return rows

    def result(self, enough: float) -> list[Closing]:
        """Return the outcome of every initial guess, in input order.

        A guess that is still unfinished counts as closed if its residual is at most `enough`.
        """
        self._end(self.open & (self.residual <= enough), CLOSED)
        return [
            Closing(
                self.z[i] * self.scales,
                self.firings[i],
                self.jacobians[i] * self.scales[:, np.newaxis] / self.scales,
                float(self.residual[i]),
                bool(self.smooth[i]),
                str(self.reasons[i]),
            )
            for i in range(len(self.z))
        ]

    def _end(self, rows: IntArray | BoolArray, reason: str) -> None:
        self.reasons[rows] = reason
        self.open[rows] = False

    def _evaluate(self, z: FloatArray, rows: IntArray) -> tuple[Images, FloatArray, FloatArray, TextArray]:
        """Evaluate the orbits `rows` at the scaled trial states `z`.

        Returns, in this order: the images; the closing defects, i.e. the differences between the end of each
        segment and the start of the next; the largest absolute defect of each orbit, infinite after a
        failure; and the reason for a failure.
        """
        images = self.maps((z * self.scales).reshape(-1, 2), self.firings[rows].reshape(-1))
        ends = images.states.reshape(z.shape) / self.scales
        defects = ends - np.roll(z, -1, axis=1)
        why = images.reasons.reshape(z.shape[:2])
        fine = (why == CLOSED).all(axis=1)
        residual = np.where(fine, np.abs(defects).max(axis=(1, 2)), np.inf)
        first = np.argmax(why != CLOSED, axis=1)
        return images, defects, residual, np.where(fine, CLOSED, why[np.arange(len(why)), first])

    def _take(
        self,
        rows: IntArray,
        images: Images,
        defects: FloatArray,
        residual: FloatArray,
        reasons: TextArray,
        which: BoolArray | None = None,
    ) -> None:
        """Store the results of `_evaluate` for the orbits `rows`; compute the full Newton step from each.

        `which` is the mask of the evaluated orbits whose step is accepted; by default all are accepted.
        """
        chosen = np.ones(len(residual), np.bool_) if which is None else which
        shape = (len(residual), self.segments, 2, 2)
        jacobians = images.jacobians.reshape(shape) * self.scales / self.scales[:, np.newaxis]
        self.jacobians[rows] = jacobians[chosen]
        self.defects[rows] = defects[chosen]
        self.residual[rows] = residual[chosen]
        self.smooth[rows] = np.asarray(images.smooth.reshape(shape[:2]).all(axis=1))[chosen]
        bad = np.asarray(reasons[chosen] != CLOSED, np.bool_)
        self.reasons[rows[bad]] = reasons[chosen][bad]
        self._aim(rows[~bad])

    def _aim(self, rows: IntArray) -> None:
        """Compute the full Newton step of the orbits `rows`; limit each step to `_LONGEST_STEP`."""
        m = self.segments
        matrix = np.zeros((len(rows), 2 * m, 2 * m))
        for i in range(m):
            here, ahead = slice(2 * i, 2 * i + 2), slice(2 * ((i + 1) % m), 2 * ((i + 1) % m) + 2)
            matrix[:, here, here] += self.jacobians[rows, i]
            matrix[:, here, ahead] -= np.eye(2)
        for row, equations in zip(rows, matrix, strict=True):
            try:
                step = np.linalg.solve(equations, -self.defects[row].reshape(-1))
            except np.linalg.LinAlgError:
                step = np.full(2 * m, np.nan)
            size = float(np.abs(step).max())
            if not np.isfinite(size):
                self._end(np.array([row]), SINGULAR)
                continue
            self.direction[row] = (step * min(1.0, _LONGEST_STEP / size if size else 1.0)).reshape(m, 2)


_SPACING: Final = 1e-5
"""Finite-difference step of a state, in half-widths of the strobe window; arbitrary."""
_PIECE: Final = 30_000
"""Maximum number of states integrated in one batch, which bounds the memory; arbitrary."""


class ExactMaps:
    """Strobe map evaluated by single runs in threads, with derivatives from the tangent flow."""

    def __init__(self, regime: Regime, effort: Effort) -> None:
        self.regime, self.effort = regime, effort.quiet

    def __call__(self, states: FloatArray, firings: IntArray) -> Images:
        """Compute the exact images of states, each after its own number of firings."""

        def image(i: int) -> Image:
            return image_of(self.regime, states[i], int(firings[i]), self.effort.tolerance, contacts=False)

        images = Images.empty(len(states))
        for i, own in enumerate(self.effort.mapped(image, range(len(states)))):
            images.states[i], images.jacobians[i], images.smooth[i] = own.state, own.jacobian, own.smooth
            images.reasons[i] = CLOSED if own.ok else own.status
        return images


class FastMaps:
    """Strobe map evaluated for all states as one ensemble, with finite-difference derivatives.

    `longest` is the largest number of firings between a state and its image.
    """

    def __init__(self, regime: Regime, longest: int, effort: Effort) -> None:
        regime.check_planar()
        self.regime, self.effort = regime, effort
        self.drive, _ = regime.train(longest)
        self.moments = regime.moments(self.drive, longest)
        self.scales = regime.window.half_widths

    def __call__(self, states: FloatArray, firings: IntArray) -> Images:
        """Compute the images of states by one ensemble run, each after its own number of firings."""
        images = Images.empty(len(states))
        step, hammer = _SPACING * self.scales, self.regime.hammer
        neighbours = states[:, np.newaxis] + np.array([[0.0, 0.0], [step[0], 0.0], [0.0, step[1]]])
        allowed, whole = (
            np.array([all(test(hammer, x, v) for x, v in three) for three in neighbours], np.bool_)
            for test in (is_possible, is_usable)
        )
        images.reasons[~allowed] = RANGE_LEFT
        images.reasons[allowed & ~whole] = IN_PACK
        every = np.flatnonzero(allowed & whole)
        for begin in range(0, len(every), _PIECE // 3):
            rows = every[begin : begin + _PIECE // 3]
            ends = np.repeat(self.moments[firings[rows]], 3)
            ensemble = Ensemble(
                hammer,
                self.drive,
                ends,
                states=neighbours[rows].reshape(-1, 2),
                starts=float(self.moments[0]),
                tolerance=self.effort.tolerance,
            )
            strobes: Any = ends[:, np.newaxis]
            result = ensemble.run(strobes=strobes, threads=self.effort.threads)
            table = result.strobes
            assert table is not None
            shape = (len(rows), 3)
            final = np.stack([table.x[:, 0].reshape(shape), table.v[:, 0].reshape(shape)], axis=2)
            kept = np.isin(table.branch[:, 0].reshape(shape), WITH_MEMORY).any(axis=1)
            names = np.array(result.status_names).reshape(shape)
            stopped = ~result.ok.reshape(shape)
            images.states[rows] = final[:, 0]
            slopes = [(final[:, 1 + k] - final[:, 0]) / step[k] for k in range(2)]
            images.jacobians[rows] = np.stack(slopes, axis=2)
            images.smooth[rows] = True
            why = np.where(kept, IN_PACK, CLOSED)
            if table.current is not None:
                limit = STILL_COIL * current_scale(hammer, self.drive)
                flows = np.abs(table.current[:, 0].reshape(shape)).max(axis=1) > limit
                why = np.where(flows, CURRENT, why)
            first = np.argmax(stopped, axis=1)
            images.reasons[rows] = np.where(stopped.any(axis=1), names[np.arange(len(rows)), first], why)
        return images
