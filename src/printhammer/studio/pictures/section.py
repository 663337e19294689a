"""Strobe section of a state: growing numbers of points, a running exponent, and the classification."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.run.problem import TOLERANCE
from printhammer.studio import bounds
from printhammer.studio.frames import frame
from printhammer.studio.work import try_out

if TYPE_CHECKING:
    from printhammer.studio.states.state import State

AT_ONCE: Final = (25, 50, 100)
"""Numbers of strobe points in the frames that are sent at once, one frame after the other."""

LATER: Final = (150, 200, 300, 400)
"""Numbers of strobe points in later frames, which include the exponent over the later half of the firings."""


VERDICT_WORK: Final = 16.0
"""Computation time of the classification, relative to the last frame of points with its exponent."""


def check_strobe(state: State) -> None:
    """Check that a strobe section can be computed in time, by a run up to its first points.

    Raises
    ------
    InputError
        The first points take too long.
    """
    train = PulseTrain(state.fired, rate=state.rate, pulses=AT_ONCE[0], overlap=state.overlap)
    what = f"the first {AT_ONCE[0]} strobe points"
    try_out(
        state, train, AT_ONCE[0] / state.rate, what, TOLERANCE, through=True, most=bounds.MOST_SECTION_STEPS
    )


def strobe_frame(
    state: State,
    serial: int,
    points: int,
    *,
    exponent: bool = False,
    judged: bool = False,
) -> bytes:
    """Return a frame of strobe points of an endless train; optionally with exponent or classification.

    Raises
    ------
    InputError
        The state has no valid hammer or drive.
    """
    from printhammer.chaos.strobe.points import strobe

    fired: dict[str, Any] = {"waveform": state.fired, "overlap": state.overlap, "rate": state.rate}
    section = strobe(state.changed, points=points, verdict=judged, **fired)
    heading: dict[str, Any] = {"status": section.status, "rate": state.rate, "verdict": None, "reason": ""}
    heading["exponent"] = exponent_so_far(state, points) if exponent else None
    heading["last"] = LATER[-1]
    if section.verdict is not None:
        heading["verdict"] = {**section.verdict.as_dict(), "phrases": section.verdict.phrases}
    arrays = {"x": np.float32(section.x), "v": np.float32(section.v)}
    return frame("strobe", serial, arrays, **heading)


def exponent_so_far(state: State, points: int) -> dict[str, Any] | None:
    """Estimate the largest exponent over the later half of `points` firings; None if not computable."""
    from printhammer.derivatives.states import strobe_exponent

    period = 1.0 / state.rate
    train = PulseTrain(state.fired, period=period, pulses=points, overlap=state.overlap)
    first = points // 2 + 1
    exponent = strobe_exponent(state.changed, train, period, first=first, last=points)
    if not (exponent.ok and exponent.smooth and math.isfinite(exponent.value)):
        return None
    return {"value": exponent.value, "standard_error": exponent.standard_error, "firings": [first, points]}
