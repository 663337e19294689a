"""Frequency-time map of a state: displacement against time and firing rate, as codes for colours."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.batch import PulseTrains
from printhammer.errors import InputError
from printhammer.maps.frequency import tail_of
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble
from printhammer.run.start import initial_state
from printhammer.studio import bounds
from printhammer.studio.frames import frame
from printhammer.studio.states.coil import by_voltage
from printhammer.studio.work import Patience, alike, try_out
from printhammer.support.threads import in_threads, thread_count

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.drive.base import Overlap
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.studio.states.state import State

PREVIEW: Final = (64, 128)
"""Numbers of rates and times of the coarse map that is drawn while a slider is dragged."""

PREVIEW_BY_VOLTAGE: Final = (32, 128)
"""Numbers of rates and times of the coarse map if a voltage drives the coil.

A run with a circuit takes about five times as long."""

FULL: Final = (512, 512)
"""Numbers of rates and times of the full map."""

GAP: Final = 65535
"""Integer code of a map cell without a displacement."""

_RATES_OF_PIECE: Final = {False: 64, True: 16}
"""Number of rates computed between two checks for a newer state, by whether a voltage drives the coil."""
_TRIED: Final = 9
_STEEPEST: Final = 1e38


def try_map(state: State, known: State | None) -> State:
    """Check by runs at some rates that the map of a state can be computed in time; return the tested state.

    Parameters
    ----------
    state : State
        State of the map.
    known : State or None
        State tested before, which is valid for similar states.

    Raises
    ------
    InputError
        The map would take too long, or its rates are not ascending.
    """
    if not state.low < state.high:
        raise InputError(
            f"map: rates from {state.low:g} Hz to {state.high:g} Hz", key="map", expected="ascending ones"
        )
    if known is not None and alike(state, known):
        return known
    rates = tuple(np.linspace(state.low, state.high, _TRIED).tolist())
    trains = _trains(state.fired, rates, state.slots, state.overlap)
    for rate, train in zip(rates, trains, strict=True):
        try_out(state, train, _end(state), f"a run of the map, at {rate:.4g} Hz,")
    return state


def preview_of(state: State) -> tuple[int, int]:
    """Return the numbers of rates and times of the coarse map that is drawn while a slider is dragged."""
    return PREVIEW_BY_VOLTAGE if by_voltage(state.fired) else PREVIEW


def map_frame(
    state: State,
    serial: int,
    size: tuple[int, int],
    newer: Callable[[], bool],
    threads: int | None = None,
) -> bytes:
    """Return the frame of the map: displacement against time and rate, as 16-bit codes.

    Raises
    ------
    GivenUp
        A newer state arrived first.
    InputError
        The map takes too long, or the state has no valid hammer or drive.
    """
    hammer, count = state.changed, size[0]
    rates = np.linspace(state.low, state.high, count)
    end = _end(state)
    x = np.empty(size, np.float32)
    ok = np.empty(count, bool)
    times = np.linspace(0.0, end, size[1])
    rest = initial_state(hammer, None)
    patience = Patience(newer, "the map")
    # A touch may be shorter than the time step of the map.
    struck = np.zeros((count, state.slots.count("1")), np.uint8) if size == FULL else None

    def piece(first: int, last: int) -> None:
        patience.check()
        fired = rates[first:last].tolist()
        trains = _trains(state.fired, tuple(fired), state.slots, state.overlap)
        most = bounds.MOST_MAP_STEPS
        runs = Ensemble(hammer, trains, end, states=rest, tolerance=DISPLAY_TOLERANCE, max_steps=most)
        result = runs.run(times=times, x=x[first:last], threads=1, dots=struck is not None)
        ok[first:last] = result.ok
        if struck is not None and result.dots is not None:
            struck[first:last] = result.dots.struck

    # Prepare the next piece while the current one is integrated.
    in_threads([piece], [count], thread_count(threads), lengths=[_RATES_OF_PIECE[by_voltage(state.fired)]])
    # Colours span the range from backstop to platen, as far as both exist.
    known = x[np.isfinite(x)]
    low, high = hammer.position or 0.0, hammer.platen or 0.0
    if known.size:
        low = float(known.min()) if hammer.position is None else low
        high = float(known.max()) if hammer.platen is None else high
    high = max(high, float(np.nextafter(np.float32(low), np.float32(np.inf))))
    arrays = {"codes": codes_of(x, low, high), **({} if struck is None else {"struck": struck})}
    heading = {
        "rates": [state.low, state.high],
        "end": end,
        "low": low,
        "high": high,
        "front": hammer.front,
        "pattern": state.pattern,
        "pulses": state.pulses,
        "failed": int((~ok).sum()),
        "detail": "full" if size == FULL else "preview",
        "reason": "",
    }
    return frame("map", serial, arrays, **heading)


def _end(state: State) -> float:
    return (len(state.slots) - 1) / state.low + tail_of(state.changed, state.fired)


@lru_cache(maxsize=64)
def _trains(waveform: Waveform, rates: tuple[float, ...], slots: str, overlap: Overlap) -> PulseTrains:
    """Build a pulse train for each rate; cached, since trains do not depend on the hammer's constants."""
    if "0" not in slots:
        return PulseTrains.at_rates(waveform, rates, len(slots), overlap)
    fired = np.flatnonzero([mark == "1" for mark in slots])
    return PulseTrains(waveform, [fired / rate for rate in rates], overlap)


def codes_of(x: Any, low: float, high: float) -> Any:
    """Encode displacements as integers from 0 (at `low`) to 65534 (at `high`); 65535 if missing."""
    # Without motion, both ends are adjacent floats.
    steep = np.float32(min((GAP - 1) / (high - low), _STEEPEST))
    scaled = np.minimum(x - np.float32(low), np.float32(high - low)) * steep
    np.clip(scaled, 0.0, GAP - 1, out=scaled)
    unknown = np.isnan(scaled)
    scaled[unknown] = GAP
    return scaled.astype(np.uint16)
