import pytest

from printhammer.results.summary import quantity, rendered, shown


@pytest.mark.parametrize(
    ("value", "text"), [(-1e-9, "0.00"), (-0.0, "0.00"), (-6e-9, "-0.01"), (1.5e-6, "1.50")]
)
def test_what_is_rounded_to_zero_has_no_minus(value: float, text: str) -> None:
    assert shown(value, "m", "si") == text
    assert rendered(quantity(value, "m", bare=True)) == text


def test_a_unit_follows_its_number() -> None:
    assert rendered(quantity(-1e-9, "m")) == "0.00 µm"
    assert rendered(quantity(25.4e-6, "m"), "inch") == "1.000 mil"
    assert rendered(quantity(None, "m")) == "–"
