"""Units: accepted notation, exact conversion, errors of one sentence."""

import math
import string
import subprocess
import sys
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer import units
from printhammer.errors import InputError
from printhammer.units import DIMENSIONS, describe, from_si, parse, split, to_si

# By hand from the definitions of the inch (25.4 mm), pound (0.45359237 kg) and g (9.80665 m/s2).
KNOWN = [
    ("0.002 in", "m", 5.08e-05),
    ("0.0112 in", "m", 0.00028448),
    ("0.015in", "m", 0.000381),
    ("2 mil", "m", 5.08e-05),
    ("60 lbf", "N", float(Fraction("60") * Fraction("0.45359237") * Fraction("9.80665"))),
    ("1 kgf", "N", 9.80665),
    ("1 ozf", "N", float(Fraction("0.45359237") * Fraction("9.80665") / 16)),
    ("25 in/s", "m/s", 0.635),
    ("0.397975875 g", "kg", 0.000397975875),
    ("351.910639 us", "s", 0.000351910639),
    ("351.910639 µs", "s", 0.000351910639),
    ("351.910639 \N{GREEK SMALL LETTER MU}s", "s", 0.000351910639),
    ("1.05 ms", "s", 0.00105),
    ("1.2 kHz", "Hz", 1200.0),
    ("1200 1/s", "Hz", 1200.0),
    ("0.437407904 N^0.5 m^0.25", "N^0.5 m^0.25", 0.437407904),
    ("0.0930958152 N^0.5 m^0.25/A", "N^0.5 m^0.25/A", 0.0930958152),
    ("417549759 N s/m^2.5", "N s/m^2.5", 417549759.0),
    ("417549759 N·s/m**2.5", "N s/m^2.5", 417549759.0),
    ("1.15608224e+09 N/m^1.5", "N/m^1.5", 1.15608224e09),
    ("1 N/mm^1.5", "N/m^1.5", 1000.0**1.5),
    ("4 N/m^(1/2)", "N/m^0.5", 4.0),
    ("30 psi", "Pa", float(30 * Fraction("0.45359237") * Fraction("9.80665") / Fraction("0.0254") ** 2)),
    ("200 GPa", "Pa", 2e11),
    ("5 mohm", "ohm", 0.005),
    ("0.5", "1", 0.5),
    ("0.5 1", "1", 0.5),
    ("50 %", "1", 0.5),
    ("-3e-3 N", "N", -0.003),
    (".5 A", "A", 0.5),
    ("5. A", "A", 5.0),
    ("3000 rpm", "Hz", 50.0),
    ("77 degF", "degC", 25.0),
    ("-40 degF", "degC", -40.0),
    ("77 °F", "degC", 25.0),
    ("77℉", "degC", 25.0),
    ("25 °C", "degC", 25.0),
    ("25 ℃", "degC", 25.0),
    ("90 °", "1", math.pi / 2),
    ("6 \N{OHM SIGN}", "ohm", 6.0),
    ("6 \N{GREEK CAPITAL LETTER OMEGA}", "ohm", 6.0),
    ("2 kp", "N", 19.6133),
    ("3 Newton", "N", 3.0),
    ("12 Volt", "V", 12.0),
    ("0.1 Ampere", "A", 0.1),
    ("10 A/V", "A/V", 10.0),
]


@pytest.mark.parametrize(("text", "si_unit", "value"), KNOWN)
def test_known_conversions(text: str, si_unit: str, value: float) -> None:
    assert math.isclose(parse(text, si_unit), value, rel_tol=3e-16)


@pytest.mark.parametrize("text", ["0.002 in", "0.0112 in", "25 in/s", "0.397975875 g", "1.2 kHz", "200 GPa"])
def test_decimal_factors_give_the_nearest_float(text: str) -> None:
    (si_unit, value) = next((si, v) for t, si, v in KNOWN if t == text)
    assert parse(text, si_unit) == value


REFUSED = [
    ("60 lbf", "m", "'lbf' is a force: expected a length (m)"),
    ("60", "m", "'60' has no unit: expected a length (m)"),
    ("1,2kHz", "Hz", "'1,2kHz' has a comma: expected a number with a decimal point, such as '1.2 kHz'"),
    ("1, 2", "1", "'1, 2' has a comma: expected a number with a decimal point, such as '1.2 kHz'"),
    ("", "m", "is not a finite number"),
    ("in", "m", "is not a finite number"),
    ("nan m", "m", "is not a finite number"),
    ("inf m", "m", "is not a finite number"),
    ("-inf m", "m", "is not a finite number"),
    ("1e999 m", "m", "is not a finite number"),
    ("1e308 km", "m", "is not a finite number"),
    ("20 degC", "m", "'degC' is a temperature: expected a length (m)"),
    ("293 K", "degC", "'K' is a difference of temperatures: expected a temperature (degC)"),
    ("68 degF", "K", "'degF' is a temperature: expected a difference of temperatures (K)"),
    ("3 furlong", "m", "'furlong' is not known"),
    ("3 nan", "m", "'nan' is not known"),
    ("3 2 m", "m", "is not known"),
    ("3 m+m", "m", "is not known"),
    ("3 m/", "m", "is not known"),
    ("3 m^", "m", "is not known"),
    ("3 /m", "1/m", "is not known"),
    ("3 m^999999999", "m", "is not known"),
    ("3 m^(1/0)", "m", "is not known"),
    ("3 9**9**9**9", "m", "is not known"),
    ("3 mkg", "kg", "is not known"),
    ("3 m^0.3", "m", "is of another dimension: expected a length (m)"),
    ("3 1", "m", "is a pure number: expected a length (m)"),
]


@pytest.mark.parametrize(("text", "si_unit", "reason"), REFUSED)
def test_refusals_say_what_was_expected(text: str, si_unit: str, reason: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(text, si_unit)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, True, None, "1", 10**400])
def test_what_is_not_a_finite_number_is_refused(value: object) -> None:
    with refused(None, value):
        to_si(value, "m", "m")  # type: ignore[arg-type]


def test_numpy_numbers_are_numbers() -> None:
    import numpy as np

    assert to_si(np.float64(0.002), "in", "m") == 5.08e-05


def test_split_keeps_what_is_written() -> None:
    assert split("60 lbf", "N") == (60.0, "lbf")
    assert split("0.3", "1") == (0.3, "1")


def test_every_named_dimension_is_a_unit() -> None:
    for unit in DIMENSIONS:
        assert to_si(1.0, unit, unit) == 1.0
        assert unit in describe(unit)


UNITS = [
    ("m", "in"),
    ("m", "um"),
    ("N", "lbf"),
    ("Pa", "psi"),
    ("N s/m^2.5", "lbf s/in^2.5"),
    ("s", "us"),
    ("kg", "lb"),
]
finite = st.floats(min_value=1e-250, max_value=1e250) | st.floats(min_value=-1e250, max_value=-1e-250)


@given(finite, st.sampled_from(UNITS))
def test_round_trip_is_within_two_rounding_errors(value: float, units: tuple[str, str]) -> None:
    si_unit, unit = units
    back = from_si(to_si(value, unit, si_unit), si_unit, unit)
    assert math.isclose(back, value, rel_tol=2.3e-16 * 2)


@given(finite, st.sampled_from(UNITS))
def test_text_and_number_agree(value: float, units: tuple[str, str]) -> None:
    si_unit, unit = units
    assert parse(f"{value!r} {unit}", si_unit) == to_si(value, unit, si_unit)


@given(st.decimals(min_value="-1e6", max_value="1e6", places=6))
def test_inches_are_correctly_rounded_decimals(value: object) -> None:
    assert parse(f"{value:f} in", "m") == float(Fraction(repr(float(f"{value}"))) * Fraction("0.0254"))


@given(st.text(string.printable + "µμ·²Ω%", max_size=24))
def test_any_text_is_read_or_refused(text: str) -> None:
    for candidate in (text, f"1 {text}"):
        message = ""
        try:
            value = parse(candidate, "m")
        except InputError as error:
            value, message = 0.0, str(error)
        assert math.isfinite(value)
        assert "\n" not in message


def test_first_conversion_in_a_process() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from printhammer.units import parse; print(parse('0.002 in', 'm'))"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "5.08e-05"


def test_common_units_are_those_of_the_file() -> None:
    for name, measure in units._common().items():
        assert measure == units._looked_up(name), name


def test_common_units_do_not_load_the_library_of_units() -> None:
    code = """
import sys
from printhammer.units import parse
assert parse("3 um", "m") == 3e-6 and parse("2 N s/m", "N s/m") == 2.0 and parse("1 %", "1") == 0.01
assert "pint" not in sys.modules
assert parse("1 ft", "m") == 0.3048
assert "pint" in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)
