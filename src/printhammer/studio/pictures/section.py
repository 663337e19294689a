"""The strobe section of a state: points as they arrive, with a running exponent, and the verdict."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.run.problem import TOLERANCE
from printhammer.studio.frames import frame
from printhammer.studio.work import try_through

if TYPE_CHECKING:
    from printhammer.studio.states.state import State

AT_ONCE: Final = (25, 50, 100)
"""Points that are shown at once, one number after the other."""

LATER: Final = (150, 200, 300, 400)
"""Points that follow where no newer state comes, with the exponent over the later half of them."""

VERDICT_WORK: Final = 16.0
"""Work of the verdict in that of all points before it: five times the firings, and the exponent over them."""


def strobe_key(state: State) -> tuple[Any, ...]:
    """Return what the strobe section depends on."""
    return (state.hammer, state.text, state.constants, state.waveform, state.rate, state.overlap)


def check_strobe(state: State) -> None:
    """Refuse a section whose first points take too long, by running to them.

    Raises
    ------
    InputError
        They do.
    """
    train = PulseTrain(state.fired, rate=state.rate, pulses=AT_ONCE[0], overlap=state.overlap)
    try_through(
        state,
        train,
        AT_ONCE[0] / state.rate,
        f"the first {AT_ONCE[0]} strobe points",
        TOLERANCE,
    )


def strobe_frame(
    state: State, serial: int, points: int, *, exponent: bool = False, judged: bool = False
) -> bytes:
    """Return strobe points of an endless train at the rate; exponent so far and verdict if asked for.

    Raises
    ------
    InputError
        The state describes no hammer or drive that could be run.
    """
    from printhammer.chaos.strobe.points import strobe

    found = strobe(
        state.changed,
        rate=state.rate,
        points=points,
        waveform=state.fired,
        overlap=state.overlap,
        verdict=judged,
    )
    told: dict[str, Any] = {"status": found.status, "rate": state.rate, "verdict": None, "reason": ""}
    told["exponent"] = exponent_so_far(state, points) if exponent else None
    told["last"] = LATER[-1]
    if found.verdict is not None:
        told["verdict"] = {**found.verdict.as_dict(), "phrases": found.verdict.phrases}
    arrays = {"x": np.float32(found.x), "v": np.float32(found.v)}
    return frame("strobe", serial, arrays, **told)


def exponent_so_far(state: State, points: int) -> dict[str, Any] | None:
    """Return the largest exponent over the later half of some firings, or None where there is none."""
    from printhammer.derivatives.states import strobe_exponent

    period = 1.0 / state.rate
    train = PulseTrain(state.fired, period=period, pulses=points, overlap=state.overlap)
    first = points // 2 + 1
    found = strobe_exponent(state.changed, train, period, first=first, last=points)
    if not (found.ok and found.smooth and math.isfinite(found.value)):
        return None
    return {"value": found.value, "standard_error": found.standard_error, "firings": [first, points]}


def no_section(serial: int, reason: str) -> bytes:
    """Return a section that there is not, and why."""
    return frame("strobe", serial, reason=reason, verdict=None)
