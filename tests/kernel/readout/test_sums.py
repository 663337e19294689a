"""Column sums equal those of the standard library and of NumPy, bit for bit."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from printhammer.kernel.readout.sums import PARTIALS, exact_sum, pairwise_sum

NUMBERS = st.floats(-1e12, 1e12)


@given(arrays.arrays(np.float64, st.tuples(st.integers(0, 400), st.just(2)), elements=NUMBERS))
def test_an_exact_sum_is_rounded_once(table: np.ndarray) -> None:
    assert exact_sum(table, 1, np.empty(PARTIALS)) == math.fsum(table[:, 1])


@given(st.integers(0, 2000), st.integers(0, 9), st.integers(0, 2**32 - 1))
def test_a_pairwise_sum_adds_in_the_order_of_numpy(count: int, first: int, seed: int) -> None:
    table = np.random.default_rng(seed).normal(size=(first + count, 3)) ** 5
    assert pairwise_sum(table, first, count, 2, np.empty(PARTIALS)) == table[first:, 2].sum()
