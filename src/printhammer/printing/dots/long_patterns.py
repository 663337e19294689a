"""Long test patterns for drives: the de Bruijn cycle, rows of dots, and a line of text.

The cycle holds every word of eight slots, but at most eight dots in a row. An error may grow from dot to dot
and show only in a longer row, so rows have 200 slots, with a dot in every slot, every second or every third.
The text holds all letters and digits in the built-in font, one pattern per wire of the head.
"""

from __future__ import annotations

from functools import cache
from typing import Final, Literal, NamedTuple, get_args

from printhammer.printing.dots.lettering import lettered
from printhammer.printing.dots.strategy import LEAD_IN, cycle_with_lead_in, slots_of

ROW: Final = 200  # Number of slots of a row of dots

STEPS: Final = (1, 2, 3)  # Slots from one dot to the next in the rows

TEXT: Final = "Pack my box with five dozen liquor jugs 0123456789"
"""The line of text: every letter of the alphabet and every digit."""

Kind = Literal["cycle", "row", "text"]
KINDS: Final = get_args(Kind)


class LongPattern(NamedTuple):
    """A long test pattern: its kind, the slots of its dots, and the first slot that is evaluated."""

    kind: Kind
    slots: tuple[int, ...]
    judged_from: int = 0


def row_of_dots(step: int = 1) -> tuple[int, ...]:
    """Return the slots with a dot in a row of `ROW` slots, of which every `step`-th slot has a dot."""
    return tuple(range(0, ROW, step))


@cache
def long_patterns() -> tuple[LongPattern, ...]:
    """Return the long test patterns: cycle with lead-in, rows, and the line of text, one pattern per wire.

    Patterns of the same kind are consecutive.
    """
    wires = [slots_of(wire) for wire in lettered(TEXT, columns=len(TEXT))[0]]
    return (
        LongPattern("cycle", slots_of(cycle_with_lead_in()), LEAD_IN),
        *(LongPattern("row", row_of_dots(step)) for step in STEPS),
        *(LongPattern("text", slots) for slots in wires if slots),
    )
