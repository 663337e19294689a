import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.drive.segments import EXPONENTIAL, POLYNOMIAL, SINE, evaluate, largest, table

coefficients = st.floats(-5.0, 5.0)


@given(coefficients, coefficients, coefficients, coefficients, st.floats(0.1, 2.0))
def test_the_largest_value_of_a_cubic(p0: float, p1: float, p2: float, p3: float, end: float) -> None:
    cubic = table([(0.0, POLYNOMIAL, p0, p1, p2, p3)], end)
    s = np.linspace(0.0, end, 2001)
    sampled = np.abs(np.polyval([p3, p2, p1, p0], s)).max()
    assert sampled * (1.0 - 1e-12) <= largest(cubic) <= sampled + 1e-4


@given(coefficients, coefficients, st.floats(0.1, 20.0), st.floats(-4.0, 4.0), st.floats(0.1, 3.0))
def test_the_largest_value_of_a_sine(p0: float, p1: float, p2: float, p3: float, end: float) -> None:
    s = np.linspace(0.0, end, 5001)
    sampled = np.abs(p0 + p1 * np.sin(p2 * s + p3)).max()
    assert sampled * (1.0 - 1e-12) <= largest(table([(0.0, SINE, p0, p1, p2, p3)], end)) <= sampled + 1e-3


def test_the_largest_value_of_an_endless_segment() -> None:
    assert largest(table([(0.0, SINE, 1.0, -2.0, 3.0, 0.0)], math.inf)) == pytest.approx(3.0, rel=1e-15)
    assert largest(table([(0.0, EXPONENTIAL, 2.0, -2.0, 3.0, 0.0)], math.inf)) == 2.0
    assert largest(table([(0.0, POLYNOMIAL, -4.0, 0.0, 0.0, 0.0)], math.inf)) == 4.0


def test_a_table_begins_at_zero() -> None:
    late = table([(0.5, POLYNOMIAL, 1.0, 0.0, 0.0, 0.0)], 1.0)
    assert late[:, 0].tolist() == [0.0, 0.5, 1.0]
    assert evaluate(late, [0.0, 0.25, 0.5, 1.0]).tolist() == [0.0, 0.0, 1.0, 0.0]


@given(st.floats(0.0, 1e3), st.floats(1e-6, 1.0), st.floats(1e-6, 1.0))
def test_an_edge_lies_at_the_rounded_sum_of_firing_and_start(fired: float, on: float, more: float) -> None:
    step = table([(0.0, POLYNOMIAL, 1.0, 0, 0, 0), (on, POLYNOMIAL, 2.0, 0, 0, 0)], on + more)
    first, second, third = fired, fired + on, fired + (on + more)
    if first < second < third:
        edges = np.array([first, second, third])
        assert evaluate(step, edges, fired).tolist() == [1.0, 2.0, 0.0]
        assert evaluate(step, np.nextafter(edges, -np.inf), fired).tolist() == [0.0, 1.0, 2.0]


def test_times_and_firings_are_broadcast() -> None:
    ramp = table([(0.0, POLYNOMIAL, 0.0, 1.0, 0, 0)], 10.0)
    values = evaluate(ramp, np.array([[1.0], [2.0]]), np.array([0.0, 0.5, 3.0]))
    assert values.tolist() == [[1.0, 0.5, 0.0], [2.0, 1.5, 0.0]]
