"""A coil switched between currents by a driver of finite speed.

The driver holds the coil at one current after another. After each switching the current goes to its new
value exponentially, with one time constant for all, as in a coil behind a driver that holds a voltage; it is
never beyond the largest of the values, since every piece is a mean of where it comes from and where it goes.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar, Final, Self

from printhammer.drive_sequence import PulseSequence
from printhammer.segments import EXPONENTIAL, FloatArray, table
from printhammer.waveform_base import Waveform
from printhammer.waveforms import DECAY_TIMES

if TYPE_CHECKING:
    from collections.abc import Sequence

_KEPT: Final = 256


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


class BoundedSequence(PulseSequence):
    """Pulses of a driver; its bound is taken for the largest of them, so that this need not be sought.

    Parameters
    ----------
    waveforms : sequence of Switched
        What each firing does.
    at : sequence of float
        Firing times, s.
    bound : float
        Largest current of the driver, A.
    """

    def __init__(self, waveforms: Sequence[Switched], at: Sequence[float], bound: float) -> None:
        super().__init__(waveforms, at=at)
        self._bound = bound

    @property
    def largest_pulse(self) -> float:
        """The bound, A."""
        return self._bound


@lru_cache(maxsize=_KEPT)
def switched_table(
    at: tuple[float, ...], levels: tuple[float, ...], edge: float, initial: float = 0.0
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
    found = table(rows, now + DECAY_TIMES * edge)
    found.setflags(write=False)
    return found
