"""Candidates that amplify errors along a row are rejected: two candidates of a hammer at 1,020 Hz.

Both print the second dot correctly; in a long row, the dots of one candidate alternate increasingly.
"""

from typing import Any

import numpy as np
import pytest
from tests.control.table.by_hand import task_of

import printhammer as ph
from printhammer.control.table.task import Task
from printhammer.control.table.ways import STABLE, UNSTABLE, costs, growths, rows_of, solved, ways_of
from printhammer.derivatives.rows import DOTS, row_multipliers
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.variability import Perturbation
from printhammer.run.effort import Effort

RATE = 1020.0
PERIOD = 1.0 / RATE
GROWS = (PERIOD, 944e-6, 124.5e-6, PERIOD + 108.2e-6, 107e-6)
SHRINKS = (PERIOD, 772e-6, 40.9e-6, PERIOD + 94e-6, 181.5e-6)


@pytest.fixture(scope="module")
def task() -> Task:
    return task_of(ph.load("hendriks-1983-1"), RATE)


def test_both_make_the_second_dot_right_and_one_is_no_way(task: Task) -> None:
    ways = solved(task, ways_of([GROWS, SHRINKS]))
    assert (growths(task, ways) <= STABLE).tolist() == [False, True]
    assert (costs(task, ways) < UNSTABLE).tolist() == [False, True]
    growth = row_multipliers([task.hammers[0]] * 2, rows_of(task, ways, DOTS), Effort(1e-9))
    assert growth[0] < -1.1
    assert abs(growth[1]) < STABLE


def test_a_long_row_shows_it(task: Task) -> None:
    """Simulated one after another; the residual of Newton's method is a thousandth of the limits."""
    hammer, limits, single = task.hammers[0], Limits(), task.single.nominal
    ways = solved(task, ways_of([GROWS, SHRINKS]))
    worst = []
    for drive in rows_of(task, ways, 128):
        dots = ph.simulate(hammer, drive, points=2, tolerance=1e-9).dots
        off = np.array([(dot.peak_force or 0.0) / single.force - 1.0 for dot in dots])
        assert np.abs(off[:4]).max() < 0.1 * limits.force
        worst.append(float(np.abs(off).max()))
    assert worst[0] > limits.force > 0.1 * limits.force > worst[1]


@pytest.mark.slow
def test_the_table_prints_rows_of_200() -> None:
    hammer = ph.load("hendriks-1983-1")
    table = ph.tune(hammer, rate=RATE)
    report: Any = ph.judge_table(hammer, table, perturbations=[Perturbation()])
    assert report.passed[1].all()
    assert np.abs(report.multiplier[1]).max() < STABLE


def test_a_rate_at_which_most_ways_are_unstable_has_a_table() -> None:
    """At 1 kHz the best candidates of this hammer are unstable; their neighbours are stable."""
    hammer = ph.load("hendriks-1983")
    table = ph.tune(hammer, rate=1000.0, history=1, reach=2)
    drive = table.strategy(hammer)(hammer, [tuple(range(128))], 1000.0)[0]
    forces = [dot.peak_force or 0.0 for dot in ph.simulate(hammer, drive, points=2).dots]
    off = np.array(forces) / nominal(hammer).force - 1.0
    assert len(off) == 128
    assert np.abs(off).max() < 0.05
