"""Motions that come to rest on a rigid backstop: they forget their past and repeat exactly.

A ball on a shaken table may bounce ever lower and lie still until the table launches it again, always at the
same phase. The motion that follows is the same each time: a superstable cycle, whose multipliers are 0. It
may be hundreds of firings long; between two rests small errors grow as in a chaotic motion, so that rounding
often decides the length of a cycle.
"""

from __future__ import annotations

import numpy as np

from printhammer.chaos.strobe.map import image_of
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray


def exact_cycle(states: FloatArray) -> int:
    """Return the period, at most n // 2, of states, shape (n, k), that repeat exactly; 0 without a period."""
    ended = np.flatnonzero((states[:-1] == states[-1]).all(axis=1))
    for count in (len(states) - 1 - int(place) for place in ended[::-1]):
        if count <= len(states) // 2 and np.array_equal(states[count:], states[:-count]):
            return count
    return 0


def rests_of(regime: Regime, states: FloatArray, tolerance: float) -> int:
    """Count the states, (m, m/s), at firings after which the armature rests before the next firing.

    After a rest, the derivative of the next state with respect to the present state is 0.
    """
    at_firings = regime.at_firings
    images = (image_of(at_firings, state, 1, tolerance, contacts=False) for state in states)
    return sum(image.ok and not image.jacobian.any() for image in images)
