"""Winding of the coil: resistance, constant inductance, and a shorted turn for eddy currents.

    d lambda / dt = u - R i,    lambda = lambda_m(x, i) + L i,    R = R20 (1 + 0.00393 (T - 20 degC))

The flux linkage lambda_m belongs to the magnet and follows from the same coenergy as the magnet's force; the
voltage u is positive where it drives a positive current, and a moving armature induces -v d lambda / dx. With
a shorted turn, of resistance Re and leakage Ls referred to the coil,

    lambda = lambda_1 + Ls i,    d lambda_1 / dt = -Re ie,    lambda_1 = lambda_m(x, i + ie) + L (i + ie).

Source: H. H. Woodson and J. R. Melcher, *Electromechanical Dynamics* (1968), ch. 3; the temperature
coefficient of copper, IEC 60028. Validity: no skin effect in the wire. Weakness: one shorted turn
represents eddy currents that spread in the iron; the iron has no hysteresis. The circuit is solved only if
the drive is a voltage; a current drive is imposed directly.

Packed constants: c = [resistance, inductance, turn_resistance, leakage, back_emf].
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final, Self

from pydantic import Field, model_validator

from printhammer.parts.base import CoilPart, register
from printhammer.support.constants import quantity

COPPER: Final = 3.93e-3
"""Temperature coefficient of the resistance of copper at 20 degC, 1/K: standard IEC 60028 (1925)."""

REFERENCE: Final = 20.0
"""Temperature at which the resistance of the winding is stated, degC, as in IEC 60028."""


def warm_resistance(resistance: float, temperature: float) -> float:
    """Return the resistance [ohm] of a copper winding at a temperature [degC].

    `resistance` is the resistance at 20 degC, ohm.
    """
    return resistance * (1.0 + COPPER * (temperature - REFERENCE))


def coil_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants to `c` from the part's values `q`; return their count."""
    c[0] = 0.0 if math.isnan(q[0]) else warm_resistance(q[0], q[2])
    c[1] = q[1]
    c[2] = 0.0 if math.isnan(q[3]) else q[3]
    c[3] = 0.0 if math.isnan(q[4]) else q[4]
    c[4] = q[5]
    return 5


@register
class Winding(CoilPart):
    """Winding of the coil, with resistance, inductance, shorted turn and temperature."""

    law: ClassVar[str] = "winding"

    resistance: float | None = quantity("ohm", "R", "resistance of the coil at 20 degC", ge=0, default=None)
    inductance: float = quantity("H", "L", "constant part of the inductance", ge=0, default=0.0)
    temperature: float = quantity(
        "degC", "T", "temperature of the winding", gt=-200, lt=400, default=REFERENCE
    )
    turn_resistance: float | None = quantity(
        "ohm", "Re", "resistance of a shorted turn, referred to the coil", gt=0, default=None
    )
    leakage: float | None = quantity(
        "H", "Ls", "leakage inductance between coil and shorted turn", gt=0, default=None
    )
    back_emf: bool = Field(default=True, description="whether the magnet's flux is linked with the coil")

    @model_validator(mode="after")
    def _turn_is_whole(self) -> Self:
        if (self.turn_resistance is None) != (self.leakage is None):
            there, missing = "turn_resistance", "leakage"
            if self.turn_resistance is None:
                there, missing = missing, there
            raise ValueError(f"{there} is given without {missing}: expected both or none")
        return self

    @property
    def warm_resistance(self) -> float:
        """Resistance at the winding temperature, ohm; 0 if no resistance is stated."""
        return warm_resistance(self.resistance or 0.0, self.temperature)
