"""Differentiable constants of a motion, and their effect on the kernel's arrays.

A constant is named as in a hammer file, such as "pack.stiffness"; constants of the pulse, such as
"waveform.width", refer to the drive. Further constants are "period" and "rate" of a train at a constant
rate or a sinusoidal force, and the time of a single firing, such as "firing.3", counted from 0. A sampled
waveform has a single constant, "waveform.amplitude", its largest value.

Derivatives of the packed arrays are finite differences of fourth order, one-sided if a constant is at an end
of its range, so that the hammer components need no analytic derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Sine, Waveform
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import PERIOD, TIMING, quantities_of, unknown
from printhammer.kernel.model.layout import SUPPLY
from printhammer.results import Declared, part
from printhammer.run.problem import constants_of, scales_of
from printhammer.run.supply import inductance, typical_current
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import quantities

_SPACING: Final = 2e-4  # Arbitrary
"""Step of the finite differences, as a fraction of the constant's value or, if that is zero, of its scale."""
_STENCILS: Final = (
    ((-2, -1, 1, 2), (1.0, -8.0, 8.0, -1.0)),
    ((0, 1, 2, 3, 4), (-25.0, 48.0, -36.0, 16.0, -3.0)),
    ((0, -1, -2, -3, -4), (25.0, -48.0, 36.0, -16.0, 3.0)),
)
"""Central, forward, backward stencils: offsets, and weights times 12 (Abramowitz and Stegun 1964, 25.2)."""
_MOST_SINGLE: Final = 20
"""Largest number of firings of a train without a period whose times are listed as constants; arbitrary."""


class Parameter(Declared):
    """Differentiable constant, with the derivatives of the kernel's arrays with respect to the constant."""

    name: str = part('name of the constant, such as "pack.stiffness", "waveform.width", "period", "firing.1"')
    value: float = part("value in SI")
    scale: float = part(
        "scale of its changes, SI: the absolute value of the constant, or, if that is zero, a value typical"
        " of its dimension"
    )
    unit: str = part("SI unit")
    meaning: str = part("meaning of the constant in one phrase")
    hammer: FloatArray = part(
        "derivative of the packed constants with respect to ``value / scale``, shape (h,)", repr=False
    )
    firings: FloatArray = part("derivative of the firing times [s], shape (f,)", repr=False)
    pieces: FloatArray = part(
        "derivative of the waveforms' segment tables, see `Drive.kernel_arrays`, shape (m, 6)", repr=False
    )


def parameter_names(hammer: Hammer, drive: Drive) -> list[str]:
    """List the differentiable constants of a hammer and a drive: hammer, pulse and firing times.

    A train at a constant rate has the constant "period"; any other train of up to 20 firings has a constant
    for the time of each firing except the first. A drive with different waveforms has no constants of the
    pulse.
    """
    names = [key for key in hammer.constants if not key.startswith("waveform.")]
    if drive.uniform:
        names += [f"waveform.{name}" for name in _of_waveform(drive.waveform)]
    count = len(drive.times)
    if drive.period is not None and count > 1:
        names.append(PERIOD)
    elif count <= _MOST_SINGLE:
        names += [f"firing.{number}" for number in range(1, count)]
    return names


def parameters(hammer: Hammer, drive: Drive, names: Sequence[str]) -> list[Parameter]:
    """Build the named constants, with the derivatives of the kernel's arrays with respect to each.

    The names are those listed by `parameter_names`, or "rate".

    Raises
    ------
    InputError
        The constant is unknown, or the motion is not differentiable at its value, such as a rise time of
        zero.
    """
    return [_parameter(hammer, drive, name) for name in names]


def rest_changes(hammer: Hammer, wanted: Sequence[Parameter]) -> FloatArray:
    """Compute the gradient of the rest displacement [m] with respect to the scaled constants, shape (n,)."""
    changes = np.zeros(len(wanted))
    for k, parameter in enumerate(wanted):
        # The supply does not affect the state of rest.
        if parameter.hammer.any() and not parameter.name.startswith("waveform."):
            changes[k] = _rest_change(hammer, parameter)
    return changes


def _rest_change(hammer: Hammer, parameter: Parameter) -> float:
    def rest(value: float) -> FloatArray:
        return np.array(rest_state(hammer.replace(parameter.name, value)))

    return float(_difference(rest, parameter.value, parameter.scale, parameter.name))


def _parameter(hammer: Hammer, drive: Drive, name: str) -> Parameter:
    section, _, last = name.rpartition(".")
    firings = np.zeros(len(drive.times))
    pieces = np.zeros(drive.kernel_arrays()[2].shape)
    packed = np.zeros(len(constants_of(hammer)))
    if section == "waveform":
        waveform = drive.waveform
        fields = _of_waveform(waveform)
        if drive.uniform and last in fields:
            value, unit, meaning = fields[last]
            scale = abs(value) or _natural(unit, hammer, drive)
            pieces = _table_change(lambda moved: _changed(waveform, last, moved), value, scale, name)
            if drive.quantity == "voltage":
                packed[SUPPLY : SUPPLY + len(waveform.supply())] = _difference(
                    lambda moved: np.array(_changed(waveform, last, moved).supply()), value, scale, name
                )
            return Parameter(name, value, scale, unit, meaning, packed, firings, pieces)
    elif name in TIMING:
        return _spacing(drive, name, packed)
    elif section == "firing":
        number = int(last) if last.isdecimal() else -1
        if 0 <= number < len(firings) and not isinstance(drive.waveform, Sine):
            value = float(drive.times[number])
            gaps = np.diff(drive.times)
            scale = abs(value) or (float(gaps.min()) if len(gaps) else _natural("s", hammer, drive))
            firings[number] = scale
            return Parameter(name, value, scale, "s", f"time of firing {number}", packed, firings, pieces)
    elif name in hammer.constants:
        constant = hammer.constants[name]
        scale = abs(constant.si) or _natural(constant.si_unit, hammer, drive)
        packed = _difference(
            lambda value: constants_of(hammer.replace(name, value)), constant.si, scale, name
        )
        return Parameter(
            name, constant.si, scale, constant.si_unit, constant.meaning, packed, firings, pieces
        )
    raise unknown(name, parameter_names(hammer, drive))


def _spacing(drive: Drive, name: str, packed: FloatArray) -> Parameter:
    """Build the constant `name`, "period" or "rate", of a drive; the first firing of a train stays fixed.

    `packed` is the derivative of the hammer's packed constants, which is zero.
    """
    period, count = drive.period, len(drive.times)
    if period is None or (count == 1 and not isinstance(drive.waveform, Sine)):
        raise InputError.of("constant", name, "a drive with a single period and several firings")
    value, sign = (period, 1.0) if name == PERIOD else (1.0 / period, -1.0)
    firings, pieces = np.zeros(count), np.zeros(drive.kernel_arrays()[2].shape)
    waveform = drive.waveform
    if isinstance(waveform, Sine):
        frequency = waveform.frequency
        table = _table_change(
            lambda moved: _changed(waveform, "frequency", moved), frequency, frequency, name
        )
        pieces = -sign * table
    else:
        firings = sign * (drive.times - drive.times[0])
    note = TIMING[name]
    return Parameter(name, value, value, note.si, note.meaning, packed, firings, pieces)


def _of_waveform(waveform: Waveform) -> dict[str, tuple[float, str, str]]:
    """Return value, unit and meaning of each constant of a waveform, by name."""
    fields = {
        name: (float(getattr(waveform, name)), note.si, note.meaning)
        for name, note in quantities_of(waveform).items()
        if getattr(waveform, name) is not None
    }
    if waveform.replaces:
        return fields
    own = {"amplitude": (waveform.peak, waveform.unit, "largest value of the pulse")}
    return fields if "amplitude" in fields else {**own, **fields}


def _changed(waveform: Waveform, name: str, value: float) -> Waveform:
    if name in quantities(type(waveform)):
        return type(waveform)(**{**waveform.model_dump(), name: value})
    return waveform.scaled(value / waveform.peak)


def _table_change(made: Callable[[float], Waveform], value: float, scale: float, name: str) -> FloatArray:
    """Compute the derivative of the segment table of a waveform with respect to the scaled constant `name`.

    `made` builds the waveform from a value of the constant. Raise InputError if a small change of the
    constant changes the number or the kinds of segments.
    """
    kinds = made(value).segments()[:, 1]

    def table(moved: float) -> FloatArray:
        segments = made(moved).segments()
        if len(segments) != len(kinds) or (segments[:, 1] != kinds).any():
            raise InputError(
                f"constant = {name!r}: the segments of the waveform change near {value!r}",
                key="constant",
                value=name,
            )
        return segments

    return _difference(table, value, scale, name)


def _difference(function: Callable[[float], FloatArray], value: float, scale: float, name: str) -> FloatArray:
    """Differentiate an array with respect to a scaled constant, ``value / scale``.

    `function` returns the array for a value of the constant; `name` is for error messages. The derivative of
    an entry that is not finite is 0.
    """
    for offsets, weights in _STENCILS:
        try:
            middle = function(value)
            samples = [function(value + offset * _SPACING * scale) for offset in offsets]
        except InputError:
            continue
        # Subtract the middle value, so that entries independent of the constant are exactly zero.
        with np.errstate(invalid="ignore"):
            change = sum(weight * (array - middle) for weight, array in zip(weights, samples, strict=True))
        change = np.asarray(change) / (12.0 * _SPACING)
        return np.where(np.isfinite(change), change, 0.0)
    raise InputError(
        f"constant = {name!r} is {value!r}, where the motion is not differentiable with respect to it",
        key="constant",
        value=name,
    )


def _natural(unit: str, hammer: Hammer, drive: Drive) -> float:
    """Return the typical magnitude of a constant with a given SI unit, such as "N s/m^2.5"."""
    way, speed = scales_of(hammer, drive, (hammer.origin, 0.0))
    time, force = way / speed, hammer.mass * speed * speed / way
    known = {
        "m": way,
        "s": time,
        "N": force,
        "kg": hammer.mass,
        "Hz": 1.0 / time,
        "Pa": force / (way * way),
        "A": drive.largest_pulse or 1.0,
    }
    if drive.quantity == "voltage":
        known["V"], known["A"] = drive.largest_pulse or 1.0, typical_current(hammer, drive)
        known["ohm"] = known["V"] / known["A"]
        known["H"] = abs(inductance(hammer, hammer.origin, 0.0))
    result, divides = 1.0, False
    for factor in unit.replace("/", " / ").split():
        if factor == "/":
            divides = True
            continue
        symbol, _, power = factor.partition("^")
        size = known.get(symbol, 1.0) ** float(power or 1.0)
        result = result / size if divides else result * size
        divides = False
    return result if math.isfinite(result) and result > 0.0 else 1.0


def as_arrays(wanted: Sequence[Parameter]) -> dict[str, Any]:
    """Stack the derivative arrays of several constants, by name: `hammer`, `firings` and `pieces`."""
    return {
        name: np.ascontiguousarray([getattr(parameter, name) for parameter in wanted], dtype=np.float64)
        for name in ("hammer", "firings", "pieces")
    }
