import pytest

from printhammer.results.summary import Cells, quantity, rendered


@pytest.mark.parametrize(
    ("value", "text"), [(-1e-9, "0.00"), (-0.0, "0.00"), (-6e-9, "-0.01"), (1.5e-6, "1.50")]
)
def test_what_is_rounded_to_zero_has_no_minus(value: float, text: str) -> None:
    assert rendered(quantity(value, "m", bare=True)) == text


def test_a_unit_follows_its_number() -> None:
    assert rendered(quantity(-1e-9, "m")) == "0.00 µm"
    assert rendered(quantity(25.4e-6, "m"), "inch") == "1.000 mil"
    assert rendered(quantity(None, "m")) == "–"


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (9.99e-3, "m", "9990.00 µm"),
        (-20.06e-3, "m", "-20.060 mm"),
        (1.98418386, "m", "1.9842 m"),
        (9.9e-3, "s", "9900.0 µs"),
        (16.82e-3, "s", "16.82 ms"),
        (25.0, "s", "25.000 s"),
        (1.2469994, "J", "1.2470 J"),
        (0.5, "J", "500.0000 mJ"),
    ],
)
def test_large_quantities_have_large_units(value: float, unit: str, text: str) -> None:
    assert rendered(quantity(value, unit)) == text


def test_a_column_has_one_unit() -> None:
    column = Cells("gap", [0.1, None, -2e-3, float("nan"), "none"], "m")
    assert column.unit_sign("si") == "mm"
    assert column.texts("si") == ["100.000", "–", "-2.000", "–", "none"]
    assert column.unit_sign("inch") == "mil"
