"""Drive strategies, which map dot patterns to drives, and the long test patterns.

The open loop is defined here; compensation tables and feedback are strategies too. A pattern is a row of
slots, one period apart in time, each with or without a requested dot.

The long test patterns are the de Bruijn cycle, rows of dots, and a line of text. The cycle contains every
word of eight slots, but at most eight dots in a row. An error that grows from dot to dot may exceed the
limits only in a longer row, so rows have 200 slots, with a dot in every slot, every second or every third.
The text contains all letters and digits in the built-in font, one pattern per wire of the head.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Final, Literal, NamedTuple, Protocol, get_args

import numpy as np
import numpy.typing as npt

from printhammer.drive.batch import PulseTrains, firings_of
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.lettering import lettered
from printhammer.printing.dots.nominal import pulse_of
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

SLOTS: Final = 8  # Number of slots of a pattern from rest, and order of the de Bruijn cycle; arbitrary

LEAD_IN: Final = 64  # Slots simulated before the first judged slot of the cycle; arbitrary

FIRST_SLOT: Final = 1e-3
"""Time of slot 0, s, so that a drive may fire ahead of slot 0, but not before time 0; arbitrary."""


@cache
def eight_slot_patterns() -> BoolArray:
    """Return the 255 patterns of eight slots with at least one dot, shape (255, 8), read-only.

    Row n holds the binary digits of n + 1, the most significant digit in slot 0.
    """
    numbers = np.arange(1, 2**SLOTS)
    rows: BoolArray = (numbers[:, np.newaxis] >> np.arange(SLOTS - 1, -1, -1)) & 1 == 1
    rows.setflags(write=False)
    return rows


@cache
def de_bruijn(order: int = SLOTS) -> BoolArray:
    """Return a binary de Bruijn cycle, which contains every word of `order` slots exactly once.

    The cycle is the lexicographically smallest such cycle: the concatenation of the Lyndon words whose length
    divides the order (H. Fredricksen and J. Maiorana, Discrete Math. 23 (1978) 207). `order` is 1 to 16;
    the array has the shape (2**order,) and is read-only.
    """
    if not 1 <= order <= 16:
        raise InputError(
            f"order = {order!r} of a de Bruijn cycle", key="order", value=order, expected="1 to 16"
        )
    cycle: list[int] = []
    word = [0]
    # Duval's algorithm: the Lyndon words up to length `order`, in lexicographic order.
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
    """Return one period of the de Bruijn cycle, preceded by the last `lead_in` slots of the cycle.

    A simulation of the pattern begins at rest with the lead-in. Every evaluated slot, from index `lead_in`
    onward, is therefore preceded by the same `lead_in` slots as in an endless cycle.
    """
    cycle = de_bruijn(order)
    return np.concatenate([np.resize(cycle[::-1], lead_in)[::-1], cycle])


def slots_of(pattern: npt.ArrayLike) -> tuple[int, ...]:
    """Return the indices of the slots with a requested dot."""
    return tuple(np.flatnonzero(np.asarray(pattern, dtype=np.bool_)).tolist())


def slot_times(slots: Sequence[int] | IntArray, rate: float, first: float = FIRST_SLOT) -> FloatArray:
    """Compute the times [s] of slots from their indices, of any shape, and the slot rate [Hz].

    `first` is the time of slot 0, s.
    """
    return first + np.asarray(slots, dtype=np.float64) / rate


class Strategy(Protocol):
    """Interface of drive strategies: callables that return a drive for each dot pattern.

    A strategy is called with the hammer to drive, which may differ from the hammer that the strategy was
    designed for, the patterns as indices of the slots with a dot, and the slot rate, Hz. Each drive has one
    firing for each requested dot, in order; slot 0 is at `FIRST_SLOT` of
    `printhammer.printing.dots.strategy`, so that a dot may be fired ahead of its slot. The drive of a pattern
    must not depend on the other patterns.
    """

    def __call__(
        self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float, /
    ) -> Sequence[Drive]:
        """Return a drive for each pattern."""
        ...


def open_loop(hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> Sequence[Drive]:
    """Fire the hammer's waveform at every slot with a dot, without compensation."""
    return OpenLoop()(hammer, patterns, rate)


class OpenLoop:
    """Open-loop strategy; see `open_loop`.

    Parameters
    ----------
    waveform : Waveform, optional
        Waveform to fire; by default that of the hammer.
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
    """Call a strategy, check that each drive has one firing per requested dot, and return the drives.

    Raises
    ------
    InputError
        The number of drives, or the number of firings of a drive, does not match the patterns.
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
    """Return the name of a drive strategy, such as "open loop"."""
    name = getattr(strategy, "name", None) or getattr(strategy, "__name__", type(strategy).__name__)
    return str(name).replace("_", " ")


ROW: Final = 200  # Number of slots of a row of dots; arbitrary

STEPS: Final = (1, 2, 3)  # Slots from one dot to the next in the rows; arbitrary

TEXT: Final = "Pack my box with five dozen liquor jugs 0123456789"
"""Text of the test line: every letter of the alphabet and every digit."""

Kind = Literal["cycle", "row", "text"]
KINDS: Final = get_args(Kind)


class LongPattern(NamedTuple):
    """Long test pattern: its kind, the slots with a dot, and the first evaluated slot."""

    kind: Kind
    slots: tuple[int, ...]
    judged_from: int = 0


def row_of_dots(step: int = 1) -> tuple[int, ...]:
    """Return the indices 0, `step`, 2 `step`, ... of the slots with a dot in a row of `ROW` slots."""
    return tuple(range(0, ROW, step))


@cache
def long_patterns() -> tuple[LongPattern, ...]:
    """Return the long test patterns: cycle with lead-in, rows, and one pattern per wire of text.

    Patterns of the same kind are consecutive.
    """
    wires = [slots_of(wire) for wire in lettered(TEXT, columns=len(TEXT))[0]]
    return (
        LongPattern("cycle", slots_of(cycle_with_lead_in()), LEAD_IN),
        *(LongPattern("row", row_of_dots(step)) for step in STEPS),
        *(LongPattern("text", slots) for slots in wires if slots),
    )
