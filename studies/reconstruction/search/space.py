"""The space in which the 1983 hammer is sought: ten numbers that decide on its motion.

Mass and all forces scale together without a change of the motion, and so do the current and 1 / Bm. Both
scales are set by what the paper prints of such hammers, "about five pounds per dot", and by the currents of
its Fig. 2; the stiffness of the pack follows from the first. The mass follows from the stroke.
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
"""By which factor the current that would undo the magnet's field is at least beyond the range of Fig. 2."""

LOADING_EXPONENT: Final = 2.7
"""Exponent of the loading branch of the pack, equation (5)."""

Shape = Literal["rectangle", "trapezoid", "half-sine"]
SHAPES: Final[tuple[Shape, ...]] = get_args(Shape)
"""Waveforms among which hammers are sought."""

_FALL: Final = 3.0
"""Duration of the fall of a trapezoid over the time constant that stands for it in the search."""

_HALF_SINE: Final = 1.5
"""Duration of a half sine over the width that stands for it in the search."""

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


def _variable(name: str) -> Variable:
    return next(variable for variable in VARIABLES if variable.name == name)


def _waveform(values: Mapping[str, float], current: float, shape: Shape) -> dict[str, float]:
    """Return the constants of a waveform whose largest current is given, A.

    Of a trapezoid the width is the time from the firing to the end of its top, of which the straight rise
    takes the share that the variable `rise` has of its range; its fall takes three times `decay`. Of a half
    sine only the width counts, two thirds of its duration.
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
    """Return the shape of the waveform that constants of a hammer file describe; the rectangle if none."""
    if "waveform.fall" in constants:
        return "trapezoid"
    return "half-sine" if "waveform.width" in constants and "waveform.decay" not in constants else "rectangle"


def constants_at(
    values: Mapping[str, float], mass: float, stiffness: float, shape: Shape = "rectangle"
) -> dict[str, float]:
    """Return the constants of a hammer file, SI, for values of the variables and any scale of mass.

    The mass of the armature is in kg, the stiffness of the pack in N; `shape` is that of the current.
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
    """Return width, rise and decay as the search has them, s, and the largest current of the pulse, A."""
    amplitude, width = constants["waveform.amplitude"], constants["waveform.width"]
    shape = shape_of(constants)
    if shape == "rectangle":
        rise, decay = constants["waveform.rise"], constants["waveform.decay"]
        return width, rise, decay, amplitude * _reached(width, rise)
    if shape == "half-sine":
        # What does not count for it lies in the middle of its range.
        rise, decay = (float(_variable(name).value(np.asarray(0.5))) for name in ("rise", "decay"))
        return width / _HALF_SINE, rise, decay, amplitude
    whole = width + constants["waveform.rise"]
    share = np.asarray(constants["waveform.rise"] / whole)
    return whole, float(_variable("rise").value(share)), constants["waveform.fall"] / _FALL, amplitude


def values_of(constants: Mapping[str, float]) -> dict[str, float]:
    """Return the values of the variables for the constants of a hammer file, SI."""
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
    """Return the stiffness of a pack that meets the print force at the printed stroke, N.

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
    """Return a hammer with the geometry of the paper, its other constants to be replaced."""
    wave: dict[str, Any] = {"shape": shape}
    for name, unit in _UNITS[shape].items():
        wave[name] = {"value": 1.0, "unit": unit, "status": "reconstructed", "source": _SOURCE}
    return load("hendriks-1983").replace({"waveform": wave})


def hammer_of(constants: Mapping[str, float], **names: Any) -> Hammer:
    """Return the hammer with the constants found, SI, and the geometry of the paper."""
    kind = template(shape_of(constants))
    return kind.replace({**constants, **names}, status="reconstructed", source=_SOURCE)
