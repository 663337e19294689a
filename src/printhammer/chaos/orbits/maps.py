"""Images of many states under the strobe map, in two ways: exact with the tangent flow, or fast side by side.

The fast way integrates three neighbours of each state together with those of all others, and takes the
derivative from their differences: good enough for Newton's method to come close.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.orbits.newton import CLOSED, Images
from printhammer.chaos.strobe.map import (
    CURRENT,
    IN_PACK,
    RANGE_LEFT,
    STILL_COIL,
    WITH_MEMORY,
    Image,
    image_of,
    possible,
    usable,
)
from printhammer.run.ensemble import Ensemble
from printhammer.run.supply import current_scale
from printhammer.support.threads import mapped, thread_count

if TYPE_CHECKING:
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray, IntArray

_SPACING: Final = 1e-5
"""Distance of neighbours, in half-widths of the window."""
_PIECE: Final = 30_000
"""States that are integrated together at most, which bounds the memory."""


class ExactMaps:
    """Images with derivatives from the tangent flow, one at a time in threads."""

    def __init__(self, regime: Regime, tolerance: float, threads: int | None = None) -> None:
        self.regime, self.tolerance = regime, tolerance
        self.threads = thread_count(threads)

    def __call__(self, states: FloatArray, firings: IntArray) -> Images:
        """Return the images of states, each after its own number of firings."""

        def image(i: int) -> Image:
            return image_of(self.regime, states[i], int(firings[i]), self.tolerance, contacts=False)

        images = Images.empty(len(states))
        for i, own in enumerate(mapped(image, range(len(states)), self.threads)):
            images.states[i], images.jacobians[i], images.smooth[i] = own.state, own.jacobian, own.smooth
            images.reasons[i] = CLOSED if own.ok else own.status
        return images


class FastMaps:
    """Images after `longest` firings at most with derivatives from differences, in an ensemble."""

    def __init__(self, regime: Regime, tolerance: float, longest: int, threads: int | None = None) -> None:
        regime.check_planar()
        self.regime, self.tolerance, self.threads = regime, tolerance, threads
        self.drive, _ = regime.train(longest)
        self.moments = regime.moments(self.drive, longest)
        self.scales = regime.window.half_widths

    def __call__(self, states: FloatArray, firings: IntArray) -> Images:
        """Return the images of states, each after its own number of firings."""
        images = Images.empty(len(states))
        step, hammer = _SPACING * self.scales, self.regime.hammer
        neighbours = states[:, np.newaxis] + np.array([[0.0, 0.0], [step[0], 0.0], [0.0, step[1]]])
        allowed, whole = (
            np.array([all(test(hammer, x, v) for x, v in three) for three in neighbours], np.bool_)
            for test in (possible, usable)
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
                tolerance=self.tolerance,
            )
            strobes: Any = ends[:, np.newaxis]
            result = ensemble.run(strobes=strobes, threads=self.threads)
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
