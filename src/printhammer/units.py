"""Conversion of quantities between SI and other units; the only module that knows units.

All internal quantities are floats in SI; units occur in hammer files, drives, tables, the command line and on
the axes of figures. Units are written in the usual way: "N/m^1.5", "N^0.5 m^0.25/A", "in", "us", "lbf", "1"
for a pure number; a slash divides by the single factor after it. ``units.txt`` lists the known units.

Conversions are correctly rounded: a float stands for its shortest decimal, factors are exact fractions (60
digits where an exponent is not whole), and the result is rounded once, so that 0.002 in is 5.08e-05 m to the
last bit. A temperature is in degC everywhere, a difference of temperatures in K.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING

from printhammer.errors import InputError

if TYPE_CHECKING:
    from pint import UnitRegistry

    _Dimension = dict[str, Fraction]

DIMENSIONS: dict[str, str] = {
    "m": "a length",
    "kg": "a mass",
    "s": "a time",
    "A": "a current",
    "N": "a force",
    "Hz": "a frequency",
    "m/s": "a speed",
    "m/s^2": "an acceleration",
    "N/m": "a stiffness",
    "N/m^3": "a cubic stiffness",
    "N s/m": "a linear damping",
    "s/m": "a damping relative to the contact force",
    "N/m^1.5": "a Hertz stiffness",
    "N s/m^2.5": "a contact damping",
    "N^0.5 m^0.25": "a root of force times the fourth root of length",
    "N^0.5 m^0.25/A": "a root of force times the fourth root of length, per current",
    "Pa": "a pressure",
    "J": "an energy",
    "W": "a power",
    "V": "a voltage",
    "ohm": "a resistance",
    "Wb": "a flux linkage",
    "H": "an inductance",
    "F": "a capacitance",
    "degC": "a temperature",
    "K": "a difference of temperatures",
    "K/W": "a thermal resistance",
    "J/K": "a heat capacity",
    "1": "a pure number",
}
"""Names of the dimensions that the program uses, by their SI unit; for messages."""

_BASES = ("[length]", "[mass]", "[time]", "[current]")
_PREFIXES = {"": 0, "p": -12, "n": -9, "u": -6, "µ": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}
_COMMON = {
    "m": (0, 1, 0, 0, 0),
    "g": (0, 0, 1, 0, 0),
    "s": (0, 0, 0, 1, 0),
    "A": (0, 0, 0, 0, 1),
    "Hz": (0, 0, 0, -1, 0),
    "N": (3, 1, 1, -2, 0),
    "Pa": (3, -1, 1, -2, 0),
    "J": (3, 2, 1, -2, 0),
    "W": (3, 2, 1, -3, 0),
    "V": (3, 2, 1, -3, -1),
    "ohm": (3, 2, 1, -3, -2),
    "Wb": (3, 2, 1, -2, -1),
    "H": (3, 2, 1, -2, -2),
    "F": (-3, -2, -1, 4, 2),
}
"""Common units by symbol: power of ten in m, g, s and A, then the exponents of the `_BASES`."""

_ZEROS = {"degF": 32, "fahrenheit": 32}
"""Zero offset of a unit: number in the unit that corresponds to 0 in SI; 0 for units not listed."""

_UNKNOWN = "the unit {!r} is not known: expected one such as 'us', 'lbf' or 'N s/m^2.5'"
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)
_FACTOR = re.compile(
    r"\s*(?P<name>[^\W\d_]+|%|1(?![\d.]))"
    r"(?:\s*(?:\^|\*\*)\s*(?P<power>[+-]?\d{1,2}(?:\.\d{1,4})?|\(\s*[+-]?\d{1,2}(?:/[1-9]\d?)?\s*\)))?"
    r"\s*(?P<operator>[*/]?)"
)
_SIGNS = str.maketrans(
    {"·": "*", "⋅": "*", "²": "^2", "³": "^3", "°": "deg", "℃": "degC", "℉": "degF", "\N{OHM SIGN}": "Ω"}
)


def to_si(value: float, unit: str, si_unit: str) -> float:
    """Convert a number to SI.

    Parameters
    ----------
    value : float
        Number in `unit`.
    unit : str
        Unit, such as "lbf" or "N/m^1.5"; "1" for a pure number.
    si_unit : str
        SI unit of the result.

    Returns
    -------
    float
        Value in `si_unit`, correctly rounded.

    Raises
    ------
    InputError
        If `value` is not a finite number, or `unit` is unknown or has another dimension than `si_unit`.
    """
    return _scaled(value, _factor(unit, si_unit), unit)


def all_to_si(values: Sequence[float], unit: str, si_unit: str) -> list[float]:
    """Convert a sequence of numbers to SI, element by element, as `to_si` does; NaN stays NaN."""
    factor = _factor(unit, si_unit)
    if factor == 1:
        return [value + 0.0 for value in values]
    power = round(math.log10(factor))
    if factor != Fraction(10) ** power:
        return [value if math.isnan(value) else _scaled(value, factor, unit) for value in values]
    # Reading the shifted decimal is correctly rounded too, and ten times faster than a fraction.
    end = f"e{power}"
    texts = ((value, repr(value)) for value in values)
    return [
        float(text + end)
        if "e" not in text and "n" not in text
        else value * float(factor)
        if math.isnan(value)
        else _scaled(value, factor, unit)
        for value, text in texts
    ]


def from_si(value: float, si_unit: str, unit: str) -> float:
    """Convert a number from an SI unit to another unit; arguments and errors as for `to_si`."""
    return _scaled(value, 1 / _factor(unit, si_unit), si_unit) + _zero(unit)


def factor_of(unit: str, si_unit: str) -> float:
    """Return the factor that converts a number in `unit`, such as "mA/V", to `si_unit`.

    Raises
    ------
    InputError
        As for `to_si`; also if the zero of the unit differs from the zero of the SI unit, as for "degF".
    """
    if _zero(unit):
        raise InputError.of("unit", unit, f"a multiple of {si_unit}")
    return to_si(1.0, unit, si_unit)


def is_unit_of(unit: str, si_unit: str) -> bool:
    """Whether `unit` is a known unit with the dimension of `si_unit`."""
    try:
        _factor(unit, si_unit)
    except InputError:
        return False
    return True


def parse(text: str, si_unit: str) -> float:
    """Parse a number with its unit, such as "60 lbf"; return the number in SI; arguments as for `split`.

    Raises
    ------
    InputError
        If `text` is not a finite number with a known unit of the dimension of `si_unit`.
    """
    value, unit = split(text, si_unit)
    return to_si(value, unit, si_unit)


def split(text: str, si_unit: str) -> tuple[float, str]:
    """Split a number from its unit, "60 lbf" to (60.0, "lbf"), without converting.

    Parameters
    ----------
    text : str
        Number and unit; the unit may be left out only where `si_unit` is "1".
    si_unit : str
        SI unit of the quantity, for the message.

    Returns
    -------
    value : float
        The number.
    unit : str
        The unit as written; "1" where it is left out.

    Raises
    ------
    InputError
        If `text` does not begin with a finite number, or lacks its unit.
    """
    match = _NUMBER.fullmatch(text)
    value = float(match[1]) if match else math.nan
    if match is None or not math.isfinite(value):
        raise InputError(
            f"{text!r} is not a finite number with a unit", value=text, expected=f"{describe(si_unit)}"
        )
    unit = match[2].strip()
    if re.match(r",\s*\d", unit):
        raise InputError(
            f"{text!r} has a comma", value=text, expected="a number with a decimal point, such as '1.2 kHz'"
        )
    if not unit and si_unit != "1":
        raise InputError(f"{text!r} has no unit", value=text, expected=f"{describe(si_unit)}")
    return value, unit or "1"


def describe(si_unit: str) -> str:
    """Return the name of the dimension of an SI unit, such as "a length (m)", for messages."""
    return f"{DIMENSIONS[si_unit]} ({si_unit})" if si_unit in DIMENSIONS else f"a quantity in {si_unit}"


def _zero(unit: str) -> int:
    return _ZEROS.get(unit.translate(_SIGNS).strip(), 0)


def _scaled(value: object, factor: Fraction, unit: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{value!r} {unit} is not a number", value=value)
    try:
        number = float(value)
        if math.isfinite(number):
            # A number that is already in SI needs no exact product.
            zero = _zero(unit)
            return number + 0.0 if factor == 1 else float((Fraction(repr(number)) - zero) * factor)
    except OverflowError:
        pass
    raise InputError(f"{value!r} {unit} is not a finite number", value=value)


@lru_cache(maxsize=1024)
def _factor(unit: str, si_unit: str) -> Fraction:
    """Return the exact conversion factor from a unit to `si_unit`."""
    size, dimension = _measure(unit)
    si_size, si_dimension = _measure(si_unit)
    if dimension != si_dimension:
        known = (name for name in DIMENSIONS if _measure(name)[1] == dimension)
        same = next(known, None)
        is_what = f"is {DIMENSIONS[same]}" if same else "is of another dimension"
        raise InputError(f"the unit {unit!r} {is_what}", value=unit, expected=f"{describe(si_unit)}")
    return size / si_size


@lru_cache(maxsize=1024)
def _measure(unit: str) -> tuple[Fraction, _Dimension]:
    """Return the size of a unit in base units, and its dimension: the nonzero exponents of the base units."""
    size, dimension = Fraction(1), dict[str, Fraction]()
    for name, power in _factors(unit):
        try:
            base, powers = _common().get(name) or _looked_up(name)
        except LookupError:
            raise InputError(_UNKNOWN.format(unit), value=unit) from None
        size *= _power(base, power)
        for of, each in powers.items():
            dimension[of] = dimension.get(of, Fraction(0)) + each * power
    return size, {of: power for of, power in dimension.items() if power}


@lru_cache(maxsize=1)
def _common() -> dict[str, tuple[Fraction, _Dimension]]:
    """Return size and dimension of common SI units by symbol, to avoid a look-up of 0.3 s at start-up.

    A test compares the table with `units.txt`.
    """
    symbols = {
        prefix + symbol: (Fraction(10) ** (power + _PREFIXES[prefix]), _dimension(powers))
        for symbol, (power, *powers) in _COMMON.items()
        for prefix in _PREFIXES
    }
    return {**symbols, "%": (Fraction(1, 100), {}), "in": (Fraction("0.0254"), symbols["m"][1])}


def _dimension(powers: Sequence[int]) -> _Dimension:
    return {of: Fraction(power) for of, power in zip(_BASES, powers, strict=True) if power}


def _looked_up(name: str) -> tuple[Fraction, _Dimension]:
    """Look up size and dimension of a unit in `units.txt`; raise LookupError if the name is unknown."""
    from pint import UndefinedUnitError

    registry = _registry()
    try:
        full = registry.get_name("percent" if name == "%" else name)
    except UndefinedUnitError:
        raise LookupError(name) from None
    powers = {str(of): Fraction(str(power)) for of, power in registry.get_dimensionality(full).items()}
    return Fraction(str(registry.get_root_units(full)[0])), powers


def _factors(unit: str) -> Iterator[tuple[str, Fraction]]:
    """Yield the factors of a unit as name and power; a slash divides by the next factor only."""
    text, position, sign = unit.translate(_SIGNS), 0, 1
    while unit.isprintable() and (match := _FACTOR.match(text, position)):
        if match["name"] != "1":
            yield match["name"], sign * Fraction((match["power"] or "1").strip("() "))
        position, sign = match.end(), -1 if match["operator"] == "/" else 1
        if position == len(text) and not match["operator"]:
            return
    raise InputError(_UNKNOWN.format(unit), value=unit)


def _power(base: Fraction, exponent: Fraction) -> Fraction:
    if exponent.denominator == 1 or base == 1:
        return base ** int(exponent)
    with localcontext() as context:
        context.prec = 60
        power = Decimal(exponent.numerator) / Decimal(exponent.denominator)
        root: Decimal = context.power(Decimal(base.numerator) / Decimal(base.denominator), power)
        return Fraction(root)


@lru_cache(maxsize=1)
def _registry() -> UnitRegistry[Fraction]:
    from pint import UnitRegistry

    registry: UnitRegistry[Fraction] = UnitRegistry(None, non_int_type=Fraction)
    lines = files("printhammer").joinpath("units.txt").read_text(encoding="utf-8").splitlines()
    registry.load_definitions(lines)
    return registry
