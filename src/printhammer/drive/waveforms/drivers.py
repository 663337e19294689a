"""Drivers of a coil: a switched voltage supply, and the path of the decaying current.

The latest firing always replaces earlier firings: a driver is a single output stage. Voltages are supply
voltages; a diode, the resistance of the supply and the thresholds of a chopper act in the circuit of the
coil; see `printhammer.kernel.model.circuit`. After the supply is switched off the current decays against a
voltage to zero, and stays zero until the coil drives it again.

`Switched` is a current switched between levels by a driver of finite speed.

After each switching the current approaches its new level exponentially with one time constant, as in a coil
behind a driver that holds a voltage. The current never exceeds the largest level, since every value is a
weighted mean of the old and the new level.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import Any, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from printhammer.drive import tables
from printhammer.drive.input import read_number
from printhammer.drive.segments import EXPONENTIAL, table
from printhammer.drive.tables import DECAY_TIMES, DIODE
from printhammer.drive.waveforms.base import QUANTITY_UNITS, QuantityName, Supply, Waveform
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import quantity
from printhammer.support.constants import quantity as measured

DECAYS: Final = ("diode", "zener", "rail")
"""Paths of the decaying coil current after the supply is switched off."""


class _Driver(Waveform):
    """Base class of drivers, which switch a supply on for the pulse width and then let the current decay."""

    quantity: QuantityName = "voltage"
    voltage: float = measured("V", "V", "voltage of the supply", gt=0.0)
    width: float = measured("s", "tw", "time for which the supply is switched on", gt=0.0)
    decay: Literal["diode", "zener", "rail"] = Field(
        default="diode", description="path of the current after the supply is switched off"
    )
    decay_voltage: float | None = measured(
        "V", "Vd", "voltage against which the current decays", ge=0.0, default=None
    )
    decay_resistance: float = measured(
        "ohm", "Rd", "resistor through which the current decays", ge=0.0, default=0.0
    )
    source_resistance: float = measured("ohm", "Rs", "resistance of the supply", ge=0.0, default=0.0)
    coils: float = measured("1", "n", "equal coils on the supply, fired together", ge=1.0, default=1.0)
    diode_voltage: float = measured(
        "V", "Vf", "voltage of the diode in which a chopped current circulates", ge=0.0, default=DIODE
    )

    @model_validator(mode="after")
    def _decay_is_known(self) -> Self:
        if self.decay == "zener" and self.decay_voltage is None:
            raise ValueError('decay = "zener" is given without decay_voltage: expected the zener voltage')
        return self

    @property
    def replaces(self) -> bool:
        """Whether the latest firing replaces earlier firings: always, as a driver has one output stage."""
        return True

    @property
    def series(self) -> float:
        """Resistance of the supply as seen by the current of one coil, ohm."""
        return self.source_resistance * self.coils

    @property
    def support(self) -> float:
        """Time from the firing until the supply is off, s; the current may last longer."""
        return float(self.segments()[-2, 0])

    def numbers(self) -> tuple[float, ...]:
        """Return the physical constants, in order of declaration, and the index of the decay path."""
        return (*super().numbers(), float(DECAYS.index(self.decay)))

    def supply(self) -> Supply:
        """Return the voltage supply of the driver, from its fields."""
        numbers = [0.0] * len(Supply._fields)
        tables.fill_supply(self.numbers(), self.code == tables.CAPACITOR, numbers, 0)
        return Supply(*numbers)

    def scaled(self, factor: float) -> Self:
        """Return a copy with the supply voltage scaled by `factor`; chopper thresholds are unchanged."""
        return type(self)(**{**self.model_dump(), "voltage": self.voltage * factor})


class Rail(_Driver):
    """Rail driver: the supply is on for the pulse width, then off."""

    shape: ClassVar[str] = "rail"
    code: ClassVar[int] = tables.RAIL_SHAPE


class Chopper(_Driver):
    """Chopper: the supply is chopped, between two currents or with a fixed off-time, for the pulse width.

    While the chopper keeps the supply off, the current circulates through a diode.
    """

    shape: ClassVar[str] = "chopper"
    code: ClassVar[int] = tables.CHOPPER
    upper: float = measured("A", "Iu", "current at which the chopper switches off", gt=0.0)
    lower: float | None = measured("A", "Il", "current at which the chopper turns on", gt=0.0, default=None)
    off_time: float | None = measured("s", "to", "time for which the chopper is off", gt=0.0, default=None)

    @model_validator(mode="after")
    def _thresholds(self) -> Self:
        if (self.lower is None) == (self.off_time is None):
            raise ValueError("expected either lower, a second threshold, or off_time")
        if self.lower is not None and not self.lower < self.upper:
            raise ValueError(f"lower = {self.lower:g} A: expected less than upper = {self.upper:g} A")
        return self


class PeakAndHold(_Driver):
    """Peak-and-hold driver: the supply is on for the peak time, then chopped between two lower currents."""

    shape: ClassVar[str] = "peak-and-hold"
    code: ClassVar[int] = tables.PEAK_AND_HOLD
    peak_time: float = measured("s", "tp", "time of the full supply", gt=0.0)
    hold_upper: float = measured("A", "Iu", "upper current of the hold phase", gt=0.0)
    hold_lower: float = measured("A", "Il", "lower current of the hold phase", gt=0.0)

    @model_validator(mode="after")
    def _thresholds(self) -> Self:
        if not self.hold_lower < self.hold_upper:
            raise ValueError(
                f"hold_lower = {self.hold_lower:g} A: expected less than hold_upper = {self.hold_upper:g} A"
            )
        if not self.peak_time < self.width:
            raise ValueError(f"peak_time = {self.peak_time:g} s: expected less than width = {self.width:g} s")
        return self


class Capacitor(_Driver):
    """Capacitor driver: a continuously charged capacitor discharges through the coil for the pulse width."""

    shape: ClassVar[str] = "capacitor"
    code: ClassVar[int] = tables.CAPACITOR
    capacitance: float = measured("F", "C", "capacitance", gt=0.0)
    charging_resistance: float = measured(
        "ohm", "Rc", "resistance through which the capacitor is charged", gt=0.0
    )


class Bridge(_Driver):
    """H-bridge: the supply is on for the pulse width, then reversed for a given time, then off."""

    shape: ClassVar[str] = "bridge"
    code: ClassVar[int] = tables.BRIDGE
    reverse: float = measured("s", "tr", "time of the reversed supply", gt=0.0)


DRIVERS: tuple[type[Waveform], ...] = (Rail, Chopper, PeakAndHold, Capacitor, Bridge)
"""Waveform classes of the coil drivers."""

_KEPT: Final = 256  # Number of cached segment tables; arbitrary


class Switched(Waveform):
    """Waveform switched between levels, with exponential edges of one time constant.

    Attributes
    ----------
    at : tuple of float
        Switching times since the firing, s or strings with units, ascending, the first time not
        negative.
    levels : tuple of float
        Level after each switching, A, or strings with units; in N for a force. The last level is 0.
    edge : float
        Time constant of the edges, s.
    initial : float
        Value at the firing, A or N; nonzero only if a run begins within a pulse.
    """

    shape: ClassVar[str] = "switched"
    at: tuple[float, ...]
    levels: tuple[float, ...]
    edge: float = quantity("s", "tau", "time constant of the edges", gt=0.0)
    initial: float = quantity("A", "I0", "value at the firing", also=("N", "V"), default=0.0)

    @model_validator(mode="before")
    @classmethod
    def _read_columns(cls, data: Any) -> Any:
        """Convert strings with units to SI; the unit of the levels determines the driven quantity."""
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
        """Check that the switching times ascend and that the last level is zero."""
        if not self.at or len(self.at) != len(self.levels):
            raise InputError(
                f"levels = {list(self.levels)}",
                key="levels",
                value=list(self.levels),
                expected=f"one value for each of the {len(self.at)} times, at least one",
            )
        if self.at[0] < 0.0 or any(not before < after for before, after in itertools.pairwise(self.at)):
            raise InputError(
                f"at = {list(self.at)}", key="at", value=list(self.at), expected="ascending times from 0 s on"
            )
        if self.levels[-1] != 0.0:
            raise InputError(
                f"levels = {list(self.levels)}",
                key="levels",
                value=list(self.levels),
                expected="0 as the last level",
            )
        return self

    def segments(self) -> FloatArray:
        """Return the segment table: one exponential per switching."""
        return switched_table(self.at, self.levels, self.edge, self.initial)

    def scaled(self, factor: float) -> Self:
        """Return a copy with all levels scaled by `factor`."""
        levels = tuple(factor * level for level in self.levels)
        return self.model_copy(update={"levels": levels, "initial": factor * self.initial})


@lru_cache(maxsize=_KEPT)
def switched_table(
    at: tuple[float, ...], levels: tuple[float, ...], edge: float, initial: float = 0.0
) -> FloatArray:
    """Return the segment table of a switched drive; see `Switched`."""
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
    """Parse a list entry that is text; return any other entry unchanged, for pydantic to validate."""
    return read_number(entry, unit, name) if isinstance(entry, str) else entry


def _levels(entries: Any) -> tuple[tuple[Any, ...], str]:
    """Parse levels that have the same SI unit, A, N or V; return the values and the unit."""
    for unit in QUANTITY_UNITS:
        try:
            return tuple(_number(entry, unit, "levels") for entry in entries), unit
        except InputError as error:
            refused = error
    raise refused
