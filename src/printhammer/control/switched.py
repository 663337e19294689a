"""A coil switched between currents by a driver of finite speed.

The driver holds the coil at one current after another. After each switching the current goes to its new
value exponentially, with one time constant for all, as in a coil behind a driver that holds a voltage; it is
never beyond the largest of the values, since every piece is a mean of where it comes from and where it goes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Self

from printhammer.segments import EXPONENTIAL, FloatArray, table
from printhammer.waveform_base import Waveform
from printhammer.waveforms import DECAY_TIMES

if TYPE_CHECKING:
    from collections.abc import Sequence


class Switched(Waveform):
    """A current switched between values.

    Attributes
    ----------
    at : tuple of float
        Times of the switchings since the firing, s, ascending, the first one not negative.
    levels : tuple of float
        Current to which each switching leads, A; the last one is 0.
    edge : float
        Time constant of the current, s.
    initial : float
        Current at the firing, A, which is 0 unless a run begins within a pulse.
    """

    shape: ClassVar[str] = "switched"
    at: tuple[float, ...]
    levels: tuple[float, ...]
    edge: float
    initial: float = 0.0

    def segments(self) -> FloatArray:
        """Return the segment table: an exponential for each switching."""
        return switched_table(self.at, self.levels, self.edge, self.initial)

    def scaled(self, factor: float) -> Self:
        """Return the same waveform with every value multiplied by a factor."""
        levels = tuple(factor * level for level in self.levels)
        return self.model_copy(update={"levels": levels, "initial": factor * self.initial})


def switched_table(
    at: Sequence[float], levels: Sequence[float], edge: float, initial: float = 0.0
) -> FloatArray:
    """Return the segment table of a switched current, see `Switched`."""
    rows = []
    now, level, current = 0.0, 0.0, initial
    if at[0] > 0.0 and initial:
        rows.append((0.0, EXPONENTIAL, 0.0, initial, 1.0 / edge, 0.0))
    for start, following in zip(at, levels, strict=True):
        current = level + (current - level) * math.exp(-(start - now) / edge)
        rows.append((start, EXPONENTIAL, following, current - following, 1.0 / edge, 0.0))
        now, level = start, following
    return table(rows, now + DECAY_TIMES * edge)
