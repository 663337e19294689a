"""What the controller learns of the hammer that it drives: where the front of the pack is, and the supply.

The front of the pack may lie farther away than it should, by some f, and all currents may be larger than
they should be, by some part s. Neither changes from dot to dot, or only slowly; the noise does. Both are
learned as in a Kalman filter (R. E. Kalman, J. Basic Eng. 82 (1960) 35): a mean and a standard deviation of
each, which every dot improves and which widen a little from dot to dot, so that what is old is forgotten.

A flight tells s, since a stronger coil accelerates more, see `printhammer.control.feedback.estimator.flight`.
A contact tells f: the state of the armature before the touch is known from the flight, and where it is slowed
down, turned and thrown back shows where the pack is. A run of the nominal hammer tells what the sensor should
show of the contact, others how that depends on displacement and speed before it, on f and on s; the four
follow by least squares. A weak supply is not taken for a distant pack: both are unknowns of the same fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.control.feedback.estimator.flight import least_squares
from printhammer.control.feedback.estimator.sensor import Samples
from printhammer.control.feedback.loop import Loop, Touched
from printhammer.control.feedback.plant import Plant
from printhammer.hammer.hammer import Hammer
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble
from printhammer.support.arrays import FloatArray

# Standard deviation of what the nominal hammer says of a contact, in parts of the way to the pack
_MODEL_ERROR: Final = 0.003
_GRID: Final = 1.0 / 128.0  # Step of the fronts at which contacts are computed, likewise
# Differences from which derivatives are taken: of the front in steps of the grid, of the scale of the
# currents, of the displacement in parts of the way to the pack, and of the speed, m/s
_FRONT_STEPS: Final = 4
_SCALE_STEP: Final = 0.03
_PLACE_STEP: Final = 0.005
_SPEED_STEP: Final = 0.02
# Mean square of what is left of the samples, in variances, above which a contact is not believed
_STRANGE: Final = 9.0


class Contacts:
    """Contacts of the nominal hammer with packs at several places."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._shifted = {0: plant.hammer}

    def learn(self, loops: Sequence[Loop], samples: Samples) -> None:
        """Learn front and scale from the latest contact of each run, of which there are samples."""
        stroke = self._plant.stroke
        touches = [loop.touched for loop in loops if loop.touched is not None]
        places = [round(loop.learned.front / _GRID) for loop in loops]
        base = np.array([touched.state for touched in touches])
        steps = np.array([_PLACE_STEP * stroke, _SPEED_STEP, _FRONT_STEPS * _GRID, _SCALE_STEP])
        runs = self._runs(loops, touches, places, steps, samples)
        counts = samples.used & np.isfinite(runs).all(axis=0)
        runs = np.where(counts, runs, 0.0)
        slopes = [(run - runs[0]) / step for run, step in zip(runs[1:], steps.tolist(), strict=True)]
        prior = np.zeros((len(loops), 4, 4))
        states = [0, 1, 3]
        prior[np.ix_(range(len(loops)), states, states)] = np.linalg.inv(
            np.array([touched.covariance for touched in touches])
        )
        prior[:, 2, 2] = np.array([loop.learned.front_error for loop in loops]) ** -2.0
        expected = np.zeros((len(loops), 4))
        expected[:, 2] = [
            loop.learned.front - place * _GRID for loop, place in zip(loops, places, strict=True)
        ]
        # The members run at nominal currents.
        expected[:, 3] = base[:, 2]
        spread = np.hypot(samples.error, _MODEL_ERROR * stroke)
        rest = np.where(counts, samples.shown - runs[0], 0.0)
        fitted, precision = least_squares(slopes, rest, counts / spread**2, prior, expected)
        left = rest - sum(slope * fitted[:, [k]] for k, slope in enumerate(slopes))
        number = counts.sum(axis=1)
        strange = np.where(counts, left**2, 0.0).sum(axis=1) > _STRANGE * spread**2 * number
        variances = np.diagonal(np.linalg.inv(precision), axis1=1, axis2=2)
        for k, loop in enumerate(loops):
            loop.touched = None
            if number[k] == 0 or strange[k]:
                continue
            loop.learned.take_front(places[k] * _GRID + float(fitted[k, 2]), float(variances[k, 2]))
            loop.learned.take_scale(float(fitted[k, 3]), float(variances[k, 3]))

    def _runs(
        self,
        loops: Sequence[Loop],
        touches: Sequence[Touched],
        places: Sequence[int],
        steps: FloatArray,
        samples: Samples,
    ) -> FloatArray:
        """Return the displacements of the nominal hammer, and of those that differ, (5, M, N), m."""
        hammers, drives, states, strobes = [], [], [], []
        plain = [loop.recent(self._plant.driver) for loop in loops]
        stronger = [drive.scaled(1.0 + _SCALE_STEP) for drive in plain]
        for number in range(5):
            for k, (touched, place) in enumerate(zip(touches, places, strict=True)):
                hammers.append(self._with_front(place + _FRONT_STEPS if number == 3 else place))
                drives.append(stronger[k] if number == 4 else plain[k])
                x, v = touched.state[:2].tolist()
                states.append(
                    (x + (steps[0] if number == 1 else 0.0), v + (steps[1] if number == 2 else 0.0))
                )
                strobes.append(samples.times[k][samples.used[k]])
        result = Ensemble(
            hammers,
            drives,
            np.tile([touched.end for touched in touches], 5),
            states=np.array(states),
            starts=np.tile([touched.start for touched in touches], 5),
            tolerance=DISPLAY_TOLERANCE,
        ).run(strobes=strobes, threads=self._plant.threads)
        assert result.strobes is not None
        whole = np.full((5, *samples.times.shape), np.nan)
        for row, x in enumerate(result.strobes.x):
            number, k = divmod(row, len(loops))
            whole[number, k, samples.used[k]] = x[: int(samples.used[k].sum())]
        return whole

    def _with_front(self, place: int) -> Hammer:
        """Return the nominal hammer with its pack a number of grid steps farther away."""
        if place not in self._shifted:
            self._shifted[place] = self._plant.moved(place * _GRID).hammer
        return self._shifted[place]
