"""Tuning: dots match the single pulse, the current stays below its limit, threads do not matter."""

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import crude

import printhammer as ph
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import COLUMNS, driven_by, print_pulse
from printhammer.control.table.report import (
    PERTURBATIONS,
    SETS,
    STRATEGIES,
    TableReport,
    between,
    random_patterns,
)
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.strategy import slot_times
from printhammer.printing.rates.variability import Perturbation

RATE = 1850.0
"""Slots per second at which rebounds of the hammer of these tests disturb the next dot."""

SLOTS = (0, 1, 2, 4, 5, 8, 9, 10, 11, 13, 17, 18)
"""A pattern that no table is tuned on."""


def quick() -> ph.Hammer:
    """The crude hammer with a pulse that ends before the touch."""
    return crude().replace({"waveform.amplitude": 1.3, "waveform.width": 200e-6})


@pytest.fixture(scope="module")
def table() -> CompensationTable:
    return ph.tune(quick(), rate=RATE, history=1, brake=False)


def off(drive: object) -> tuple[float, float]:
    """Return the largest deviations of force, relative, and arrival, s, of the dots of `SLOTS`."""
    hammer = quick()
    single = nominal(hammer)
    dots = ph.simulate(hammer, drive).dots  # type: ignore[arg-type]
    assert all(dot.struck and dot.extra_contacts == 0 for dot in dots)
    force = np.array([dot.peak_force for dot in dots], dtype=float) / single.force - 1.0
    touched = np.array([dot.fired_at + (dot.flight_time or 0.0) for dot in dots])
    arrival = touched - slot_times(SLOTS, RATE) - single.flight_time
    return float(np.abs(force).max()), float(np.abs(arrival).max())


def test_every_dot_is_like_the_single_pulse(table: CompensationTable) -> None:
    hammer = quick()
    assert hammer.waveform is not None
    without = off(ph.PulseTrain(hammer.waveform, at=slot_times(SLOTS, RATE).tolist()))
    with_table = off(table.drive(hammer, SLOTS, RATE))
    assert without[0] > 0.1
    assert with_table[0] < 0.05
    assert with_table[1] < 10e-6


def test_a_dot_from_rest_is_fired_as_ever(table: CompensationTable) -> None:
    hammer = quick()
    assert hammer.waveform is not None
    drive = table.drive(hammer, (0, 9), RATE)
    assert drive == ph.PulseTrain(hammer.waveform, at=slot_times((0, 9), RATE).tolist())


def test_the_table_does_not_depend_on_threads() -> None:
    one, two = (ph.tune(quick(), rate=RATE, history=1, brake=False, threads=count) for count in (1, 2))
    assert all(np.array_equal(getattr(one, name), getattr(two, name)) for name in (*COLUMNS, "deviation"))


@pytest.mark.slow
def test_longer_histories_begin_with_shorter_ones(table: CompensationTable) -> None:
    longer = ph.tune(quick(), rate=RATE, history=2)
    # 1-rest of the longer one is 1 of the shorter, tuned in the same pattern.
    assert longer.width[0, 3] == pytest.approx(table.width[0, 1], rel=1e-3)
    assert longer.worst[0] < 0.5


@pytest.mark.slow
def test_the_current_keeps_to_its_bound_also_with_brake_pulses() -> None:
    hammer = quick()
    found = ph.tune(hammer, rates=[1200.0, 1300.0], history=1, largest_current=1.3)
    assert found.brake_width.max() > 0.0
    for rate in found.rates.tolist():
        drive = found.drive(hammer, SLOTS, rate)
        times = np.linspace(0.0, float(drive.times[-1]) + 1e-3, 200_001)
        assert np.abs(drive.value(times)).max() <= 1.3


@pytest.mark.parametrize("driver", ["switch", "bridge"])
def test_a_driver_that_saturates_at_the_limit_may_be_on_for_longer(driver: str) -> None:
    """Its current never exceeds the limit, however wide the pulse; dots that lose energy need that."""
    hammer = ph.load("hendriks-1983")
    driven = driven_by(hammer, driver, 2.0)
    own, widest = print_pulse(driven, 2.0)
    assert own.peak == pytest.approx(2.0, rel=1e-6)
    assert widest == pytest.approx(1.5 * own.width, rel=1e-12)
    rate = 1.5 * 815.0
    table = ph.tune(hammer, rate=rate, driver=driver, history=1, reach=1)
    assert table.width.max() > 1.2 * own.width
    assert table.deviation.max() < 0.1
    drive = table.strategy(hammer)(hammer, [SLOTS], rate)[0]
    assert drive.peak <= 2.0


def test_a_rate_at_which_nothing_prints() -> None:
    with refused("rate"):
        ph.tune(quick(), rate="6 kHz", history=1, reach=1)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"rate": 0.0}, "rate"),
        ({"rate": "1 mm"}, "rate"),
        ({"rate": 800.0, "rates": [900.0]}, "rates"),
        ({"rates": []}, "rates"),
        ({"rates": "800 Hz"}, "rates"),
        ({"rates": [900.0, 800.0]}, "rates"),
        ({"rate": 800.0, "history": 5}, "history"),
        ({"rate": 800.0, "reach": 0}, "reach"),
        ({"rate": 800.0, "largest_current": 0.0}, "largest_current"),
    ],
)
def test_bad_arguments(arguments: dict[str, object], key: str) -> None:
    with refused(key):
        ph.tune(quick(), **arguments)  # type: ignore[arg-type]


@pytest.mark.slow
def test_report(table: CompensationTable) -> None:
    cases = (Perturbation(), Perturbation(travel=5e-6))
    report = ph.judge_table(quick(), table, perturbations=cases)
    assert report.good.shape == (len(STRATEGIES), 2, 1, len(SETS))
    assert (report.good[1] > report.good[0]).all()
    assert report.passed[1, 0].all()
    assert not report.passed[0, 0].any()
    assert (np.abs(report.multiplier[1]) < 1.0).all()
    chart = report.to_dataset()
    assert chart["driven"].values.tolist() == ["nominal", "travel +5 µm"]
    assert chart["arrival"].attrs["units"] == "s"
    # The worst dot of the cycle is in the numbers and among the dots kept for the histogram.
    worst = np.abs(report.force_deviation[1]).max()
    assert worst == pytest.approx(report.force[1, 0, 0, 1], rel=1e-12)


def test_a_table_with_unstable_rows_does_not_pass(table: CompensationTable) -> None:
    """Rejected even if the simulated rows are within limits: an error grows 3.45 times per dot."""
    shape = len(STRATEGIES), 1, 1, len(SETS)
    good = {name: np.zeros(shape) for name in ("force", "arrival", "lost", "extra")}
    dots = dict.fromkeys(("force_deviation", "arrival_deviation"), np.zeros((2, 4)))

    def report(growth: float) -> TableReport:
        return TableReport(
            table=table,
            hammer=quick(),
            hammers=("nominal",),
            rates=np.array([RATE]),
            limits=Limits(),
            good=np.ones(shape),
            multiplier=np.full(shape[:3], growth),
            seed=1,
            tolerance=1e-8,
            **good,
            **dots,
        )

    for growth in (-0.9, np.nan):
        assert report(growth).passed.all()
        assert "grows" not in report(growth).summary().text()
    assert report(-3.45).passed.tolist() == [[[True]], [[False]]]
    assert "grows" in report(-3.45).summary().text()


def test_what_is_judged_by_default(table: CompensationTable) -> None:
    assert between(table) == [RATE]
    assert PERTURBATIONS[0] == Perturbation()
    drawn = random_patterns(7)
    assert drawn == random_patterns(7)
    assert drawn != random_patterns(8)
    assert min(len(slots) for slots in drawn) > 0


def test_a_report_of_nothing(table: CompensationTable) -> None:
    with refused("rates"):
        ph.judge_table(quick(), table, perturbations=())


def test_a_strategy_does_not_change_with_the_hammer_driven(table: CompensationTable) -> None:
    strategy = table.strategy(quick())
    other = quick().replace("mass", 1.05 * quick().mass)
    assert strategy(other, [SLOTS], RATE) == strategy(quick(), [SLOTS], RATE)
