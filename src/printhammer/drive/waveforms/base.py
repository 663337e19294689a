"""Base class of the waveforms of a current, a force or a voltage."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, NamedTuple, Self

import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from printhammer.drive import tables
from printhammer.drive.segments import evaluate, filled, largest
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import invalid, quantities

QuantityName = Literal["current", "force", "voltage"]
QUANTITY_UNITS: Final[dict[str, QuantityName]] = {"A": "current", "N": "force", "V": "voltage"}
"""Driven quantity, by the SI unit of the amplitude."""
UNITS: Final = {driven: unit for unit, driven in QUANTITY_UNITS.items()}
"""SI unit of each driven quantity."""


class Supply(NamedTuple):
    """Voltage supply of a coil driver; see `printhammer.kernel.model.layout`."""

    diode: float = 0.0
    """Forward voltage of the diode in which a chopped current circulates, V."""
    series: float = 0.0
    """Resistance in series with an ideal source, ohm."""
    capacitance: float = 0.0
    """Capacitance of the reservoir, F."""
    charging: float = 0.0
    """Resistance through which the reservoir is charged, ohm."""
    charged: float = 0.0
    """Voltage to which the reservoir is charged, V."""
    coils: float = 1.0
    """Number of equal coils on the supply."""


class Waveform(BaseModel):
    """Waveform of one pulse, as a function of tau, the time since its firing.

    Numbers are SI; strings with a unit ("350 us") are accepted as well. An amplitude in N makes the waveform
    a force; an amplitude in V makes it a voltage that drives the circuit of a coil.

    Raises
    ------
    InputError
        A constant is missing, unknown, not finite, of the wrong dimension or out of bounds.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    shape: ClassVar[str]
    code: ClassVar[int] = tables.SAMPLED
    """Code of the shape in `printhammer.drive.tables`, for shapes with a table of a few segments."""
    quantity: QuantityName = "current"

    if not TYPE_CHECKING:

        def __init__(self, /, **data: Any) -> None:
            try:
                super().__init__(**data)
            except ValidationError as error:
                raise invalid(error, type(self), f"{self.shape} waveform: ") from None

        # A custom __init__ would lose the context of model_validate (the folder of the file).
        __init__.__pydantic_base_init__ = True

    @model_validator(mode="before")
    @classmethod
    def _read_units(cls, data: Any) -> Any:
        """Convert strings with units to SI; the unit of the amplitude determines the driven quantity."""
        if not isinstance(data, dict) or not any(isinstance(data.get(name), str) for name in quantities(cls)):
            return data
        from printhammer.units import parse

        result = dict(data)
        for name, note in quantities(cls).items():
            text = data.get(name)
            if not isinstance(text, str):
                continue
            for unit in note.also:
                try:
                    result[name] = parse(text, unit)
                except InputError:
                    continue
                result.setdefault("quantity", QUANTITY_UNITS[unit])
                break
            else:
                try:
                    result[name] = parse(text, note.si)
                except InputError as error:
                    error.key = name
                    raise
        return result

    def numbers(self) -> tuple[float, ...]:
        """Return the physical constants in order of declaration, SI; NaN for a missing constant."""
        values = (getattr(self, name) for name in quantities(type(self)))
        return tuple(math.nan if value is None else float(value) for value in values)

    def segments(self) -> FloatArray:
        """Return the segment table (see `printhammer.drive.segments`), shape (segments + 1, 6), SI."""
        return filled(self.code, self.numbers())

    @abstractmethod
    def scaled(self, factor: float) -> Self:
        """Return a copy of the waveform with its values scaled by `factor`."""

    def value(self, tau: npt.ArrayLike) -> FloatArray:
        """Return values [A or N] at times tau [s] after firing; right-continuous, 0 outside the support."""
        return evaluate(self.segments(), tau)

    @property
    def peak(self) -> float:
        """Largest absolute value of the waveform, A or N."""
        return largest(self.segments())

    @property
    def support(self) -> float:
        """Time from the firing to the end of the waveform, s; possibly infinite."""
        return float(self.segments()[-1, 0])

    @property
    def replaces(self) -> bool:
        """Whether the latest firing always replaces earlier firings."""
        return False

    @property
    def unit(self) -> str:
        """SI unit of the values, "A", "N" or "V"."""
        return UNITS[self.quantity]

    def supply(self) -> Supply:
        """Return the supply of a voltage waveform: by default an ideal source."""
        return Supply()

    def content(self) -> dict[str, FloatArray]:
        """Return the arrays that identify the waveform in addition to its fields, e.g. samples."""
        return {}
