"""The space in which the 1983 hammer is sought: ten numbers that decide on its motion.

Mass and all forces scale together without a change of the motion, and so do the current and 1 / Bm. Both
scales are set by what the paper prints of such hammers, "about five pounds per dot", and by the currents of
its Fig. 2; the stiffness of the pack follows from the first. The mass follows from the stroke.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims.definition import claims
from printhammer.hammer.hammer import Hammer, load
from printhammer.units import to_si

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.support.arrays import FloatArray

PRINT_FORCE: Final = to_si(5.0, "lbf", "N")
"""Force of the single-pulse dot that sets the scale of mass and forces, N (introduction of the paper)."""

CURRENT: Final = 1.0
"""Largest current of a pulse, which sets the scale of Bm, A: the middle of the range of Fig. 2."""

BEYOND: Final = 1.05
"""By which factor the current that would undo the magnet's field is at least beyond the range of Fig. 2."""

LOADING_EXPONENT: Final = 2.7
"""Exponent of the loading branch of the pack, equation (5)."""

_SOURCE: Final = "found by search for the behaviour that the paper tells"


@dataclass(frozen=True)
class Variable:
    """One number of the search."""

    name: str
    """What it is called in the log."""
    low: float
    high: float
    """Ends of the range of plausible values, SI."""
    logarithmic: bool
    """Whether values are spread evenly over the logarithm."""
    unit: str
    """SI unit, empty for a ratio."""
    meaning: str
    """What it is."""

    def value(self, share: FloatArray) -> FloatArray:
        """Return the values at shares of the range, from 0 to 1."""
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** share, dtype=np.float64)
        return np.asarray(self.low + (self.high - self.low) * share, dtype=np.float64)

    def share(self, value: float) -> float:
        """Return the share of the range at which a value lies."""
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


VARIABLES: Final = (
    Variable("pull", 7e3, 3e5, True, "m/s^2", "force of the magnet at the backstop over the mass"),
    Variable("bias", 0.0, 0.4, False, "", "F0 over Am^2 / sqrt(b)"),
    Variable("margin", 0.05, 0.8, False, "", "net force over magnet force at the backstop, no current"),
    Variable("reach", 150e-6, 2000e-6, True, "m", "As: way from the backstop to where the spring is slack"),
    Variable("release", 0.03, 0.94, True, "", "share of the field that the largest current takes away"),
    Variable("width", 120e-6, 500e-6, True, "s", "width of the current pulse"),
    Variable("rise", 3e-6, 1e-3, True, "s", "time constant of its rise"),
    Variable("decay", 3e-6, 80e-6, True, "s", "time constant of its decay"),
    Variable("depth", 0.05e-6, 10e-6, True, "m", "compression of the backstop at rest"),
    Variable("damping", 0.05, 8.0, True, "s/m", "l / k of the backstop"),
)
"""What is varied; ranges are those of hammers of this kind and size, generously."""


def point_of(values: Mapping[str, float]) -> FloatArray:
    """Return the point, in shares of the ranges, at which the variables have given values."""
    return np.array([variable.share(values[variable.name]) for variable in VARIABLES])


def values_at(point: FloatArray) -> dict[str, float]:
    """Return the values of the variables at a point given in shares of the ranges."""
    return {
        variable.name: float(variable.value(np.asarray(share)))
        for variable, share in zip(VARIABLES, point, strict=True)
    }


@cache
def geometry() -> dict[str, float]:
    """Return what the paper prints of the geometry: b, xp, d, platen and the stroke's top, m."""
    band = claims()["geometry"].band
    low, high = claims()["single_pulse_stroke"].band["max_displacement_m"]
    return {
        "b": band["backstop_m"],
        "xp": band["pack_front_m"],
        "d": band["pack_thickness_m"],
        "platen": band["platen_m"],
        "top": 0.5 * (low + high),
    }


def _reached(width: float, rise: float) -> float:
    """Return the part of its amplitude that a pulse reaches."""
    return -math.expm1(-width / rise)


def constants_at(values: Mapping[str, float], mass: float, stiffness: float) -> dict[str, float]:
    """Return the constants of a hammer file, SI, for values of the variables and any scale of mass.

    Parameters
    ----------
    values : mapping
        Values of the variables.
    mass : float
        Of the armature, kg.
    stiffness : float
        Of the pack, N.
    """
    b = geometry()["b"]
    current = max(CURRENT, values["release"] * BEYOND * largest_current())
    magnet_force = values["pull"] * mass
    field = magnet_force * math.sqrt(b) / (1.0 - values["bias"])
    strength = math.sqrt(field)
    stiff = values["margin"] * magnet_force / values["depth"] ** 1.5
    return {
        "mass": mass,
        "magnet.F0": values["bias"] * field / math.sqrt(b),
        "magnet.Am": strength,
        "magnet.Bm": values["release"] * strength / current,
        "spring.Bs": (1.0 - values["margin"]) * magnet_force,
        "spring.As": values["reach"],
        "pack.stiffness": stiffness,
        "backstop.stiffness": stiff,
        "backstop.damping": values["damping"] * stiff,
        "waveform.amplitude": current / _reached(values["width"], values["rise"]),
        "waveform.width": values["width"],
        "waveform.rise": values["rise"],
        "waveform.decay": values["decay"],
    }


def values_of(constants: Mapping[str, float]) -> dict[str, float]:
    """Return the values of the variables for the constants of a hammer file, SI."""
    b = geometry()["b"]
    field = constants["magnet.Am"] ** 2
    magnet_force = field / math.sqrt(b) - constants["magnet.F0"]
    net = magnet_force - constants["spring.Bs"]
    reached = _reached(constants["waveform.width"], constants["waveform.rise"])
    current = constants["waveform.amplitude"] * reached
    return {
        "pull": magnet_force / constants["mass"],
        "bias": constants["magnet.F0"] * math.sqrt(b) / field,
        "margin": net / magnet_force,
        "reach": constants["spring.As"],
        "release": constants["magnet.Bm"] * current / constants["magnet.Am"],
        "width": constants["waveform.width"],
        "rise": constants["waveform.rise"],
        "decay": constants["waveform.decay"],
        "depth": (net / constants["backstop.stiffness"]) ** (2.0 / 3.0),
        "damping": constants["backstop.damping"] / constants["backstop.stiffness"],
    }


def largest_current() -> float:
    """Return the largest current of Fig. 2, A."""
    return float(claims()["current_range"].band["largest_current_A"]["at_most"])


def printing_stiffness() -> float:
    """Return the stiffness of a pack that meets the print force at the printed stroke, N.

    Equation (5) at the turning point: force = AiEp ((top - xp) / d)^2.7.
    """
    place = geometry()
    indentation: float = (place["top"] - place["xp"]) / place["d"]
    return float(PRINT_FORCE / indentation**LOADING_EXPONENT)


@cache
def template() -> Hammer:
    """Return a hammer with the geometry of the paper, its other constants to be replaced."""
    base = load("hendriks-1983")
    units = {"amplitude": "A", "width": "s", "rise": "s", "decay": "s"}
    wave: dict[str, Any] = {"shape": "rectangle"}
    for name, unit in units.items():
        wave[name] = {"value": 1.0, "unit": unit, "status": "reconstructed", "source": _SOURCE}
    return base.replace({"waveform": wave})


def hammer_of(constants: Mapping[str, float], **names: Any) -> Hammer:
    """Return the hammer with the constants found, SI, and the geometry of the paper."""
    return template().replace({**constants, **names}, status="reconstructed", source=_SOURCE)
