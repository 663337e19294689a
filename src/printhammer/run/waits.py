"""Windows of the runs of many devices (`printhammer.run.window`), from an ensemble of single pulses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from printhammer.drive.batch import PulseTrains
from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.run.ensemble import Ensemble
from printhammer.run.window import (
    MOST_STEPS,
    TOLERANCE,
    Single,
    has_flight,
    has_window,
    is_enough,
    last_wait,
    least_wait,
    longest_of,
    window_of,
)
from printhammer.support.arrays import FloatArray


def waits_of(
    hammers: Sequence[Hammer], waveforms: Sequence[Waveform], threads: int | None = None
) -> FloatArray:
    """Compute the time [s] from the last firing to the end of each run, as `wait_of` does for one run."""
    return windows_of(hammers, waveforms, threads)[0]


def windows_of(
    hammers: Sequence[Hammer], waveforms: Sequence[Waveform], threads: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Compute the window of each run by ensembles; return windows and flight times [s] as in `Window`.

    `hammers` and `waveforms` have one entry per run, and the returned arrays the shape (runs,); equal objects
    are simulated once. Devices whose armature does not rest clear of a pack are simulated one by one: most of
    the work is then the search for the rest position.
    """
    places: dict[tuple[int, int], int] = {}
    pairs: list[tuple[Hammer, Waveform]] = []
    which = []
    for hammer, waveform in zip(hammers, waveforms, strict=True):
        key = id(hammer), id(waveform)
        if key not in places:
            places[key] = len(pairs)
            pairs.append((hammer, waveform))
        which.append(places[key])
    waits = np.array([least_wait(waveform) for _hammer, waveform in pairs])
    last, flights = np.full(len(pairs), np.nan), np.full(len(pairs), np.nan)
    left = []
    for i, (hammer, waveform) in enumerate(pairs):
        if has_window(hammer, waveform) and has_flight(hammer):
            left.append(i)
        else:
            waits[i], flights[i] = window_of(hammer, waveform)
    while left:
        drives = {id(pairs[i][1]): PulseTrain(pairs[i][1]) for i in left}
        result = Ensemble(
            [pairs[i][0] for i in left],
            [drives[id(pairs[i][1])] for i in left],
            waits[left],
            tolerance=TOLERANCE,
            max_steps=MOST_STEPS,
        ).run(dots=True, strobes=[[waits[i]] for i in left], threads=threads)
        assert result.dots is not None
        assert result.strobes is not None
        columns = result.ok, result.dots.flight_time[:, 0], result.strobes.x[:, 0], result.strobes.v[:, 0]
        seen = [Single(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
        flights[left] = [each.flight for each in seen]
        left = [i for i, each in zip(left, seen, strict=True) if not is_enough(pairs[i][0], each, waits[i])]
        for i in left:
            last[i] = last_wait(*pairs[i]) if math.isnan(last[i]) else last[i]
        left = [i for i in left if waits[i] < last[i]]
        waits[left] *= 2.0
    places_of = np.array(which, dtype=np.int64)
    return waits[places_of], flights[places_of]


def longest_waveforms(drives: Sequence[Drive]) -> list[Waveform]:
    """Return, for each drive, its waveform with the longest duration."""
    if isinstance(drives, PulseTrains):
        return [drives.pulses[number].waveform for number in drives.pulse_of.tolist()]
    return [longest_of(drive) for drive in drives]
