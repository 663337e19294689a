"""Tangent maps and exponents: consistency, and limits of their range."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from tests import hammers
from tests.errors import refused
from tests.hammers import crude, made_of
from tests.tangents import scaled

import printhammer as ph
from printhammer.derivatives import states
from printhammer.derivatives.states import standard_error, strobe_exponent, tangent_map
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.kernel.model.modes import BACKSTOP, LOADING, UNLOADING

SCALES = hammers.STROKE, 2.0


def train(period: float, pulses: int) -> ph.PulseTrain:
    return ph.PulseTrain(crude().waveform, period=period, pulses=pulses)


@given(
    st.lists(st.floats(0.0, 2.2e-3), min_size=3, max_size=3, unique=True).filter(
        lambda times: min(np.diff(sorted(times))) > 1e-9
    )
)
def test_maps_compose(times: list[float]) -> None:
    """The map from a to c is the product of the maps from a to b and from b to c, for any b."""
    a, b, c = sorted(times)
    drive = train(1.2e-3, 2)
    whole = tangent_map(crude(), drive, a, c, tolerance=1e-12)
    first = tangent_map(crude(), drive, a, b, tolerance=1e-12)
    second = tangent_map(crude(), drive, b, c, tolerance=1e-12)
    assert first.state_at_end == pytest.approx(second.state_at_start, rel=1e-9, abs=1e-12)
    product = scaled(second.matrix @ first.matrix, SCALES)
    size = np.linalg.norm(scaled(second.matrix, SCALES)) * np.linalg.norm(scaled(first.matrix, SCALES))
    assert np.linalg.norm(product - scaled(whole.matrix, SCALES)) < 1e-7 * size


def test_the_state_has_three_components_on_the_unloading_branch_only() -> None:
    drive = train(1.2e-3, 1)
    shapes = {}
    for end in (0.3e-3, 0.4e-3, 0.56e-3):
        found = tangent_map(crude(), drive, 0.0, end)
        shapes[found.branch_at_end] = found.matrix.shape
    assert shapes == {LOADING: (2, 2), UNLOADING: (3, 2), BACKSTOP: (2, 2)}
    inside = tangent_map(crude(), drive, 0.38e-3, 0.42e-3)
    assert inside.matrix.shape == (3, 3)
    # The latest local maximum stays what it is.
    np.testing.assert_array_equal(inside.matrix[2], [0.0, 0.0, 1.0])
    assert inside.determinant == pytest.approx(1.0, rel=1e-8)
    out = tangent_map(crude(), drive, 0.38e-3, 0.5e-3)
    assert out.determinant == 0.0
    with pytest.raises(ValueError, match="more components"):
        _ = tangent_map(crude(), drive, 0.0, 0.4e-3).determinant


def test_the_result_does_not_depend_on_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit-identical maps and growth, even if the record is too short for one contact."""
    drive = train(1.05e-3, 12)
    whole = tangent_map(crude(), drive, 0.5e-3, 9e-3)
    growth = strobe_exponent(crude(), drive, first=2, last=12)
    for nodes in (8, 150, 400):
        monkeypatch.setattr(states, "_NODES", nodes)
        np.testing.assert_array_equal(tangent_map(crude(), drive, 0.5e-3, 9e-3).matrix, whole.matrix)
        again = strobe_exponent(crude(), drive, first=2, last=12)
        np.testing.assert_array_equal(again.factors, growth.factors)
        assert again.value == growth.value


@pytest.mark.parametrize("period", [0.95e-3, 1.25e-3, 1.3e-3, 2e-3, 6e-3])
def test_on_a_periodic_orbit_the_exponents_are_those_of_its_multipliers(period: float) -> None:
    drive = train(period, 260)
    n = 259
    orbit = tangent_map(crude(), drive, drive.times[n - 1], drive.times[n])
    gap = np.subtract(orbit.state_at_end, orbit.state_at_start) / (SCALES[0], SCALES[1], SCALES[0])
    assert np.abs(gap).max() < 1e-6
    multipliers = np.sort(np.log(np.abs(np.linalg.eigvals(orbit.matrix))))
    found = strobe_exponent(crude(), drive, first=200, last=260)
    assert found.value == pytest.approx(multipliers[1], rel=1e-5, abs=1e-6)
    assert found.second == pytest.approx(multipliers[0], rel=1e-5)
    assert found.standard_error < 1e-5
    assert found.per_second == found.value / period


def test_a_cycle_of_two_firings() -> None:
    """The multipliers are those of the map over two firings."""
    drive = train(1.35e-3, 300)
    orbit = tangent_map(crude(), drive, drive.times[297], drive.times[299])
    assert orbit.state_at_start == pytest.approx(orbit.state_at_end, rel=1e-6)
    largest = float(np.log(np.abs(np.linalg.eigvals(orbit.matrix))).max())
    found = strobe_exponent(crude(), drive, first=200, last=300)
    assert found.value == pytest.approx(0.5 * largest, rel=1e-4)
    assert found.standard_error < 1e-4 < abs(found.factors[0] - found.factors[1])


def test_exponents_add_up_to_the_mean_growth_of_areas() -> None:
    drive = train(1.05e-3, 40)
    found = strobe_exponent(crude(), drive, first=10, last=40)
    maps = [tangent_map(crude(), drive, drive.times[i], drive.times[i + 1]) for i in range(9, 39)]
    assert {part.matrix.shape for part in maps} == {(2, 2)}
    areas = [math.log(abs(part.determinant)) for part in maps]
    assert found.total == pytest.approx(np.mean(areas), rel=1e-6)


def test_at_rest_in_the_backstop_changes_die_out_like_a_damped_oscillator() -> None:
    """Over times for which the decay underflows floating-point numbers."""
    hammer = crude()
    drive = train(1.0, 2)
    start, end = 0.2, 0.20013
    found = tangent_map(hammer, drive, start, end)
    x = found.state_at_start[0]
    small = 1e-9
    force = np.array([_static_force(hammer, x + sign * small, 0.0) for sign in (-1.0, 1.0)])
    drag = np.array([_static_force(hammer, x, sign * 1e-6) for sign in (-1.0, 1.0)])
    by_x, by_v = np.diff(force)[0] / (2.0 * small), np.diff(drag)[0] / 2e-6
    exact = expm((end - start) * np.array([[0.0, 1.0], [by_x, by_v]]) / [[1.0], [hammer.mass]])
    np.testing.assert_allclose(
        scaled(found.matrix, SCALES),
        scaled(exact, SCALES),
        rtol=0.0,
        atol=1e-6 * np.abs(scaled(exact, SCALES)).max(),
    )
    longest = strobe_exponent(hammer, drive, first=1, last=2)
    assert -np.inf < longest.value < -700.0
    assert longest.second < longest.value


def _static_force(hammer: ph.Hammer, x: float, v: float) -> float:
    """Equations (3), (4), (6) and (7) without a current."""
    c = {key: constant.si for key, constant in hammer.constants.items()}
    delta = c["backstop.position"] - x
    magnet = c["magnet.F0"] - c["magnet.Am"] ** 2 / math.sqrt(x)
    spring = c["spring.Bs"] * (1.0 + delta / c["spring.As"])
    return magnet + spring + (c["backstop.stiffness"] - c["backstop.damping"] * v) * delta**1.5


def test_a_run_that_does_not_get_there_says_so() -> None:
    push = ph.PulseTrain(Rectangle(amplitude=50.0, width=1.0, rise=0.0, decay=0.0, quantity="force"))
    mass = made_of(spring=hammers.preload(1.0))
    with hammers.interpreted():
        found = tangent_map(mass, push, 0.0, 10.0, state=(0.0, 0.0))
        growth = strobe_exponent(mass, push, period=1.0, first=1, last=20, state=(0.0, 0.0))
    assert (found.status, found.ok) == ("runaway", False)
    assert np.isnan(found.matrix).all()
    assert found.branch_at_end == -1
    assert (growth.status, growth.ok) == ("runaway", False)
    assert math.isnan(growth.value)


def test_the_old_maximum_met_without_velocity_is_reported() -> None:
    """Under a constant force, the wire oscillates without end along the unloading curve up to its maximum."""
    hammer = made_of(pack=hammers.PACKS["curve"])
    push = hammers.block(14.0, 1.0)
    with hammers.interpreted():
        once = tangent_map(hammer, push, 0.0, 0.13e-3, state=(hammers.FRONT, 0.2))
        again = tangent_map(hammer, push, 0.0, 0.24e-3, state=(hammers.FRONT, 0.2))
    assert once.branch_at_end == UNLOADING
    assert once.smooth
    assert not again.smooth


def test_the_standard_error_of_an_autocorrelated_series() -> None:
    """White noise, and autoregressive noise whose standard error is larger by sqrt((1 + r)/(1 - r))."""
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(40_000)
    assert standard_error(noise) == pytest.approx(1.0 / math.sqrt(noise.size), rel=0.1)
    series, r = np.empty_like(noise), 0.8
    series[0] = noise[0]
    for i in range(1, noise.size):
        series[i] = r * series[i - 1] + noise[i]
    exact = series.std() * math.sqrt((1.0 + r) / (1.0 - r) / noise.size)
    assert standard_error(series) == pytest.approx(exact, rel=0.15)
    assert standard_error(np.ones(7)) == math.inf
    assert standard_error([0.0] * 9 + [-math.inf]) == math.inf
    assert standard_error(np.full(100, 0.3)) == 0.0


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda h: tangent_map(h, train(1e-3, 2), 1e-3, 1e-3), "start"),
        (lambda h: tangent_map(h, train(1e-3, 2), -1e-3, 1e-3), "start"),
        (lambda h: tangent_map(h, train(1e-3, 2), 0.0, math.inf), "start"),
        (lambda h: tangent_map(h, train(1e-3, 2), 0.0, 1e-3, tolerance=0.0), "tolerance"),
        (lambda h: tangent_map(h, train(1e-3, 2), 0.0, 1e-3, state=(math.nan, 0.0)), "state"),
        (lambda h: strobe_exponent(h, h.waveform, last=20), "period"),
        (lambda h: strobe_exponent(h, h.waveform, -1e-3, last=20), "period"),
        (lambda h: strobe_exponent(h, h.waveform, 1e-3, first=20, last=20), "first"),
        (lambda h: strobe_exponent(h, h.waveform, 1e-3, first=0, last=20), "first"),
        (lambda h: strobe_exponent(h, train(1e-3, 5), last=20), "last"),
    ],
)
def test_bad_arguments(call: object, key: str) -> None:
    with refused(key):
        call(crude())
