"""Tests of members that leave the lanes because their steps make no progress."""

import numpy as np
import pytest

from printhammer.kernel.lanes import layout
from printhammer.kernel.lanes.steps import settle

TIME = 1e-3
MOST_STEPS = 5e7


def stuck(steps: float, length: float, ratio: float = 0.5) -> bool:
    """Whether a member leaves after a step of given length, s, at `TIME`; `ratio` < 1 means accepted."""
    pool = np.zeros(layout.POOL_SIZE)
    for row, value in enumerate((1e-4, 1.0, 1e-9)):
        pool[(layout.CONTROL + row) * layout.BLOCK] = value
    pool[layout.STEPS * layout.BLOCK] = steps
    pool[layout.MOST_STEPS * layout.BLOCK] = MOST_STEPS
    good = ratio <= 1.0
    start, end = (TIME, 0.0, 0.0, 0.0), (TIME + length, 0.0, 0.0, 0.0)
    settle(pool, 0, start, length, end, ratio, good, False, False)
    return bool(pool[layout.EVENT * layout.BLOCK] == layout.STUCK)


@pytest.mark.parametrize(
    ("steps", "length", "leaves"),
    [
        (1e3, 1e-6, False),
        (1e6, 1e-6, False),
        (1e3, 1e-17, False),
        (0.9 * layout.MANY_STEPS, 1e-17, False),
        (1.1 * layout.MANY_STEPS, 1e-17, True),
        (1.1 * layout.MANY_STEPS, 1e-13, False),
        (1.1 * MOST_STEPS, 1e-6, True),
    ],
)
def test_a_member_leaves_after_many_short_steps_or_too_many(
    steps: float, length: float, leaves: bool
) -> None:
    assert stuck(steps, length) == leaves


def test_a_step_that_fails_and_cannot_be_shorter_ends_the_lanes_at_once() -> None:
    assert stuck(1.0, 1e-18, ratio=1e9)
    assert not stuck(1.0, 1e-9, ratio=1e9)
