"""Window of a run: the time from its last firing to its end, from the device and its waveform.

A single pulse from rest shows how slow a device is. The window initially ends 4 ms after the supply is
switched off; it is doubled until it contains `FLIGHTS` flight times of the single pulse and the armature is
at rest. The last dot of a run is then complete, including its extra contacts. The window of the paper's
hammer, with a flight time of 0.28 ms, is 4 ms. For many devices, see `printhammer.run.waits`.

An armature is at rest when its distance from the rest position is below a fraction of a length. The length is
the distance from rest to the pack if the armature rests clear of a pack, otherwise the reach of the pulse:
the largest distance from rest at the steps of the integrator after a single pulse. An armature that does not
move during the second half of a window, for instance if dry friction holds the armature, counts as at rest at
any displacement. `unsettled` describes an armature that is not at rest at the end of a run.

The same pulse gives the time scale of a device: default times, stated for the paper's hammer, are multiplied
by the time scale, and default rates are divided by it.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model.modes import HELD, HELD_FREE, OK
from printhammer.run.plain.posing import CYCLE, FLIGHTS, flight_of, is_window, last_window, least_window
from printhammer.run.problem import Problem, Record, scales_of
from printhammer.run.supply import waveforms_of
from printhammer.support.arrays import FloatArray

TOLERANCE: Final = 5e-7
"""Tolerance of the single pulse, whose outcome is only compared with thresholds; arbitrary."""
MOST_STEPS: Final = 500_000  # Largest number of steps of a single pulse; arbitrary
# Smallest reach, as a fraction of the typical displacement; arbitrary, above the error of the single pulse
_LEAST_REACH: Final = 1e-4
THRESHOLDS: Final = {"least_reach": _LEAST_REACH, "flights": FLIGHTS, "held": (HELD + 1, HELD_FREE)}
"""Thresholds for a web page: smallest reach, smallest window in flight times, range of the held modes."""
# Distance travelled at the final speed in a time equal to the run, as a fraction of the distance from rest,
# below which the armature counts as standing still; arbitrary
_STILL: Final = 0.01
_MOST_KEPT: Final = 512  # Number of cached windows at which the cache is emptied; arbitrary

_FLIGHT: Final = 0.28e-3  # Flight time of the paper's hammer, for which default rates and times are stated, s
# Fraction of a period at the default rates that a pulse may cover; longer pulses would overlap; arbitrary
_ON: Final = 0.5

_known: dict[tuple[str, str], Window] = {}


class Window(NamedTuple):
    """Window of a run (last firing to end) for a device and waveform, and flight time of the single pulse."""

    wait: float  # Time from the last firing to the end of a run, s
    flight: float  # Flight time of the single pulse, s; NaN without a dot


class Single(NamedTuple):
    """Outcome of a single pulse at the end of a window, from which `is_enough` decides on the window."""

    ok: bool
    flight: float  # Flight time, s; NaN without a dot
    x: float
    v: float
    reach: float = math.nan  # Largest distance from rest, m; NaN if the hammer `has_flight`
    still: bool = False  # Whether the velocity is zero throughout the second half of the window


def least_wait(waveform: Waveform) -> float:
    """Compute the smallest time [s] from the last firing to the end of a run, for any device.

    With a driver, the run ends 4 ms after switch-off; with a current or a force, 4 ms after the firing or, if
    later, at the end of the pulse.
    """
    return least_window(waveform.support, waveform.replaces)


def wait_of(hammer: Hammer, waveform: Waveform | None = None) -> float:
    """Compute the time [s] from the last firing to the end of a run, by default for the hammer's waveform."""
    pulse = hammer.waveform if waveform is None else waveform
    return CYCLE if pulse is None else window_of(hammer, pulse).wait


def time_scale(hammer: Hammer, waveform: Waveform | None = None) -> float:
    """Compute the time scale of a device relative to the paper's hammer: 1, 2, 5, 10, 20, ...

    The factor is the larger of the flight time of a single pulse and half the width of the pulse, divided by
    the flight time of the paper's hammer, 0.28 ms, and rounded on a logarithmic scale; 1 for an endless
    drive.
    """
    pulse = hammer.waveform if waveform is None else waveform
    if pulse is None or not math.isfinite(pulse.support):
        return 1.0
    flight = window_of(hammer, pulse).flight
    busy = max(0.0 if math.isnan(flight) else flight, _ON * float(getattr(pulse, "width", pulse.support)))
    decade = 10.0 ** math.floor(math.log10(busy / _FLIGHT))
    return min(
        (step * decade for step in (1.0, 2.0, 5.0, 10.0)),
        key=lambda factor: abs(math.log(busy / (_FLIGHT * factor))),
    )


def scaled_rate(hammer: Hammer, rate: float, waveform: Waveform | None = None) -> float:
    """Divide a rate [Hz], stated for the paper's hammer, by the time scale of a device."""
    return rate / time_scale(hammer, waveform)


def window_of(hammer: Hammer, pulse: Waveform) -> Window:
    """Compute the window of a run from single pulses of a device; windows are cached."""
    if not has_window(hammer, pulse):
        return Window(least_wait(pulse), math.nan)
    drive = PulseTrain(pulse)
    key = hammer.fingerprint, drive.fingerprint
    window = _known.get(key)
    if window is None:
        wait, last = least_wait(pulse), math.nan
        while not is_enough(hammer, seen := _single(hammer, drive, wait), wait):
            last = last_wait(hammer, pulse) if math.isnan(last) else last
            if wait >= last:
                break
            wait *= 2.0
        # Threads share the cache; clearing it does not affect windows already returned.
        if len(_known) >= _MOST_KEPT:
            _known.clear()
        window = _known[key] = Window(wait, seen.flight)
    return window


def end_of(hammer: Hammer, drive: Drive) -> float:
    """Return the end of a run under a finite drive, s: the last firing plus the window."""
    return float(drive.times[-1]) + wait_of(hammer, longest_of(drive))


def longest_of(drive: Drive) -> Waveform:
    """Return the longest waveform of a drive; the first if several are equally long."""
    return max(waveforms_of(drive), key=lambda waveform: waveform.support)


def has_window(hammer: Hammer, waveform: Waveform) -> bool:
    """Whether single pulses determine the window: the waveform ends, and the hammer has a rest position."""
    if not math.isfinite(waveform.support):
        return False
    try:
        return math.isfinite(hammer.rest)
    except InputError:
        return False


def has_flight(hammer: Hammer) -> bool:
    """Whether the armature rests at a distance from a pack, and so can fly to the pack."""
    return hammer.front is not None and hammer.rest < hammer.front


def _reach(hammer: Hammer, nodes: FloatArray, way: float) -> float:
    """Return the largest distance of the armature from its rest position at the nodes of a record, m.

    The result is at least a small fraction of `way`, the typical displacement, m.
    """
    return max(float(np.abs(nodes[:, 1] - hammer.rest).max()), _LEAST_REACH * way)


def _single(hammer: Hammer, drive: Drive, end: float) -> Single:
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, TOLERANCE)
    problem.max_steps = MOST_STEPS
    record = problem.run(end)
    ok, nodes = record.status == OK, record.nodes
    x, v = float(nodes[-1, 1]), float(nodes[-1, 2])
    if has_flight(hammer):
        return Single(ok, flight_of(record.contacts), x, v)
    still = ok and not nodes[nodes[:, 0] >= 0.5 * end, 2].any()
    return Single(ok, math.nan, x, v, _reach(hammer, nodes, problem.scales[0]), still)


def is_enough(hammer: Hammer, seen: Single, wait: float) -> bool:
    """Whether a window spans `FLIGHTS` flight times and ends with the armature at rest.

    `seen` is the outcome of a single pulse at the end of the window `wait` [s].
    """
    rest, front = hammer.rest, hammer.front
    if not math.isnan(seen.reach):
        front = rest + seen.reach
    assert front is not None
    return seen.still or is_window(seen.ok, seen.flight, seen.x, seen.v, rest, front, wait)


def last_wait(hammer: Hammer, waveform: Waveform) -> float:
    """Return the window [s] at which the search by doubling stops."""
    way, speed = scales_of(hammer, PulseTrain(waveform), (hammer.rest, 0.0))
    return last_window(least_wait(waveform), way, speed)


def unsettled(problem: Problem, record: Record) -> str:
    """Describe in one sentence an armature that is not at rest at the end of a run; empty if at rest.

    The run, under a finite drive, ends with the window of the device. The sentence states the distance from
    rest and the velocity, which exceed the thresholds of `is_enough`.
    """
    hammer, nodes = problem.hammer, record.nodes
    x, v = float(nodes[-1, 1]), float(nodes[-1, 2])
    if record.status != OK or (len(nodes) > 1 and is_held(nodes[-2, 3])):
        return ""
    pulse = longest_of(problem.drive)
    if not has_window(hammer, pulse):
        return "the hammer has no rest position that the armature could reach by the end of the run"
    rest, front = hammer.rest, hammer.front
    if front is None or not has_flight(hammer):
        front = rest + _reach(hammer, nodes, problem.scales[0])
    if is_settled(window_of(hammer, pulse), x, v, rest, front):
        return ""
    return (
        f"the armature is not at rest at the end of the run: {x - rest:.4g} m from its rest position,"
        f" at {v:.4g} m/s"
    )


def moves_on(hammer: Hammer, nodes: FloatArray) -> bool:
    """Whether the armature still moves at the end of a record, so that it may settle in a longer run."""
    (start, *_), (end, x, v, *_) = nodes[0], nodes[-1]
    return bool(abs(v) * (end - start) > _STILL * abs(x - hammer.rest))


def stays_away(hammer: Hammer, waveform: Waveform | None = None) -> str:
    """Describe in one sentence an armature that is away from rest after a single pulse; empty if at rest.

    The pulse is by default the hammer's waveform. The sentence describes the state at the end of the window
    of the device.
    """
    pulse = hammer.waveform if waveform is None else waveform
    if pulse is None or not has_window(hammer, pulse) or not has_flight(hammer):
        return ""
    window, front = window_of(hammer, pulse), hammer.front
    seen = _single(hammer, PulseTrain(pulse), window.wait)
    assert front is not None
    if not seen.ok or is_settled(window, seen.x, seen.v, hammer.rest, front):
        return ""
    return (
        f"{1e3 * window.wait:.4g} ms after a single pulse the armature is not at rest, but"
        f" {100.0 * abs(seen.x - hammer.rest) / (front - hammer.rest):.3g} % of the stroke away: a dot that"
        " follows sooner does not start from rest"
    )


def is_held(mode: float) -> bool:
    """Whether dry friction holds the armature, by the mode code (`printhammer.kernel.model.modes`)."""
    return HELD < mode <= HELD_FREE


def is_settled(window: Window, x: float, v: float, rest: float, front: float) -> bool:
    """Whether an armature at x [m] with the velocity v [m/s] is at rest, by the thresholds of `is_enough`.

    `front` is the position [m] of the front of the pack or, for a hammer that does not rest clear of a pack,
    the rest position plus the largest distance of the motion from rest.
    """
    span = window.wait if math.isnan(window.flight) else FLIGHTS * window.flight
    return is_window(True, math.nan, x, v, rest, front, span)
