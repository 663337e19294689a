"""Candidates: points of the search space made into hammers that print the stroke of the paper."""

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
"""Tolerance of the search; what it finds is judged at the default one."""

SINGLE: Final = 2e-3
"""Time within which a single pulse has printed, s."""

_MASS: Final = 4e-4
_STIFFNESS: Final = 220.0
"""First guess of the stiffness of the pack for that mass, N."""

_ROUNDS: Final = 6
_CLOSE: Final = 0.1e-6
_LONGEST: Final = math.log(30.0)
"""Largest change of the logarithm of the stiffness from one round to the next."""


@dataclass(frozen=True)
class Candidate:
    """A hammer of the search space with the printed stroke."""

    point: FloatArray
    """Shares of the ranges of the variables."""
    constants: dict[str, float]
    """Of the hammer file, SI."""
    hammer: Hammer
    rest: float
    """Displacement at rest, m."""

    @property
    def waveform(self) -> Waveform:
        """The current of one firing."""
        waveform = self.hammer.waveform
        assert waveform is not None
        return waveform

    @property
    def state(self) -> tuple[float, float]:
        """Displacement and velocity at rest."""
        return self.rest, 0.0


def candidates(points: Sequence[FloatArray], shape: Shape = "rectangle") -> list[Candidate | None]:
    """Make hammers of points; None where the armature has no rest, does not print, or not with that stroke.

    The forces are scaled to the mass by the variables, so that the stroke is a matter of the stiffness of the
    pack over the mass alone; that is solved for, and then everything scaled to the print force.

    Parameters
    ----------
    points : sequence of arrays
        Shares of the ranges of the variables.
    shape : str, optional
        Of the current of a firing, one of `SHAPES`.
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
    """Return the stiffnesses of the pack at which hammers of a fixed mass have the printed stroke."""
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
            # Energy alone: the indentation goes with the stiffness to the power -1 / (n + 1).
            slope = -1.0 / (LOADING_EXPONENT + 1.0)
            if i in before:
                secant = (miss - before[i][1]) / (guess[i] - before[i][0])
                slope = min(max(secant, -1.0), -0.05) if math.isfinite(secant) else slope
            before[i] = guess[i], miss
            guess[i] -= min(max(miss / slope, -_LONGEST), _LONGEST)
    return found
