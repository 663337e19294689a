"""Candidates: hammers with the stroke of the paper, computed from points of the search space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.run.ensemble import Ensemble
from studies.reconstruction.search.space import (
    LOADING_EXPONENT,
    constants_at,
    geometry,
    hammer_of,
    printing_stiffness,
    values_at,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray
    from studies.reconstruction.search.space import Shape

TOLERANCE: Final = 2e-10
"""Integration tolerance of the search; candidates are judged later, at the default tolerance. Arbitrary."""

SINGLE: Final = 2e-3
"""Duration of a run in which a single pulse has printed, s; arbitrary."""

_MASS: Final = 4e-4
_STIFFNESS: Final = 220.0
"""Initial guess of the stiffness of the pack for the mass `_MASS`, N."""

_ROUNDS: Final = 6
_CLOSE: Final = 0.1e-6
_LONGEST: Final = math.log(30.0)
"""Largest change of the logarithm of the stiffness in one iteration."""


@dataclass(frozen=True)
class Candidate:
    """Candidate: hammer of the search space with the printed stroke."""

    point: FloatArray
    """Values of the variables, as fractions of their ranges."""
    constants: dict[str, float]
    """Constants of the hammer file, SI, by key."""
    hammer: Hammer
    rest: float
    """Displacement at rest, m."""

    @property
    def waveform(self) -> Waveform:
        """Current waveform of one firing."""
        waveform = self.hammer.waveform
        assert waveform is not None
        return waveform

    @property
    def state(self) -> tuple[float, float]:
        """Displacement [m], and velocity [m/s] at rest."""
        return self.rest, 0.0


def candidates(points: Sequence[FloatArray], shape: Shape = "rectangle") -> list[Candidate | None]:
    """Compute the hammer of each point; None if the point has no hammer that prints with the stroke.

    The variables determine the forces relative to the mass, so that the stroke depends only on the ratio of
    pack stiffness to mass. The ratio is solved for, then mass and forces are scaled to the print force. A
    point has no hammer if the armature has no rest position, or if no stiffness gives the printed stroke.

    Parameters
    ----------
    points : sequence of arrays
        Values of the variables, as fractions of their ranges.
    shape : str, optional
        Shape of the current waveform, one of `SHAPES`.
    """
    found: list[Candidate | None] = [None] * len(points)
    values = [values_at(point) for point in points]
    rests: dict[int, float] = {}
    for i, value in enumerate(values):
        try:
            rests[i] = rest_state(hammer_of(constants_at(value, _MASS, 1.0, shape)))
        except InputError:
            continue
    stiffness = _stiffnesses(values, rests, shape)
    for i, own in stiffness.items():
        scale = printing_stiffness() / own
        constants = constants_at(values[i], _MASS * scale, own * scale, shape)
        found[i] = Candidate(np.asarray(points[i]), constants, hammer_of(constants), rests[i])
    return found


def _stiffnesses(
    values: Sequence[dict[str, float]], rests: dict[int, float], shape: Shape
) -> dict[int, float]:
    """Solve for the pack stiffnesses [N] with which hammers of the mass `_MASS` have the printed stroke."""
    wanted = math.log(geometry()["top"] - geometry()["xp"])
    guess = dict.fromkeys(rests, math.log(_STIFFNESS))
    before: dict[int, tuple[float, float]] = {}
    close = math.log1p(_CLOSE / (geometry()["top"] - geometry()["xp"]))
    found: dict[int, float] = {}
    for _ in range(_ROUNDS):
        open_ = list(guess)
        if not open_:
            break
        hammers = [hammer_of(constants_at(values[i], _MASS, math.exp(guess[i]), shape)) for i in open_]
        drives = [PulseTrain(hammer.waveform) for hammer in hammers if hammer.waveform is not None]
        dots = (
            Ensemble(hammers, drives, SINGLE, states=[(rests[i], 0.0) for i in open_], tolerance=TOLERANCE)
            .run(dots=True, threads=1)
            .dots
        )
        assert dots is not None
        for row, i in enumerate(open_):
            depth = float(dots.indentation[row, 0]) if dots.struck[row, 0] else math.nan
            if not depth > 0.0:
                del guess[i]
                continue
            miss = math.log(depth) - wanted
            if abs(miss) < close:
                found[i] = math.exp(guess.pop(i))
                continue
            # By the energy balance, the indentation grows as the stiffness to the power -1 / (n + 1).
            slope = -1.0 / (LOADING_EXPONENT + 1.0)
            if i in before:
                secant = (miss - before[i][1]) / (guess[i] - before[i][0])
                slope = min(max(secant, -1.0), -0.05) if math.isfinite(secant) else slope
            before[i] = guess[i], miss
            guess[i] -= min(max(miss / slope, -_LONGEST), _LONGEST)
    return found
