"""Thermal duty against closed forms, and the rates of a printer family against one coil limit."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.control.duty import FEEDS, DotHeat, ThermalCoil, dot_heat, steady, time_to
from printhammer.parts.coil import COPPER

AMBIENT = [25.0, 50.0] * 3
RAIL = [21.6, 21.6, 24.0, 24.0, 26.4, 26.4]
# Dots per second that a family of line printers allows at these rails and ambient temperatures.
FAMILY = [1127.0, 700.0, 1173.0, 728.0, 1218.0, 756.0]


def test_the_rates_of_a_printer_family_come_out_of_one_limit() -> None:
    behind = ph.thermal_limit(AMBIENT, FAMILY, RAIL)
    assert behind.limit == pytest.approx(91.0, abs=0.2)
    assert behind.error < 0.1
    np.testing.assert_allclose(behind.fitted, FAMILY, atol=0.5)
    # The higher the rail, the shorter the pulse and the less heat a dot.
    assert (np.diff(behind.warming[::2]) < 0.0).all()


def test_one_limit_gives_the_ratio_of_the_family_at_every_rail() -> None:
    for heat in ("3 mJ", "4 mJ", "5 mJ"):
        for feed in FEEDS:
            duty = ph.thermal_duty(heat, "12 K/W", "91 degC", ambient=["25 degC", "50 degC"], feed=feed)
            assert duty.rate[0] / duty.rate[1] == pytest.approx(1.61, abs=0.001)


@given(
    limit=st.floats(60.0, 200.0),
    heats=st.lists(st.floats(0.01, 0.2), min_size=1, max_size=3),
    ambients=st.lists(st.floats(-20.0, 50.0), min_size=2, max_size=4, unique_by=round),
)
@settings(max_examples=50, deadline=None)
def test_the_limit_behind_rates_is_found(limit: float, heats: list[float], ambients: list[float]) -> None:
    rows = [(cold, rail) for rail in range(len(heats)) for cold in ambients]
    rates = [(limit - cold) / heats[rail] for cold, rail in rows]
    behind = ph.thermal_limit([cold for cold, _ in rows], rates, [float(rail) for _, rail in rows])
    assert behind.limit == pytest.approx(limit, rel=1e-6)


@pytest.mark.parametrize("feed", FEEDS)
def test_at_its_largest_rate_a_coil_comes_to_the_limit(feed: str) -> None:
    duty = ph.thermal_duty("4 mJ", "8 K/W", 91.0, feed=feed, body_resistance=4.0, body_capacity=30.0,
                           thermal_capacity=2.0)  # fmt: skip
    assert duty.temperature[0, 0] == pytest.approx(91.0, abs=1e-9)
    assert duty.time[0, 0] == math.inf
    assert duty.share[0, 0] == 1.0


def test_copper_at_a_rail_and_at_a_current() -> None:
    warm = 1.0 + COPPER * 80.0
    assert dot_heat(1.0, "current").at(100.0) == pytest.approx(warm)
    assert dot_heat(1.0, "voltage").at(100.0) == pytest.approx(1.0 / warm)
    assert dot_heat(1.0, "energy").at(100.0) == 1.0


def test_heat_by_a_table_passes_through_it() -> None:
    heat = DotHeat((20.0, 60.0, 100.0), (4e-3, 3.6e-3, 3.3e-3), "voltage")
    for place, value in zip(heat.temperature, heat.heat, strict=True):
        assert heat.at(place) == pytest.approx(value, rel=1e-12)
    assert heat.at(140.0) < heat.at(100.0) < heat.at(80.0) < heat.at(60.0)


def test_one_mass_warms_by_an_exponential() -> None:
    coil, heat = ThermalCoil(12.0, 2.0), dot_heat(4e-3, "energy")
    rise = 2000.0 * 4e-3 * 12.0
    exact = -24.0 * math.log(1.0 - (91.0 - 25.0) / rise)
    assert time_to(coil, heat, 91.0, 25.0, 2000.0) == pytest.approx(exact, rel=1e-7)
    assert steady(coil, heat, 25.0, 2000.0) == pytest.approx(25.0 + rise, rel=1e-12)


def test_a_current_kept_up_warms_by_a_slower_exponential() -> None:
    rate, ambient, limit = 2000.0, 25.0, 91.0
    power = rate * 4e-3
    # C dT/dt = P (1 + a (T - 20)) - (T - A) / R is linear.
    decay = (1.0 / 12.0 - power * COPPER) / 2.0
    final = (power * (1.0 - 20.0 * COPPER) + ambient / 12.0) / (1.0 / 12.0 - power * COPPER)
    exact = -math.log((final - limit) / (final - ambient)) / decay
    coil, heat = ThermalCoil(12.0, 2.0), dot_heat(4e-3, "current")
    assert time_to(coil, heat, limit, ambient, rate) == pytest.approx(exact, rel=1e-7)
    assert steady(coil, heat, ambient, rate) == pytest.approx(final, rel=1e-9)


def test_two_masses_warm_as_the_matrix_exponential_says() -> None:
    from scipy.linalg import expm

    coil, heat, rate = ThermalCoil(8.0, 2.0, 4.0, 30.0), dot_heat(4e-3, "energy"), 2500.0
    time = time_to(coil, heat, 91.0, 25.0, rate)
    slopes = np.array([[-1.0 / 16.0, 1.0 / 16.0], [1.0 / 240.0, -1.0 / 240.0 - 1.0 / 120.0]])
    final = rate * 4e-3 * np.array([12.0, 4.0])
    at = 25.0 + final - expm(slopes * time) @ final
    assert at[0] == pytest.approx(91.0, abs=1e-5)


def test_a_coil_that_current_makes_hotter_without_end() -> None:
    assert steady(ThermalCoil(12.0), dot_heat(4e-3, "current"), 25.0, 1e4) == math.inf
    duty = ph.thermal_duty("4 mJ", "12 K/W", 91.0, ambient=[95.0, 25.0], burst=["10 kHz"], feed="current")
    assert duty.rate[0] == 0.0
    assert duty.time[0, 0] == 0.0
    assert math.isnan(duty.time[1, 0])  # No heat capacity, no time.


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"heat": "-4 mJ"}, "heat = '-4 mJ': expected greater than 0 J"),
        ({"heat": "4 W"}, "'W' is a power: expected an energy (J)"),
        ({"limit": "364 K"}, "'K' is a difference of temperatures: expected a temperature (degC)"),
        ({"limit": -300.0}, "limit = -300.0: expected more than -234.5 degC"),
        ({"ambient": []}, "ambient is empty: expected one temperature or more"),
        ({"feed": "force"}, "feed = 'force': expected one of voltage, current, energy"),
        ({"burst": [-1.0]}, "burst = -1.0: expected greater than 0 Hz"),
        ({"body_resistance": 4.0}, "body_capacity is missing"),
        ({"body_resistance": 4.0, "body_capacity": 3.0}, "thermal_capacity is missing"),
    ],
)
def test_what_is_no_coil_is_refused(wrong: dict[str, object], said: str) -> None:
    right = {"heat": "4 mJ", "thermal_resistance": "12 K/W", "limit": "91 degC"}
    with pytest.raises(ph.InputError) as error:
        ph.thermal_duty(**{**right, **wrong})  # type: ignore[arg-type]
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("ambient", "rate", "key"),
    [
        ([25.0, 50.0], [700.0, 1127.0], "rates"),
        ([25.0, 25.0], [700.0, 690.0], "rates"),
        ([25.0], [700.0, 690.0], "rates"),
        ([25.0, 50.0], [700.0, 0.0], "rate"),
    ],
)
def test_rates_without_a_limit_are_refused(ambient: list[float], rate: list[float], key: str) -> None:
    with refused(key):
        ph.thermal_limit(ambient, rate)
