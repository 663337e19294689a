"""Orbits that a branch leads to: others at the same period, on the branch through a known orbit.

A branch of periodic orbits turns back at its folds and comes by the same period again, at orbits so unstable
that no motion from anywhere comes close to them.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.chaos.continuation.arclength import Steps, follow
from printhammer.chaos.continuation.family import RegimeFamily
from printhammer.chaos.continuation.fixed_points import Corrector, between
from printhammer.errors import InputError
from printhammer.hammer.names import PERIOD

if TYPE_CHECKING:
    from printhammer.chaos.orbits.orbit import Orbit
    from printhammer.support.arrays import FloatArray

SHARE: Final = 0.05
"""Part of the period by which it is changed on either side."""

_PARTS: Final = 5.0
_STEPS: Final = Steps(most=150, precision=1e-10)


def crossings(orbit: Orbit) -> list[FloatArray]:
    """Return the states at which the branch through an orbit, along the period, comes by its period again."""
    regime, own = orbit.regime, orbit.regime.period
    if PERIOD not in regime.names:
        return []
    family = RegimeFamily(regime, PERIOD, orbit.firings, orbit.tolerance)
    scales = np.append(regime.window.half_widths, 2.0 * SHARE * own / _PARTS)
    bounds = ((1.0 - SHARE) * own, (1.0 + SHARE) * own)
    try:
        curve = follow(family, orbit.section, own, scales=scales, bounds=bounds, steps=_STEPS)
    except InputError:
        return []
    corrector = Corrector(family, scales, _STEPS.precision)
    states = []
    for here, ahead in itertools.pairwise(curve.nodes):
        if (here.parameter - own) * (ahead.parameter - own) >= 0.0:
            continue
        middle = between(corrector, here, ahead, (own - here.parameter) / (ahead.parameter - here.parameter))
        node = None if middle is None else corrector.at_parameter(corrector.scaled(middle.state, own))
        if node is not None:
            states.append(node.state)
    return states
