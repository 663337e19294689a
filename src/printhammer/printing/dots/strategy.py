"""Strategies: from what is wanted to a drive. Open loop here; tables and feedback are others of the kind.

Patterns of slots: times, one period apart, at each of which a dot is wanted or not.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from printhammer.drive.batch import PulseTrains, firings_of
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import pulse_of
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

SLOTS: Final = 8  # Number of slots of a pattern from rest, and order of the cycle

LEAD_IN: Final = 64  # Slots of the cycle that are run before the first one that is judged

FIRST_SLOT: Final = 1e-3
"""Time of slot 0 in a run, s: a drive may fire ahead of a slot, and no drive fires before time 0."""


@cache
def eight_slot_patterns() -> BoolArray:
    """Return the 255 patterns of eight slots in which at least one dot is wanted, (255, 8), read-only.

    Row n holds the binary digits of n + 1, the most significant one in slot 0.
    """
    numbers = np.arange(1, 2**SLOTS)
    rows: BoolArray = (numbers[:, np.newaxis] >> np.arange(SLOTS - 1, -1, -1)) & 1 == 1
    rows.setflags(write=False)
    return rows


@cache
def de_bruijn(order: int = SLOTS) -> BoolArray:
    """Return a binary de Bruijn cycle: read around, it holds every word of `order` slots exactly once.

    It is the least one in the order of a dictionary: the Lyndon words whose length divides the order, one
    after another (H. Fredricksen and J. Maiorana, Discrete Math. 23 (1978) 207). The order is from 1 to 16,
    the shape (2**order,); read-only.
    """
    if not 1 <= order <= 16:
        raise InputError(
            f"order = {order!r} of a de Bruijn cycle", key="order", value=order, expected="1 to 16"
        )
    cycle: list[int] = []
    word = [0]
    # Duval's algorithm: the Lyndon words up to a length, in order.
    while word:
        if order % len(word) == 0:
            cycle += word
        word = [word[place % len(word)] for place in range(order)]
        while word and word[-1] == 1:
            word.pop()
        if word:
            word[-1] = 1
    whole = np.array(cycle, dtype=np.bool_)
    whole.setflags(write=False)
    return whole


def cycle_with_lead_in(order: int = SLOTS, lead_in: int = LEAD_IN) -> BoolArray:
    """Return once around the de Bruijn cycle of an order, its own last slots before it.

    The run begins at rest, `lead_in` slots before the cycle does, with what the cycle ends with. So at every
    slot that is judged, from number `lead_in` on, the past is that of a cycle without end, for `lead_in`
    slots at least.
    """
    cycle = de_bruijn(order)
    return np.concatenate([np.resize(cycle[::-1], lead_in)[::-1], cycle])


def slots_of(pattern: npt.ArrayLike) -> tuple[int, ...]:
    """Return the numbers of the slots at which a dot is wanted."""
    return tuple(np.flatnonzero(np.asarray(pattern, dtype=np.bool_)).tolist())


def slot_times(slots: Sequence[int] | IntArray, rate: float, first: float = FIRST_SLOT) -> FloatArray:
    """Return the times of some slots, s; of an array of numbers of slots an array of the same shape."""
    return first + np.asarray(slots, dtype=np.float64) / rate


class Strategy(Protocol):
    """A way to drive a hammer: a function that gives a drive for each pattern.

    It is called with the hammer that is driven, which may differ from the one that the strategy was made for,
    the patterns as the numbers of the slots at which dots are wanted, and the slots per second, Hz. Each
    drive has one firing for each wanted dot, in order; slot 0 is at `FIRST_SLOT` of
    `printhammer.printing.dots.strategy`, so that a dot may be fired ahead of its slot. What it gives for a
    pattern must not depend on the others.
    """

    def __call__(
        self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float, /
    ) -> Sequence[Drive]:
        """Return a drive for each pattern."""
        ...


def open_loop(hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> Sequence[Drive]:
    """Fire the waveform of the hammer at every slot at which a dot is wanted, whatever the hammer does."""
    return OpenLoop()(hammer, patterns, rate)


class OpenLoop:
    """As `open_loop`, with another waveform than that of the hammer.

    Parameters
    ----------
    waveform : Waveform, optional
        What is fired.
    """

    name = "open loop"

    def __init__(self, waveform: Waveform | None = None) -> None:
        self.waveform = waveform

    def __call__(self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> Sequence[Drive]:
        """Return a drive for each pattern."""
        if not patterns:
            return []
        return PulseTrains(pulse_of(hammer, self.waveform), [slot_times(slots, rate) for slots in patterns])


def checked_drives(
    strategy: Strategy, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float
) -> Sequence[Drive]:
    """Return the drives of a strategy.

    Raises
    ------
    InputError
        It gives another number of drives, or drives with another number of firings, than is wanted.
    """
    drives = strategy(hammer, patterns, rate)
    if len(drives) != len(patterns):
        raise InputError(
            f"the strategy gives {len(drives)} drives", key="strategy", expected=f"{len(patterns)}"
        )
    for slots, count in zip(patterns, firings_of(drives).counts.tolist(), strict=True):
        if count != len(slots):
            raise InputError(
                f"the strategy gives {count} firings for the slots {slots}",
                key="strategy",
                expected=f"{len(slots)}",
            )
    return drives


def name_of(strategy: Strategy) -> str:
    """Return the name of a strategy, such as "open loop"."""
    name = getattr(strategy, "name", None) or getattr(strategy, "__name__", type(strategy).__name__)
    return str(name).replace("_", " ")
