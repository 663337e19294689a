"""Search space of the hammer of 1983: ten variables that determine its motion.

Multiplying mass and all forces by one factor does not change the motion, nor does multiplying the current and
1 / Bm by one factor. The first factor is set by the print force of the paper, "about five pounds per dot",
which determines the stiffness of the pack; the second by the currents of Fig. 2. The mass follows from the
stroke.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from printhammer.claims.judging import claims
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
"""Smallest ratio of the current that cancels the magnet's field to the largest current of Fig. 2."""

LOADING_EXPONENT: Final = 2.7
"""Exponent of the loading branch of the pack, equation (5)."""

Shape = Literal["rectangle", "trapezoid", "half-sine"]
SHAPES: Final[tuple[Shape, ...]] = get_args(Shape)
"""Waveform shapes of the hammers that are searched for."""

_FALL: Final = 3.0
"""Ratio of the fall time of a trapezoid to the time constant `decay` that represents it in the search."""

_HALF_SINE: Final = 1.5
"""Ratio of the duration of a half sine to the variable `width` that represents it in the search."""

_SOURCE: Final = "found by search for the behaviour that the paper tells"


@dataclass(frozen=True)
class Variable:
    """Variable of the search."""

    name: str
    """Name of the variable in the log."""
    low: float
    """Lower end of the range of plausible values, SI."""
    high: float
    """Upper end of the range of plausible values, SI."""
    logarithmic: bool
    """Whether the values are evenly spaced on a logarithmic scale."""
    unit: str
    """SI unit; empty for a ratio."""
    meaning: str
    """Meaning of the variable in one phrase."""

    def value(self, share: FloatArray) -> FloatArray:
        """Return the values at fractions of the range, from 0 to 1."""
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** share, dtype=np.float64)
        return np.asarray(self.low + (self.high - self.low) * share, dtype=np.float64)

    def share(self, value: float) -> float:
        """Return the position of a value within the range, as a fraction."""
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
"""Variables of the search, with generous ranges for hammers of this kind and size; arbitrary."""


def point_of(values: Mapping[str, float]) -> FloatArray:
    """Convert values of the variables to a point: fractions of the ranges."""
    return np.array([variable.share(values[variable.name]) for variable in VARIABLES])


def values_at(point: FloatArray) -> dict[str, float]:
    """Convert a point, fractions of the ranges, to values of the variables."""
    return {
        variable.name: float(variable.value(np.asarray(share)))
        for variable, share in zip(VARIABLES, point, strict=True)
    }


@cache
def geometry() -> dict[str, float]:
    """Return the printed geometry, m: backstop b, pack front xp, pack thickness d, platen, stroke top."""
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
    """Return the fraction of its amplitude that a rectangular pulse with exponential rise reaches."""
    return -math.expm1(-width / rise)


def _variable(name: str) -> Variable:
    return next(variable for variable in VARIABLES if variable.name == name)


def _waveform(values: Mapping[str, float], current: float, shape: Shape) -> dict[str, float]:
    """Return the constants of a waveform with a given largest current, A.

    For a trapezoid, `width` is the time from the firing to the end of its top; the straight rise takes the
    fraction of this time at which the variable `rise` lies in its range, and the fall takes three times
    `decay`. For a half sine, only `width` counts, which is two thirds of its duration.
    """
    width = values["width"]
    if shape == "half-sine":
        return {"waveform.amplitude": current, "waveform.width": _HALF_SINE * width}
    if shape == "trapezoid":
        rise = width * min(max(_variable("rise").share(values["rise"]), 0.01), 0.99)
        return {
            "waveform.amplitude": current,
            "waveform.rise": rise,
            "waveform.width": width - rise,
            "waveform.fall": _FALL * values["decay"],
        }
    return {
        "waveform.amplitude": current / _reached(width, values["rise"]),
        "waveform.width": width,
        "waveform.rise": values["rise"],
        "waveform.decay": values["decay"],
    }


def shape_of(constants: Mapping[str, float]) -> Shape:
    """Return the waveform shape of constants of a hammer file; by default a rectangle."""
    if "waveform.fall" in constants:
        return "trapezoid"
    return "half-sine" if "waveform.width" in constants and "waveform.decay" not in constants else "rectangle"


def constants_at(
    values: Mapping[str, float], mass: float, stiffness: float, shape: Shape = "rectangle"
) -> dict[str, float]:
    """Convert values of the variables to constants of a hammer file, SI, for any scale of the mass.

    `mass` is the mass of the armature [kg], `stiffness` of the pack [N], and `shape` the waveform shape.
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
        **_waveform(values, current, shape),
    }


def _pulse_values(constants: Mapping[str, float]) -> tuple[float, float, float, float]:
    """Return the search variables of a waveform: width, rise and decay [s], and its largest current [A]."""
    amplitude, width = constants["waveform.amplitude"], constants["waveform.width"]
    shape = shape_of(constants)
    if shape == "rectangle":
        rise, decay = constants["waveform.rise"], constants["waveform.decay"]
        return width, rise, decay, amplitude * _reached(width, rise)
    if shape == "half-sine":
        # Variables without effect on a half sine are set to the middle of their ranges.
        rise, decay = (float(_variable(name).value(np.asarray(0.5))) for name in ("rise", "decay"))
        return width / _HALF_SINE, rise, decay, amplitude
    whole = width + constants["waveform.rise"]
    share = np.asarray(constants["waveform.rise"] / whole)
    return whole, float(_variable("rise").value(share)), constants["waveform.fall"] / _FALL, amplitude


def values_of(constants: Mapping[str, float]) -> dict[str, float]:
    """Convert the constants of a hammer file, SI, to values of the variables."""
    b = geometry()["b"]
    field = constants["magnet.Am"] ** 2
    magnet_force = field / math.sqrt(b) - constants["magnet.F0"]
    net = magnet_force - constants["spring.Bs"]
    width, rise, decay, current = _pulse_values(constants)
    return {
        "pull": magnet_force / constants["mass"],
        "bias": constants["magnet.F0"] * math.sqrt(b) / field,
        "margin": net / magnet_force,
        "reach": constants["spring.As"],
        "release": constants["magnet.Bm"] * current / constants["magnet.Am"],
        "width": width,
        "rise": rise,
        "decay": decay,
        "depth": (net / constants["backstop.stiffness"]) ** (2.0 / 3.0),
        "damping": constants["backstop.damping"] / constants["backstop.stiffness"],
    }


def largest_current() -> float:
    """Return the largest current of Fig. 2, A."""
    return float(claims()["current_range"].band["largest_current_A"]["at_most"])


def printing_stiffness() -> float:
    """Return the stiffness of the pack with which the printed stroke gives the print force, N.

    Equation (5) at the turning point: force = AiEp ((top - xp) / d)^2.7.
    """
    place = geometry()
    indentation: float = (place["top"] - place["xp"]) / place["d"]
    return float(PRINT_FORCE / indentation**LOADING_EXPONENT)


_UNITS: Final = {
    "rectangle": {"amplitude": "A", "width": "s", "rise": "s", "decay": "s"},
    "trapezoid": {"amplitude": "A", "rise": "s", "width": "s", "fall": "s"},
    "half-sine": {"amplitude": "A", "width": "s"},
}


@cache
def template(shape: Shape = "rectangle") -> Hammer:
    """Return a hammer with the geometry of the paper; its other constants are placeholders."""
    wave: dict[str, Any] = {"shape": shape}
    for name, unit in _UNITS[shape].items():
        wave[name] = {"value": 1.0, "unit": unit, "status": "reconstructed", "source": _SOURCE}
    return load("hendriks-1983").replace({"waveform": wave})


def hammer_of(constants: Mapping[str, float], **names: Any) -> Hammer:
    """Build the hammer with given constants, SI, and the geometry of the paper."""
    kind = template(shape_of(constants))
    return kind.replace({**constants, **names}, status="reconstructed", source=_SOURCE)
