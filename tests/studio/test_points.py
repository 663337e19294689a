"""Where the points of a curve lie."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from printhammer.studio.pictures.engine import POINTS, points_of

STEPS = st.lists(st.floats(1e-9, 1e-3), min_size=1, max_size=60)


@given(STEPS)
def test_the_ends_of_all_steps_are_among_them_and_no_gap_is_wide(steps: list[float]) -> None:
    ends = np.concatenate([[0.0], np.cumsum(steps)])
    times = points_of(ends)
    assert np.isin(ends, times).all()
    assert (np.diff(times) >= 0.0).all()
    assert np.diff(times).max() <= 1.000001 * ends[-1] / POINTS
    assert POINTS <= len(times) <= POINTS + 4 * len(steps) + 1


def test_each_step_has_points_inside() -> None:
    ends = np.array([0.0, 1e-3, 1.000001e-3, 2e-3])
    times = points_of(ends)
    assert ((times > ends[1]) & (times < ends[2])).sum() == 2
