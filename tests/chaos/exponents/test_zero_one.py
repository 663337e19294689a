"""The 0-1 test on series known to be regular or chaotic."""

import dataclasses
import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import strobes
from printhammer.chaos.exponents.zero_one import FEWEST, mean_square_displacements, without_cycle, zero_one

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def logistic(r: float, count: int, skipped: int = 2000) -> np.ndarray:
    found, x = [], 0.3
    for k in range(count + skipped):
        x = r * x * (1.0 - x)
        if k >= skipped:
            found.append(x)
    return np.array(found)


def exponent(r: float, count: int = 20000) -> float:
    return float(np.mean(np.log(np.abs(r * (1.0 - 2.0 * logistic(r, count))))))


def test_chaos_at_its_fullest() -> None:
    found = zero_one(logistic(4.0, 1000))
    assert found.verdict == "chaotic"
    assert found.k > 0.99
    assert found.reason == ""
    assert found.cycle == 1


@pytest.mark.parametrize("count", [300, 3000])
@pytest.mark.parametrize(
    "series",
    [
        lambda k: np.cos(2.0 * math.pi * GOLDEN * k),
        lambda k: np.cos(2.0 * math.pi * GOLDEN * k) + 0.7 * np.cos(2.0 * math.pi * math.sqrt(2.0) * k),
        lambda k: np.full(k.size, 3.0),
        lambda k: np.array([0.1, 0.7, 0.2, 0.9])[k % 4],
        lambda k: 1.0 + 0.99**k,
        lambda k: (-1.0) ** k * (1.0 + 0.995**k),
    ],
    ids=["circle", "torus", "constant", "cycle", "settling", "settling on a cycle"],
)
def test_regular_series(series: object, count: int) -> None:
    found = zero_one(series(np.arange(count)))
    assert found.verdict == "regular", found.phrase


@pytest.mark.parametrize("r", np.linspace(3.4, 4.0, 13))
def test_it_never_contradicts_the_exponent_of_the_logistic_map(r: float) -> None:
    value = exponent(r)
    expected = "chaotic" if value > 0.0 else "regular"
    assert zero_one(logistic(r, 1000)).verdict in (expected, "undecided")
    assert zero_one(logistic(r, 3000)).verdict == expected


def test_chaos_in_narrow_bands_takes_few_numbers() -> None:
    # Four bands: the cycle alone makes displacements that drown the growth.
    found = zero_one(logistic(3.58, 1000))
    assert found.cycle == 4
    assert found.verdict == "chaotic"


def test_bands_without_numbers_enough_are_undecided() -> None:
    found = zero_one(logistic(3.5699, 300))
    assert found.cycle > 6
    assert found.verdict == "undecided"
    assert f"every {found.cycle} numbers" in found.reason


def test_noise_below_the_resolution_is_no_chaos() -> None:
    noise = np.random.default_rng(0).standard_normal(1000)
    series = 60e-6 + 1e-17 * noise
    assert zero_one(series, resolution=1e-11).verdict == "regular"
    assert zero_one(series, resolution=1e-17).verdict == "chaotic"
    # Far above it the damping does not matter.
    assert zero_one(noise, resolution=1e-3).k == pytest.approx(zero_one(noise, resolution=0.0).k, abs=1e-3)


def test_what_dies_out_is_a_transient() -> None:
    rng = np.random.default_rng(3)
    found = zero_one(rng.standard_normal(1000) * np.exp(-np.arange(1000) / 300.0))
    assert found.verdict == "undecided"
    assert "settled" in found.reason


def test_displacements_are_those_of_the_definition() -> None:
    rng = np.random.default_rng(5)
    paths = rng.standard_normal((3, 57)) + 1j * rng.standard_normal((3, 57))
    cut = 9
    direct = [
        [np.mean([abs(row[j + n] - row[j]) ** 2 for j in range(len(row) - cut)]) for n in range(1, cut + 1)]
        for row in paths
    ]
    np.testing.assert_allclose(mean_square_displacements(paths, cut), direct, rtol=1e-12)


def test_without_the_mean_is_without_its_oscillation() -> None:
    # M_c(n) - (mean)^2 (1 - cos n c)/(1 - cos c), as the test of 2009 has it, in the limit of a long series.
    series, c, cut = logistic(4.0, 100_000), 1.1, 50
    turned = np.exp(1j * c * np.arange(1, series.size + 1))
    raw = mean_square_displacements(np.cumsum(series * turned)[np.newaxis], cut)[0]
    mine = mean_square_displacements(np.cumsum((series - series.mean()) * turned)[np.newaxis], cut)[0]
    n = np.arange(1, cut + 1)
    theirs = raw - series.mean() ** 2 * (1.0 - np.cos(n * c)) / (1.0 - math.cos(c))
    np.testing.assert_allclose(mine, theirs, atol=0.01 * mine.max())


def test_a_cycle_is_found_and_taken_out() -> None:
    levels = np.random.default_rng(2).standard_normal(7)
    series = np.tile(levels, 40)
    cycle, rest = without_cycle(series, 1e-9)
    assert cycle == 7
    np.testing.assert_allclose(rest, 0.0, atol=1e-15)
    noise = np.random.default_rng(4).standard_normal(2000)
    cycle, rest = without_cycle(noise, 1e-9)
    assert cycle == 1
    np.testing.assert_allclose(rest, noise - noise.mean())


@settings(max_examples=15)
@given(
    factor=st.floats(1e-6, 1e6),
    shift=st.floats(-100.0, 100.0),
    series=st.sampled_from(
        [logistic(4.0, 300), logistic(3.83, 300), np.cos(2.0 * math.pi * GOLDEN * np.arange(300))]
    ),
)
def test_units_and_origin_do_not_matter(factor: float, shift: float, series: np.ndarray) -> None:
    one = zero_one(series, resolution=1e-6)
    other = zero_one(factor * (series + shift), resolution=1e-6 * factor)
    assert other.k == pytest.approx(one.k, abs=1e-4)
    assert other.verdict == one.verdict


def test_same_seed_same_bits_and_another_seed_the_same_verdict() -> None:
    series = logistic(3.7, 1000)
    one, again, other = zero_one(series), zero_one(series), zero_one(series, seed=7)
    for name in ("angles", "correlations", "displacement", "p", "q"):
        np.testing.assert_array_equal(getattr(one, name), getattr(again, name))
    assert not np.array_equal(one.angles, other.angles)
    assert one.verdict == other.verdict == "chaotic"
    assert (one.angles > math.pi / 5.0).all()
    assert (one.angles < 4.0 * math.pi / 5.0).all()


def test_many_angles_are_worked_on_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    series = logistic(4.0, 500)
    whole = zero_one(series, angles=37)
    monkeypatch.setattr(sys.modules["printhammer.chaos.exponents.zero_one"], "_TOGETHER", 1000)
    np.testing.assert_array_equal(zero_one(series, angles=37).correlations, whole.correlations)


def test_what_is_shown_is_the_angle_in_the_middle() -> None:
    found = zero_one(logistic(3.9, 400), angles=51)
    assert found.correlations[found.shown] == found.k
    moved = np.abs(found.p + 1j * found.q)
    assert moved[0] > 0.0
    assert len(found.p) == 400
    assert len(found.displacement) == 40
    chart = found.to_dataset()
    assert chart.attrs["k"] == found.k
    assert dict(chart.sizes) == {"angle": 51, "step": 40, "number": 400}


def test_points_of_a_strobe(hammer: "ph.Hammer") -> None:
    (points,) = strobes(hammer, ["6 ms"], points=FEWEST, transient=5, verdict=False)
    found = zero_one(points)
    assert found.resolution == pytest.approx(1e-6 * points.window.half_widths[0])
    # The armature is at rest before each firing, but for the noise of the arithmetic.
    assert found.verdict == "regular"
    known = dataclasses.replace(points, x=logistic(4.0, FEWEST) * 1e-5)
    assert zero_one(known).verdict == "chaotic"


def test_a_run_that_stopped_is_undecided(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "250 um")
    (points,) = strobes(short, ["1 ms"], points=FEWEST, verdict=False)
    found = zero_one(points)
    assert found.verdict == "undecided"
    assert "range left" in found.reason
    assert math.isnan(found.k)


@pytest.mark.parametrize(
    ("series", "options", "key"),
    [
        (np.zeros(FEWEST - 1), {}, "series"),
        (np.zeros((FEWEST, 2)), {}, "series"),
        ([math.nan] * FEWEST, {}, "series"),
        (["a"] * FEWEST, {}, "series"),
        (np.zeros(FEWEST), {"resolution": -1.0}, "resolution"),
        (np.zeros(FEWEST), {"resolution": math.inf}, "resolution"),
        (np.zeros(FEWEST), {"angles": 0}, "angles"),
        (np.zeros(FEWEST), {"seed": -1}, "seed"),
    ],
)
def test_bad_input(series: object, options: dict[str, object], key: str) -> None:
    with refused(key):
        zero_one(series, **options)


@pytest.mark.parametrize(("count", "noise"), [(200, 0.01), (1000, 0.01), (3000, 0.02)])
def test_noise_on_a_cycle_is_no_chaos(count: int, noise: float) -> None:
    cycle = np.tile([1.0, 0.3, -0.7, 0.2, -0.9], count // 5)
    found = ph.zero_one(cycle + noise * np.random.default_rng(5).standard_normal(count))
    assert found.verdict == "regular"
    assert abs(found.k) < 0.2
