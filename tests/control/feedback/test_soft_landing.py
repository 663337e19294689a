"""Soft landings and launches against single runs."""

import numpy as np
import pytest
from tests.control.feedback import coarse

import printhammer as ph
from printhammer.control.feedback.impact_map import AHEAD, PUSHED
from printhammer.control.feedback.plant import Driver, Plant
from printhammer.control.feedback.soft_landing import Landing, launch, soft_landing
from printhammer.drive.waveforms.shapes import Switched
from printhammer.hammer.equilibrium import rest_state
from printhammer.printing.dots.nominal import nominal


@pytest.fixture(scope="module")
def landing() -> Landing:
    """With the usual resolution of brake pulses, for few touches."""
    return soft_landing(coarse.plant(), coarse.tables()[0])


def touch_down(motion: ph.Motion) -> float:
    """Speed of the first touch of the backstop after the pack, m/s."""
    return next(abs(each.v_in) for each in motion.contacts if each.surface == "backstop")


def motion_of(row: int, release: float, brake: float, width: float) -> ph.Motion:
    """Touch, push, release, brake and final release, as a single run from just before a touch."""
    forces, _, _ = coarse.tables()
    plant = coarse.plant()
    largest = plant.driver.current
    before = largest if forces.kind[row] == PUSHED else 0.0
    released = AHEAD + max(release, AHEAD)
    at = (0.0, AHEAD, released, AHEAD + brake, AHEAD + brake + width)
    levels = (before, largest if release > 0.0 else 0.0, 0.0, largest, 0.0)
    pulse = Switched(at=at, levels=levels, edge=plant.driver.edge, initial=before)
    speed = float(forces.speed[row])
    state = (plant.front - AHEAD * speed, speed)
    return ph.simulate(
        plant.hammer,
        ph.PulseSequence([pulse], at=[0.0]),
        duration=AHEAD + 3.4 * plant.single.flight_time,
        state=state,
    )


def remains(motion: ph.Motion) -> float:
    """Largest speed late in a run, or distance from rest divided by a third of a flight time, m/s."""
    scale = coarse.plant().single.flight_time
    x, v = motion.at(AHEAD + np.linspace(2.2, 3.4, 16) * scale)[:2]
    rest = rest_state(coarse.plant().hammer)
    return float(np.maximum(np.abs(v), np.abs(x - rest) / (scale / 3.0)).max())


def test_a_landing_leaves_what_it_says(landing: Landing) -> None:
    rows = np.flatnonzero(np.isfinite(landing.left))
    assert rows.size > 2
    for row in rows.tolist():
        motion = motion_of(row, *(float(a[row]) for a in (landing.release, landing.brake, landing.width)))
        assert remains(motion) == pytest.approx(landing.left[row], rel=1e-2)
        force = motion.dots[0].peak_force / coarse.plant().single.force
        if landing.release[row] == 0.0:
            assert force == pytest.approx(landing.force[row], rel=1e-5)
        assert [contact.surface for contact in motion.contacts].count("pack") == 1
        # It lands an order of magnitude slower than without a brake, and all but stays there.
        free = motion_of(row, float(landing.release[row]), coarse.plant().single.flight_time, 1e-9)
        assert touch_down(motion) < 0.1 * touch_down(free)
        assert landing.left[row] < 0.1 * remains(free)


def test_a_landing_is_the_best_of_its_grid() -> None:
    forces, _, _ = coarse.tables()
    with coarse.patched(coarse.GRIDS):
        landing = soft_landing(coarse.plant(), forces)
    scale = coarse.plant().single.flight_time
    for row in np.flatnonzero(np.isfinite(landing.left)).tolist():
        release = float(landing.release[row])
        tried = np.array(
            [
                [remains(motion_of(row, release, begin * scale, width * scale)) for width in coarse.WIDTHS]
                for begin in coarse.STARTS
            ]
        )
        # The finer grids contain the best of the first one, and move it by less than they are wide.
        assert landing.left[row] <= tried.min() * (1.0 + 1e-2)
        begin, width = (int(k) for k in np.unravel_index(np.argmin(tried), tried.shape))
        assert abs(landing.brake[row] / scale - coarse.STARTS[begin]) <= 0.047 * (1.0 + 1e-9)
        assert abs(landing.width[row] / scale - coarse.WIDTHS[width]) <= 0.047 * (1.0 + 1e-9)


def test_after_a_landing_the_armature_is_at_rest_soon(landing: Landing) -> None:
    scale = coarse.plant().single.flight_time
    known = np.isfinite(landing.brake)
    middle = np.median((landing.brake + landing.width)[known])
    assert landing.settled == pytest.approx(middle + 0.65 * scale, rel=1e-12)
    # Where the push cannot print the force there is no landing.
    forces, _, _ = coarse.tables()
    np.testing.assert_array_equal(np.isnan(landing.left), forces.force[:, forces.off].max(axis=1) < 1.0)


def test_a_launch_touches_when_and_as_fast_as_it_says() -> None:
    _, start, _ = coarse.tables()
    plant = coarse.plant()

    def launched(width: float, factor: float = 1.0) -> ph.Motion:
        pulse = Switched(at=(0.0, width), levels=(plant.driver.current, 0.0), edge=plant.driver.edge)
        return ph.simulate(plant.hammer, ph.PulseSequence([pulse.scaled(factor)], at=[0.0]), duration=1e-3)

    scale = plant.single.flight_time
    nodes = [launched(width).contacts for width in np.linspace(0.2, 1.0, 9) * scale]
    touches = [next(c for c in each if c.surface == "pack") for each in nodes if len(each) > 1]
    fastest = max(abs(touch.v_in) for touch in touches)
    assert start.speed < fastest
    exact = next(c for c in launched(start.width).contacts if c.surface == "pack")
    # Between widths that are a tenth of a flight time apart; the touch prints less than the single pulse.
    assert exact.v_in == pytest.approx(start.speed, rel=0.01)
    assert exact.t_in == pytest.approx(start.flight, rel=0.01)
    assert start.speed < plant.single.impact_speed
    # How it changes with the scale of the currents, from smaller differences.
    before = start.flight - AHEAD
    (x, v), (less, slower) = (
        np.array(launched(start.width, factor).at(np.array([before]))[:2])[:, 0] for factor in (1.0, 0.999)
    )
    assert start.place_slope == pytest.approx((x - less) / 1e-3, rel=0.1)
    assert start.speed_slope == pytest.approx((v - slower) / 1e-3, rel=0.1)


def test_a_driver_that_is_too_weak_is_refused() -> None:
    forces, _, _ = coarse.tables()
    plant = coarse.plant()
    weak = Plant(plant.hammer, Driver(0.6, plant.driver.edge), nominal(plant.hammer), 1)
    with coarse.patched(coarse.GRIDS), pytest.raises(ph.InputError, match=r"no push of 0\.6 A from rest"):
        launch(weak, forces)
