"""Data of one run of the closed loop, and the resulting currents."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.control.feedback.controller import _current, _steps
from printhammer.control.feedback.plant import (
    APART,
    FRONT_ERROR,
    REMEMBERED,
    SCALE_ERROR,
    Driver,
    Learned,
    Loop,
    Pulse,
)

DRIVER = Driver(2.0, 6e-6)
LEVELS = st.sampled_from([-2.0, -0.8, 0.0, 2.0])
SWITCHINGS = st.lists(st.tuples(st.floats(-2e-4, 4e-4), LEVELS), min_size=1, max_size=6)


def loop_of(*pulses: Pulse) -> Loop:
    return Loop((0, 2, 3), np.array([1e-3, 3e-3, 4e-3]), 7, np.zeros(4), list(pulses))


def pulse_of(fired: float, switchings: list[tuple[float, float]]) -> Pulse:
    pulse = Pulse(fired)
    pulse.switch(fired, DRIVER.current)
    for after, level in switchings:
        pulse.switch(fired + after, level)
    return pulse


@given(SWITCHINGS)
def test_switchings_ascend_whatever_is_asked_for(switchings: list[tuple[float, float]]) -> None:
    pulse = pulse_of(1e-3, switchings)
    assert len(pulse.at) == len(pulse.levels) == 1 + len(switchings)
    assert (np.diff(pulse.at) >= 0.99 * APART).all()
    for (after, level), at, kept in zip(switchings, pulse.at[1:], pulse.levels[1:], strict=True):
        assert kept == level
        assert at >= 1e-3 + after


@given(st.lists(SWITCHINGS, min_size=1, max_size=6))
def test_the_current_that_is_reckoned_with_is_that_of_the_drive(
    pulses: list[list[tuple[float, float]]],
) -> None:
    """The current of each pulse approaches its levels exponentially; currents of several pulses add up."""
    made, fired = [], 1e-3
    for switchings in pulses:
        # A pulse ends without a current before the next one.
        made.append(pulse_of(fired, [*switchings, (6e-4, 0.0)]))
        fired += 1e-3
    loops = [loop_of(*made), loop_of(made[0])]
    times = np.linspace(1e-3, fired + 5e-4, 301)
    reckoned = _current(*_steps(loops), DRIVER.edge, np.broadcast_to(times, (2, 301)))
    exact = loops[0].drive(DRIVER.edge).value(times)
    # Of pulses before the latest ones nothing is left.
    known = times > made[-min(REMEMBERED, len(made))].fired
    np.testing.assert_allclose(reckoned[0, known], exact[known], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(
        loops[0].recent(DRIVER).value(times)[known], exact[known], rtol=0.0, atol=1e-12
    )
    np.testing.assert_allclose(reckoned[1], loops[1].drive(DRIVER.edge).value(times), rtol=0.0, atol=1e-8)
    # The driver does not exceed its largest current.
    assert np.abs(exact).max() <= DRIVER.current * (1.0 + 1e-12)
    assert loops[0].drive(DRIVER.edge).peak <= DRIVER.current * (1.0 + 1e-12)
    assert loops[0].recent(DRIVER).largest_pulse == DRIVER.current


def test_a_push_is_the_answer_of_a_first_order_driver() -> None:
    width = 5e-5
    drive = DRIVER.drive([DRIVER.push(width)], [2e-4])
    t = np.linspace(0.0, 2e-4, 101)
    rises = 2.0 * -np.expm1(-t / DRIVER.edge)
    fades = 2.0 * -np.expm1(-width / DRIVER.edge) * np.exp(-(t - width) / DRIVER.edge)
    np.testing.assert_allclose(drive.value(2e-4 + t), np.where(t < width, rises, fades), atol=1e-12)


def test_waits_between_dots() -> None:
    loop = loop_of()
    assert [loop.wait(dot) for dot in range(3)] == [pytest.approx(2e-3), pytest.approx(1e-3), np.inf]


@given(
    st.lists(st.tuples(st.booleans(), st.floats(-0.5, 0.5), st.floats(-1e-4, 1e-2)) | st.none(), max_size=20)
)
def test_what_is_learned_stays_within_what_is_possible(news: list[tuple[bool, float, float] | None]) -> None:
    learned = Learned()
    for each in news:
        if each is None:
            known = np.array([learned.front_error, learned.scale_error])
            learned.drift()
            wider = np.minimum(np.hypot(known, 0.002), [FRONT_ERROR, SCALE_ERROR])
            assert [learned.front_error, learned.scale_error] == pytest.approx(wider)
            continue
        front, mean, variance = each
        before = learned.front, learned.front_error, learned.scale, learned.scale_error
        (learned.take_front if front else learned.take_scale)(mean, variance)
        limit = 5.0 * (FRONT_ERROR if front else SCALE_ERROR)
        after = learned.front, learned.front_error, learned.scale, learned.scale_error
        if abs(mean) > limit or variance <= 0.0:
            assert after == before
        else:
            own = (mean, np.sqrt(variance))
            assert after == ((*own, *before[2:]) if front else (*before[:2], *own))
        assert abs(learned.front) <= 5.0 * FRONT_ERROR
        assert abs(learned.scale) <= 5.0 * SCALE_ERROR


def test_doubt_grows_like_a_random_walk_up_to_what_it_was() -> None:
    learned = Learned(front_error=0.003, scale_error=0.004)
    for count in range(1, 1000):
        learned.drift()
        walked = np.sqrt(np.array([0.003, 0.004]) ** 2 + count * 0.002**2)
        expected = np.minimum(walked, [FRONT_ERROR, SCALE_ERROR])
        assert [learned.front_error, learned.scale_error] == pytest.approx(expected, rel=1e-9)
