"""Bursts of least work without the slow search: components, files, pictures, rejected input."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from tests import hammers
from tests.errors import refused

import printhammer as ph
from printhammer.control.least_work import search
from printhammer.control.least_work.bound import bound
from printhammer.control.least_work.burst import LeastWork, NoBurstError
from printhammer.control.least_work.pulses import PulsePlan
from printhammer.control.least_work.rates import least_work_rates
from printhammer.control.least_work.search import printing_current
from printhammer.control.least_work.slot import CoilForce, NodeCurrent, Outcomes, SlotState, Task, node_times
from printhammer.control.pulses import steepest_rise, widest
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Trapezoid, Waveform
from printhammer.printing.dots.nominal import nominal
from printhammer.run.ensemble_group import Group


def thrown(task: Any, begin: SlotState, duration: float, arrival: float, nodes: int, *_: Any) -> np.ndarray:
    """A current that throws the armature in time for an adequate dot, without a search."""
    times = node_times(duration, nodes)[1:]
    return np.where((times > arrival - 3.5e-4) & (times < arrival + 1e-4), 0.9 * task.largest, 0.0)


def let_go(_task: Any, _begin: SlotState, _duration: float, nodes: int) -> np.ndarray:
    return np.zeros(nodes)


@pytest.fixture
def unsearched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "printing_current", thrown)
    monkeypatch.setattr(search, "landing_current", let_go)


@pytest.fixture
def burst(unsearched: None) -> LeastWork:
    return ph.least_work(hammers.crude().replace("coil.resistance", "5 ohm"), rate="400 Hz", dots=2)


def test_the_burst_is_one_current_fired_slot_by_slot(burst: LeastWork) -> None:
    times, values = burst.nodes
    assert burst.drive.times.size == burst.count == 2
    assert np.diff(times) == pytest.approx(np.full(len(times) - 1, times[1]), rel=1e-9)
    record = Sampled.from_samples(times, values, interpolation="linear")
    once = ph.simulate(burst.hammer, ph.PulseTrain(record), duration=burst.motion.end)
    assert once.coil_work.net == pytest.approx(burst.work.net, rel=1e-7)
    assert once.end == burst.motion.end
    moments = np.linspace(0.0, burst.drive.end * 0.999, 777)
    assert burst.drive.value(moments) == pytest.approx(np.interp(moments, times, values), abs=1e-9)


def test_ratios_are_those_of_the_ledger(burst: LeastWork) -> None:
    ledger, work = burst.ledger, burst.work
    assert burst.net_ratio == work.net / ledger.pack_loss
    assert burst.net_ratio == pytest.approx(1.0 + ledger.backstop_loss / ledger.pack_loss, rel=1e-4)
    assert burst.positive_ratio >= burst.net_ratio
    assert work.heat == pytest.approx(5.0 * work.squared_current)
    assert burst.slots[1] - burst.slots[0] == pytest.approx(1.0 / 400.0)
    assert 0.0 < burst.rest_time <= burst.motion.end


def test_weak_dots_are_counted(unsearched: None) -> None:
    options: dict[str, Any] = {"rate": "400 Hz", "dots": 2, "largest": "1.2 A"}
    strong = ph.least_work(hammers.crude(), force=0.3, **options)
    weak = ph.least_work(hammers.crude(), force=2.0, **options)
    assert weak.forces == pytest.approx(strong.forces)
    assert (strong.adequate, weak.adequate) == (2, 0)


def test_a_burst_that_prints_nothing_has_no_ratios(unsearched: None) -> None:
    found = ph.least_work(hammers.crude(), rate="400 Hz", dots=1, largest="0.5 A")
    assert found.contacts == ()
    assert found.adequate == 0
    assert math.isnan(found.net_ratio)
    assert found.deviations.size == 0
    assert found.plot().axes


def test_supply_scales_the_current(burst: LeastWork) -> None:
    found = burst.under_supply([-0.05, 0.0])
    assert found.status.tolist() == ["ok", "ok"]
    assert found.weakest[1] == pytest.approx(burst.forces.min(), rel=1e-6)
    assert found.weakest[0] < found.weakest[1]
    with refused("changes"):
        burst.under_supply([-1.0])


def test_files(burst: LeastWork, tmp_path: Path) -> None:
    burst.save(tmp_path / "burst.nc")
    with xr.open_dataset(tmp_path / "burst.nc", engine="scipy") as kept:
        np.testing.assert_array_equal(kept["x"], burst.motion.x)
        assert kept["current"].attrs["units"] == "A"
        assert kept.attrs["net_work"] == burst.work.net
        assert kept.attrs["hammer_fingerprint"] == burst.hammer.fingerprint
    burst.save(tmp_path / "current.csv")
    table = pd.read_csv(tmp_path / "current.csv", comment="#")
    assert table["current [A]"].tolist() == burst.nodes[1]
    record = Sampled(file=str(tmp_path / "current.csv"), interpolation="linear")
    assert record.times == pytest.approx(np.array(burst.nodes[0]), rel=1e-12, abs=1e-18)
    with refused(None, file="burst.txt"):
        burst.save(tmp_path / "burst.txt")


def test_the_picture_shows_motion_current_power_and_ledger(burst: LeastWork) -> None:
    figure = burst.plot()
    motion, current, power, ledger = figure.axes
    line = next(line for line in motion.lines if line.get_gid() == "displacement")
    assert np.asarray(line.get_ydata()) == pytest.approx(1e6 * burst.motion.x)
    assert {line.get_gid() for line in current.lines} >= {"current"}
    assert [area.get_gid() for area in power.collections] == ["given", "taken back"]
    widths = [bar.get_width() for bar in ledger.patches]
    assert widths[:3] == pytest.approx([1.0, burst.net_ratio, burst.positive_ratio])
    assert [text.get_text() for text in power.get_legend().get_texts()] == [
        "supplied by the coil",
        "recovered by the coil",
    ]
    assert "-0.000" not in [text.get_text() for text in ledger.texts]


def test_no_current_found_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "printing_current", lambda *_: None)
    with pytest.raises(NoBurstError, match=r"at most 2 A .* dot 1 of 8 with 0\.9 .* 1000 Hz"):
        ph.least_work(hammers.crude(), slew=2e4)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"rate": 0.0}, "rate"),
        ({"rate": "3 mm"}, "rate"),
        ({"dots": 0}, "dots"),
        ({"dots": 1001}, "dots"),
        ({"force": -1.0}, "force"),
        ({"force": 2.5}, "force"),
        ({"largest": "0 A"}, "largest"),
        ({"slew": -3.0}, "slew"),
        ({"spacing": "0 us"}, "spacing"),
        ({"least": "noise"}, "least"),
        ({"shape": "round"}, "shape"),
    ],
)
def test_bad_input_is_one_sentence(options: dict[str, Any], key: str) -> None:
    with refused(key):
        ph.least_work(hammers.crude(), **options)


def test_hammers_that_cannot_swing_are_refused() -> None:
    with refused("magnet"):
        ph.least_work(hammers.shelf())
    jump = Rectangle(amplitude=2.0, width=3e-4, rise=0.0, decay=0.0)
    with refused("waveform"):
        ph.least_work(hammers.crude().replace("waveform", jump))


@pytest.mark.parametrize(
    ("waveform", "expected"),
    [
        (HalfSine(amplitude=2.0, width=3e-4), 2.0 * math.pi / 3e-4),
        (Rectangle(amplitude=2.0, width=3e-4, rise=5e-5, decay=2e-5), 2.0 / 5e-5),
        (Trapezoid(amplitude=-2.0, rise=4e-5, width=1e-4, fall=1e-5), 2.0 / 4e-5),
        (Trapezoid(amplitude=2.0, rise=0.0, width=1e-4, fall=1e-5), math.inf),
    ],
)
def test_steepest_rise_in_closed_form(waveform: Waveform, expected: float) -> None:
    assert steepest_rise(waveform) == pytest.approx(expected, rel=1e-4)


@given(
    st.lists(st.floats(-50.0, 50.0), min_size=2, max_size=20),
    st.floats(-2.0, 2.0),
    st.floats(0.1, 5.0),
    st.booleans(),
)
def test_currents_keep_their_bounds(wanted: list[float], begin: float, reach: float, to_zero: bool) -> None:
    task: Any = SimpleNamespace(largest=2.0)
    found = search._within(task, np.array(wanted), begin, reach, to_zero)
    steps = np.diff(np.concatenate([[begin], found]))
    assert np.abs(found).max() <= 2.0
    if not to_zero or abs(begin) <= reach * (len(wanted) + 1):
        assert np.abs(steps).max() <= reach * (1.0 + 1e-12) + 1e-15
    if to_zero:
        assert abs(found[-1]) <= reach


def test_a_slot_gives_what_the_whole_run_gives() -> None:
    hammer = hammers.crude()
    begin = SlotState(ph.rest_state(hammer), 0.0, -1, 0.0, 0.0)
    values = np.array([[0.8, 1.6, 1.6, 0.2, 0.0, 0.0], [0.5, 1.7, 1.2, 0.0, 0.1, 0.0]])
    task = Task(hammer, CoilForce(hammer, 2.0), 2.0, 1e4, 20.0, 1e-3, False, 1e-10)
    found = task.run(begin, values, 8e-4, 1e-10)
    for row, currents in enumerate(values):
        path = np.concatenate([[0.0], currents])
        record = Sampled.from_samples(node_times(8e-4, 6), path, interpolation="linear")
        motion = ph.simulate(hammer, ph.PulseTrain(record), duration=8e-4)
        assert found.net[row] == pytest.approx(motion.coil_work.net, rel=1e-3, abs=1e-7)
        assert found.positive[row] == pytest.approx(motion.coil_work.positive, rel=1e-3, abs=1e-7)
        assert found.squared_current[row] == pytest.approx(motion.coil_work.squared_current, rel=1e-3)
        dot = motion.dots[0]
        assert dot.struck
        assert found.arrival[row] == pytest.approx(dot.flight_time, rel=1e-7)


def test_a_node_current_is_the_sampled_one() -> None:
    values = (0.0, 1.0, -0.5, 0.25)
    mine = NodeCurrent(duration=3e-4, values=values, largest=2.0)
    record = Sampled.from_samples(node_times(3e-4, 3), values, interpolation="linear")
    times = np.linspace(-1e-5, 3.2e-4, 200)
    assert mine.value(times) == pytest.approx(record.value(times), abs=1e-12)
    assert mine.scaled(2.0).value(1e-4) == pytest.approx(2.0 * mine.value(1e-4))


def test_harder_dots_cost_less_for_what_they_give() -> None:
    hammer = hammers.crude()
    single = nominal(hammer)
    shares = [bound(hammer, single, force, 2.0) for force in (0.7, 0.9, 1.2)]
    for found in shares:
        assert found.loading < found.later <= found.first
        assert found.burst(3) == pytest.approx(found.first + 2.0 * found.later)
    ratios = [found.first / found.loading for found in shares]
    assert ratios == sorted(ratios, reverse=True)


def test_works_against_the_rate(monkeypatch: pytest.MonkeyPatch, unsearched: None, tmp_path: Path) -> None:
    def not_above(task: Any, begin: SlotState, duration: float, *rest: Any) -> Any:
        return thrown(task, begin, duration, *rest) if duration > 1.5e-3 else None

    monkeypatch.setattr(search, "printing_current", not_above)
    told: list[tuple[int, int]] = []
    found = least_work_rates(
        hammers.crude(), ["400 Hz", 1000.0], dots=2, progress=lambda *at: told.append(at), force=0.3
    )
    assert told == [(1, 2), (2, 2)]
    assert found.status.tolist() == ["ok", "no current found"]
    assert found.adequate.tolist() == [2, 0]
    alone = ph.least_work(hammers.crude(), rate=400.0, dots=2, force=0.3)
    assert found.positive_ratio[0] == alone.positive_ratio
    assert np.isnan(found.net_ratio[1])
    table = found.to_dataset()
    assert table["rate"].values.tolist() == [400.0, 1000.0]
    figure = found.plot()
    assert np.asarray(figure.axes[0].lines[0].get_ydata())[0] == alone.positive_ratio
    for wrong in ([], "400 Hz"):
        with refused("rates"):
            least_work_rates(hammers.crude(), wrong)


@pytest.mark.slow
def test_pulses_of_the_hammer_swing_too() -> None:
    found = ph.least_work(ph.load("hendriks-1983"), dots=1, shape="pulses", largest="2 A")
    assert found.adequate == 1
    assert found.drive.peak <= 2.0
    assert {type(waveform) for waveform in found.drive.waveforms} == {type(found.hammer.waveform)}
    assert 1.0 <= found.net_ratio < 1.1
    assert found.positive_ratio >= found.bound_ratio
    with refused("shape", "pulses"):
        _ = found.nodes


@pytest.mark.parametrize(("lag", "allowed"), [(0.0, True), (1e-10, True), (1e-7, False)])
def test_a_current_that_lags_in_the_pack_is_none(
    monkeypatch: pytest.MonkeyPatch, lag: float, allowed: bool
) -> None:
    """Also where it costs least: reloaded, the law as printed jumps, and gives back too much."""

    def as_asked(_self: Task, _begin: SlotState, currents: Any, *_rest: float) -> Outcomes:
        same = np.ones(len(currents))
        none = np.zeros(len(currents), dtype=np.int64)
        return Outcomes(same, same, same, 20.0 * same, 5e-4 * same, none, lag * same, none == 0)

    monkeypatch.setattr(Task, "run", as_asked)
    task = Task(hammers.crude(), CoilForce(hammers.crude(), 2.0), 2.0, 1e4, 20.0, 1e-3, False, 1e-9)
    begin = SlotState(1e-4, 0.0, -1, 0.0, 0.0)
    found = printing_current(task, begin, 1e-3, 5e-4, 8)
    assert (found is not None) == allowed


def test_the_widest_pulse_in_closed_form() -> None:
    pulse = Rectangle(amplitude=3.0, width=1e-4, rise=2e-4, decay=2e-5)
    assert widest(pulse, 2.0, 0.0, 1.0, 60) == pytest.approx(2e-4 * math.log(3.0), rel=1e-9)
    assert widest(pulse, 3.5, 0.0, 1e-3, 60) == 1e-3
    assert widest(HalfSine(amplitude=3.0, width=1e-4), 2.0, 0.0, 1.0, 60) == 0.0


def test_pulses_without_a_width_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    # Lanes would be compiled for half sines.
    monkeypatch.setattr(Group, "fits_lanes", lambda _group: False)
    record = Sampled.from_samples([0.0, 1e-4, 3e-4, 4e-4], [0.0, 2.0, 2.0, 0.0])
    task: Any = SimpleNamespace(hammer=hammers.crude(), largest=2.0)
    with refused("waveform"):
        PulsePlan(task, record, 1e-3, 1e-4, 1e-3, 1e-3, 5e-5)
    with refused("width"):
        ph.least_work(
            hammers.crude().replace("waveform", HalfSine(amplitude=4.0, width=4e-4)),
            shape="pulses",
            largest="2 A",
        )


def test_a_missing_part_and_a_missing_current_are_refused_in_one_sentence() -> None:
    for name, faults in {
        "pot-magnet": ("a voltage", "no spring"),
        "relay-5v": ("a voltage",),
        "bouncing-ball": ("no magnet", "no pack"),
        "tung-shaw-1988": ("a force", "no magnet"),
    }.items():
        with pytest.raises(ph.InputError) as refusal:
            ph.least_work(ph.load(name))
        assert all(fault in str(refusal.value) for fault in faults)
        assert refusal.value.file == ph.load(name).path
        assert refusal.value.key == ("magnet" if name == "bouncing-ball" else "waveform")
