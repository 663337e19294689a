"""A step of Newton's method for a dot, against a least-squares search."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from printhammer.control.table.ways import LONGEST_STEP, changes

FREE = np.array([1.0])

number = st.floats(-1.0, 1.0)
slope = st.floats(-2e5, 2e5)
deviation = st.floats(-1.0, 1.0)


def test_two_deviations_vanish() -> None:
    slopes = np.array([[[3e4, 1e4], [-2e4, 5e4]]])
    wanted = np.array([[4e-6, -7e-6]])
    found = changes(slopes, -(slopes @ wanted[:, :, np.newaxis])[:, :, 0], -FREE, FREE)
    assert found == pytest.approx(wanted, rel=0.001)


def test_a_direction_in_which_nothing_changes_is_left_alone() -> None:
    slopes = np.array([[[3e4, 0.0], [-2e4, 0.0]]])
    found = changes(slopes, np.array([[0.1, 0.2]]), -FREE, FREE)
    assert np.isfinite(found).all()
    assert found[0, 1] == 0.0


@given(
    st.lists(st.tuples(slope, slope, deviation), min_size=2, max_size=8),
    st.floats(0.0, LONGEST_STEP),
)
def test_no_other_change_is_better(rows: list[tuple[float, float, float]], room: float) -> None:
    *slopes, off = np.array(rows).T
    square = np.stack(slopes, axis=1)
    bound = np.array([room])
    found = changes(square[np.newaxis], off[np.newaxis], -bound, bound)[0]
    assert np.abs(found).max() <= LONGEST_STEP
    assert abs(found[1]) <= room * (1.0 + 1e-12)
    # Scaled to a step of 1; a little damping as in the source, which is part of what is least.
    scaled = np.vstack([square * LONGEST_STEP, 0.02 * np.eye(2)])
    right = -np.concatenate([off, np.zeros(2)])
    far = 1e6
    limits = ([-far, -max(room / LONGEST_STEP, 1e-9)], [far, max(room / LONGEST_STEP, 1e-9)])
    least = lsq_linear(scaled, right, bounds=limits, tol=1e-14)
    if np.abs(least.x).max() > 1.0:
        return

    def size(change: np.ndarray) -> float:
        return float(np.sum((scaled @ change - right) ** 2))

    # On its bound the step leaves the damping out.
    assert size(found / LONGEST_STEP) <= size(least.x) + 1e-3


@given(st.tuples(number, number, number, number), number, number)
def test_a_step_solves_two_equations_or_keeps_to_the_bounds(
    slopes: tuple[float, float, float, float], force: float, arrival: float
) -> None:
    # Deviations per 100 us, as they are in a table.
    matrix = np.array(slopes).reshape(1, 2, 2) * 1e4 + np.diag([2e4, 2e4])
    off = 0.1 * np.array([[force, arrival]])
    bound = np.array([3e-6])
    later, wider = changes(matrix, off, -bound, bound)[0]
    assert abs(wider) <= bound[0]
    exact = -np.linalg.solve(matrix[0], off[0])
    if abs(exact[1]) < 0.9 * bound[0]:
        assert np.allclose([later, wider], exact, rtol=0.05, atol=2e-7)
    elif abs(wider) == bound[0]:
        # The best firing time with that width: the deviation that is left has no part along it.
        left = off[0] + matrix[0] @ [later, wider]
        assert abs(matrix[0][:, 0] @ left) <= 1e-6 * np.linalg.norm(matrix[0][:, 0])
