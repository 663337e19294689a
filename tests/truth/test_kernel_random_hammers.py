"""The compiled kernel against the reference, for random hammers around the crude hammer.

Every constant is log-uniform within 20 %; hammers that `warnings` names or refuses are drawn again and
counted. Default tolerance throughout.
"""

import numpy as np
import pytest
from tests import hammers
from tests.hammers import DRAWS, Draw, compare

import printhammer as ph

CYCLE = 4e-3
BOUND = 1e-8
"""Of the stroke."""


def check_single_pulses(seed: int, count: int, record: pytest.FixtureRequest) -> None:
    draw = Draw(np.random.default_rng([1983, seed]))
    errors = []
    for _ in range(count):
        hammer = draw()
        found = compare(hammer, ph.PulseTrain(hammer.waveform), CYCLE, whole=True)
        assert found.motion.status == found.truth.status
        assert found.horizon == CYCLE
        for surface in ("pack", "backstop"):
            mine, theirs = found.touches(surface)
            assert len(mine) == len(theirs)
            np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=1e-10)
        assert abs(found.motion.energy.residual) < 1e-8 * found.motion.energy.throughput
        errors.append(found.error)
    assert max(errors) < BOUND, f"{sorted(errors)[-3:]}"
    report(record, draw, errors)


def check_trains(seed: int, count: int, record: pytest.FixtureRequest) -> None:
    rng = np.random.default_rng([1984, seed])
    draw = Draw(rng)
    errors, reached = [], []
    for _ in range(count):
        hammer = draw()
        period = rng.uniform(0.7e-3, 1.6e-3)
        drive = ph.PulseTrain(hammer.waveform, period=period, pulses=3)
        found = compare(hammer, drive, 2.0 * period + 2e-3, points=801)
        assert found.motion.status == found.truth.status
        reached.append(found.horizon / found.motion.end)
        assert len(found.touches("pack")[0]) == len(found.touches("pack")[1])
        assert abs(found.motion.energy.residual) < 1e-8 * found.motion.energy.throughput
        errors.append(found.error)
    assert max(errors) < BOUND, f"{sorted(errors)[-3:]}"
    # Short horizons are rare, or the comparison would say little.
    assert np.mean(np.array(reached) > 0.9) >= 0.5
    report(record, draw, errors)


def report(record: pytest.FixtureRequest, draw: Draw, errors: list[float]) -> None:
    """Record the draws (`pytest --junit-xml`), and print them on the terminal with `-s`."""
    told = f"{draw.drawn} hammers, {draw.redrawn} drawn again; error median {np.median(errors):.1e}"
    told += f", largest {max(errors):.1e} of the stroke"
    record.node.user_properties.append(("random hammers", told))
    print(told)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_single_pulses(seed: int, request: pytest.FixtureRequest) -> None:
    check_single_pulses(seed, 6, request)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_three_pulses(seed: int, request: pytest.FixtureRequest) -> None:
    check_trains(seed, 6, request)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 100 + 2 * DRAWS))
def test_many_single_pulses(seed: int, request: pytest.FixtureRequest) -> None:
    check_single_pulses(seed, 25, request)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 100 + 2 * DRAWS))
def test_many_trains(seed: int, request: pytest.FixtureRequest) -> None:
    check_trains(seed, 25, request)


def test_the_draw_is_what_it_says() -> None:
    """All constants vary, within 20 % of the crude hammer, and no drawn hammer causes a warning."""
    draw = Draw(np.random.default_rng(7))
    drawn = [draw() for _ in range(20)]
    crude = hammers.crude()
    for key, constant in crude.constants.items():
        ratios = [hammer.constants[key].si / constant.si for hammer in drawn]
        assert 0.8 <= min(ratios) < 1.0 < max(ratios) <= 1.2, key
    assert draw.drawn == 20
    assert all(hammer.warnings() == [] for hammer in drawn)
