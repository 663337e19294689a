import pytest

from printhammer.cli.options import Units, shown, with_unit


@pytest.mark.parametrize(
    ("value", "text"), [(-1e-9, "0.00"), (-0.0, "0.00"), (-6e-9, "-0.01"), (1.5e-6, "1.50"), (None, "–")]
)
def test_what_is_rounded_to_zero_has_no_minus(value: float | None, text: str) -> None:
    assert shown(value, "length", Units.SI) == text


def test_a_unit_follows_its_number() -> None:
    assert with_unit(-1e-9, "length", Units.SI) == "0.00 µm"
    assert with_unit(25.4e-6, "length", Units.INCH) == "1.000 mil"
