"""The force that the coil adds to that of the magnet, for many places and currents at once."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.interpolate import RectBivariateSpline

from printhammer.hammer.static_force import StaticForce

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_PLACES, _CURRENTS = 161, 33  # Numbers of nodes of the surface
_BEHIND: Final = 0.2  # How far it reaches behind the backstop, in parts of the stroke


class CoilForce:
    """Fm(x, I) - Fm(x, 0) as a smooth surface through values of the law, for searches.

    Its error is about 1e-8 of the largest force. What a search has found is computed anew with the law
    itself, see `printhammer.run.energy.coil_work`. The hammer has magnet, pack and backstop; the surface
    reaches to currents of `largest`, A, of either sign.
    """

    def __init__(self, hammer: Hammer, largest: float) -> None:
        static = StaticForce(hammer)
        low = hammer.origin - _BEHIND * (static.front - hammer.origin)
        # About a fifth of the stroke behind the backstop; a law that is singular there ends before it.
        low = max(low, hammer.origin - _BEHIND * (hammer.origin - static.low))
        places = np.linspace(low, static.end, _PLACES)
        currents = np.linspace(-largest, largest, _CURRENTS)
        force = [
            static.magnet(x, current) - static.magnet(x)
            for x, current in itertools.product(places.tolist(), currents.tolist())
        ]
        table = np.array(force).reshape(places.size, currents.size)
        self._spline = RectBivariateSpline(places, currents, table, kx=5, ky=3)
        self._ends = float(places[0]), float(places[-1])

    def __call__(self, x: FloatArray, current: FloatArray) -> FloatArray:
        """Return the force, N, at displacements, m, and currents, A; NaN where x is NaN."""
        inside = np.clip(np.nan_to_num(x, nan=self._ends[0]), *self._ends)
        force = self._spline.ev(inside, current)
        return np.where(np.isnan(x), np.nan, force)
