import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.support.roots import Root, bisect, roots

GRID = np.linspace(-1.0, 1.0, 201).tolist()
places = st.lists(st.integers(-990, 990).map(lambda k: k / 1000.0), min_size=1, max_size=5, unique=True).map(
    sorted
)


# At most two of the roots, which are 0.001 apart, lie between two of these.
FINE = np.linspace(-1.0, 1.0, 1500).tolist()


@given(places)
def test_every_root_of_a_polynomial_is_found_to_the_last_bits(expected: list[float]) -> None:
    found = roots(lambda x: math.prod(x - root for root in expected), FINE)
    assert [root.x for root in found] == pytest.approx(expected, rel=1e-15, abs=1e-18)
    signs = [root.after for root in found]
    assert signs == [(-1) ** (len(expected) - 1 - k) for k in range(len(expected))]
    assert [root.before for root in found] == [-sign for sign in signs]


@given(st.floats(-0.9, 0.9), st.floats(1e-6, 4e-3))
def test_a_pair_between_two_grid_points_is_found(middle: float, half: float) -> None:
    found = roots(lambda x: (x - middle) ** 2 - half**2, GRID)
    assert [root.x for root in found] == pytest.approx([middle - half, middle + half], abs=1e-12)


def test_a_curve_that_comes_near_to_zero_has_no_root() -> None:
    assert roots(lambda x: (x - 0.1234) ** 2 + 1e-12, GRID) == []


def test_a_curve_that_touches_zero_at_a_grid_point_has_one_root_of_one_sign() -> None:
    assert roots(lambda x: -x * x, [-1.0, 0.0, 1.0]) == [Root(0.0, -1, -1)]


def test_a_curve_that_touches_zero_between_grid_points_has_at_most_one_root() -> None:
    assert roots(lambda x: (x - 0.125) ** 2, [-1.0, 1.0]) == [Root(0.125, 1, 1)]
    assert len(roots(lambda x: (x - 0.1234) ** 2, GRID)) <= 1


def test_a_stretch_of_zeros_and_of_nan_holds_no_root() -> None:
    assert roots(lambda _: 0.0, GRID) == []
    assert roots(lambda x: max(x, 0.0), GRID) == []
    assert roots(lambda x: max(x - 0.2, 0.0) + min(x + 0.2, 0.0), GRID) == []
    assert roots(lambda x: math.nan if x < 0.0 else x - 0.333, GRID)[0].x == pytest.approx(0.333, rel=1e-15)
    assert roots(lambda _: math.nan, GRID) == []


def test_a_root_that_rounding_makes_a_short_stretch_of_zeros_is_one_root() -> None:
    fine = sorted({*GRID, *(sign * k * 1e-18 for sign in (-1, 1) for k in range(1, 100))})
    (root,) = roots(lambda x: (1.0 + x) - 1.0, fine)
    assert abs(root.x) < 1e-16
    assert (root.before, root.after) == (-1, 1)


def test_a_root_at_an_end_of_the_grid_knows_one_side() -> None:
    assert roots(lambda x: 1.0 - x, GRID) == [Root(1.0, 1, 0)]
    assert roots(lambda x: 1.0 + x, GRID) == [Root(-1.0, 0, 1)]


def test_bisection_ends_between_neighbouring_numbers() -> None:
    root = bisect(lambda x: x * x - 2.0, 1.0, 2.0)
    assert abs(root - math.sqrt(2.0)) <= math.ulp(1.5)
