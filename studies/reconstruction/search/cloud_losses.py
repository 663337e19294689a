"""Losses of the strange panels of Fig. 11: depth and extent of the clouds of strobe points.

The depth is that of the deepest of the first strobe points behind the backstop. The extent is the fraction of
the single-pulse orbit near which the points of a panel lie, in the phase plane scaled to the window of
Fig. 11.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.claims.judging import claims
from printhammer.claims.strobes import window
from printhammer.claims.verdicts import printed_verdicts
from printhammer.drive.trains import PulseTrain
from printhammer.run.simulate import simulate
from studies.reconstruction.search.candidates import TOLERANCE
from studies.reconstruction.search.losses import Score, hinge, run_all
from studies.reconstruction.search.space import geometry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.support.arrays import FloatArray
    from studies.reconstruction.search.candidates import Candidate

_FIRST: Final = 100
"""Number of initial points excluded from a cloud as a transient: half of the plotted points."""

_ORBIT_TIME: Final = 3e-3
_ORBIT_POINTS: Final = 1501
_PIECES: Final = 36
"""Number of pieces of equal length into which the orbit is divided; arbitrary."""

_SHARE: Final = 0.9
"""Fraction of the orbit's length that counts; the last tenth winds closely about the rest state."""

_WANTED: Final = 0.6
"""Fraction of the orbit's pieces that a cloud should cover; arbitrary, as for the widest clouds."""


def clouds(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the losses for extent and depth of the strobe points of the strange panels."""
    settings = claims()["poincare_window"].settings
    low, high = claims()["behind_the_backstop"].band["depth_m"]
    periods = [period for period, verdict in printed_verdicts().items() if verdict == "strange"]
    for candidate, score in zip(chosen, scores, strict=True):
        trains = [
            PulseTrain(candidate.waveform, period=period, pulses=settings["points"] + 1) for period in periods
        ]
        ends = [period * settings["points"] for period in periods]
        table = run_all([candidate], trains, ends, len(trains), strobes="firings").strobes
        assert table is not None
        x, v = table.x[:, : settings["points"]], table.v[:, : settings["points"]]
        depth = geometry()["b"] - float(np.nanmin(x))
        # The ends of the band are approached from outside over its own width.
        score.losses["behind_the_backstop"] = hinge(max(low - depth, depth - high), high - low)
        orbit = _orbit(candidate)
        extents = [_extent(x[k, _FIRST:], v[k, _FIRST:], orbit) for k in range(len(periods))]
        extent = float(np.median(extents))
        score.losses["clouds"] = hinge(_WANTED - extent, _WANTED)
        score.measured |= {"depth": depth, "extent": extent}


def _orbit(candidate: Candidate) -> FloatArray:
    """Simulate the single-pulse orbit from its first backstop touch, in window half-widths, shape (n, 2)."""
    motion = simulate(
        candidate.hammer,
        PulseTrain(candidate.waveform),
        duration=_ORBIT_TIME,
        points=_ORBIT_POINTS,
        tolerance=TOLERANCE,
    )
    inside = np.flatnonzero((motion.x[1:] <= geometry()["b"]) & (motion.x[:-1] > geometry()["b"]))
    start = int(inside[0]) if inside.size else 0
    _, half = window()
    return np.column_stack([motion.x[start:], motion.v[start:]]) / half


def _extent(x: FloatArray, v: FloatArray, orbit: FloatArray) -> float:
    """Return the fraction of the pieces of an orbit that are nearest to any of the points, m and m/s."""
    from scipy.spatial import cKDTree

    _, half = window()
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(orbit, axis=0).T))])
    kept = length <= _SHARE * length[-1]
    _, nearest = cKDTree(orbit[kept]).query(np.column_stack([x, v]) / half)
    pieces = length[nearest] / (_SHARE * length[-1]) * _PIECES
    return len(np.unique(np.minimum(pieces.astype(np.int64), _PIECES - 1))) / _PIECES
