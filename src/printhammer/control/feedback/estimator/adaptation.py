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

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.estimator.flight import least_squares
from printhammer.printing.rates.perturbation import Perturbation, perturbed
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.feedback.closed_loop import Loop
    from printhammer.control.feedback.driver import Driver
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

FRONT_ERROR: Final = 0.04
"""Standard deviation of the front before the first contact, in parts of the way from backstop to pack."""

SCALE_ERROR: Final = 0.03
"""Standard deviation of the scale of the currents before the first flight."""

_FRONT_DRIFT: Final = 0.002
_SCALE_DRIFT: Final = 0.002
_FARTHEST: Final = 5.0
_MODEL_ERROR: Final = 0.003
_GRID: Final = 1.0 / 128.0
_FRONT_STEPS: Final = 4
_SCALE_STEP: Final = 0.03
_PLACE_STEP: Final = 0.005
_SPEED_STEP: Final = 0.02
_STRANGE: Final = 9.0


@dataclass
class Learned:
    """What is known of a hammer: means and standard deviations.

    Attributes
    ----------
    front, front_error : float
        By how much the front of the pack lies farther from the armature than it should, in parts of the way
        from backstop to pack.
    scale, scale_error : float
        By which part all currents are larger than they should be.
    """

    front: float = 0.0
    front_error: float = FRONT_ERROR
    scale: float = 0.0
    scale_error: float = SCALE_ERROR

    def drift(self) -> None:
        """Forget a little."""
        self.front_error = float(min(np.hypot(self.front_error, _FRONT_DRIFT), FRONT_ERROR))
        self.scale_error = float(min(np.hypot(self.scale_error, _SCALE_DRIFT), SCALE_ERROR))

    def take_scale(self, scale: float, variance: float) -> None:
        """Take what was found of the scale, with its variance; far from all that was expected it is not."""
        if abs(scale) <= _FARTHEST * SCALE_ERROR and variance > 0.0:
            self.scale, self.scale_error = scale, float(np.sqrt(variance))

    def take_front(self, front: float, variance: float) -> None:
        """Likewise of the front."""
        if abs(front) <= _FARTHEST * FRONT_ERROR and variance > 0.0:
            self.front, self.front_error = front, float(np.sqrt(variance))


@dataclass
class Touched:
    """A touch of the pack, from which the front is learned.

    Attributes
    ----------
    start, end : float
        From before the touch until after the contact, s.
    state : array, shape (3,)
        Displacement, m, and speed, m/s, at the start, and scale of the currents.
    covariance : array, shape (3, 3)
        Their covariance.
    """

    start: float
    end: float
    state: FloatArray
    covariance: FloatArray


class Contacts:
    """Contacts of a nominal hammer with packs at several places.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer.
    stroke : float
        Way from backstop to pack, m.
    driver : Driver
        Of the coil.
    """

    def __init__(self, hammer: Hammer, stroke: float, driver: Driver) -> None:
        self._stroke = stroke
        self._driver = driver
        self._shifted = {0: hammer}
        self._nominal = hammer

    def learn(
        self,
        loops: Sequence[Loop],
        times: FloatArray,
        seen: FloatArray,
        used: FloatArray,
        error: float,
        threads: int | None = None,
    ) -> None:
        """Learn front and scale from the latest contact of each run.

        Parameters
        ----------
        loops : sequence of Loop
            Runs with a contact.
        times, seen, used : array, shape (M, N)
            Times of the samples, s, what the sensor shows, m, and 1 for samples that count.
        error : float
            Standard deviation of a sample, m.
        threads : int, optional
            By default as many as there are cores.
        """
        touches = [loop.touched for loop in loops if loop.touched is not None]
        places = [round(loop.learned.front / _GRID) for loop in loops]
        base = np.array([touched.state for touched in touches])
        steps = np.array([_PLACE_STEP * self._stroke, _SPEED_STEP, _FRONT_STEPS * _GRID, _SCALE_STEP])
        runs = self._runs(loops, touches, places, steps, times, used, threads)
        counts = (used > 0.0) & np.isfinite(runs).all(axis=0)
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
        spread = np.hypot(error, _MODEL_ERROR * self._stroke)
        rest = np.where(counts, seen - runs[0], 0.0)
        found, precision = least_squares(slopes, rest, counts / spread**2, prior, expected)
        left = rest - sum(slope * found[:, [k]] for k, slope in enumerate(slopes))
        number = counts.sum(axis=1)
        strange = np.where(counts, left**2, 0.0).sum(axis=1) > _STRANGE * spread**2 * number
        variances = np.diagonal(np.linalg.inv(precision), axis1=1, axis2=2)
        for k, loop in enumerate(loops):
            loop.touched = None
            if number[k] == 0 or strange[k]:
                continue
            loop.learned.take_front(places[k] * _GRID + float(found[k, 2]), float(variances[k, 2]))
            loop.learned.take_scale(float(found[k, 3]), float(variances[k, 3]))

    def _runs(
        self,
        loops: Sequence[Loop],
        touches: Sequence[Touched],
        places: Sequence[int],
        steps: FloatArray,
        times: FloatArray,
        used: FloatArray,
        threads: int | None,
    ) -> FloatArray:
        """Return the displacements of the nominal hammer, and of those that differ, (5, M, N), m."""
        hammers, drives, states, strobes = [], [], [], []
        plain = [loop.recent(self._driver) for loop in loops]
        stronger = [drive.scaled(1.0 + _SCALE_STEP) for drive in plain]
        for number in range(5):
            for k, (touched, place) in enumerate(zip(touches, places, strict=True)):
                moved = place + _FRONT_STEPS if number == 3 else place
                hammers.append(self._with_front(moved))
                drives.append(stronger[k] if number == 4 else plain[k])
                x, v = touched.state[:2].tolist()
                states.append(
                    (x + (steps[0] if number == 1 else 0.0), v + (steps[1] if number == 2 else 0.0))
                )
                strobes.append(times[k][used[k] > 0.0])
        result = Ensemble(
            hammers,
            drives,
            np.tile([touched.end for touched in touches], 5),
            states=np.array(states),
            starts=np.tile([touched.start for touched in touches], 5),
            tolerance=DISPLAY_TOLERANCE,
        ).run(strobes=strobes, threads=threads)
        assert result.strobes is not None
        whole = np.full((5, *times.shape), np.nan)
        for row, x in enumerate(result.strobes.x):
            number, k = divmod(row, len(loops))
            own = used[k] > 0.0
            whole[number, k, own] = x[: int(own.sum())]
        return whole

    def _with_front(self, place: int) -> Hammer:
        """Return the nominal hammer with its pack a number of grid steps farther away."""
        if place not in self._shifted:
            travel = place * _GRID * self._stroke
            self._shifted[place] = perturbed(self._nominal, Perturbation(travel=travel))
        return self._shifted[place]
