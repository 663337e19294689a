"""The impact map against single runs, and its interpolation against functions that it reproduces exactly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.control.feedback import coarse

import printhammer as ph
from printhammer.control.feedback.impact_map import (
    AHEAD,
    ALWAYS,
    FORCES,
    FREE,
    PUSHED,
    ForceMap,
    bilinear,
    blend_known,
    first_pulse,
    place_of,
)
from printhammer.control.feedback.plant import Driver
from printhammer.drive.waveforms.shapes import Switched

COUNT = 12
"""Entries of a table that are compared with runs."""


def coil(kind: int, release: float, back: float, fire: float) -> Switched:
    """Coil current from just before a touch to the next push, evaluated directly."""
    largest, edge = coarse.plant().driver.current, coarse.plant().driver.edge
    before = largest if kind == PUSHED else 0.0
    if release == 0.0:
        at = (0.0, AHEAD, AHEAD + fire)
        return Switched(at=at, levels=(before, back, 0.0), edge=edge, initial=before)
    at = (0.0, AHEAD, AHEAD + release, AHEAD + fire)
    return Switched(at=at, levels=(before, largest, back, 0.0), edge=edge, initial=before)


def test_forces_are_those_of_single_runs() -> None:
    forces, _, _ = coarse.tables()
    plant = coarse.plant()
    rng = np.random.default_rng(1)
    for row, level, number in zip(*(rng.integers(0, n, COUNT) for n in forces.force.shape), strict=True):
        back, release = float(forces.back[level]), float(forces.release[number])
        long = 3.0 * plant.single.flight_time
        pulse = coil(int(forces.kind[row]), release, back, long)
        state = (plant.front - AHEAD * forces.speed[row], float(forces.speed[row]))
        drive = ph.PulseSequence([pulse], at=[0.0])
        motion = ph.simulate(plant.hammer, drive, duration=long, state=state)
        force = motion.dots[0].peak_force / plant.single.force
        assert forces.force[row, level, number] == pytest.approx(force, rel=1e-5)
        assert forces.state(row) == pytest.approx(state, rel=1e-12)
        assert forces.force_at(row, release, back) == forces.force[row, level, number]


def test_a_longer_push_into_the_pack_prints_harder() -> None:
    forces, _, _ = coarse.tables()
    assert (np.diff(forces.force, axis=2) > -1e-5).all()
    assert forces.off == 0


def test_ways_lead_where_single_runs_do() -> None:
    _, _, table = coarse.tables()
    plant = coarse.plant()
    known = np.argwhere(np.isfinite(table.next_touch))
    rng = np.random.default_rng(2)
    kinds = set()
    for row, way in rng.permutation(known)[:COUNT]:
        fire, width = float(table.fire[way]), float(table.width[way])
        pulse = coil(int(table.kind[row]), float(table.release[row, way]), float(table.back[way]), fire)
        levels = (plant.driver.current, 0.0)
        push = Switched(at=(0.0, width), levels=levels, edge=plant.driver.edge)
        drive = ph.PulseSequence([pulse, push], at=[0.0, AHEAD + fire])
        speed = float(table.speed[row])
        motion = ph.simulate(
            plant.hammer,
            drive,
            duration=fire + 1.7 * plant.single.flight_time,
            state=(plant.front - AHEAD * speed, speed),
        )
        touch, after = [contact for contact in motion.contacts if contact.surface == "pack"][:2]
        assert table.next_touch[row, way] == pytest.approx(after.t_in - touch.t_in, abs=1e-8)
        assert table.next_speed[row, way] == pytest.approx(after.v_in, rel=1e-4)
        assert table.leaves[row, way] == pytest.approx(touch.t_out - touch.t_in, abs=1e-8)
        assert table.force[row, way] == pytest.approx(
            motion.dots[0].peak_force / plant.single.force, rel=1e-5
        )
        # At a free touch the coil has been off for long, at a pushed one it is on.
        current = float(drive.value(np.array([after.t_in]))[0])
        wanted = plant.driver.current if table.next_kind[way] == PUSHED else 0.0
        assert abs(current - wanted) < np.exp(-2.5) * plant.driver.current
        assert (table.next_kind[way] == PUSHED) == (width == ALWAYS)
        kinds.add(int(table.next_kind[way]))
    assert kinds == {PUSHED, FREE}


def test_the_coil_has_settled_at_the_next_touch() -> None:
    """Two and a half time constants after the switching, so that a touch is either pushed or free."""
    _, _, table = coarse.tables()
    pushed = table.width == ALWAYS
    since = table.next_touch - table.fire - np.where(pushed, 0.0, table.width)
    # The time of the touch is that of a run, whose beginning lies before it by about `AHEAD`.
    assert np.nanmin(since) > 2.5 * coarse.plant().driver.edge - AHEAD
    assert (table.width[~pushed] < 1e-3).all()


def test_ways_print_the_force_that_they_are_for() -> None:
    forces, _, table = coarse.tables()
    shape = (len(forces.kind), len(forces.back), len(FORCES), -1)
    release, force = (values.reshape(shape) for values in (table.release, table.force))
    for number, share in enumerate(FORCES):
        for row, level in np.argwhere((release[:, :, number, 0] > 0.0) & (forces.force[..., -1] > share)):
            printed = force[row, level, number]
            printed = printed[np.isfinite(printed)]
            # A force between those of the two releases of the map between which the way has its own.
            after = int(np.argmax(np.maximum.accumulate(forces.force[row, level]) >= share))
            low, high = forces.force[row, level, after - 1 : after + 1]
            assert (printed >= low - 1e-5).all()
            assert (printed <= high + 1e-5).all()
    # Where a touch alone prints more, no push is added.
    least = forces.force[..., 0]
    np.testing.assert_array_equal(forces.release_for(1.0)[least >= 1.0], 0.0)
    np.testing.assert_array_equal(np.isnan(forces.release_for(1.0)), forces.force.max(axis=2) < 1.0)


@given(st.floats(0.2, 1.9))
def test_the_release_for_a_force_prints_it(force: float) -> None:
    rng = np.random.default_rng(3)
    release = np.linspace(0.0, 2e-4, 9)
    # Not quite rising, as runs with an error are not.
    rows = np.sort(rng.uniform(0.4, 1.8, (4, 2, 9)), axis=2)
    rows[0, 0, 4] = rows[0, 0, 3] - 1e-3
    table = ForceMap(np.zeros(4, np.int64), np.arange(4.0), np.array([0.0, -2.0]), release, rows, 2e-4)
    found = table.release_for(force)
    for place in np.ndindex(4, 2):
        row = np.maximum.accumulate(rows[place])
        if np.isnan(found[place]):
            assert row[-1] < force
        elif found[place] == 0.0:
            assert row[0] >= force or row[0] == pytest.approx(force)
        else:
            assert np.interp(found[place], release, row) == pytest.approx(force, rel=1e-12)


@pytest.mark.parametrize("kind", [PUSHED, FREE])
@pytest.mark.parametrize("release", [0.0, 7e-5])
@pytest.mark.parametrize("back", [0.0, -0.8, -2.0])
def test_the_coil_follows_the_plan(kind: int, release: float, back: float) -> None:
    driver = Driver(2.0, 5e-6)
    fire = 3e-4
    pulse = first_pulse(kind, release, back, fire, driver)
    before = driver.current if kind == PUSHED else 0.0

    def current(t: float) -> float:
        return float(ph.PulseSequence([pulse], at=[0.0]).value(np.array([t]))[0])

    assert current(0.5 * AHEAD) == pytest.approx(before)
    if release:
        left = (before - driver.current) * np.exp(-release / driver.edge)
        assert current(AHEAD + release) == pytest.approx(driver.current + left)
    assert current(AHEAD + fire) == pytest.approx(back, abs=1e-9)
    assert current(AHEAD + fire + driver.edge) == pytest.approx(back / np.e, abs=1e-9)


COEFFICIENTS = st.tuples(*[st.floats(-2.0, 2.0)] * 4)


@given(COEFFICIENTS, st.floats(0.3, 1.1), st.floats(-1.0, 5.0))
def test_interpolation_is_exact_for_what_is_bilinear(
    c: tuple[float, float, float, float], x: float, y: float
) -> None:
    xs, ys = np.linspace(0.3, 1.1, 5), np.linspace(-1.0, 5.0, 7)
    table = c[0] + c[1] * xs[:, np.newaxis] + c[2] * ys + c[3] * xs[:, np.newaxis] * ys
    i, p = place_of(np.array([x]), xs)
    j, q = place_of(np.array([y]), ys)
    assert 0 <= i[0] <= 3
    assert -1e-12 <= p[0] <= 1.0 + 1e-12
    exact = c[0] + c[1] * x + c[2] * y + c[3] * x * y
    assert bilinear(table, i, p, j, q)[0] == pytest.approx(exact, abs=1e-12)


def test_what_is_not_known_is_taken_from_beside() -> None:
    low, high = np.array([1.0, np.nan, 3.0, np.nan]), np.array([2.0, 5.0, np.nan, np.nan])
    np.testing.assert_array_equal(blend_known(low, high, np.full(4, 0.25)), [1.25, 5.0, 3.0, np.nan])
