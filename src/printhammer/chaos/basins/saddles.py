"""Manifolds of the saddles in a plane of basins: the stable manifolds are the basin boundaries."""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.chaos.basins.basins import Basins
from printhammer.chaos.orbits.manifolds import Manifolds, manifolds
from printhammer.chaos.orbits.orbit import SADDLE
from printhammer.chaos.orbits.search import orbits
from printhammer.support.threads import Progress

_CROSSINGS: Final = 6  # Length of a manifold, in units of the longer side of the plane; arbitrary
_PIECES: Final = 200  # Number of points of a manifold per longer side of the plane; arbitrary


def saddle_manifolds(
    planes: Basins, longest: int, *, progress: Progress | None = None
) -> tuple[list[Manifolds], int]:
    """Compute the stable and unstable manifolds of all saddles with a period of up to `longest` firings.

    Parameters
    ----------
    planes : Basins
        Basins of attraction, which provide the hammer, the drive and the plane of initial states.
    longest : int
        Largest orbit period, firings.
    progress : callable, optional
        Function called with the number of saddles done and the number of all saddles.

    Returns
    -------
    list of Manifolds
        One entry for each saddle that lies in the plane of the states at a firing.
    int
        Number of saddles omitted, because the armature is in the pack at a firing.
    """
    spans = np.array([np.ptp(planes.x), np.ptp(planes.v)]) / planes.regime.window.half_widths
    side = float(spans.max())
    saddles = [orbit for orbit in orbits(planes.regime, longest=longest) if orbit.kind == SADDLE]
    in_plane = [orbit for orbit in saddles if orbit.phase == planes.regime.phase]
    curves = []
    for number, saddle in enumerate(in_plane, 1):
        curves.append(manifolds(saddle, length=_CROSSINGS * side, spacing=side / _PIECES))
        if progress is not None:
            progress(number, len(in_plane))
    return curves, len(saddles) - len(in_plane)
