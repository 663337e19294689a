"""Units that learn: what they gain, by times of impact alone and with forces."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import printhammer as ph
from printhammer.control.learning.law import RUNS, LearningLaw
from printhammer.control.learning.learn import Progress, calibrate
from printhammer.control.learning.learner import Learner
from printhammer.control.learning.lines import DOTS, LINE, Press, Rung
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.sensor import ImpactSensor, Readings
from printhammer.control.table.drive import with_pulse
from printhammer.printing.rates.variability import Variability

RATE = 1275.0
SENSOR = ImpactSensor(force=0.03)


def nominal() -> ph.Hammer:
    return ph.load("hendriks-1983-1")


def apart(learner: Learner, row: np.ndarray) -> np.ndarray:
    """Return how far constants are off from what is believed of them, in its standard deviations."""
    assert learner.belief is not None
    mean, deviation = learner.belief.moments()
    return np.asarray(((mean - np.pad(row, (0, mean.size - row.size))) / deviation)[: row.size])


@pytest.fixture(scope="module")
def learned(law: LearningLaw) -> tuple[list[Learner], list[Progress]]:
    """Return what four units learn from times and forces."""
    return calibrate(law, Variability().draw(nominal(), 4, 5), SENSOR)


def test_updates_do_not_lead_apart(learned: tuple[list[Learner], list[Progress]]) -> None:
    for learner in learned[0]:
        assert len(learner.contractions) == len(RUNS)
        assert max(learner.contractions) <= 1.0
    assert sum(RUNS) * (DOTS + len(LINE)) == 1000


def test_learning_depends_on_readings_and_on_nothing_else_of_the_unit(law: LearningLaw) -> None:
    """Two units that are not alike, behind a sensor that shows the same of both."""

    press, single = law.production.press([law.production.nominal]), law.entries.task.single.nominal
    (time,), (force,) = press.ladder(law.rungs)
    line = press.line([law.entries.open_loop])[0]
    shown = {
        len(time): Readings(time, force),
        len(LINE): Readings(line.flight_time[0], line.peak_force[0] / single.force),
    }

    class Deaf(ImpactSensor):
        def read(self, flight: np.ndarray, force: np.ndarray, unit: int, run: int) -> Readings:
            return shown[len(flight)]

    one, two = calibrate(law, Variability().draw(nominal(), 2, 8), Deaf(force=0.03))[0]
    assert (one.corrections == two.corrections).all()
    assert one.corrections.any()
    assert set(vars(one)) == {
        *("law", "stage", "corrections", "belief", "contractions"),
        *("_gains", "_started", "_ladders", "_line", "_first"),
    }


def test_it_gains_where_the_force_is_measured(learned: tuple[list[Learner], list[Progress]]) -> None:
    learners, stages = learned
    first, last = (stage.cycle.good.mean(axis=1) for stage in (stages[0], stages[-1]))
    assert last.mean() > first.mean() + 0.1
    assert last.mean() > 0.95
    assert all(learner.finished for learner in learners)


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"missed": 0.01, "false": 0.01},
        {"seed": 7},
        {"colour": 0.8},
        {"gain": 0.02},
        {"missed": 0.1},
    ],
    ids=str,
)
def test_it_gains_with_other_sensors_than_it_was_designed_for(
    law: LearningLaw, options: dict[str, Any]
) -> None:
    units = Variability().draw(nominal(), 4, 5)
    stages = calibrate(law, units, ImpactSensor(**{"force": 0.03, **options}))[1]
    first, *others = (stage.cycle.good.mean(axis=1) for stage in stages)
    assert others[-1].mean() > 0.93
    assert others[-1].mean() > first.mean() + 0.1
    for good in others:
        assert (good >= first - 0.02).all()


@pytest.mark.slow
def test_times_tell_the_force_that_they_do_not_show(by_time: LearningLaw) -> None:
    """After 1,000 dots, better than single pulses could (3.2 %)."""
    rows, units = zip(*Variability().draw_rows(nominal(), 4, 5), strict=True)
    learners, stages = calibrate(by_time, units, ImpactSensor())
    off = np.abs(np.concatenate([apart(each, row) for each, row in zip(learners, rows, strict=True)]))
    assert (off < 2.0).mean() > 0.8
    production = by_time.production
    known = [
        production.hammers(each.belief.modes[0].mean[None])[0] for each in learners if each.belief is not None
    ]
    task = by_time.entries.task
    force, told = (
        Press(task, RATE, hammers).ladder([Rung(1.0)])[1][:, 0]
        for hammers in ([with_pulse(unit, task.pulse) for unit in units], known)
    )
    assert np.sqrt(np.mean((told / force - 1.0) ** 2)) < 0.02
    good = [stage.cycle.good.mean(axis=1) for stage in stages]
    assert (good[1] >= good[0]).all()
    assert good[-1].mean() > 0.98


class Many(NamedTuple):
    """What 40 units learn."""

    good: np.ndarray  # Share of the dots of the cycle within limits, (stages, units), in an open loop first
    off: np.ndarray  # How far constants are off, in the standard deviations said of them


@pytest.fixture(scope="module")
def many() -> Callable[[ImpactSensor], Many]:
    """Return a function that lets 40 units learn, once for each sensor."""

    @cache
    def learn(sensor: ImpactSensor) -> Many:
        rows, units = zip(*Variability().draw_rows(nominal(), 40, 11), strict=True)
        learners, stages = calibrate(law_for(nominal(), RATE, sensor=sensor)[0], units, sensor)
        off = [apart(each, row) for each, row in zip(learners, rows, strict=True)]
        return Many(np.array([stage.cycle.good.mean(axis=1) for stage in stages]), np.abs(off))

    return learn


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "asked"), [(SENSOR, 0.94), (ImpactSensor(), 0.9)], ids=["force", "time"])
def test_nearly_all_units_print_all_dots(
    many: Callable[[ImpactSensor], Many], sensor: ImpactSensor, asked: float
) -> None:
    assert (many(sensor).good[-1] == 1.0).mean() >= asked


@pytest.mark.slow
def test_no_unit_prints_fewer_dots_than_in_an_open_loop(many: Callable[[ImpactSensor], Many]) -> None:
    good = many(SENSOR).good
    # A single dot of the cycle may be lost on the way.
    assert (good[1:] - good[0]).min() >= -0.02


@pytest.mark.slow
def test_constants_lie_where_they_are_said_to_lie(many: Callable[[ImpactSensor], Many]) -> None:
    """68 and 95 of 100 within one and two standard deviations."""
    off = many(ImpactSensor()).off
    assert 0.55 < (off < 1.0).mean() < 0.85
    assert (off < 2.0).mean() > 0.88


@pytest.mark.slow
@pytest.mark.golden
def test_golden_figures_of_what_falls_short(many: Callable[[ImpactSensor], Many]) -> None:
    """What the page says of these units: a loss by times alone, and how well forces tell constants.

    None and 0.95 were asked for; whoever comes nearer changes page and figures, and takes up the tests above.
    """
    lost = many(ImpactSensor()).good[1:] - many(ImpactSensor()).good[0]
    assert np.argwhere(lost < 0.0).tolist() == [[0, 23]]
    assert lost.min() == pytest.approx(-4 / 87)
    off = many(SENSOR).off
    assert [round(100.0 * (off < size).mean()) for size in (1.0, 2.0)] == [64, 86]
