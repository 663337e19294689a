"""What a hammer prints while it learns its table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.results import Result, column, coordinate, part, scalar

if TYPE_CHECKING:
    from printhammer.control.learning.sensor import ImpactSensor
    from printhammer.control.table.compensation import CompensationTable
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.limits import Limits
    from printhammer.printing.rates.variability import Variability
    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

_DOTS = "stage dot"


class Learning(Result, rows=_DOTS):
    """A unit that calibrates its table, and what it prints at each stage, first in an open loop."""

    hammer: Hammer = part("the nominal hammer, all that the learner knows")
    unit: Hammer = part("the hammer that is driven", repr=False)
    table: CompensationTable = part("what is learned, for this unit", repr=False)
    rate: float = scalar("Hz", "slots per second", name="rate_Hz")
    driver: str = scalar("", "what switches the coil")
    sensor: ImpactSensor = part("what the learner is shown")
    variability: Variability = part("what is known of the production")
    limits: Limits = part("how far a dot may be off")
    dots: IntArray = coordinate("1", "dots of test lines printed before", "stage", name="dots_learned")
    learned: BoolArray = column(
        "1", "whether the table is printed with, and not an open loop", "stage", dtype=np.int8
    )
    slot: IntArray = coordinate("1", "number of the slot", "dot", name="slot")
    force_deviation: FloatArray = column(
        "1", "peak force less that of the single pulse, in parts of it", _DOTS
    )
    arrival_deviation: FloatArray = column("s", "touch less slot time and single-pulse flight time", _DOTS)
    good: BoolArray = column("1", "whether the dot is within limits", _DOTS, dtype=np.int8)
    constants: tuple[str, ...] = coordinate("", "a constant that varies", "constant", name="constant")
    believed: FloatArray = column("SI", "constant of the unit, as its readings tell it", "constant")
    uncertainty: FloatArray = column("SI", "its standard deviation", "constant")
    contraction: FloatArray = part("largest eigenvalue of the law at each update")
    seed: int = scalar("1", "seed of the simulated hammers")

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return f"{self.hammer.name} learns its table at {self.rate:g} Hz"

    @property
    def share(self) -> FloatArray:
        """Share of the dots within limits at each stage."""
        return np.asarray(self.good.mean(axis=1))

    @property
    def passed(self) -> bool:
        """Whether all dots are within limits in the end."""
        return bool(self.good[-1].all())

    def notes(self) -> dict[str, Any]:
        """Return limits, sensor noise and what is known of the production."""
        return {
            "limits": self.limits.text,
            "variability": self.variability.text,
            "sensor_noise_s": self.sensor.noise,
            "serial": self.table.serial,
        }
