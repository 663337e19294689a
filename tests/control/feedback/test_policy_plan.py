"""The plan of the policy against brute force: all actions for every dot up to the next rest."""

import itertools
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.control.feedback import policy as module
from printhammer.control.feedback.impact_map import ALWAYS, FORCES, FREE, PUSHED, ForceMap, ImpactMap
from printhammer.control.feedback.plant import Driver
from printhammer.control.feedback.policy import OFFSETS, Choice, Committed, Fronts, Policy, between_fronts
from printhammer.control.feedback.soft_landing import Landing
from printhammer.printing.dots.judging import Limits

PERIOD = 7e-4
LIMITS = Limits()
KINDS = np.array([PUSHED] * 3 + [FREE] * 3)
SPEEDS = np.array([0.5, 0.75, 1.0, 0.8, 1.0, 1.2])
BACKS = (0.0, -2.0)
COUNT = len(BACKS) * len(FORCES) * 2
"""Number of ways: return currents, forces, and throws."""

LATE = np.linspace(-0.9, 0.9, 13) * LIMITS.arrival
"""Latenesses between which the policy interpolates."""


def table_of(seed: int, shift: float = 0.0, holes: float = 0.0) -> ImpactMap:
    """Actions from one speed of the table to another, later by whole steps of the lateness grid."""
    rng = np.random.default_rng(seed)
    back, _, throw = (axis.ravel() for axis in np.meshgrid(BACKS, FORCES, (0.0, 1.0), indexing="ij"))
    kind = rng.integers(0, 2, COUNT)
    speeds = np.array([[SPEEDS[3 * k + rng.integers(0, 3)] for k in kind] for _ in KINDS])
    # The time does not depend on the speed, which would make a way unsafe.
    touch = PERIOD + (LATE[1] - LATE[0]) * rng.integers(-1, 2, COUNT) + np.zeros((len(KINDS), 1))
    force = rng.uniform(0.93, 1.07, (len(KINDS), COUNT))
    # A way is missing for all speeds of a kind: at the edge of what is possible it would be unsafe.
    nowhere = np.repeat(rng.random((2, COUNT)) < holes, 3, axis=0)
    release = rng.uniform(0.0, 1e-4, force.shape)
    forces = ForceMap(KINDS, SPEEDS, np.array(BACKS), np.array([0.0, 1e-4]), np.ones((6, 2, 2)), 2e-4)
    return ImpactMap(
        back=back,
        fire=3e-4 + 1e-4 * throw,
        width=np.where(kind == PUSHED, ALWAYS, 1e-4),
        release=release + shift * 1e-5,
        force=np.where(nowhere, np.nan, force + 0.1 * shift),
        next_touch=np.where(nowhere, np.nan, touch + 1e-5 * shift),
        next_speed=np.where(nowhere, np.nan, speeds + 0.2 * shift),
        next_kind=kind,
        leaves=np.full(force.shape, 1e-4),
        kind=KINDS,
        speed=SPEEDS,
        forces=forces,
        driver=Driver(2.0, 5e-6),
    )


def landing_of(seed: int) -> Landing:
    rng = np.random.default_rng(seed)
    left = np.append(rng.uniform(0.0, 0.3, 5), np.nan)
    force = np.append(rng.uniform(0.95, 1.05, 5), np.nan)
    return Landing(np.zeros(6), force, np.zeros(6), np.zeros(6), left, 1e-3)


def policy_of(seed: int, holes: float = 0.0) -> Policy:
    maps = tuple(table_of(seed, offset, holes) for offset in OFFSETS)
    front_force = np.random.default_rng(seed + 1).uniform(0.1, 0.6, (6, COUNT))
    return Policy(Fronts(maps, (landing_of(seed),) * 3, front_force), PERIOD, LIMITS)


def dot(force: float, late: float) -> float:
    """Cost of a dot, as the module defines it: squares, which rise steeply near the limits."""
    a, b = (force - 1.0) / LIMITS.force, late / LIMITS.arrival
    return a * a + b * b + 8.0 * (a**6 + b**6)


def rest(policy: Policy, row: int, late: float) -> float:
    """Cost of a landing: its dot, and the residual speed in units of 0.3 m/s."""
    left, force = (float(getattr(policy.landing, name)[row]) for name in ("left", "force"))
    if np.isnan(left):
        left, force = 0.3, 0.0
    return min(dot(force, late) + (left / 0.3) ** 2, 50.0)


def brute(policy: Policy, row: int, late: float, ways: tuple[int, ...]) -> float:
    """Cost of a sequence of actions and of the landing after it."""
    total, weight = 0.0, 1.0
    table = policy.table
    for way in ways:
        if np.isnan(table.force[row, way]):
            return np.inf
        held = (table.fire[way] - table.release[row, way]) / PERIOD
        effort = 0.1 * (table.back[way] / 2.0) ** 2 * held
        total += weight * (dot(float(table.force[row, way]), late) + effort)
        weight *= 0.9
        late += float(table.next_touch[row, way]) - PERIOD
        own = table.next_kind[way] == KINDS
        row = int(np.flatnonzero(own & np.isclose(SPEEDS, table.next_speed[row, way]))[0])
    return total + weight * rest(policy, row, late)


@pytest.mark.parametrize("dots", [0, 1, 2, 3])
@pytest.mark.parametrize("holes", [0.0, 0.4])
def test_costs_are_the_least_of_all_sequences(dots: int, holes: float) -> None:
    policy = policy_of(11, holes)
    costs = policy.costs(dots)
    assert costs.shape == (6, 13)
    # From the middle latenesses no sequence gets beyond the last.
    # The longest sequences for one speed of each kind.
    cells = ((1, 4), (4, 7)) if dots == 3 else itertools.product(range(6), range(3, 10))
    for row, column in cells:
        every = itertools.product(range(COUNT), repeat=dots)
        least = min(brute(policy, row, float(LATE[column]), ways) for ways in every)
        assert costs[row, column] == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("holes", [0.0, 0.4])
def test_the_best_way_is_that_of_brute_force(holes: float) -> None:
    policy = policy_of(5, holes)
    places = [(row, column) for row in range(6) for column in range(3, 10)]
    rows, columns = np.array(places).T
    for after in (0, 1):
        way, cost, _ = policy.best(
            KINDS[rows],
            LATE[columns],
            SPEEDS[rows],
            np.full(len(rows), PERIOD),
            np.full(len(rows), after),
            np.zeros(len(rows)),
            np.zeros(len(rows)),
        )
        for k, (row, column) in enumerate(places):
            late = float(LATE[column])
            least = {
                first: min(
                    brute(policy, row, late, (first, *ways))
                    for ways in itertools.product(range(COUNT), repeat=after)
                )
                for first in range(COUNT)
            }
            assert cost[k] == pytest.approx(min(least.values()), rel=1e-9)
            assert least[int(way[k])] == pytest.approx(cost[k], rel=1e-9)


def test_more_dots_than_matter_cost_the_same() -> None:
    policy = policy_of(3)
    assert policy.costs(8) is policy.costs(50)
    assert len(policy._costs) == 9


def test_a_throw_that_is_decided_anew_keeps_what_was_done() -> None:
    policy = policy_of(7)
    rows = np.arange(6)
    force = np.linspace(0.9, 1.1, 6)
    back, time = np.full(6, -2.0), np.full(6, 3.5e-4)
    arguments: Any = (
        KINDS, np.zeros(6), SPEEDS, np.full(6, PERIOD), np.zeros(6, int), np.zeros(6), np.zeros(6)
    )  # fmt: skip
    way, cost, choice = policy.best(*arguments, Committed(back, force, time))
    assert np.isfinite(cost).all()
    table = policy.table
    # With the return current that flows, and a throw that is still to come.
    np.testing.assert_array_equal(table.back[way], -2.0)
    assert (table.fire[way] > 3.5e-4).all()
    # Where it leads lies on the line through those of the least and the largest force.
    shape = (6, len(BACKS), len(FORCES), 2)
    own, touch, later = (
        values.reshape(shape) for values in (table.force, table.next_touch, choice.next_touch)
    )
    assert np.isnan(later[:, :, [0, 2]]).all()
    slope = (touch[:, :, 2] - touch[:, :, 0]) / (own[:, :, 2] - own[:, :, 0])
    expected = touch[:, :, 1] + slope * (force[rows, np.newaxis, np.newaxis] - own[:, :, 1])
    np.testing.assert_allclose(later[:, :, 1], expected, rtol=1e-12)


def test_a_throw_that_is_decided_anew_leads_somewhere_or_is_none() -> None:
    """Also if every action is far too late, so that an infeasible action costs as much."""
    policy = policy_of(7)
    committed = Committed(np.full(6, -2.0), np.linspace(0.9, 1.1, 6), np.full(6, 3.5e-4))
    for wait in (0.2 * PERIOD, 5.0 * PERIOD):
        way, cost, choice = policy.best(
            KINDS,
            np.zeros(6),
            SPEEDS,
            np.full(6, wait),
            np.zeros(6, int),
            np.zeros(6),
            np.zeros(6),
            committed,
        )
        assert np.isfinite(choice.next_touch[np.arange(6), way]).all()
        assert np.isfinite(cost).all()


@given(st.floats(-0.1, 0.1), st.floats(0.8, 1.2))
def test_ways_between_speeds_and_fronts_are_interpolated(front: float, speed: float) -> None:
    policy = policy_of(2)
    choice = Choice(policy.fronts, np.array([FREE]), np.array([speed]), np.array([front]))
    place = (speed - 0.8) / 0.2
    row, share = 3 + min(int(place), 1), place - min(int(place), 1)
    table = policy.table
    offset = float(np.clip(front, OFFSETS[0], OFFSETS[-1]))
    for name, slope in (("force", 0.1), ("next_touch", 1e-5), ("next_speed", 0.2)):
        values = getattr(table, name)
        exact = (1.0 - share) * values[row] + share * values[row + 1] + slope * offset
        np.testing.assert_allclose(choice.of(name)[0], exact, rtol=1e-12)
        np.testing.assert_allclose(choice.of(name, np.array([4])), exact[4], rtol=1e-12)
    below, farther = between_fronts(np.array([front]))
    assert np.interp(offset, OFFSETS, range(3)) == pytest.approx(float(below[0] + farther[0]), abs=1e-12)


@given(st.floats(0.0, 0.05), st.floats(0.0, 0.05))
def test_a_front_that_is_not_known_costs_what_it_may_spoil(less: float, more: float) -> None:
    policy = policy_of(4)
    less, more = sorted((less, more))
    choice = Choice(policy.fronts, KINDS, SPEEDS, np.zeros(6))
    near, far = (policy._front_doubt(choice, np.arange(6), np.full(6, error)) for error in (less, more))
    assert (near >= -1e-12).all()
    assert (far >= near - 1e-12).all()
    # Half the cost at either end of a standard deviation, and the arrival by its slope over the front.
    for row, way in ((0, 3), (5, 7)):
        force = float(policy.table.force[row, way])
        off = more * float(policy.fronts.front_force[row, way])
        either = 0.5 * (dot(force + off, 0.0) + dot(force - off, 0.0)) - dot(force, 0.0)
        late = more * 1e-5 / LIMITS.arrival
        assert far[row, way] == pytest.approx(either + late**2, abs=1e-9)


def test_what_is_too_late_costs_more_the_later_it_is() -> None:
    policy = policy_of(6)
    costs = policy.costs(1)
    end = float(LATE[-1])
    late = np.array([end, end + 1e-6, end + 5e-6, -end - 5e-6])
    kind, speed = np.full(4, FREE), np.full(4, 1.0)
    found = policy.ahead(kind, late, speed, costs)
    assert found[0] == pytest.approx(costs[4, -1])
    assert found[1] - found[0] == pytest.approx(50.0 * 1e-6 / LIMITS.arrival)
    assert found[2] - found[0] == pytest.approx(50.0 * 5e-6 / LIMITS.arrival)
    assert found[3] - costs[4, 0] == pytest.approx(50.0 * 5e-6 / LIMITS.arrival)
    # Beyond the speeds of the map nothing is known.
    assert policy.ahead(kind[:2], np.zeros(2), np.array([0.79, np.nan]), costs).tolist() == [50.0, 50.0]


def test_forces_at_a_farther_front(monkeypatch: pytest.MonkeyPatch) -> None:
    table = table_of(9, holes=0.2)
    told = []

    def released(_plant: Any, _forces: Any, keys: list[tuple[int, float, float]]) -> np.ndarray:
        told.extend(keys)
        return np.array([1.0 + 0.02 * row + 1e3 * release for row, release, _ in keys])

    monkeypatch.setattr(module, "released_forces", released)
    found = module.front_force(SimpleNamespace(), table)  # type: ignore[arg-type]
    assert len(told) == len(set(told))
    exact = (0.02 * np.arange(6)[:, np.newaxis] + 1e3 * table.release) / OFFSETS[-1]
    np.testing.assert_allclose(found, exact, rtol=1e-9)
