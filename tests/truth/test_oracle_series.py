import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.oracle.series import ORDER, first_fall, horner, motion_series

NO_CONTACT = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0])


@given(
    st.lists(st.integers(1, 400), min_size=1, max_size=6, unique=True),
    st.lists(st.tuples(st.integers(-100, 500), st.integers(5, 100)), max_size=3),
    st.integers(50, 450),
)
def test_the_first_fall_is_the_smallest_root(
    roots: list[int], pairs: list[tuple[int, int]], theta: int
) -> None:
    real = sorted(root / 100.0 for root in roots)
    every = [*real, *(complex(a, b) / 100.0 for a, b in pairs), *(complex(a, -b) / 100.0 for a, b in pairs)]
    c = np.polynomial.polynomial.polyfromroots(every).real
    c *= np.sign(c[0])
    found = first_fall(c, theta / 100.0)
    if real[0] < theta / 100.0:
        assert found == pytest.approx(real[0], abs=1e-6)
    elif real[0] > theta / 100.0:
        assert found is None


@pytest.mark.parametrize("half_width", [1e-3, 1e-5, 1e-7])
def test_two_crossings_close_together_are_found(half_width: float) -> None:
    c = np.array([0.25 - half_width**2, -1.0, 1.0])
    assert first_fall(c, 1.0) == pytest.approx(0.5 - half_width, abs=1e-8 * half_width + 1e-16 / half_width)
    assert first_fall(np.array([0.25 + half_width**2, -1.0, 1.0]), 1.0) is None


def test_a_start_on_the_switch() -> None:
    assert first_fall(np.array([0.0, 1.0, -2.0]), 1.0) == pytest.approx(0.5, rel=1e-15)
    assert first_fall(np.array([0.0, -1.0, 5.0]), 1.0) == 0.0
    assert first_fall(np.array([0.0, 0.0, 1.0]), 1.0) is None
    assert first_fall(np.zeros(4), 1.0) is None
    # A touch is no fall.
    assert first_fall(np.array([0.25, -1.0, 1.0]), 1.0) is None


def test_a_table_cell_moves_as_its_polynomial_says() -> None:
    """A force linear in x, as a cell of a table, is the oscillator cos(omega t)."""
    mass, stiffness, x0 = 2.0, 50.0, 0.3
    cell = np.zeros(18)
    cell[0], cell[1] = 0.1, 0.2
    # -stiffness x + 3 i about (0.1, 0.2), with i = 0 in the end.
    cell[2] = -stiffness * 0.1 + 3.0 * 0.2
    cell[3], cell[6] = 3.0, -stiffness
    y, v = np.zeros(ORDER + 1), np.zeros(ORDER + 1)
    y[0] = x0
    drive = np.zeros(ORDER + 1)
    motion_series()(0.1, 0.0, drive, True, mass, 2, cell, np.zeros(4), 0.0, NO_CONTACT, y, v)
    omega = (stiffness / mass) ** 0.5
    for s in (0.5, 1.0, 3.0):
        assert horner(y, s) == pytest.approx(x0 * np.cos(omega * 0.1 * s), rel=1e-14)
        assert horner(v, s) == pytest.approx(-x0 * omega * np.sin(omega * 0.1 * s), rel=1e-14)
