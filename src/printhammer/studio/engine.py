"""From a state to frames: what is quick first, previews before detail.

Everything here is a function of the state alone. `newer` is asked now and then whether a newer state has
come, and what is under way is then given up.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive import PulseTrain
from printhammer.ensemble import DISPLAY_TOLERANCE, Ensemble
from printhammer.errors import InputError
from printhammer.maps import TAIL
from printhammer.motion import Motion
from printhammer.problem import Problem
from printhammer.simulate import end_of_run
from printhammer.start import initial_state
from printhammer.studio import bounds
from printhammer.studio.frames import frame
from printhammer.threads import in_threads, thread_count

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.drive_base import Overlap
    from printhammer.segments import FloatArray
    from printhammer.studio.state import State
    from printhammer.waveforms import Waveform

PREVIEW: Final = (64, 128)
"""Rates and times of the map that is shown while a slider moves."""

FULL: Final = (512, 512)
"""Rates and times of the map in full detail."""

POINTS: Final = 1600
"""Points of a curve, at least."""

MOST_ENDS: Final = 20_000
"""Ends of steps among the points of a curve, at most."""

SECTION: Final = (100, 400)
"""Strobe points, at first and in the end."""

GAP: Final = 65535
"""Code of a displacement that is not known, in a map."""

_EXPONENT_STEPS: Final = 40.0


_RATES_OF_PIECE: Final = 64


class GivenUp(Exception):
    """A newer state has come."""


def motion_frame(state: State, serial: int) -> tuple[bytes, Motion]:
    """Return the curves of a single run, and the run.

    Raises
    ------
    InputError
        The state describes no hammer or drive that could be run.
    """
    hammer, drive = state.changed, state.drive
    motion = run_of(state)
    times = points_of(motion.step_times)
    places, speeds = motion.at(times)
    force, values = motion.forces_at(times), drive.value(times)
    fired, x, v = motion.strobe
    arrays: dict[str, Any] = {
        "t": times,
        "x": np.float32(places),
        "v": np.float32(speeds),
        "drive": np.float32(values),
        **{f"F {name}": np.float32(values) for name, values in force.items()},
        "strobe t": fired,
        "strobe x": np.float32(x),
        "strobe v": np.float32(v),
    }
    told: dict[str, Any] = {
        "status": motion.status,
        "message": motion.message,
        "places": {
            "backstop": hammer.position,
            "front": hammer.front,
            "platen": hammer.platen,
            "thickness": getattr(hammer.pack, "thickness", None),
        },
        "quantity": drive.quantity,
        "peak": float(np.abs(values).max()),
        "fired": drive.times.tolist(),
        "steps": motion.steps,
        "pulse": pulse_of(state),
    }
    return frame("motion", serial, arrays, **told), motion


def run_of(state: State) -> Motion:
    """Return the run of a state, given up after `bounds.MOST_STEPS` steps.

    Raises
    ------
    InputError
        As `motion_frame`.
    """
    hammer, drive = state.changed, state.drive
    problem = Problem(hammer, drive, initial_state(hammer, None), 0.0, DISPLAY_TOLERANCE)
    problem.max_steps = bounds.MOST_STEPS
    end = end_of_run(drive, None)
    record = problem.run(end)
    return Motion(problem, record, end, record.nodes[:, 0].copy(), "default")


def points_of(ends: FloatArray) -> FloatArray:
    """Return the times of a curve's points, s: close where the integrator's steps are short, as in contacts.

    Every switch of a force is the end of a step, and is among them, where the steps are at most `MOST_ENDS`.
    """
    # What is longer than any picture is wide is thinned out.
    ends = ends[np.unique(np.linspace(0, len(ends) - 1, min(len(ends), MOST_ENDS)).astype(int))]
    steps = np.diff(ends)
    least = 3 if len(steps) < POINTS else 1
    counts = np.maximum(np.ceil(steps * POINTS / (ends[-1] - ends[0])).astype(int), least)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(counts.sum()) - first) / np.repeat(counts, counts)
    return np.append(np.repeat(ends[:-1], counts) + part * np.repeat(steps, counts), ends[-1])


def pulse_of(state: State) -> dict[str, list[float]]:
    """Return the curve of one pulse for the waveform editor, s and A or N."""
    waveform = state.fired
    tau = np.linspace(0.0, min(waveform.support, _shown(state)), 160)
    return {"t": tau.tolist(), "value": waveform.value(tau).tolist()}


def _shown(state: State) -> float:
    # An exponential decay goes on far beyond what can be seen.
    waveform = state.fired
    width, decay = getattr(waveform, "width", None), getattr(waveform, "decay", None)
    if width is None or decay is None:
        return waveform.support
    return float(width + 5.0 * decay)


def dots_frame(serial: int, motion: Motion) -> bytes:
    """Return what the firings did, all contacts, and the energies of the run."""
    dots = motion.dots
    struck = [dot for dot in dots if dot.struck]
    energy = motion.energy
    told: dict[str, Any] = {
        "dots": [asdict(dot) for dot in dots],
        "contacts": [
            {
                "surface": contact.surface,
                "t_in": contact.t_in,
                "t_out": contact.t_out,
                "t_peak": contact.t_peak,
                "peak_force": contact.peak_force,
                "depth": contact.depth,
                "v_in": contact.v_in,
                "loss": contact.loss,
                "extra": contact.extra,
            }
            for contact in motion.contacts[: 4 * bounds.MOST_PULSES]
        ],
        "energy": asdict(energy),
        "quality": {
            "fired": len(dots),
            "struck": len(struck),
            "extra": sum(dot.extra_contacts for dot in dots),
            "force_low": min((dot.peak_force or 0.0 for dot in struck), default=None),
            "force_high": max((dot.peak_force or 0.0 for dot in struck), default=None),
            "flight_low": min((dot.flight_time or 0.0 for dot in struck), default=None),
            "flight_high": max((dot.flight_time or 0.0 for dot in struck), default=None),
        },
    }
    return frame("dots", serial, **told)


def map_key(state: State) -> tuple[Any, ...]:
    """Return what the map depends on."""
    return (
        state.hammer,
        state.text,
        state.constants,
        state.waveform,
        state.pulses,
        state.overlap,
        state.low,
        state.high,
    )


def map_frame(
    state: State, serial: int, size: tuple[int, int], newer: Callable[[], bool], threads: int | None = None
) -> bytes:
    """Return the displacement against time and rate, as 16-bit codes between two displacements.

    Raises
    ------
    GivenUp
        A newer state has come before it was done.
    InputError
        The rates are not ascending, or as `motion_frame`.
    """
    if not state.low < state.high:
        raise InputError(f"map: rates from {state.low:g} Hz to {state.high:g} Hz, expected ascending ones")
    hammer, count = state.changed, size[0]
    rates = np.linspace(state.low, state.high, count)
    end = (state.pulses - 1) / state.low + TAIL
    x = np.empty(size, np.float32)
    ok = np.empty(count, bool)
    times = np.linspace(0.0, end, size[1])

    def piece(first: int, last: int) -> None:
        if newer():
            raise GivenUp
        trains = _trains(state.fired, tuple(rates[first:last].tolist()), state.pulses, state.overlap)
        runs = Ensemble(hammer, trains, end, tolerance=DISPLAY_TOLERANCE)
        ok[first:last] = runs.run(times=times, x=x[first:last], threads=1).ok

    # While one piece is integrated, another is made ready.
    in_threads([piece], [count], thread_count(threads), lengths=[_RATES_OF_PIECE])
    low, high = _limits(hammer.position, hammer.platen, x)
    arrays = {"codes": codes_of(x, low, high)}
    told = {
        "rates": [state.low, state.high],
        "end": end,
        "low": low,
        "high": high,
        "front": hammer.front,
        "failed": int((~ok).sum()),
        "detail": "full" if size == FULL else "preview",
    }
    return frame("map", serial, arrays, **told)


@lru_cache(maxsize=64)
def _trains(waveform: Waveform, rates: tuple[float, ...], pulses: int, overlap: Overlap) -> list[PulseTrain]:
    """Return a train for each rate; kept, since they stay the same while a constant of the hammer changes."""
    return [PulseTrain(waveform, rate=rate, pulses=pulses, overlap=overlap) for rate in rates]


def _limits(low: float | None, high: float | None, x: Any) -> tuple[float, float]:
    """Return the displacements between which colours lie: backstop and platen, or what there is."""
    known = x[np.isfinite(x)]
    first = float(known.min()) if low is None and known.size else (low or 0.0)
    last = float(known.max()) if high is None and known.size else (high or 0.0)
    return first, last if last > first else first + 1e-9


def codes_of(x: Any, low: float, high: float) -> Any:
    """Return displacements as whole numbers from 0 (low) to 65534 (high), 65535 where they are not known."""
    scaled = (x - np.float32(low)) * np.float32((GAP - 1) / (high - low))
    np.clip(scaled, 0.0, GAP - 1, out=scaled)
    unknown = np.isnan(scaled)
    scaled[unknown] = GAP
    return scaled.astype(np.uint16)


def watch(newer: Callable[[], bool]) -> Callable[[int, int], None]:
    """Return what gives work up when a newer state has come, to be called as it goes on."""

    def progress(_done: int, _all: int) -> None:
        if newer():
            raise GivenUp

    return progress


def strobe_key(state: State) -> tuple[Any, ...]:
    """Return what the strobe section depends on."""
    return (state.hammer, state.text, state.constants, state.waveform, state.rate, state.overlap)


def strobe_frame(state: State, serial: int, points: int, judged: bool) -> bytes:
    """Return strobe points of an endless train at the rate, and the verdict on it if asked for.

    Raises
    ------
    InputError
        As `motion_frame`.
    """
    from printhammer.chaos.strobe import strobe

    found = strobe(
        state.changed,
        rate=state.rate,
        points=points,
        waveform=state.fired,
        overlap=state.overlap,
        verdict=judged,
    )
    told: dict[str, Any] = {"status": found.status, "rate": state.rate, "verdict": None}
    if found.verdict is not None:
        told["verdict"] = {**found.verdict.as_dict(), "phrases": found.verdict.phrases}
    arrays = {"x": np.float32(found.x), "v": np.float32(found.v)}
    return frame("strobe", serial, arrays, **told)


def too_long(motion: Motion) -> str:
    """Return why a run is too much work to be repeated for a map and a strobe, or nothing."""
    if motion.steps <= bounds.MOST_MAP_STEPS:
        return ""
    most = bounds.MOST_MAP_STEPS
    return f"the run took {motion.steps} steps, expected at most {most} for a map, a strobe and a line"
