"""Recurrence plots counted by hand, and by an independent count."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import strobes
from printhammer.chaos.exponents.recurrence import MOST, counted, recurrence, run_lengths


def test_a_cycle_of_three() -> None:
    # Twelve states: the lines parallel to the main diagonal begin 3, 6 and 9 places off it.
    found = recurrence(np.tile([0.0, 1.0, 2.0], 4), threshold=0.5)
    assert found.rate == (9 + 6 + 3) / 66
    assert found.determinism == 1.0
    assert found.longest_diagonal == 9
    assert found.mean_diagonal == 6.0
    assert found.entropy == pytest.approx(math.log(3.0))
    assert found.laminarity == 0.0
    assert math.isnan(found.trapping)
    assert found.longest_vertical == 0


def test_a_motion_that_stays() -> None:
    # Two states of rest, three points each: two squares of three.
    found = recurrence([0.0, 0.0, 0.0, 5.0, 5.0, 5.0], threshold=1.0)
    # Above the diagonal: a line of two and a single point in either square.
    assert found.rate == 6 / 15
    assert found.determinism == 4 / 6
    assert found.longest_diagonal == 2
    assert found.entropy == 0.0
    assert found.laminarity == 1.0
    assert found.trapping == 3.0
    assert found.longest_vertical == 3


def test_a_matrix_by_hand() -> None:
    upper = np.zeros((5, 5), bool)
    for i, j in ((0, 1), (1, 2), (2, 3), (0, 4), (0, 2)):
        upper[i, j] = True
    matrix = upper | upper.T | np.eye(5, dtype=bool)
    found = counted(matrix, 0.1, 1, 2)
    assert found.rate == 5 / 10
    assert found.determinism == 3 / 5
    assert found.longest_diagonal == 3
    # Columns, from the first to the last row: 11101, 1110, 1111, .. 11, 1...1.
    assert found.laminarity == (3 + 3 + 4 + 2) / 15
    assert found.trapping == (3 + 3 + 4 + 2) / 4
    longer = counted(matrix, 0.1, 1, 4)
    assert longer.determinism == 0.0
    assert longer.laminarity == 4 / 15
    apart = counted(matrix, 0.1, 2, 2)
    assert apart.rate == 2 / 6
    assert apart.determinism == 0.0


def test_unrelated_states_and_equal_ones() -> None:
    lonely = recurrence(np.arange(10.0), threshold=0.5)
    assert lonely.rate == 0.0
    assert math.isnan(lonely.determinism)
    equal = recurrence(np.zeros(10), threshold=0.0)
    assert equal.rate == equal.laminarity == 1.0
    # In the corner lies a diagonal of one point, which is no line.
    assert equal.determinism == 44 / 45
    assert equal.longest_diagonal == 9


def test_lengths_of_rows() -> None:
    rows = np.array([1, 1, 0, 1, 0, 0, 1, 1, 1], dtype=bool)
    assert run_lengths(rows).tolist() == [2, 1, 3]
    assert run_lengths(~rows).tolist() == [1, 2]
    assert run_lengths(np.zeros(4, bool)).size == 0


@given(st.integers(2, 14), st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 4))
def test_against_a_count_point_by_point(count: int, seed: int, theiler: int, shortest: int) -> None:
    theiler = min(theiler, count - 1)
    states = np.random.default_rng(seed).uniform(size=(count, 2))
    found = recurrence(states, threshold=0.3, theiler=theiler, shortest=shortest)

    def near(i: int, j: int) -> bool:
        return max(abs(states[i, 0] - states[j, 0]), abs(states[i, 1] - states[j, 1])) <= 0.3

    lines = []
    for lag in range(theiler, count):
        length = 0
        for i in range(count - lag + 1):
            if i < count - lag and near(i, i + lag):
                length += 1
            elif length:
                lines.append(length)
                length = 0
    pairs = sum(count - lag for lag in range(theiler, count))
    assert found.rate == pytest.approx(sum(lines) / pairs)
    long = [line for line in lines if line >= shortest]
    assert found.longest_diagonal == max(long, default=0)
    if lines:
        assert found.determinism == pytest.approx(sum(long) / sum(lines))
    np.testing.assert_array_equal(found.matrix, [[near(i, j) for j in range(count)] for i in range(count)])


@pytest.mark.parametrize("rate", [0.01, 0.1, 0.5, 1.0])
def test_a_rate_gives_a_threshold(rate: float) -> None:
    states = np.random.default_rng(1).standard_normal((200, 2))
    found = recurrence(states, rate=rate)
    pairs = 200 * 199 // 2
    assert found.rate == math.ceil(rate * pairs) / pairs
    assert recurrence(states, threshold=found.threshold).rate == found.rate


def test_scales_are_units() -> None:
    states = np.random.default_rng(2).standard_normal((60, 2))
    one = recurrence(states, threshold=0.2)
    other = recurrence(states * [1e-6, 100.0], threshold=0.2, scales=[1e-6, 100.0])
    np.testing.assert_array_equal(one.matrix, other.matrix)


def test_points_of_trains(hammer: "ph.Hammer") -> None:
    # So slow that the armature is at rest before each firing; and so fast that it is not.
    settled, early = strobes(hammer, ["6 ms", "1.3 ms"], points=60, verdict=False)
    found = recurrence(settled)
    assert found.rate == found.laminarity == 1.0
    assert recurrence(early).rate < 1.0
    chart = found.to_dataset()
    assert chart.attrs["determinism"] == found.determinism
    assert chart["recurs"].shape == (60, 60)


def test_a_run_that_stopped_is_refused(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "250 um")
    (points,) = strobes(short, ["1 ms"], points=20, verdict=False)
    with refused("states"):
        recurrence(points)


@pytest.mark.parametrize(
    ("states", "options", "key"),
    [
        ([1.0], {}, "states"),
        (np.zeros(MOST + 1), {}, "states"),
        (np.zeros((4, 2, 2)), {}, "states"),
        ([0.0, math.nan], {}, "states"),
        (["a", "b"], {}, "states"),
        ([0.0, 1.0], {"threshold": 1.0, "rate": 0.1}, "threshold"),
        ([0.0, 1.0], {"threshold": -1.0}, "threshold"),
        ([0.0, 1.0], {"rate": 0.0}, "rate"),
        ([0.0, 1.0], {"rate": 1.5}, "rate"),
        ([0.0, 1.0], {"scales": [1.0, 2.0]}, "scales"),
        ([0.0, 1.0], {"scales": [0.0]}, "scales"),
        ([0.0, 1.0], {"theiler": 2}, "theiler"),
        ([0.0, 1.0], {"shortest": 0}, "shortest"),
    ],
)
def test_bad_input(states: object, options: dict[str, object], key: str) -> None:
    with refused(key):
        recurrence(states, **options)
