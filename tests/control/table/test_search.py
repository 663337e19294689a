"""Pulse candidates of a dot: the dot is correct, and does not overlap the pack contact of another dot."""

from typing import Any

import numpy as np
import pytest
from tests.control.table.by_hand import task_of
from tests.control.table.test_tuning import RATE, SLOTS, quick

import printhammer as ph
from printhammer.control.table import search, tuning
from printhammer.control.table import ways as table_ways
from printhammer.control.table.drive import JUMP
from printhammer.control.table.task import Task
from printhammer.control.table.ways import Ways
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.variability import perturbed

TOLERANCE = 1e-10
PERIOD = 1.0 / RATE


@pytest.fixture(scope="module")
def task() -> Task:
    """Return the tuning task for the hammer of these tests."""
    return task_of(quick(), RATE)


@pytest.fixture(scope="module")
def found(task: Task) -> Ways:
    return search.searched(task, PERIOD)


def row_of(ways: Ways, place: int, dots: int) -> ph.PulseSequence:
    """A row of dots with one candidate, without brake pulses, constructed directly."""
    pulse: Any = quick().waveform
    wide = pulse.model_copy(update={"width": float(ways.width[place])})
    late = float(ways.fired[place] - ways.period[place])
    times = [0.0, *(number * PERIOD + late for number in range(1, dots))]
    return ph.PulseSequence([pulse, *[wide] * (dots - 1)], at=times)


def test_the_best_way_makes_the_second_dot_right(found: Ways) -> None:
    plain = found.take(found.brake == 0.0)
    single = nominal(quick(), tolerance=TOLERANCE)
    best = int(np.argmin(plain.cost))
    _first, second = ph.simulate(quick(), row_of(plain, best, 2), tolerance=TOLERANCE).dots
    assert second.peak_force == pytest.approx(single.force, rel=0.002)
    touched = second.fired_at + (second.flight_time or 0.0)
    assert touched == pytest.approx(PERIOD + single.flight_time, abs=1e-6)


def test_the_cost_is_that_of_the_worst_dot_of_a_row(task: Task, found: Ways) -> None:
    plain = found.take(found.brake == 0.0)
    best = int(np.argmin(plain.cost))
    single = nominal(quick(), tolerance=TOLERANCE)
    drive = row_of(plain, best, table_ways.ROW)
    worst = 0.0
    for factor, hammer in [
        (table_ways.NOMINAL, quick()),
        *((1.0, perturbed(quick(), by)) for by in tuning.SPREAD),
    ]:
        for number, dot in enumerate(ph.simulate(hammer, drive, tolerance=TOLERANCE).dots):
            assert dot.peak_force is not None
            force = abs(dot.peak_force / single.force - 1.0) / task.limits.force
            touched = dot.fired_at + (dot.flight_time or 0.0)
            arrival = abs(touched - number * PERIOD - single.flight_time) / task.limits.arrival
            worst = max(worst, factor * force, factor * arrival)
    # A row multiplies what the tolerance of pictures leaves open.
    assert plain.cost[best] == pytest.approx(worst, rel=0.02, abs=0.02)


def test_the_best_way_comes_first_of_those_without_and_of_those_with_a_brake_pulse(found: Ways) -> None:
    for some in (found.take(found.brake == 0.0), found.take(found.brake > 0.0)):
        assert (np.diff(some.cost) >= 0.0).all()
    assert np.isfinite(found.cost).all()


@pytest.mark.slow
def test_nothing_is_fired_while_the_armature_is_in_the_pack() -> None:
    hammer = quick()
    table = ph.tune(hammer, rate=1900.0, history=1)
    drive = table.drive(hammer, SLOTS, 1900.0)
    pack = [touch for touch in ph.simulate(hammer, drive).contacts if touch.surface == "pack"]
    assert len(pack) == len(SLOTS)
    for touch in pack:
        assert touch.t_out is not None
        assert not ((drive.times > touch.t_in) & (drive.times < touch.t_out)).any()


def test_pulses_that_do_not_fit_are_never_run(task: Task) -> None:
    early = task.single.left - 1e-6
    ways = table_ways.ways_of([(PERIOD, 0.0, 0.0, early, 150e-6)])
    assert not table_ways.fits(task, ways).any()
    assert np.isinf(table_ways.costs(task, ways)).all()


def ways(rows: list[tuple[float, float, float]]) -> Ways:
    """Candidates by period, us, brake width, us, and cost."""
    period, brake, cost = np.array(rows).T
    nothing = np.zeros(period.size)
    return Ways(1e-6 * period, 300e-6 * (brake > 0.0), 1e-6 * brake, 1e-6 * period, nothing + 1e-4, cost)


def test_a_way_is_kept_where_another_one_is_hardly_better() -> None:
    every = ways(
        [(700, 0, 0.4), (700, 20, 0.5), (710, 0, 0.45), (710, 20, 0.4), (720, 0, 0.4), (720, 20, 2.0)]
    )
    groups = [np.array([0, 1]), np.array([2, 3]), np.array([4, 5])]
    assert search._path(every, groups, JUMP).tolist() == [0, 2, 4]


def test_a_way_is_left_where_it_is_no_good() -> None:
    every = ways(
        [(700, 0, 0.4), (700, 20, 0.5), (710, 0, 3.0), (710, 20, 0.4), (720, 0, 0.4), (720, 20, 2.0)]
    )
    groups = [np.array([0, 1]), np.array([2, 3]), np.array([4, 5])]
    chosen = search._path(every, groups, JUMP).tolist()
    assert chosen[1] == 3
    assert chosen[2] == 4
    assert search._path(every, [], JUMP).size == 0


def test_pulses_keep_to_their_bounds_also_where_it_is_looked_closely(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "BAD", 0.0)
    monkeypatch.setattr(search, "_WIDER", (1.0, 50.0))
    kept: list[Ways] = []
    known = search._kept

    def watched(task: Task, found: Ways) -> Ways:
        kept.append(found)
        return known(task, found)

    monkeypatch.setattr(search, "_kept", watched)
    search.chosen(task, np.array([PERIOD]))
    assert max(some.brake.max(initial=0.0) for some in kept) == task.widest
    assert max(some.width.max(initial=0.0) for some in kept) <= task.widest
    brakes = np.concatenate([some.delay[some.brake > 0.0] for some in kept])
    assert brakes.min() >= task.brake_from
