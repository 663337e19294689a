"""Frames of the single run of a state: curves, dots and energies."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem
from printhammer.run.simulate import end_of_run
from printhammer.run.start import initial_state
from printhammer.studio import bounds
from printhammer.studio.frames import frame

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.studio.states.state import State
    from printhammer.support.arrays import FloatArray

POINTS: Final = 1600
"""Smallest number of points of a plotted curve."""

MOST_ENDS: Final = 20_000
"""Largest number of step ends among the points of a curve."""


def motion_frame(
    state: State, serial: int, outdated: Mapping[str, str] | None = None
) -> tuple[bytes, Motion]:
    """Simulate the single run of a state, up to `bounds.MOST_STEPS` steps; return its curves and motion.

    Parameters
    ----------
    state : State
        State to run.
    serial : int
        Number of the state.
    outdated : mapping, optional
        Reasons why displayed views do not belong to this state, by view.

    Raises
    ------
    InputError
        The state has no valid hammer or drive.
    """
    hammer, drive = state.changed, state.drive
    motion = limited_run(hammer, drive, end_of_run(hammer, drive, None), bounds.MOST_STEPS)
    times = points_of(motion.step_times)
    places, speeds, values, voltage, force = motion.curves_at(times)
    by_voltage = drive.quantity == "voltage"
    fired, x, v = motion.strobe
    arrays: dict[str, Any] = {
        "t": times,
        "x": np.float32(places),
        "v": np.float32(speeds),
        "drive": np.float32(values),
        **({"u": np.float32(voltage)} if by_voltage else {}),
        **{f"F {name}": np.float32(values) for name, values in force.items()},
        "strobe t": fired,
        "strobe x": np.float32(x),
        "strobe v": np.float32(v),
    }
    heading: dict[str, Any] = {
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
        "pulse": pulse_of(state.fired),
        "outdated": outdated or {},
    }
    if by_voltage:
        heading["supply"] = float(state.fired.peak)
    return frame("motion", serial, arrays, **heading), motion


def limited_run(
    hammer: Hammer, drive: Drive, end: float, most: int, tolerance: float = DISPLAY_TOLERANCE
) -> Motion:
    """Return a run with a step limit.

    Raises
    ------
    InputError
        The hammer has no rest state.
    """
    problem = Problem(hammer, drive, initial_state(hammer, None), 0.0, tolerance)
    problem.max_steps = most
    record = problem.run(end)
    return Motion(problem, record, end, record.nodes[:, 0].copy(), "default")


def points_of(ends: FloatArray) -> FloatArray:
    """Return the times of a curve's points, s: dense where the integrator's steps are short, as in contacts.

    Every switch of a force ends a step, and is included unless there are more than `MOST_ENDS` steps.
    """
    # Thin out beyond the width of any picture.
    ends = ends[np.unique(np.linspace(0, len(ends) - 1, min(len(ends), MOST_ENDS)).astype(int))]
    steps = np.diff(ends)
    least = 3 if len(steps) < POINTS else 1
    counts = np.maximum(np.ceil(steps * POINTS / (ends[-1] - ends[0])).astype(int), least)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(counts.sum()) - first) / np.repeat(counts, counts)
    return np.append(np.repeat(ends[:-1], counts) + part * np.repeat(steps, counts), ends[-1])


def pulse_of(waveform: Waveform) -> dict[str, list[float]]:
    """Return times, s, and values, A, N or V, of one pulse, for the waveform editor."""
    shown = waveform.support
    width, decay = getattr(waveform, "width", None), getattr(waveform, "decay", None)
    # An exponential decay extends beyond the visible range; that of a driver only names a path.
    if width is not None and isinstance(decay, float):
        shown = min(shown, float(width + 5.0 * decay))
    tau = np.linspace(0.0, shown, 160)
    return {"t": tau.tolist(), "value": waveform.value(tau).tolist()}


def dots_frame(serial: int, motion: Motion) -> bytes:
    """Return the frame with the dots and the energies of a run."""
    dots = motion.dots
    struck = [dot for dot in dots if dot.struck]
    forces, flights = [dot.peak_force or 0.0 for dot in struck], [dot.flight_time or 0.0 for dot in struck]
    heading: dict[str, Any] = {
        "dots": [_fields(dot) for dot in dots],
        "energy": _fields(motion.energy),
        "quality": {
            "fired": len(dots),
            "struck": len(struck),
            "extra": sum(dot.extra_contacts for dot in dots),
            "force_low": min(forces, default=None),
            "force_high": max(forces, default=None),
            "flight_low": min(flights, default=None),
            "flight_high": max(flights, default=None),
        },
    }
    return frame("dots", serial, **heading)


def _fields(made: Any) -> dict[str, Any]:
    """Return the fields of a dataclass by name, without the copies of `dataclasses.asdict`."""
    return {field.name: getattr(made, field.name) for field in fields(made)}
