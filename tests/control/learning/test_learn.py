"""Learning: it converges, keeps to its bounds, sees its sensor only, and gains on units it does not know."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.hammers import crude

import printhammer as ph
from printhammer.control.learning.calibrate import calibrate
from printhammer.control.learning.law import LearningLaw
from printhammer.control.learning.learner import Learner
from printhammer.control.learning.lines import DOTS, LADDER, LINE, REPEATED, Press
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.sensor import ImpactSensor, Readings
from printhammer.control.learning.settings import MARGIN, WIDTH
from printhammer.control.table.drivers import driven_by
from printhammer.printing.rates.variability import Variability

RATE = 1275.0
SENSOR = ImpactSensor(force=0.03)


def nominal() -> ph.Hammer:
    return ph.load("hendriks-1983")


@pytest.fixture(scope="module")
def law() -> LearningLaw:
    return law_for(nominal(), RATE, sensor=SENSOR, members=60)[0]


def readings(law: LearningLaw, late: float = 0.0) -> tuple[Readings, Readings]:
    """Return what a sensor shows of a hammer that is nominal, but all impacts are late by a time, s."""
    time, force = (np.tile(each, REPEATED) for each in law.ladder)
    single = law.entries.task.single.nominal
    line = np.full(len(LINE), single.flight_time + late)
    return Readings(time + late, force), Readings(line, np.ones(len(LINE)))


class Poisoned:
    """A unit of which nothing may be asked."""

    def __getattribute__(self, name: str) -> Any:
        raise AssertionError(f"the learner asks the unit for {name}")


def test_updates_do_not_lead_apart(law: LearningLaw) -> None:
    assert len(law.stages) > 1
    for stage in law.stages:
        assert stage.contraction <= 1.0
        assert np.isfinite(stage.gain).all()
    assert sum(stage.runs for stage in law.stages) * DOTS == 1000


def test_the_learner_sees_readings_and_nothing_else(
    law: LearningLaw, monkeypatch: pytest.MonkeyPatch
) -> None:
    learner = Learner(law)
    assert set(vars(learner)) == {
        *("law", "stage", "corrections", "_gains", "_ladders", "_line", "_lines"),
    }
    # No run of any hammer, no unit and no file is within its reach while it learns.
    for name in ("Ensemble", "PulseTrain", "judge"):
        monkeypatch.setattr(f"printhammer.control.learning.lines.{name}", Poisoned())
    monkeypatch.setattr("printhammer.control.learning.law.Press", Poisoned())
    while not learner.finished:
        learner.see(*readings(law, late=10e-6))
    assert np.isfinite(learner.settings).all()


def test_it_begins_in_an_open_loop(law: LearningLaw) -> None:
    learner = Learner(law)
    assert not learner.learned
    assert (learner.settings == law.entries.open_loop).all()
    assert (learner.printed == law.entries.open_loop).all()


def weighed(law: LearningLaw, edge: float, worse: int = 0, doubt: float = 0.0) -> Learner:
    """Return a learner after a run that every simulated hammer looks like, some of which a table harms."""
    edges = np.full_like(law.stages[0].edge, edge)
    edges[:worse] = -0.01
    first = replace(law.stages[0], edge=edges, seen=np.zeros_like(law.stages[0].seen))
    learner = Learner(replace(law, doubt=doubt, stages=(first, *law.stages[1:])))
    learner.see(*readings(law))
    return learner


def test_the_open_loop_is_left_for_a_gain_without_harm_only(law: LearningLaw) -> None:
    assert weighed(law, 0.3).learned
    assert not weighed(law, 0.0).learned
    harmed = weighed(law, 0.3, worse=1)
    assert not harmed.learned
    assert (harmed.printed == law.entries.open_loop).all()
    assert weighed(law, 0.3, worse=1, doubt=0.1).learned
    assert not weighed(law, 0.3, worse=4, doubt=0.1).learned


def test_two_learners_shown_the_same_learn_the_same(law: LearningLaw) -> None:
    one, two = Learner(law), Learner(law)
    for _ in range(4):
        for learner in (one, two):
            learner.see(*readings(law, late=7e-6))
    assert (one.corrections == two.corrections).all()
    assert one.corrections.any()


@pytest.mark.parametrize("late", [-400e-6, 400e-6, float("nan")])
def test_no_reading_leads_beyond_the_bounds(law: LearningLaw, late: float) -> None:
    learner, entries = Learner(law), law.entries
    task = entries.task
    while not learner.finished:
        learner.see(*readings(law, late=late))
        advance, width, delay, brake = learner.settings
        assert (width <= task.widest).all()
        assert (learner.settings[WIDTH] > 0.0).all()
        for gap in range(1, task.reach + 1):
            first = gap * (task.reach + 1) ** (task.gaps - 1)
            own = slice(first, first + (task.reach + 1) ** (task.gaps - 1))
            fired = gap / RATE - advance[own]
            base = gap / RATE - entries.base[0, own]
            clear = task.earliest(delay[own], brake[own])
            # After the nominal armature has left the pack, with a margin where the table itself has one.
            assert (fired >= np.minimum(clear + MARGIN * (brake[own] == 0.0), base) - 1e-9).all()


def test_a_missed_impact_counts_for_nothing(law: LearningLaw) -> None:
    whole, holed = Learner(law), Learner(law)
    rungs, line = readings(law)
    whole.see(rungs, line)
    time = rungs.time.copy()
    time[len(LADDER)] = np.nan
    holed.see(Readings(time, rungs.force), line)
    assert holed.corrections == pytest.approx(whole.corrections, abs=1e-9)


def test_it_gains_where_the_force_is_measured(law: LearningLaw) -> None:
    units = Variability().draw(nominal(), 12, 5)
    learners, stages = calibrate(law, units, SENSOR)
    first, last = (stage.cycle.good.mean(axis=1) for stage in (stages[0], stages[-1]))
    assert last.mean() > first.mean() + 0.1
    assert last.mean() > 0.95
    assert all(learner.finished for learner in learners)


@pytest.mark.parametrize(
    "options",
    [{"seed": 7}, {"colour": 0.8}, {"gain": 0.02}, {"missed": 0.01}, {"missed": 0.01, "false": 0.01}],
    ids=str,
)
def test_it_gains_with_other_sensors_than_it_was_designed_for(
    law: LearningLaw, options: dict[str, Any]
) -> None:
    units = Variability().draw(nominal(), 12, 5)
    stages = calibrate(law, units, ImpactSensor(**{"force": 0.03, **options}))[1]
    first, *others = (stage.cycle.good.mean(axis=1) for stage in stages)
    assert others[-1].mean() > 0.93
    assert others[-1].mean() > first.mean() + 0.1
    for good in others:
        assert (good >= first - 0.02).all()


def test_times_do_not_show_the_stiffness_of_the_paper(law: LearningLaw) -> None:
    """Why no learner that sees times only can promise never to print worse: alike is not the same."""
    hammer = driven_by(nominal(), "switch", 2.0)
    stiff = hammer.replace("pack.stiffness", 1.1 * hammer.constants["pack.stiffness"].si)
    time, force = Press(law.entries.task, RATE, [hammer, stiff]).ladder()
    assert time[1] == pytest.approx(time[0], abs=1e-12)
    # Equation (5) at the same energy: by the power 1/3.7 of the stiffness; the coil pushes meanwhile.
    assert force[1] / force[0] == pytest.approx(np.full(3, 1.1 ** (1.0 / 3.7)), rel=6e-3)


@pytest.mark.slow
def test_nearly_all_units_print_all_dots_in_the_end() -> None:
    units = Variability().draw(nominal(), 50, 11)
    for sensor, asked in ((ImpactSensor(force=0.03), 0.94), (ImpactSensor(), 0.76)):
        law = law_for(nominal(), RATE, sensor=sensor, doubt=0.1)[0]
        last = calibrate(law, units, sensor)[1][-1]
        assert last.cycle.good.all(axis=1).mean() >= asked


@pytest.mark.slow
def test_without_doubt_no_unit_prints_worse_than_in_an_open_loop() -> None:
    units = Variability().draw(nominal(), 50, 11)
    for sensor, asked, harmed in ((SENSOR, 0.94, 0), (ImpactSensor(), 0.6, 2)):
        stages = calibrate(law_for(nominal(), RATE, sensor=sensor)[0], units, sensor)[1]
        first, *others = (stage.cycle.good.mean(axis=1) for stage in stages)
        assert stages[-1].cycle.good.all(axis=1).mean() >= asked
        # Times do not show how hard a dot is: a few units are harmed on the way.
        assert max(int((good < first - 1e-12).sum()) for good in others) <= harmed


def test_the_table_is_for_its_unit_only(tmp_path: Path) -> None:
    result = ph.learn(nominal(), rate=RATE, sensor=SENSOR, members=60, serial="A17")
    assert result.table.serial == "A17"
    assert result.dots.tolist() == [0, 25, 50, 100, 200, 400, 1000]
    for name in ("learned.csv", "learned.json"):
        result.table.save(tmp_path / name)
        table = ph.load_table(tmp_path / name)
        assert (table.serial, table.driver) == ("A17", "switch")
        assert table.to_csv() == result.table.to_csv()
        for serial in (None, "B2"):
            with pytest.raises(ph.InputError, match="learned on unit 'A17'"):
                table.strategy(nominal(), serial=serial)
        for serial in ("A17", "any"):
            drive = table.strategy(nominal(), serial=serial)(nominal(), [(0, 1, 3)], RATE)[0]
            assert drive.peak <= 2.0
    assert result.share[-1] >= result.share[0]
    result.plot()


@pytest.mark.parametrize("driver", ["switch", "bridge"])
def test_another_driver_prints_the_same_dot_at_the_same_time(driver: str) -> None:
    hammer = nominal()
    table = ph.tune(hammer, rate=RATE, history=1, driver=driver)
    drive = table.drive(hammer, (0,), RATE)
    (dot,) = ph.simulate(hammer, drive).dots
    (own,) = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=[1e-3])).dots
    assert dot.peak_force == pytest.approx(own.peak_force, rel=1e-4)
    assert dot.fired_at + (dot.flight_time or 0.0) == pytest.approx(1e-3 + (own.flight_time or 0.0), abs=1e-8)
    assert drive.peak <= 2.0


def test_bad_arguments_are_refused() -> None:
    hammer = nominal()
    for options, sentence in (
        ({"driver": "bellows"}, "driver = 'bellows', expected own, switch or bridge"),
        ({"members": 3}, "members = 3, expected 50 to 5000"),
        ({"forgetting": 0.0}, "forgetting = 0.0, expected a number above 0 and below 1"),
        ({"doubt": -0.1}, "doubt = -0.1, expected a number from 0 to 1"),
        ({"serial": ""}, "serial = '', expected a text"),
        ({"rate": "-3 Hz"}, "rate"),
    ):
        with pytest.raises(ph.InputError, match=sentence):
            ph.learn(hammer, **{"rate": RATE, **options})  # type: ignore[arg-type]
    with pytest.raises(ph.InputError, match="no width of the pulse makes a dot of"):
        driven_by(hammer, "switch", 0.2)
    with pytest.raises(ph.InputError, match="expected a current"):
        driven_by(
            crude().replace("waveform", {"shape": "half-sine", "amplitude": "9 N", "width": 3e-4}),
            "switch",
            2.0,
        )
