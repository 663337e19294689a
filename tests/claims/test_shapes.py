import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import spearmanr

from printhammer.claims.judging import falling, largest, rank_correlation
from printhammer.claims.pulses import half_rise
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Trapezoid


@given(st.floats(0.02, 0.98))
def test_the_largest_value_is_found_between_grid_points(top: float) -> None:
    assert largest(lambda t: -np.abs(t - top), 0.0, 1.0) == pytest.approx(0.0, abs=1e-12)


def test_the_largest_value_of_no_interval() -> None:
    assert largest(np.cos, 0.3, 0.3) == math.cos(0.3)


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=2, max_size=12))
def test_rank_correlation_is_that_of_spearman(pairs: list[tuple[int, int]]) -> None:
    first, second = ([float(value) for value in column] for column in zip(*pairs, strict=True))
    found = rank_correlation(first, second)
    if len(set(first)) < 2 or len(set(second)) < 2:
        assert found is None
    else:
        assert found == pytest.approx(spearmanr(first, second).statistic, abs=1e-12)


@pytest.mark.parametrize(
    ("values", "expected"), [([], True), ([1.0], True), ([3, 2, 1], True), ([3, 3], False), ([1, 2], False)]
)
def test_falling(values: list[float], expected: bool) -> None:
    assert falling(values) == expected


def test_half_of_the_peak() -> None:
    assert half_rise(HalfSine(amplitude=2.0, width=6e-4)) == pytest.approx(1e-4, rel=1e-9)
    assert half_rise(Trapezoid(amplitude=-1.0, rise=2e-5, width=1e-4, fall=1e-5)) == pytest.approx(
        1e-5, rel=1e-9
    )
    assert half_rise(Rectangle(amplitude=1.0, width=1e-4, rise=0.0, decay=0.0)) == 0.0
    width, rise = 1e-4, 4e-5
    reached = -math.expm1(-width / rise)
    pulse = Rectangle(amplitude=1.0, width=width, rise=rise, decay=1e-5)
    assert half_rise(pulse) == pytest.approx(-rise * math.log1p(-0.5 * reached), rel=1e-9)
