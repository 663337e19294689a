"""The window of a run: how long it goes on after its last firing, from the device and its waveform.

A single pulse from rest shows how slow a device is. The window starts at 4 ms after the supply is off and is
doubled until it holds `FLIGHTS` flight times of the single pulse and ends with the armature at rest. So the
last dot of a run is struck, and its extra contacts are counted, as those of all other dots. The hammer of the
paper, with a flight time of 0.28 ms, keeps 4 ms. Windows of many devices: `printhammer.run.waits`.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model.modes import OK, PACK_SURFACE
from printhammer.run.problem import Problem, scales_of
from printhammer.run.supply import waveforms_of

CYCLE: Final = 4e-3
"""Least time after the supply is off, s, at which a run ends unless stated otherwise."""

FLIGHTS: Final = 3.0
"""Least length of a window, in flight times of the single pulse; a later dot of a train may fly longer."""

_SETTLED: Final = 0.05  # Distance from rest at the end of a window, as a fraction of the way to the pack
_PATIENCE: Final = 16.0  # Flight times after which a device that does not settle is waited for no longer
_LONGEST: Final = 64.0  # The same for a device that does not strike either, in times of its scales
_LAST: Final = 1.0  # And in any case, s
TOLERANCE: Final = 5e-7  # The result depends on thresholds only
MOST_STEPS: Final = 500_000
_MOST_KEPT: Final = 512

_known: dict[tuple[str, str], float] = {}


class Single(NamedTuple):
    """A single pulse at the end of a window: whether the run went on so far, its flight, where it is then."""

    ok: bool
    flight: float  # s, NaN without a dot
    x: float
    v: float


def least_wait(waveform: Waveform) -> float:
    """Return the least time from the last firing to the end of a run, s, whatever the device.

    Under a driver 4 ms after it is off, under a current or a force 4 ms after the firing, or its end.
    """
    lasts = waveform.support if math.isfinite(waveform.support) else 0.0
    return CYCLE + lasts if waveform.replaces else max(CYCLE, lasts)


def wait_of(hammer: Hammer, waveform: Waveform | None = None) -> float:
    """Return how long a run goes on after its last firing, s; by default of the hammer's own waveform."""
    pulse = hammer.waveform if waveform is None else waveform
    if pulse is None:
        return CYCLE
    if not has_window(hammer, pulse):
        return least_wait(pulse)
    drive = PulseTrain(pulse)
    key = hammer.fingerprint, drive.fingerprint
    if key not in _known:
        while len(_known) >= _MOST_KEPT:
            _known.pop(next(iter(_known)))
        wait, last = least_wait(pulse), math.nan
        while not is_enough(hammer, _single(hammer, drive, wait), wait):
            last = last_wait(hammer, pulse) if math.isnan(last) else last
            if wait >= last:
                break
            wait *= 2.0
        _known[key] = wait
    return _known[key]


def end_of(hammer: Hammer, drive: Drive) -> float:
    """Return the end of a run under a drive that ends, s: the last firing and the window."""
    return float(drive.times[-1]) + wait_of(hammer, longest_of(drive))


def longest_of(drive: Drive) -> Waveform:
    """Return the waveform of a drive that lasts longest, the first of several."""
    return max(waveforms_of(drive), key=lambda waveform: waveform.support)


def has_window(hammer: Hammer, waveform: Waveform) -> bool:
    """Whether a single pulse of a hammer says how long its runs are: it has a pack, and rests before it."""
    if hammer.front is None or not math.isfinite(waveform.support):
        return False
    try:
        return hammer.rest < hammer.front
    except InputError:
        return False


def _single(hammer: Hammer, drive: Drive, end: float) -> Single:
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, TOLERANCE)
    problem.max_steps = MOST_STEPS
    record = problem.run(end)
    touches = [row[1] for row in record.contacts if int(row[0]) == PACK_SURFACE and not row[6]]
    flight = float(touches[0]) if touches else math.nan
    return Single(record.status == OK, flight, float(record.nodes[-1, 1]), float(record.nodes[-1, 2]))


def is_enough(hammer: Hammer, seen: Single, wait: float) -> bool:
    """Whether a window holds the flights that it has to, and the armature is at rest at the end of it."""
    if not seen.ok:
        return True
    struck = math.isfinite(seen.flight)
    if struck and wait < FLIGHTS * seen.flight:
        return False
    if struck and wait >= _PATIENCE * seen.flight:
        return True
    assert hammer.front is not None
    near = _SETTLED * (hammer.front - hammer.rest)
    time = seen.flight if struck else wait / FLIGHTS
    return abs(seen.x - hammer.rest) <= near and abs(seen.v) * time <= near


def last_wait(hammer: Hammer, waveform: Waveform) -> float:
    """Return the window, s, that is not doubled any more, whatever is seen."""
    way, speed = scales_of(hammer, PulseTrain(waveform), (hammer.rest, 0.0))
    return least_wait(waveform) + min(_LONGEST * way / speed, _LAST)
