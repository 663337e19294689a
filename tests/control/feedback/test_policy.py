"""Unsafe actions of the policy: the next touch depends strongly on the speed of the present touch."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from printhammer.control.feedback.policy import Policy
from printhammer.printing.dots.judging import Limits

SPEEDS = np.linspace(0.6, 1.3, 15)

ROUNDING = 1e-20
"""Bound of a cost that is zero up to rounding."""


def doubts(*touches: Any) -> np.ndarray:
    """Costs of actions, by their next touches, s, at all speeds; shape (speeds, actions)."""
    policy = Policy.__new__(Policy)
    made: Any = policy
    made.table = SimpleNamespace(speed=SPEEDS, next_touch=np.column_stack(touches))
    made._rows = [np.arange(SPEEDS.size)]
    made.limits = Limits()
    return policy._doubts()


def test_a_way_that_does_not_depend_on_the_speed_costs_nothing() -> None:
    assert doubts(np.full(15, 7e-4)).max() < ROUNDING


def test_the_cost_grows_with_the_square_of_the_slope() -> None:
    gentle, steep = doubts(7e-4 - 1e-4 * SPEEDS, 7e-4 - 3e-4 * SPEEDS).T
    assert np.allclose(gentle, gentle[0])
    assert np.allclose(steep, 9.0 * gentle)


def test_beside_a_jump_a_way_is_as_unsafe_as_on_it() -> None:
    jump = np.where(np.arange(15) < 8, 7.2e-4, 6.9e-4)
    (found,) = doubts(jump).T
    # It lies between the eighth and the ninth speed, and counts two speeds to either side.
    assert (found > ROUNDING).tolist() == [6 <= place <= 9 for place in range(15)]
    assert np.ptp(found[6:10]) <= 1e-9 * found[7]


def test_where_no_touch_follows_nearby_a_way_is_unsafe() -> None:
    ends = np.full(15, 7e-4)
    ends[:4] = np.nan
    (found,) = doubts(ends).T
    assert (found[:5] > 1.0).all()
    assert (found[5:] < ROUNDING).all()
