"""Current profiles from which searches start: closed forms, and local optimisation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from printhammer.control.least_work.search import (
    LANDING_SHARES,
    PRINTING_SHARES,
    landing_profile,
    printing_profile,
    refined,
)

DURATION, ARRIVAL, NODES = 1e-3, 8e-4, 20


@given(arrays(float, (3, PRINTING_SHARES), elements=st.floats(0.0, 1.0)))
def test_a_printing_profile_is_the_mean_of_its_levels_over_each_step(shares: np.ndarray) -> None:
    found = printing_profile(shares, 2.0, DURATION, ARRIVAL, NODES)
    assert found.shape == (3, NODES)
    fine = (np.arange(NODES * 500) + 0.5) * DURATION / (NODES * 500)
    for row, (brake, wait, throw, until, held) in enumerate(shares.tolist()):
        released = 0.5 * ARRIVAL * until
        thrown = released + held * (ARRIVAL - released)
        current = np.where(
            fine < released, 2.0 * brake, np.where(fine < thrown, 1.2 * wait, 0.6 + 1.4 * throw)
        )
        assert found[row] == pytest.approx(current.reshape(NODES, 500).mean(axis=1), abs=2.0 * 2.0 / 500)


def test_a_landing_profile_ends_without_current() -> None:
    shares = np.array([[0.5, 0.25, 0.5, 0.5], [0.0, 1.0, 1.0, 1.0]])
    assert shares.shape[1] == LANDING_SHARES
    found = landing_profile(shares, 2.0, DURATION, NODES)
    assert found.shape == (2, NODES - 1)
    # Caught at 0.35 and landed at 0.675 of the slot, the second of them in the middle of a step
    assert found[0] == pytest.approx([0.9] * 7 + [0.5] * 6 + [0.25] + [0.0] * 5)
    assert found[1] == pytest.approx([-0.2] * 14 + [2.0] * 5)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_best_profiles_come_to_what_is_best(first: float, second: float) -> None:
    wanted = np.array([first, second, 0.5, 0.5])
    found, bad = refined(lambda shares: shares, lambda rows: ((rows - wanted) ** 2).sum(axis=1), 4)
    assert found.min() >= 0.0
    assert found.max() <= 1.0
    assert bad == pytest.approx(((found - wanted) ** 2).sum(axis=1))
    assert np.sqrt(bad.min()) < 0.02
