"""Figures of quality, safe rate, yield and damping against their numbers."""

import dataclasses
import math

import numpy as np
import pytest
from matplotlib.figure import Figure

import printhammer as ph
from printhammer.figures.quality import plot_safe_rate
from printhammer.printing.dots.judging import FAULTS, Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.damping import DampingStudy, Material
from printhammer.printing.rates.quality import Quality
from printhammer.printing.rates.safe_rate import SafeRate
from printhammer.printing.rates.tolerance import ToleranceYield


def lines(drawn: Figure, gid: str) -> list[tuple[np.ndarray, np.ndarray]]:
    return [line.get_data() for ax in drawn.axes for line in ax.lines if line.get_gid() == gid]


def words(drawn: Figure) -> str:
    found = [text.get_text() for ax in drawn.axes for text in [*ax.texts, ax._left_title, ax._right_title]]
    extra = [text.get_text() for text in (drawn._suptitle, drawn._supxlabel) if text is not None]
    return "\n".join([*found, *extra])


@pytest.fixture(scope="module")
def report(hammer: "ph.Hammer") -> Quality:
    return ph.quality(hammer, 900.0, "1101")


@pytest.fixture(scope="module")
def rates(hammer: "ph.Hammer") -> SafeRate:
    return ph.safe_rate(hammer, first=300.0, last=1800.0, step=300.0, stop=False, tolerance=1e-7)


def test_every_dot_is_where_it_is(report: Quality) -> None:
    force = np.array([1.0, 1.05, np.nan]) * report.nominal.force
    arrival = np.array([0.0, 60e-6, np.nan])
    lost = np.array([False, False, True])
    fault = np.array([-1, FAULTS.index("arrival"), FAULTS.index("lost")])
    made = dataclasses.replace(report, force=force, arrival_deviation=arrival, lost=lost, fault=fault)
    drawn = made.plot()
    (good,), (off,) = lines(drawn, "within limits"), lines(drawn, "off")
    np.testing.assert_allclose(good, [[0.0], [0.0]], atol=1e-12)
    np.testing.assert_allclose(off, [[60.0], [5.0]])
    assert [x.tolist() for x, _ in lines(drawn, "lost")] == [[3], [3]]
    assert "1 of 3 dots within limits" in words(drawn)


def test_of_many_slots_those_with_the_worst_are_shown(report: Quality) -> None:
    count = 300
    arrival = np.zeros(count)
    arrival[200] = 1e-3
    made = dataclasses.replace(
        report,
        wanted=np.ones(count, bool),
        slot=np.arange(count),
        force=np.full(count, report.nominal.force),
        arrival_deviation=arrival,
        lost=np.zeros(count, bool),
        extra_contacts=np.zeros(count, int),
        fault=np.where(arrival > 0.0, FAULTS.index("arrival"), -1),
    )
    low, high = made.plot().axes[1].get_xlim()
    assert low < 200 < high
    assert high - low < 70


def test_slots_of_a_cycle_are_counted_from_its_beginning(report: Quality) -> None:
    led_in, count = 64, 256
    arrival = np.zeros(count)
    arrival[-3] = 1e-3
    made = dataclasses.replace(
        report,
        judged_from=led_in,
        wanted=np.ones(led_in + count, bool),
        slot=led_in + np.arange(count),
        force=np.full(count, report.nominal.force),
        arrival_deviation=arrival,
        lost=np.zeros(count, bool),
        extra_contacts=np.zeros(count, int),
        fault=np.where(arrival > 0.0, FAULTS.index("arrival"), -1),
    )
    _plane, force, axes = made.plot().axes
    for ax in (force, axes):
        shown = ax.collections[-1].get_offsets()[:, 0]
        assert (shown.min(), shown.max()) == (count - 64, count - 1)
        assert ax.get_xlim()[1] == count
    assert axes.get_xlabel() == "Slot of the cycle; the 64 with the worst dot"


def test_a_report_of_a_run_that_stopped_says_so(report: Quality) -> None:
    assert "range left" in words(dataclasses.replace(report, status="range left").plot())


def test_the_safe_rate_is_marked(rates: SafeRate) -> None:
    drawn = rates.plot()
    marks = lines(drawn, "safe rate")
    assert rates.failure is not None
    assert [x[0] for x, _ in marks] == [rates.rate] * 2
    assert rates.failure.text in words(drawn).replace("\n", " ")
    low = drawn.axes[0].lines[0].get_ydata()
    np.testing.assert_allclose(low, 100.0 * rates.force_low)
    both = plot_safe_rate(rates, dataclasses.replace(rates, strategy="other"))
    assert {text.get_text() for text in both.axes[0].get_legend().get_texts()} == {"open loop", "other"}
    none = dataclasses.replace(rates, rate=math.nan)
    assert lines(none.plot(), "safe rate") == []


def test_yields_are_drawn_with_and_without_a_rate(hammer: "ph.Hammer") -> None:
    factors = np.linspace(0.99, 1.01, 8)[:, np.newaxis] * np.ones(2)
    common = ToleranceYield(
        hammer=hammer,
        strategy="open loop",
        limits=Limits(),
        rate=math.nan,
        spreads={"mass": 0.01, "magnet.Am": 0.01},
        factors=factors * np.array([[1.0, 1.0]]),
        judged_by="own",
        status=np.array(["ok"] * 7 + ["does not rest"]),
        single_force=np.append(np.linspace(20.0, 21.0, 7), np.nan),
        single_flight_time=np.append(np.linspace(3e-4, 3.1e-4, 7), np.nan),
        passed=np.array([True] * 7 + [False]),
        safe_rates=np.array([600.0, 600.0, 650.0, 650.0, 700.0, 700.0, 700.0, np.nan]),
        grid=np.arange(500.0, 1000.0, 50.0),
        seed=0,
        tolerance=5e-7,
    )
    drawn = common.plot()
    (steps,) = [line.get_ydata() for line in drawn.axes[0].lines if len(line.get_xdata()) > 2]
    assert steps[0] == pytest.approx(100.0 * 7 / 8)
    assert min(steps) == 0.0
    assert "1 of 8 sampled hammers" in words(drawn)
    assert "7 pass" in {
        text.get_text()
        for text in dataclasses.replace(common, rate=600.0).plot().axes[0].get_legend().get_texts()
    }


def test_every_material_is_drawn(hammer: "ph.Hammer") -> None:
    kinds = ("as it is", "hard", "elastomer", "pack", "hard")
    numbers = np.array([0.3, 0.1, 0.0, 0.35, np.nan])
    found = DampingStudy(
        hammer=hammer,
        limits=Limits(),
        current_limit=2.0,
        nominal=nominal(hammer),
        materials=tuple(Material(kind, f"material {n}", {}) for n, kind in enumerate(kinds)),
        status=np.array(["ok", "ok", "ok", "current limit", "no hammer"]),
        **dict.fromkeys(
            (
                "amplitude",
                "peak_current",
                "force",
                "flight_time",
                "settle_out",
                "rebounds",
                "highest",
                "restitution",
                "impulse",
                "loss",
                "backstop_force",
                "coil_work",
            ),
            numbers,
        ),
        safe_rate=np.array([800.0, 1300.0, np.nan, 900.0, np.nan]),
        grid=np.arange(400.0, 1500.0, 100.0),
        tolerance=5e-7,
    )
    drawn = found.plot()
    for ax, values in zip(drawn.axes, (found.safe_rate, 1e3 * numbers, 1e3 * numbers), strict=True):
        drawn_bars = {bar.get_gid(): bar.get_width() for bar in ax.patches}
        expected = {f"bar-{row}": value for row, value in enumerate(values) if np.isfinite(value)}
        assert drawn_bars == expected
    assert [text.get_text() for text in drawn.axes[0].get_yticklabels()] == [
        f"material {row}" for row in range(5)
    ]
    told = words(drawn)
    assert "not even 400 Hz" in told
    assert "no hammer" in told
    assert "hollow: over 2 A" in told
    assert found.best == 1
