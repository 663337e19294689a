"""Event search in one step: no crossing of the quintic is missed, and roots lie in their brackets."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from printhammer.kernel.methods.hermite import (
    MARGIN,
    control_points,
    position_root,
    rises_through,
    turns_down,
    velocity_root,
)
from printhammer.kernel.model.modes import NEAR_TOUCH, NO_SWITCH, REACHED_FRONT, UNRESOLVED

SAMPLES = np.linspace(0.0, 1.0, 2001)
NUMBER = st.floats(-10.0, 10.0).map(lambda value: round(value, 6))


def quintic(x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, h: float) -> np.ndarray:
    """Samples of the polynomial with these end values, from the Hermite basis instead of Bernstein's."""
    s = SAMPLES
    rows, ends = [], [x0, v0 * h, a0 * h * h, x1, v1 * h, a1 * h * h]
    for place in (0.0, 1.0):
        rows.append([place**k for k in range(6)])
        rows.append([k * place ** max(k - 1, 0) for k in range(6)])
        rows.append([k * (k - 1) * place ** max(k - 2, 0) for k in range(6)])
    return np.polynomial.Polynomial(np.linalg.solve(np.array(rows), ends))(s)


ENDS = st.tuples(NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, st.sampled_from([0.1, 1.0, 3.0]))


@settings(max_examples=400)
@given(ends=ENDS, gap=st.floats(0.0, 5.0))
def test_no_crossing_is_overlooked(ends: tuple[float, ...], gap: float) -> None:
    """From at or below the level: the result "no switch" means that no sample lies above the level."""
    assume(ends[1] != 0.0 or ends[2] != 0.0)
    level = ends[0] + gap
    code = rises_through(*ends, level)
    samples = quintic(*ends)
    size = np.ptp(samples) + abs(level) + 1.0
    if code == NO_SWITCH:
        assert samples.max() <= level + 1e-9 * size
    if code == REACHED_FRONT:
        assert ends[3] >= level
        # One crossing: once above, always above, but for the start itself.
        above = np.flatnonzero(samples[1:] > level + 1e-9 * size) + 1
        if above.size:
            assert (samples[above[0] :] > level - 1e-9 * size).all()
    if code == NEAR_TOUCH:
        assert ends[3] <= level
        rises = np.diff(samples) > 1e-12 * size
        assert np.count_nonzero(np.diff(rises.astype(int)) > 0) == 0, "one maximum only"


@settings(max_examples=300)
@given(ends=ENDS, share=st.floats(0.01, 0.99))
def test_the_root_of_a_rise_is_where_it_says(ends: tuple[float, ...], share: float) -> None:
    x0, x1 = sorted((ends[0], ends[3]))
    if x1 - x0 < 1e-3:
        return
    ends = (x0, *ends[1:3], x1, *ends[4:])
    level = x0 + share * (x1 - x0)
    if rises_through(*ends, level) != REACHED_FRONT:
        return
    root = position_root(*ends, level, 1.0)
    assert 0.0 < root <= 1.0
    samples = quintic(*ends)
    size = np.ptp(samples) + 1.0
    assert abs(np.interp(root, SAMPLES, samples) - level) < 1e-4 * size
    before, after = samples[root - 1e-3 > SAMPLES], samples[root + 1e-3 < SAMPLES]
    assert (before <= level + 1e-9 * size).all()
    assert (after >= level - 1e-9 * size).all()


@settings(max_examples=300)
@given(ends=ENDS)
def test_no_reversal_is_overlooked(ends: tuple[float, ...]) -> None:
    x0, v0, a0, x1, v1, a1, h = ends
    v0 = abs(v0)
    code = turns_down(x0, v0, a0, x1, v1, a1, h)
    samples = quintic(x0, v0, a0, x1, v1, a1, h)
    size = np.ptp(samples) + abs(h * v0) + 1.0
    falls = np.diff(samples) < -1e-9 * size
    if code == NO_SWITCH:
        assert not falls.any()
    elif code == REACHED_FRONT:
        assert v1 <= 0.0
    else:
        assert code == UNRESOLVED


@settings(max_examples=300)
@given(v0=st.floats(0.0, 10.0), a0=NUMBER, v1=st.floats(-10.0, 0.0), a1=NUMBER)
def test_the_root_of_a_velocity_lies_in_the_step(v0: float, a0: float, v1: float, a1: float) -> None:
    root = velocity_root(v0, a0, v1, a1, 1.0)
    assert 0.0 <= root <= 1.0
    c2, c3 = 3.0 * (v1 - v0) - 2.0 * a0 - a1, 2.0 * (v0 - v1) + a0 + a1
    size = abs(v0) + abs(v1) + abs(a0) + abs(a1) + 1.0
    value = v0 + root * (a0 + root * (c2 + root * c3))
    if v0 > 0.0 and v1 < 0.0:
        assert abs(value) < 1e-6 * size


@given(ends=ENDS)
def test_control_points_are_those_of_the_quintic(ends: tuple[float, ...]) -> None:
    """De Casteljau at one half gives the sample at one half."""
    points = np.array([ends[0], *control_points(*ends), ends[3]])
    while points.size > 1:
        points = 0.5 * (points[1:] + points[:-1])
    samples = quintic(*ends)
    size = np.abs(samples).max() + 100.0
    assert abs(points[0] - samples[1000]) < 1e-10 * size


def test_a_graze_within_the_margin_is_not_judged_by_the_quintic() -> None:
    """A parabola whose apex misses the level by less than the margin is delegated to the integrator."""
    for miss, code in ((0.5 * MARGIN, NEAR_TOUCH), (-0.5 * MARGIN, NEAR_TOUCH), (1.0, NO_SWITCH)):
        assert rises_through(-1.0, 2.0, -2.0, -1.0, -2.0, -2.0, 2.0, miss) == code
