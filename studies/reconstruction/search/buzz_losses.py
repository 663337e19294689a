"""Loss of candidates for buzz printing, Fig. 7: trains in which each pulse follows a departure from the pack.

For each of several delays, a train of nine pulses is simulated; all trains form one ensemble. The score of
six successive dots is the sum of the scores of their forces, 1 for a force within limits, minus half a dot
for each backstop touch between two dots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.claims.judging import claims
from printhammer.drive.trains import PulseTrain
from printhammer.printing.dots.buzz import PATIENCE, delayed_trains
from studies.reconstruction.search.candidates import TOLERANCE
from studies.reconstruction.search.losses import CHUNK, run_all
from studies.reconstruction.search.space import geometry

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.run.ensemble import DotTable
    from printhammer.support.arrays import FloatArray
    from studies.reconstruction.search.candidates import Candidate
    from studies.reconstruction.search.losses import Score

DELAYS: Final = np.arange(0.0, 240e-6, 6e-6)
"""Trial delays from the departure from the pack to the next firing, s."""

PULSES: Final = 9
_GRID: Final = 8e-6
"""Sampling interval in the search for backstop touches, s."""

_NEAR: Final = 0.8
"""Score of a dot just outside the limits."""

_TOO_STRONG: Final = 0.5
"""Excess over the upper limit at which the score of a dot is 0, in units of the single-pulse force."""

_TOUCH: Final = 0.5
_RESERVE: Final = 0.005
"""Margin of the force limits in the search, inside the limits of the claim."""


def buzz(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the loss of buzz printing from trains with a constant delay after each pack contact."""
    band = claims()["buzz_printing"].band
    fewest: int = band["dots"]["at_least"]
    low = band["least_force_over_single"]["at_least"] + _RESERVE
    high = band["largest_force_over_single"]["at_most"] - _RESERVE
    for score in scores:
        score.losses["buzz_printing"] = 1.0
    # No train can follow a pack contact that does not end.
    both = [
        (candidate, score)
        for candidate, score in zip(chosen, scores, strict=True)
        if score.measured["leaving"]
    ]
    for start in range(0, len(both), CHUNK):
        some, own = zip(*both[start : start + CHUNK], strict=True)
        rows = np.repeat(np.arange(len(some)), len(DELAYS))
        forces = np.array([score.measured["force"] for score in own])[rows]
        patience = PATIENCE * np.array([score.measured["leaving"] for score in own])[rows]

        def hopeless(
            dots: DotTable, numbers: list[int], forces: FloatArray = forces
        ) -> npt.NDArray[np.bool_]:
            """Mask of the trains with too many dots outside the limits for six good successive dots."""
            relative = dots.peak_force / forces[numbers][:, np.newaxis]
            inside = (relative >= low) & (relative <= high)
            count = inside.shape[1]
            run = np.where(inside.all(axis=1), count, np.argmin(inside[:, ::-1], axis=1))
            whole = np.array([_longest(row) for row in inside]) >= fewest
            return np.asarray(~whole & (run + PULSES - count < fewest))

        trains = delayed_trains(
            [some[k].hammer for k in rows.tolist()],
            np.tile(DELAYS, len(some)).tolist(),
            patience.tolist(),
            PULSES,
            states=[some[k].state for k in rows.tolist()],
            hopeless=hopeless,
            tolerance=TOLERANCE,
            threads=1,
        )
        shares, touched = _judged(some, trains, patience, forces, (low, high))
        for k, score in enumerate(own):
            mine = slice(k * len(DELAYS), (k + 1) * len(DELAYS))
            best = [_best(row, touch, fewest) for row, touch in zip(shares[mine], touched[mine], strict=True)]
            score.losses["buzz_printing"] = 1.0 - max(best) / fewest
            score.measured["buzz_delay"] = float(DELAYS[int(np.argmax(best))])


def _judged(
    some: Sequence[Candidate],
    trains: Sequence[tuple[float, ...]],
    patience: FloatArray,
    forces: FloatArray,
    limits: tuple[float, float],
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Score each dot of each train; return scores, and a mask of dots that follow a backstop touch."""
    drives = [
        PulseTrain(some[row // len(DELAYS)].waveform, at=list(times)) for row, times in enumerate(trains)
    ]
    ends = [times[-1] + wait for times, wait in zip(trains, patience.tolist(), strict=True)]
    times = np.arange(0.0, max(ends), _GRID)
    result = run_all(some, drives, ends, len(DELAYS), times=times, dots=True)
    assert result.x is not None
    assert result.dots is not None
    dots = result.dots
    relative = dots.peak_force / forces[:, np.newaxis]
    low, high = limits
    counts = np.where(relative < low, _NEAR * relative / low, 1.0)
    counts = np.where(relative > high, _NEAR * np.maximum(1.0 - (relative - high) / _TOO_STRONG, 0.0), counts)
    counts = np.where(dots.struck & np.isfinite(dots.contact_time) & np.isfinite(relative), counts, 0.0)
    below = result.x <= np.float32(geometry()["b"])
    seen = np.concatenate([np.zeros((len(below), 1), np.int64), np.cumsum(below, axis=1)], axis=1)
    struck = np.nan_to_num(dots.fired_at + dots.flight_time)
    place = np.clip(np.searchsorted(times, struck), 0, len(times))
    total = np.take_along_axis(seen, place, axis=1)
    touched = np.zeros(counts.shape, np.bool_)
    touched[:, 1:] = total[:, 1:] > total[:, :-1]
    return counts, touched


def _longest(inside: npt.NDArray[np.bool_]) -> int:
    """Return the length of the longest run of True values."""
    best = run = 0
    for each in inside.tolist():
        run = run + 1 if each else 0
        best = max(best, run)
    return best


def _best(counts: FloatArray, touched: npt.NDArray[np.bool_], fewest: int) -> float:
    """Return the best score of `fewest` successive dots, less the deduction for backstop touches."""
    sums = [
        float(counts[first : first + fewest].sum() - _TOUCH * touched[first + 1 : first + fewest].sum())
        for first in range(max(len(counts) - fewest, 0) + 1)
    ]
    return max(*sums, 0.0)
