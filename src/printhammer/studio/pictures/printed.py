"""Frame of the printed line: position and darkness of each dot of a text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.studio import bounds
from printhammer.studio.frames import frame
from printhammer.studio.work import Patience, try_out

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.printing.page.pattern import Pattern
    from printhammer.studio.states.state import State

_TRIED: Final = 16


def check_line(state: State, pattern: Pattern) -> None:
    """Check that a line can be printed in time, by a run that fires in every slot.

    Raises
    ------
    InputError
        The line would take too long.
    """
    train = PulseTrain(state.fired, rate=state.rate, pulses=_TRIED, overlap=state.overlap)
    what = f"the first {_TRIED} slots of the line"
    tried = try_out(state, train, _TRIED / state.rate, what, through=True)
    runs = int(pattern.dots.any(axis=2).sum())
    steps = runs * pattern.slots * tried.steps / _TRIED
    if steps > bounds.MOST_WORK:
        raise InputError(
            f"the line would take about {steps:.2g} steps",
            key="line",
            expected=f"at most {bounds.MOST_WORK:.2g}",
        )


def line_frame(state: State, serial: int, newer: Callable[[], bool]) -> bytes:
    """Return the dots of the line, or the reason why it cannot be printed or takes too long.

    Raises
    ------
    GivenUp
        A newer state arrived first.
    """
    from printhammer.printing.page.page import print_page
    from printhammer.printing.page.pattern import Pattern

    try:
        pattern = Pattern.from_text(state.line)
        check_line(state, pattern)
        patience = Patience(newer, "the line")
        page = print_page(
            state.changed, pattern, state.rate, waveform=state.fired, progress=patience.progress
        )
    except InputError as error:
        return frame("line", serial, reason=str(error))
    (x, y), (wanted_x, wanted_y) = page.places, page.intended
    arrays = {
        "x": np.float32(x),
        "y": np.float32(y),
        "wanted x": np.float32(wanted_x),
        "wanted y": np.float32(wanted_y),
        "darkness": np.float32(page.darkness),
        "fault": page.fault.astype(np.int32),
        "extra x": np.float32(page.extra_places[0]),
        "extra y": np.float32(page.extra_places[1]),
    }
    force, off = page.force_ratio[page.printed], page.placement_error[page.printed]
    heading = {
        "wanted": int(page.lost.size),
        "good": int(page.good.sum()),
        "lost": int(page.lost.sum()),
        "faults": {name: count for name, count in page.fault_counts.items() if count},
        "wire": page.head.wire_diameter,
        "pitch": page.head.pitch,
        "force": [float(force.min()), float(force.max())] if force.size else None,
        "placement": [float(off.min()), float(off.max())] if off.size else None,
        "failed": int((page.status != "ok").sum()),
    }
    return frame("line", serial, arrays, reason="", **heading)
