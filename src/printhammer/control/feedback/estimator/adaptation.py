"""Recursive estimation of two constants of the driven hammer: front of the pack, and current scale.

The front may be farther away than nominal by a distance f, and all currents may deviate from nominal by a
relative scale s. Both are constant or drift slowly from dot to dot, whereas the noise is independent. Both
are estimated as in a Kalman filter (R. E. Kalman, J. Basic Eng. 82 (1960) 35): each dot updates mean and
standard deviation, and process noise inflates the standard deviation between dots, so that old data are
forgotten.

A flight observes s, since a larger current accelerates more, see
`printhammer.control.feedback.estimator.flight`. A contact observes f: the state before the touch is known
from the flight, and the deceleration, turning and rebound show where the pack is. A simulation of the nominal
hammer predicts the samples of the contact, and perturbed simulations give their derivatives with respect to
displacement and speed before it, f and s; one Gauss-Newton step then estimates all four. A weak supply is not
mistaken for a distant pack, since both are unknowns of the same fit.
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

# Standard deviation of the model error of a contact, as a fraction of the stroke
_MODEL_ERROR: Final = 0.003
_GRID: Final = 1.0 / 128.0  # Spacing of the simulated pack fronts, as a fraction of the stroke
# Finite-difference steps: front in grid steps, current scale, displacement as a fraction of the stroke, speed
# in m/s
_FRONT_STEPS: Final = 4
_SCALE_STEP: Final = 0.03
_PLACE_STEP: Final = 0.005
_SPEED_STEP: Final = 0.02
# Mean squared normalised residual above which a contact is rejected
_STRANGE: Final = 9.0


class Contacts:
    """Simulated contacts of the nominal hammer with packs at several distances."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._shifted = {0: plant.hammer}

    def learn(self, loops: Sequence[Loop], samples: Samples) -> None:
        """Update front and scale of each run from the samples of its latest contact."""
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
        # The simulations use nominal currents.
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
        """Simulate the nominal contact and four perturbed ones; return displacements, m, shape (5, M, N)."""
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
        """Return the nominal hammer with its pack `place` grid steps farther away; cached."""
        if place not in self._shifted:
            self._shifted[place] = self._plant.moved(place * _GRID).hammer
        return self._shifted[place]
