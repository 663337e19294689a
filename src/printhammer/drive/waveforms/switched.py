"""A coil switched between currents by a driver of finite speed.

The driver holds the coil at one current after another. After each switching the current goes to its new
value exponentially, with one time constant for all, as in a coil behind a driver that holds a voltage; it is
never beyond the largest of the values, since every piece is a mean of where it comes from and where it goes.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import Any, ClassVar, Final, Self

from pydantic import model_validator

from printhammer.drive.input import read_number
from printhammer.drive.segments import EXPONENTIAL, table
from printhammer.drive.waveforms.base import DECAY_TIMES, QUANTITY_UNITS, Waveform
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import quantity

_KEPT: Final = 256


class Switched(Waveform):
    """A drive switched between values.

    Attributes
    ----------
    at : tuple of float
        Times of the switchings since the firing, s or strings with units, ascending, the first one not
        negative.
    levels : tuple of float
        Value to which each switching leads, A, or strings with units; in N it is a force. The last one is 0.
    edge : float
        Time constant of the edges, s.
    initial : float
        Value at the firing, A or N, which is 0 unless a run begins within a pulse.
    """

    shape: ClassVar[str] = "switched"
    at: tuple[float, ...]
    levels: tuple[float, ...]
    edge: float = quantity("s", "tau", "time constant of the edges", gt=0.0)
    initial: float = quantity("A", "I0", "value at the firing", also=("N", "V"), default=0.0)

    @model_validator(mode="before")
    @classmethod
    def _read_columns(cls, data: Any) -> Any:
        """Turn strings with units into SI numbers; the unit of the levels decides what is driven."""
        if not isinstance(data, dict):
            return data
        result = dict(data)
        if _has_text(data.get("at")):
            result["at"] = tuple(_number(entry, "s", "at") for entry in data["at"])
        if _has_text(data.get("levels")):
            result["levels"], unit = _levels(data["levels"])
            result.setdefault("quantity", QUANTITY_UNITS[unit])
        return result

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        """Check that the switchings ascend and end at zero."""
        if not self.at or len(self.at) != len(self.levels):
            raise InputError(
                f"levels = {list(self.levels)} is expected to have one value for each of the"
                f" {len(self.at)} times, at least one",
                key="levels",
                value=list(self.levels),
            )
        if self.at[0] < 0.0 or any(not before < after for before, after in itertools.pairwise(self.at)):
            raise InputError(
                f"at = {list(self.at)} is expected to ascend from 0 s on", key="at", value=list(self.at)
            )
        if self.levels[-1] != 0.0:
            raise InputError(
                f"levels = {list(self.levels)} is expected to end with 0",
                key="levels",
                value=list(self.levels),
            )
        return self

    def segments(self) -> FloatArray:
        """Return the segment table: an exponential for each switching."""
        return switched_table(self.at, self.levels, self.edge, self.initial)

    def scaled(self, factor: float) -> Self:
        """Return the same waveform with every value multiplied by a factor."""
        levels = tuple(factor * level for level in self.levels)
        return self.model_copy(update={"levels": levels, "initial": factor * self.initial})


@lru_cache(maxsize=_KEPT)
def switched_table(
    at: tuple[float, ...], levels: tuple[float, ...], edge: float, initial: float = 0.0
) -> FloatArray:
    """Return the segment table of a switched drive, see `Switched`."""
    rows = []
    now, level, current = 0.0, 0.0, initial
    if at[0] > 0.0 and initial:
        rows.append((0.0, EXPONENTIAL, 0.0, initial, 1.0 / edge, 0.0))
    for start, following in zip(at, levels, strict=True):
        current = level + (current - level) * math.exp(-(start - now) / edge)
        rows.append((start, EXPONENTIAL, following, current - following, 1.0 / edge, 0.0))
        now, level = start, following
    segments = table(rows, now + DECAY_TIMES * edge)
    segments.setflags(write=False)
    return segments


def _has_text(entries: object) -> bool:
    return isinstance(entries, list | tuple) and any(isinstance(entry, str) for entry in entries)


def _number(entry: object, unit: str, name: str) -> Any:
    """Read one entry of a column; one that is no text is left to pydantic."""
    return read_number(entry, unit, name) if isinstance(entry, str) else entry


def _levels(entries: Any) -> tuple[tuple[Any, ...], str]:
    """Read levels, all of them A or all of them N, and return the unit as well."""
    for unit in QUANTITY_UNITS:
        try:
            return tuple(_number(entry, unit, "levels") for entry in entries), unit
        except InputError as error:
            refused = error
    raise refused
