"""Learning: convergence, limits, dependence on the sensor alone, and gains on unknown units."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import crude

import printhammer as ph
from printhammer.control.learning.belief import Belief, Mode
from printhammer.control.learning.law import (
    COMPARED,
    IN_CYCLE,
    MARGIN,
    RUNS,
    WIDTH,
    LearningLaw,
    Verdict,
    better_loop,
    order_good,
    order_loops,
)
from printhammer.control.learning.learn import table_of
from printhammer.control.learning.learner import Learner, is_explained, mean
from printhammer.control.learning.lines import DOTS, LINE, Press, Rung, candidates, printed
from printhammer.control.learning.sensor import ImpactSensor, Readings
from printhammer.control.pulses import of_width
from printhammer.control.table.drive import driven_by, histories, number_of
from printhammer.printing.dots.strategy import open_loop

RATE = 1275.0
SENSOR = ImpactSensor(force=0.03)


def nominal() -> ph.Hammer:
    return ph.load("hendriks-1983-1")


def readings(law: LearningLaw, late: float = 0.0) -> tuple[Readings, Readings]:
    """Return readings of a nominal hammer whose impacts are all late by a time, s."""
    press, single = law.production.press([law.production.nominal]), law.entries.task.single.nominal
    (time,), (force,) = press.ladder(law.rungs)
    line = press.line([law.entries.open_loop])[0]
    return (
        Readings(time + late, force),
        Readings(line.flight_time[0] + late, line.peak_force[0] / single.force),
    )


def test_the_rate_is_optional(monkeypatch: pytest.MonkeyPatch) -> None:
    class PreparedError(Exception):
        pass

    def prepared(_hammer: ph.Hammer, rate: float, **_more: object) -> None:
        raise PreparedError(rate)

    monkeypatch.setattr("printhammer.control.learning.learn.law_for", prepared)
    for given, rate in ((None, RATE), ("900 Hz", 900.0)):
        with pytest.raises(PreparedError) as stopped:
            ph.learn(nominal(), rate=given)
        assert stopped.value.args == (rate,)


def believed(law: LearningLaw, spread: float) -> Belief:
    """Return a posterior for the nominal hammer; all constants have the same standard deviation."""
    size = law.production.size
    mode = Mode(np.zeros(size), spread**2 * np.eye(size), np.zeros(law.seen.shape[1]), 0.0, 1.0)
    return Belief.of([mode])


def show(learner: Learner, ladder: Readings, line: Readings) -> None:
    """Show a learner the same readings in all runs of a stage, and update it."""
    for _ in range(RUNS[learner.stage]):
        learner.see(ladder, line)
    printed(learner.learn(), learner.law.entries.task)


def test_it_begins_in_an_open_loop(small: LearningLaw) -> None:
    learner = Learner(small)
    assert not learner.learned
    assert (learner.settings == small.entries.open_loop).all()
    assert (learner.printed == small.first.settings).all()


def test_the_open_loop_of_the_own_pulse_is_handed_out_as_a_table(small: LearningLaw) -> None:
    """The learner fires the open loop of the hammer if that is better."""
    hammer, slots = nominal(), (0, 1, 3)
    base = ph.tune(hammer, rate=RATE, history=1, reach=2, driver="switch")
    learner, own = Learner(small), small.entries.own
    assert own is not None
    learner.verdict = learner.verdict._replace(loop=own)
    drive = table_of(learner, base, "switch", hammer).drive(hammer, slots, RATE)
    (plain,) = open_loop(hammer, [slots], RATE)
    assert drive.times == pytest.approx(plain.times, abs=1e-12)
    times = np.linspace(0.0, 5e-3, 2001)
    assert drive.value(times) == pytest.approx(plain.value(times), abs=1e-9)


@pytest.mark.usefixtures("brief")
def test_the_open_loop_is_left_for_a_gain_without_harm_only(
    small: LearningLaw, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A learner that knows the unit leaves the open loop; an uncertain learner does so only with doubt."""
    monkeypatch.setattr("printhammer.control.learning.law._ALIKE", 12)
    off = np.zeros(small.entries.inputs.shape[1])
    unexplained = np.zeros((2, len(LINE)))

    def gains(law: LearningLaw, belief: Belief) -> bool:
        return printed(law.update(belief, off, unexplained), law.entries.task).verdict.gains

    assert gains(small, believed(small, 0.01))
    unsure = believed(small, 1.5)
    assert not gains(small, unsure)
    assert gains(replace(small, doubt=1.0), unsure)
    # Nor for a table with which errors grow from dot to dot of a row, on one of the likely units.
    growing = np.append(np.full(11, 0.5), 1.1)
    monkeypatch.setattr(Press, "multipliers", lambda self, settings: growing)
    assert not gains(small, believed(small, 0.01))
    assert gains(replace(small, doubt=0.1), believed(small, 0.01))


def test_the_usual_open_loop_is_left_if_the_posterior_is_sure_only() -> None:
    """Fractions of good dots on ten hammers: 0.7 in the usual loop, the values below in the other loop."""
    usual = np.full(10, 0.7)
    for other, expected in (
        (np.full(10, 0.8), (0, 1.0)),  # Better on all
        (np.append(np.full(9, 0.8), 0.6), (0, 0.9)),  # Worse on one of ten
        (np.append(np.full(8, 0.8), [0.6, 0.6]), (1, 0.2)),  # Worse on two: not decided
        (np.append(np.full(9, 0.7), 0.1), (1, 1.0)),  # Never better
        (usual, (1, 1.0)),  # Equal
        (np.append(np.full(9, 0.71), 0.0), (1, 0.1)),  # Better on nine, and worse in the mean
    ):
        assert better_loop(np.array([other, usual]), 1) == pytest.approx(expected)


@pytest.mark.parametrize("usual", [0, 1])
def test_a_posterior_that_knows_the_unit_chooses_its_better_open_loop(small: LearningLaw, usual: int) -> None:
    """The nominal hammer prints more dots in one of the open loops, whichever is the default."""
    (unit,) = small.production.hammers(np.zeros((1, small.production.size)))
    assert unit is not None
    loops, task = small.entries.loops, small.entries.task
    press = small.production.press([unit])
    shares = [good.mean() for good in printed(order_loops(press, small.entries), task)]
    assert abs(shares[0] - shares[1]) > 0.1
    verdict = Verdict(False, loops[usual], np.nan, np.nan, np.nan, np.nan)
    other = replace(small, first=loops[usual])
    chosen = printed(other.choose_loop(believed(small, 1e-4), verdict), task)
    assert chosen.loop.pulse is loops[int(np.argmax(shares))].pulse
    assert chosen.loop_certainty == 1.0
    assert chosen.expected == pytest.approx(max(shares), abs=0.02)


@pytest.mark.parametrize(
    ("level", "misfit", "explained"), [(0.0, 1.05, True), (0.1, 1.05, False), (0.0, 1.3, False)]
)
def test_a_search_that_ended_on_the_way_decides_nothing(level: float, misfit: float, explained: bool) -> None:
    """The misfit of 145 readings is 1, with a standard error of 6 %."""
    mode = Mode(np.zeros(3), np.eye(3), np.zeros(145), level, 1.0, misfit)
    assert is_explained(Belief.of([mode])) is explained


def test_the_line_that_compares_open_loops_has_their_histories_and_rows() -> None:
    """Three rows, with a dot in every slot, every second slot and every third slot, each from rest."""
    assert COMPARED[: len(LINE)] == LINE
    steps = np.diff(COMPARED[len(LINE) :])
    assert len(COMPARED) == 60
    assert steps.tolist() == [*[1] * 23, 9, *[2] * 11, 9, *[3] * 7]


def test_a_start_from_the_hammer_believed_in_prints_all_its_dots(small: LearningLaw) -> None:
    """Single dots have nominal force and arrival time although the hammer differs from nominal."""
    row = np.array([0.0, 0.0, 0.0, 0.0, 1.0, -1.0, -1.0, 1.0])
    unit = replace(believed(small, 0.1).modes[0], mean=np.pad(row, (0, small.production.size - row.size)))
    started = small.started_anew(Belief.of([unit]))
    assert started is not None
    task, (hammer,) = small.entries.task, small.production.hammers(unit.mean[None])
    assert hammer is not None
    press = small.production.press([hammer])
    shown, kept = (
        printed(order_good(press, [entries.settings(np.zeros(entries.inputs.shape[1]))]), task)
        for entries in (small.entries, started.entries)
    )
    # Of the cycle; a row has one history.
    assert shown[:, IN_CYCLE].mean() < 0.9
    assert kept.all()
    for history in histories(task.gaps, task.reach):
        advance, width, delay, brake = started.entries.base[:, number_of(history, task.reach)]
        assert width <= task.widest
        assert brake == 0.0 or delay >= task.brake_from
        if history[0]:
            clear = task.earliest(delay, brake) + MARGIN * (brake == 0.0)
            assert history[0] / RATE - advance >= clear - 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("late", [400e-6, float("nan")])
def test_no_reading_leads_beyond_the_bounds(law: LearningLaw, late: float) -> None:
    learner, task = Learner(law), law.entries.task
    # The readings do not change, so that later stages repeat the third.
    while learner.stage < 3:
        show(learner, *readings(law, late=late))
        advance, width, delay, brake = learner.settings
        assert (width <= task.widest).all()
        assert (learner.settings[WIDTH] > 0.0).all()
        for gap in range(1, task.reach + 1):
            first = gap * (task.reach + 1) ** (task.gaps - 1)
            own = slice(first, first + (task.reach + 1) ** (task.gaps - 1))
            fired = gap / RATE - advance[own]
            base = gap / RATE - learner.law.entries.base[0, own]
            clear = task.earliest(delay[own], brake[own])
            # After the nominal armature has left the pack, with a margin where the table itself has one.
            assert (fired >= np.minimum(clear + MARGIN * (brake[own] == 0.0), base) - 1e-9).all()


@pytest.mark.usefixtures("brief")
def test_a_missed_and_a_false_impact_change_little(small: LearningLaw) -> None:
    whole, holed, fooled = (Learner(small) for _ in range(3))
    rungs, line = readings(small)
    missed, false = rungs.time.copy(), line.time.copy()
    missed[0] = np.nan
    false[5] = 60e-6
    show(whole, rungs, line)
    show(holed, Readings(missed, rungs.force), line)
    show(fooled, rungs, Readings(false, line.force))
    assert whole.corrections.any()
    assert holed.corrections == pytest.approx(whole.corrections, abs=1.0)
    assert fooled.corrections == pytest.approx(whole.corrections, abs=1.5)


def test_of_three_readings_an_outlier_is_left_out_of_the_mean() -> None:
    """Times of two dots, the second without readings; either of two unlike readings may be wrong."""
    early, late, missed = 1e-6, 61e-6, float("nan")
    noise = np.full(2, 5e-6)
    three = mean([np.array([time, missed]) for time in (early, late, early)], noise)
    assert three.value == pytest.approx([early, missed], nan_ok=True)
    assert three.seen.tolist() == [2.0, 0.0]
    two = mean([np.array([time, missed]) for time in (early, late)], noise)
    assert two.value == pytest.approx([31e-6, missed], nan_ok=True)
    assert two.seen.tolist() == [2.0, 0.0]


def test_the_stiffness_of_the_paper_shows_in_second_impacts_only(small_by_time: LearningLaw) -> None:
    """Pairs in a ladder determine a constant that single pulses do not, and that changes the force."""
    hammer = driven_by(nominal(), "switch", 2.0)
    stiff = hammer.replace("pack.stiffness", 1.1 * hammer.constants["pack.stiffness"].si)
    press = Press(small_by_time.entries.task, RATE, [hammer, stiff])
    singles = [Rung(0.8), Rung(1.0), Rung(1.3)]
    time, force = press.ladder(singles)
    assert time[1] == pytest.approx(time[0], abs=1e-12)
    # Equation (5) at the same energy: by the power 1/3.7 of the stiffness; the coil pushes meanwhile.
    assert force[1] / force[0] == pytest.approx(np.full(3, 1.1 ** (1.0 / 3.7)), rel=6e-3)
    pairs = [rung for rung in small_by_time.rungs if rung.later]
    assert pairs
    for rung in pairs:
        first, second = press.ladder([rung])[0].T
        assert first[1] == pytest.approx(first[0], abs=1e-12)
        assert abs(second[1] - second[0]) > 0.5e-6


def test_no_rung_is_fired_while_the_armature_is_in_the_pack(small_by_time: LearningLaw) -> None:
    task = small_by_time.entries.task
    assert sum(rung.dots for rung in small_by_time.rungs) == DOTS
    for rung in candidates(task):
        assert max(rung.first, rung.second) * task.width <= task.widest
        if rung.later:
            drive = ph.PulseTrain(of_width(task.pulse, rung.first * task.width), at=[0.0])
            dot = next(
                each for each in ph.simulate(task.hammers[0], drive).contacts if each.surface == "pack"
            )
            assert dot.t_out is not None
            # The ladder is laid out by runs of a wider tolerance.
            assert rung.later >= dot.t_out + MARGIN - 1e-9


@pytest.mark.slow
def test_the_table_is_for_its_unit_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two stages only; `test_units.py` runs all stages for two units."""
    monkeypatch.setattr("printhammer.control.learning.learn.RUNS", RUNS[:2])
    result = ph.learn(nominal(), rate=RATE, sensor=SENSOR, members=150, serial="A17")
    assert result.table.serial == "A17"
    assert result.dots.tolist() == [0, 25, 50]
    for name in ("learned.csv", "learned.json"):
        result.table.save(tmp_path / name)
        table = ph.load_table(tmp_path / name)
        assert (table.serial, table.driver) == ("A17", "switch")
        assert table.to_csv() == result.table.to_csv()
        for serial in (None, "B2"):
            with refused("unit"):
                table.strategy(nominal(), serial=serial)
        for serial in ("A17", "any"):
            drive = table.strategy(nominal(), serial=serial)(nominal(), [(0, 1, 3)], RATE)[0]
            assert drive.peak <= 2.0
    assert result.share[-1] >= result.share[0]
    result.plot()
    for name, value, error in zip(result.constants, result.believed, result.uncertainty, strict=True):
        assert result.believed_hammer.constants[name].si == pytest.approx(value, rel=1e-9)
        assert abs(value - result.unit.constants[name].si) < 5.0 * error


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
    for options, key in (
        ({"driver": "bellows"}, "driver"),
        ({"members": 3}, "members"),
        ({"forgetting": 0.0}, "forgetting"),
        ({"doubt": -0.1}, "doubt"),
        ({"serial": ""}, "serial"),
        ({"rate": "-3 Hz"}, "rate"),
    ):
        with refused(key):
            ph.learn(hammer, **{"rate": RATE, **options})  # type: ignore[arg-type]
    with refused("width"):
        driven_by(hammer, "switch", 0.2)
    with refused("waveform"):
        driven_by(
            crude().replace("waveform", {"shape": "half-sine", "amplitude": "9 N", "width": 3e-4}),
            "switch",
            2.0,
        )
