"""The closed loop with a coarse controller: properties that hold for any tables, hammer and noise."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests import hammers
from tests.control.feedback import coarse

import printhammer as ph
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import FRONT_ERROR, SCALE_ERROR, Driver, Loop
from printhammer.control.feedback.sensor import PositionSensor
from printhammer.printing.rates.variability import Perturbation, perturbed

PERFECT = PositionSensor(noise=0.0, step=0.0)
RATE = 1300.0
PATTERNS = st.sets(st.integers(0, 5), min_size=1, max_size=4).map(lambda slots: tuple(sorted(slots)))


def loops(
    patterns: list[tuple[int, ...]],
    sensor: PositionSensor = PERFECT,
    by: Perturbation | None = None,
    rate: float = RATE,
) -> tuple[ph.Hammer, list[Loop]]:
    """The driven hammer, and the runs of the closed loop with it."""
    hammer = coarse.plant().hammer
    driven = hammer if by is None else perturbed(hammer, by)
    return driven, FeedbackStrategy(coarse.controller(), sensor, threads=1).loops(driven, patterns, rate)


@settings(max_examples=15, deadline=None)
@example((0, 1, 2), 2290.0, 0.0, 0.0, 0.0, 0)  # No throw that is decided anew comes in time.
@given(
    PATTERNS,
    st.floats(600.0, 2400.0),
    st.floats(-0.4, 0.4),
    st.floats(-4e-5, 6e-5),
    st.floats(0.0, 0.2),
    st.integers(0, 1000),
)
def test_the_driver_keeps_its_limits(
    slots: tuple[int, ...], rate: float, current: float, travel: float, noise: float, seed: int
) -> None:
    """Also for a hammer far from nominal, with a noisy sensor and large currents."""
    by = Perturbation(current=current, travel=travel)
    driver = coarse.controller().driver
    _, (loop,) = loops([slots], PositionSensor(noise=noise, seed=seed), by, rate)
    drive = loop.drive(driver.edge)
    assert np.isfinite(loop.touches).all()
    assert len(drive.times) == len(slots)
    assert (np.diff(drive.times) > 0.0).all()
    assert drive.peak <= driver.current * (1.0 + 1e-12)
    for pulse in loop.pulses:
        assert np.abs(pulse.levels).max() <= driver.current
        assert (np.diff(pulse.at) > 0.0).all()
        assert pulse.levels[-1] == 0.0
    assert 0.0 <= loop.learned.front_error <= FRONT_ERROR
    assert 0.0 <= loop.learned.scale_error <= SCALE_ERROR


@pytest.mark.parametrize("travel", [0.0, -8e-6])
def test_what_is_seen_is_what_the_whole_drive_does(travel: float) -> None:
    patterns = [(0,), (0, 1, 2), (0, 4), (1, 3, 4)]
    driven, runs = loops(patterns, by=Perturbation(travel=travel) if travel else None)
    for loop in runs:
        drive = loop.drive(coarse.controller().driver.edge)
        motion = ph.simulate(driven, drive, duration=float(loop.due[-1]) + 2e-3)
        assert len(loop.seen) == len(loop.touches) == len(loop.due)
        for number, (times, shown) in enumerate(loop.seen):
            assert motion.at(times)[0] == pytest.approx(shown, abs=1e-7)
            # A decision knows no sample that is not in by then.
            decided = loop.touches[number][0]
            assert times.max() < decided - PERFECT.delay


def test_a_perfect_sensor_tells_first_touches() -> None:
    driven, runs = loops([(0,), (2,), (0, 4)])
    for loop in runs:
        drive = loop.drive(coarse.controller().driver.edge)
        motion = ph.simulate(driven, drive, duration=float(loop.due[-1]) + 2e-3)
        touch = next(contact for contact in motion.contacts if contact.surface == "pack")
        assert loop.touches[0][0] == pytest.approx(touch.t_in, abs=1e-6)
        assert loop.touches[0][1] == pytest.approx(touch.v_in, rel=0.02)


@pytest.mark.parametrize(
    ("current", "travel"), [(0.0, 8e-6), (0.0, -8e-6), (-0.03, 0.0), (0.03, 0.0), (-0.02, 8e-6)]
)
def test_front_and_supply_are_learned(current: float, travel: float) -> None:
    """Independent of the printed dots: learning needs touches, not good dots."""
    patterns = list(itertools.combinations(range(7), 4))[:12]
    _, runs = loops(patterns, PositionSensor(), Perturbation(current=current, travel=travel))
    for loop in runs:
        known, stroke = loop.learned, coarse.plant().stroke
        assert known.front * stroke == pytest.approx(travel, abs=1e-6)
        # As far off as is said, and far better known than before the first dot.
        assert abs(known.front - travel / stroke) < 3.0 * known.front_error
        assert abs(known.scale - current) < 3.0 * known.scale_error
        assert known.front_error < 0.1 * FRONT_ERROR
        assert known.scale_error < 0.5 * SCALE_ERROR


def test_of_the_nominal_hammer_nothing_else_is_learned() -> None:
    """Errors in units of the reported standard deviations have a mean square of at most 1."""
    _, runs = loops(list(itertools.combinations(range(7), 4))[:24], PositionSensor())
    learned = [loop.learned for loop in runs]
    for off in (
        np.array([each.front / each.front_error for each in learned]),
        np.array([each.scale / each.scale_error for each in learned]),
    ):
        assert np.mean(off**2) < 1.0
        # The mean is that of 24 runs, whose noises differ.
        assert abs(off.mean()) < 4.0 / np.sqrt(24.0)


def test_doubts_about_the_front_shrink_from_dot_to_dot() -> None:
    by = Perturbation(travel=8e-6)
    patterns = [(0,), (0, 3), (0, 3, 6, 9)]
    ends = [loop.learned for loop in loops(patterns, PositionSensor(), by)[1]]
    doubts = [each.front_error for each in ends]
    # A front is learned from contacts, and the last one is not looked at.
    assert doubts[0] == FRONT_ERROR
    assert doubts[0] > doubts[1] > doubts[2]
    assert all(each.scale_error < 0.5 * SCALE_ERROR for each in ends)


def test_drives_do_not_depend_on_company_or_threads() -> None:
    patterns = [(0, 1, 2), (0,), (0, 4)]
    controller = coarse.controller()
    together = FeedbackStrategy(controller, PositionSensor(), threads=2)(controller.hammer, patterns, RATE)
    for pattern, drive in zip(patterns, together, strict=True):
        alone = FeedbackStrategy(controller, PositionSensor(), threads=1)(controller.hammer, [pattern], RATE)
        assert alone == [drive]
    assert FeedbackStrategy(controller, PositionSensor())(controller.hammer, [], RATE) == []


def test_a_hammer_that_takes_turns_with_itself_is_the_same() -> None:
    controller = coarse.controller()
    hammer, slots = controller.hammer, (0, 1, 4)
    own = FeedbackStrategy(controller, PositionSensor(), threads=1)
    (plain,) = own(hammer, [slots], RATE)
    (same,) = own.along((hammer,) * 5)(hammer, [slots], RATE)
    # Where hammers take turns steps begin anew.
    assert same.times == pytest.approx(plain.times, abs=1e-7)
    (loop,) = own.along(ph.Paper(front=8e-6, seed=3).hammers(hammer, 5, 4e-4)).loops(hammer, [slots], RATE)
    assert loop.alive
    assert loop.drive(controller.driver.edge).times[0] == plain.times[0]


def test_hammers_that_cannot_be_driven_are_refused() -> None:
    driver = Driver(2.0, 5e-6)
    for missing, parts in (
        ("backstop", {"spring": hammers.preload(-4.0), "pack": hammers.power()}),
        ("pack", {"spring": hammers.preload(-4.0), "backstop": hammers.hertz()}),
    ):
        with pytest.raises(ph.InputError, match=f"the hammer has no {missing}: expected one"):
            Controller(hammers.made_of(**parts), driver)
