"""Entries of ``[[force]]`` and ``[[contact]]`` of a hammer file.

Each class is one law, with its constants in SI. `Term.row` converts an entry to a row of the sum of forces,
see `printhammer.parts.spring.forces`; dry friction becomes part of the damping instead, see
`printhammer.parts.friction`, and a sampled force a curve, see `printhammer.parts.spring.sampled`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationInfo, model_validator

from printhammer.errors import InputError
from printhammer.parts.spring.forces import BACK, FRONT, MOST_SAMPLES, Row
from printhammer.support.constants import folder_of, quantity

GRAVITY: Final = 9.80665
"""Standard acceleration of free fall, m/s^2: 3rd General Conference on Weights and Measures (1901)."""


class Term(BaseModel):
    """Base class of the entries of ``[[force]]`` and ``[[contact]]``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    law: ClassVar[str]

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the entry; `mass` is the mass of the armature, kg."""
        raise NotImplementedError


class ConstantForce(Term):
    """Constant force on the armature."""

    law: ClassVar[str] = "constant"

    force: float = quantity("N", "F", "constant force, positive toward the paper")

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        return (0.0, 0.0, self.force, 0.0, 0.0)


class Gravity(Term):
    """Weight of the armature on an inclined axis."""

    law: ClassVar[str] = "gravity"

    angle: float = quantity(
        "rad", "theta", "angle of the motion above the horizontal, 90 deg for an upward blow"
    )
    acceleration: float = quantity("m/s^2", "g", "acceleration of free fall", gt=0, default=GRAVITY)

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        return (0.0, 0.0, -mass * self.acceleration * math.sin(self.angle), 0.0, 0.0)


class FurtherSpring(Term):
    """Linear spring with a preload at a position, by default the position of the backstop."""

    law: ClassVar[str] = "spring"

    preload: float = quantity("N", "P", "spring force at `position`", default=0.0)
    stiffness: float = quantity("N/m", "K", "spring stiffness, negative for an unstable spring")
    position: float | None = quantity("m", "x0", "position of the preload", default=None)

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        position = math.nan if self.position is None else self.position
        return (0.0, position, self.preload, -self.stiffness, 0.0)


class CubicForce(Term):
    """Spring with a linear and a cubic term about a relaxed position."""

    law: ClassVar[str] = "cubic"

    stiffness: float = quantity("N/m", "K", "stiffness at the relaxed position, negative between two wells")
    cubic: float = quantity("N/m^3", "D", "coefficient of the cubic term")
    center: float = quantity("m", "x0", "position at which the spring is relaxed")

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        return (0.0, self.center, 0.0, -self.stiffness, -self.cubic)


class Friction(Term):
    """Dry friction of the armature in its guide; part of the damping, see `printhammer.parts.friction`."""

    law: ClassVar[str] = "friction"

    kinetic: float = quantity("N", "Fk", "friction force of the moving armature", gt=0)
    static: float | None = quantity("N", "Fs", "largest friction force at rest (default: Fk)", default=None)

    @model_validator(mode="after")
    def _static_is_not_less(self) -> Self:
        if self.static is not None and self.static < self.kinetic:
            raise ValueError("static is less than kinetic: expected at least the kinetic friction")
        return self

    @property
    def largest(self) -> float:
        """Static friction force, N; the kinetic friction force if `static` is None."""
        return self.kinetic if self.static is None else self.static


class SampledForce(Term):
    """Force sampled against displacement, from a CSV file.

    The file has one sample per line, in any order, and units in its heading, ``displacement [mm],force [N]``;
    the force is positive toward the paper. Between the samples the curve is a shape-preserving cubic or a
    straight line (`printhammer.parts.samples`); beyond them, the force is unknown, and a run ends.
    """

    law: ClassVar[str] = "sampled"

    file: str = Field(description="CSV file of the samples, relative to the file that names it")
    interpolation: Literal["pchip", "linear"] = Field(
        "pchip", description="curve between samples: shape-preserving cubics or straight lines"
    )
    _samples: tuple[tuple[float, float], ...] = PrivateAttr(())

    @model_validator(mode="wrap")
    @classmethod
    def _load(cls, data: Any, handler: Callable[[Any], Self], info: ValidationInfo) -> Self:
        made = handler(data)
        if isinstance(data, dict):
            made._samples = _samples_of(folder_of(info) / made.file)
        return made

    @property
    def samples(self) -> tuple[tuple[float, float], ...]:
        """Samples as pairs of displacement [m] and force [N], by ascending displacement."""
        return self._samples


def _samples_of(path: Path) -> tuple[tuple[float, float], ...]:
    """Read the samples of a force from a table: pairs of displacement [m] and force [N], ascending.

    Raises InputError if the table cannot be read, or has fewer than two samples, more than `MOST_SAMPLES`, or
    two samples at the same displacement.
    """
    # Most hammers have no table; the reader of tables takes time to import.
    from printhammer.support.tables.readings import read_table

    where = str(path)
    table = read_table(path, {"displacement": "m", "force": "N"}, what="the sampled force")
    x, force = table.values["displacement"], table.values["force"]
    if not 2 <= len(x) <= MOST_SAMPLES:
        expected = f"2 to {MOST_SAMPLES} samples"
        raise InputError.of("samples", len(x), expected, file=where)
    order = np.argsort(x, kind="stable")
    again = np.flatnonzero(np.diff(x[order]) <= 0.0)
    if len(again):
        first, second = order[again[0]], order[again[0] + 1]
        raise InputError(
            f"{where}: line {table.lines[second]}: displacement {x[second]:.9g} m, as in line"
            f" {table.lines[first]}",
            file=where,
            key="displacement",
            value=float(x[second]),
            expected="one sample for each displacement",
        )
    return tuple(zip(x[order].tolist(), force[order].tolist(), strict=True))


class LinearContact(Term):
    """Linear spring that acts on one side of a position, with or without damping."""

    law: ClassVar[str] = "linear"
    power: ClassVar[float] = 1.0
    """Exponent of the indentation in the force law."""

    side: Literal["front", "back"]
    """Side of the armature that touches: the front if x > `position`, the back if x < `position`."""
    position: float = quantity("m", "x0", "position at which the contact closes")
    stiffness: float = quantity("N/m", "K", "stiffness of the contact", gt=0)
    damping: float | None = quantity(
        "s/m", "chi", "damping: share of the elastic force per unit speed of indentation", gt=0, default=None
    )

    @property
    def sign(self) -> float:
        """Direction of motion in which the indentation grows: 1 toward the paper, -1 away from the paper."""
        return FRONT if self.side == "front" else BACK

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the contact."""
        return (self.sign, self.position, self.stiffness, self.power, self.damping or 0.0)

    def force(self, depth: Any, rate: Any = 0.0) -> Any:
        """Return the contact force [N] at indentations `depth` [m] that grow at `rate` [m/s].

        Both are numbers or arrays.
        """
        return self.stiffness * depth**self.power * np.maximum(1.0 + (self.damping or 0.0) * rate, 0.0)


class HertzContact(LinearContact):
    """Elastic contact of round bodies: the force grows with the 3/2 power of the indentation."""

    law: ClassVar[str] = "hertz"
    power: ClassVar[float] = 1.5

    stiffness: float = quantity("N/m^1.5", "K", "Hertz stiffness of the contact", gt=0)


_FORCES: Final = (ConstantForce, CubicForce, Friction, Gravity, SampledForce, FurtherSpring)

TERMS: Final[dict[str, dict[str, type[Term]]]] = {
    "force": {term.law: term for term in _FORCES},
    "contact": {term.law: term for term in (HertzContact, LinearContact)},
}
"""Classes of forces and contacts, by the list of the hammer file, "force" or "contact", and by law."""
