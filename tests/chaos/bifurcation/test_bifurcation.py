import dataclasses
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.chaos import Bifurcation, strobes
from printhammer.chaos.bifurcation import builder
from printhammer.chaos.bifurcation import diagram as kept
from printhammer.chaos.bifurcation.bifurcation import InterruptedDiagram
from printhammer.chaos.bifurcation.columns import Columns, blank_columns, cycles_of, orbit_distance
from printhammer.chaos.bifurcation.diagram import cells, doublings, hysteresis
from printhammer.chaos.strobe.verdict import period_of, repeats
from printhammer.parts.spring.linear import PreloadSpring
from printhammer.run.regime import Regime

ARRAYS = ("values", "x", "v", "branch", "status", "cycles", "distances", "levels")
SHORT = {"firings": 80, "transient": 40}


def same(one: Bifurcation, other: Bifurcation) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name in ("x", "v", "distances"))
        for name in ARRAYS
    )


def diagram(
    verdicts: dict[str, list[int]], values: list[float], states: np.ndarray | None = None
) -> Bifurcation:
    """Return a diagram with given periods; -1 denotes a strange train."""
    cycles = np.array(list(verdicts.values()))
    shape = cycles.shape
    strange = cycles < 0
    points = np.zeros((*shape, 16)) if states is None else states
    hammer = ph.load(CRUDE)
    return Bifurcation(
        regime=Regime.of(hammer, period=1e-3),
        parameter="period",
        values=np.array(values),
        directions=tuple(verdicts),
        firing=np.arange(1, 17),
        x=points,
        v=np.zeros_like(points),
        branch=np.zeros(points.shape, np.int8),
        status=np.full(shape, "ok", "U16"),
        cycles=np.where(strange, 0, cycles),
        distances=np.zeros(shape),
        exponents=np.where(strange, 0.5, np.nan),
        standard_errors=np.where(strange, 0.01, np.nan),
        sensitive=np.zeros(shape, np.bool_),
        levels=np.zeros(len(values), np.int64),
        carried=0,
        tolerance=1e-9,
    )


def test_from_rest_every_column_is_the_strobe_of_its_train(hammer: "ph.Hammer") -> None:
    periods = [0.9e-3, 1.05e-3, 1.3e-3]
    found = ph.bifurcation(hammer, periods=periods, refine=0, **SHORT)
    assert found.directions == ("from rest",)
    trains = strobes(hammer, periods, points=40, transient=40, tolerance=found.tolerance, verdict=False)
    for k, train in enumerate(trains):
        np.testing.assert_array_equal(found.x[0, k], train.x)
        np.testing.assert_array_equal(found.v[0, k], train.v)
        np.testing.assert_array_equal(found.branch[0, k], train.branch)
    np.testing.assert_array_equal(found.firing, trains[0].firing)


def test_rates_and_periods_are_the_same(hammer: "ph.Hammer") -> None:
    periods = np.array([2.0**-10, 2.0**-9])
    by_period = ph.bifurcation(hammer, periods=periods, refine=0, **SHORT)
    by_rate = ph.bifurcation(hammer, rates=1.0 / periods[::-1], refine=0, **SHORT)
    np.testing.assert_array_equal(by_rate.x[:, ::-1], by_period.x)


@pytest.mark.parametrize("direction", ["from rest", "both"])
def test_the_result_does_not_depend_on_threads(
    hammer: "ph.Hammer", direction: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(builder, "STRAND", 4)
    options = {"periods": np.linspace(1.24e-3, 1.34e-3, 10), "direction": direction, "refine": 1, **SHORT}
    assert same(ph.bifurcation(hammer, threads=1, **options), ph.bifurcation(hammer, threads=2, **options))


def test_strands_lead_where_a_strict_carrying_does(
    hammer: "ph.Hammer", monkeypatch: pytest.MonkeyPatch
) -> None:
    # In the middle rising and falling values lead to different orbits of period 1.
    periods = [859, 860, 861, 864, 865, 866, 867, 868, 871, 872, 873, 874]
    # Some of them settle slowly.
    settled = {"firings": 360, "transient": 240}
    options = {"periods": 1e-6 * np.array(periods), "direction": "both", "refine": 0, **settled}
    monkeypatch.setattr(builder, "STRAND", 1000)
    strict = ph.bifurcation(hammer, **options)
    assert strict.carried == 0
    # Strands of four that are not closed would show no hysteresis here.
    monkeypatch.setattr(builder, "STRAND", 4)
    found = ph.bifurcation(hammer, **options)
    assert found.carried > 0
    np.testing.assert_array_equal(found.cycles, strict.cycles)
    half = found.regime.window.half_widths
    for way in range(2):
        for k, q in enumerate(found.cycles[way].tolist()):
            if q:
                orbits = [
                    np.column_stack([one.x[way, k, -q:], one.v[way, k, -q:]]) / half
                    for one in (found, strict)
                ]
                assert orbit_distance(*orbits) < 1e-3
    assert hysteresis(found).tolist() == [False] * 3 + [True] * 5 + [False] * 4
    np.testing.assert_array_equal(hysteresis(found), hysteresis(strict))


def test_the_state_is_carried_with_the_pulses_under_way(hammer: "ph.Hammer") -> None:
    periods = [1.1e-3, 1.1005e-3]
    found = ph.bifurcation(hammer, periods=periods, direction="up", refine=0, firings=40, transient=1)
    assert found.status.tolist() == [["ok", "ok"]]
    # The first column is at rest nowhere near its first point; the second goes on close to the first's orbit.
    settled = found.x[0, 0, -1]
    rest = ph.rest_state(hammer)
    assert abs(found.x[0, 1, 0] - settled) < 0.1 * abs(found.x[0, 0, 0] - settled)
    assert abs(found.x[0, 0, 0] - rest) > 0.0


def test_steps_are_halved_where_neighbours_differ(hammer: "ph.Hammer") -> None:
    # Between them a stable orbit of period 1 gives way to one of period 2.
    options = {"direction": "from rest", "firings": 200, "transient": 100}
    rough = ph.bifurcation(hammer, periods=[1.16e-3, 1.17e-3, 1.18e-3, 1.185e-3], refine=0, **options)
    assert rough.cycles[0].tolist() == [1, 1, 1, 2]
    fine = ph.bifurcation(hammer, periods=rough.values, refine=3, **options)
    assert (np.diff(fine.values) > 0.0).all()
    np.testing.assert_array_equal(fine.values[fine.levels == 0], rough.values)
    new = fine.values[fine.levels > 0]
    assert len(new) >= 3
    assert (new > 1.18e-3).all()
    first, second = (int(np.flatnonzero(fine.cycles[0] == q)[end]) for q, end in ((1, -1), (2, 0)))
    # The multiplier is -1 in between; trains too close to it have not settled, and have no verdict.
    assert fine.values[first] < 1.182180514e-3 < fine.values[second]
    assert fine.cycles[0, first + 1 : second].tolist() == [0, 0]
    assert np.diff(fine.values).min() == pytest.approx(5e-6 / 8.0)
    assert fine.levels.max() == 3


def test_a_train_that_takes_turns_about_an_orbit_has_the_period_of_the_orbit() -> None:
    # States two firings apart agree within 300 firings, but still move: the multiplier is close to -1.
    found = ph.bifurcation(ph.load("hendriks-1983-1"), periods=[1.004e-3, 1.0075e-3, 1.0105e-3], refine=0)
    assert found.verdicts[0].tolist() == ["period-1"] * 3


def test_another_constant_can_be_the_parameter(hammer: "ph.Hammer") -> None:
    found = ph.bifurcation(
        hammer, parameter="backstop.damping", values=[4e8, 5e8], period="1.3 ms", refine=0, **SHORT
    )
    alone = ph.bifurcation(hammer.replace("backstop.damping", 5e8), periods=[1.3e-3], refine=0, **SHORT)
    np.testing.assert_array_equal(found.x[0, 1], alone.x[0, 0])
    assert found.regime.quantity("backstop.damping").si == "N s/m^2.5"
    assert found.regime.quantity("waveform.amplitude").si == "A"


def test_exponents_tell_strange_from_undecided(hammer: "ph.Hammer") -> None:
    options = {"periods": [0.95e-3, 1.05e-3, 1.1e-3], "refine": 0, "firings": 200}
    plain = ph.bifurcation(hammer, **options)
    assert plain.verdicts[0].tolist() == ["undecided", "undecided", "period-1"]
    judged = ph.bifurcation(hammer, exponents=True, **options)
    assert judged.verdicts[0, 1] == "strange"
    assert judged.exponents[0, 1] > 0.0
    assert math.isnan(judged.exponents[0, 2])
    # Without the exponents of all trains those on the way are computed.
    for route in plain.routes():
        assert route.complete
    assert plain.routes()[1].first == judged.routes()[1].first == 1.05e-3
    assert plain.routes()[1].periods == [1]


def test_a_run_that_stops_has_a_status_and_the_next_begins_at_rest(hammer: "ph.Hammer") -> None:
    # With strong pulses the armature leaves the range of the magnet.
    short = hammer.replace("magnet.range_max", "290 um")
    values = [0.5, 0.926579285, 1.5]
    found = ph.bifurcation(
        short,
        parameter="waveform.amplitude",
        values=values,
        period="1.3 ms",
        direction="down",
        refine=0,
        **SHORT,
    )
    assert found.status[0, 2] == "range left"
    assert np.isnan(found.x[0, 2]).any()
    assert found.verdicts[0, 2] == "undecided"
    alone = ph.bifurcation(
        short,
        parameter="waveform.amplitude",
        values=values[:2],
        period="1.3 ms",
        direction="down",
        refine=0,
        **SHORT,
    )
    np.testing.assert_array_equal(found.x[0, :2], alone.x[0])


def test_an_interrupted_diagram_keeps_what_is_done(hammer: "ph.Hammer") -> None:
    def stop(done: int, _total: int) -> None:
        if done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        ph.bifurcation(
            hammer, periods=[1.3e-3, 1.31e-3, 1.32e-3, 1.33e-3], direction="up", progress=stop, **SHORT
        )
    assert isinstance(caught.value, InterruptedDiagram)
    found = caught.value.diagram
    assert found.status[0].tolist()[:1] == ["ok"]
    assert found.status[0].tolist()[-1] == "not run"
    assert np.isnan(found.x[0, -1]).all()


def test_progress_comes_to_its_end(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    ph.bifurcation(
        hammer,
        periods=[1.17e-3, 1.18e-3, 1.19e-3],
        direction="both",
        refine=1,
        progress=lambda done, total: told.append((done, total)),
        **SHORT,
    )
    assert told[-1][0] == told[-1][1]
    assert [done for done, _ in told] == sorted(done for done, _ in told)


@given(
    q=st.integers(1, 20),
    noise=st.sampled_from([0.0, 1e-8, 1e-4]),
    seed=st.integers(0, 2**32 - 1),
    in_pack=st.booleans(),
)
def test_periods_are_those_of_the_verdict(q: int, noise: float, seed: int, in_pack: bool) -> None:
    random = np.random.default_rng(seed)
    count = 48
    orbit = random.normal(size=(q, 2))
    states = np.tile(orbit, (count // q + 1, 1))[:count] + noise * random.normal(size=(count, 2))
    branch = np.tile(random.integers(1, 4, q) if in_pack else np.zeros(q, int), count // q + 1)[:count]
    columns = Columns(
        x=states[np.newaxis, :, 0],
        v=states[np.newaxis, :, 1],
        branch=branch[np.newaxis].astype(np.int8),
        memory=np.zeros((1, count)),
        current=np.zeros((1, count)),
        status=np.array(["ok"]),
        last=np.zeros((1, 7)),
    )
    cycles, distances = cycles_of(columns, np.array([-np.inf if in_pack else np.inf]), np.ones((1, 4)))
    expected = repeats(
        np.column_stack([states, np.zeros(count)]), branch if in_pack else 0 * branch, np.ones(3)
    )
    period = period_of(expected)
    assert cycles[0] == (period or 0)
    if period:
        assert distances[0] == expected[period - 1]


def test_columns_that_were_not_run_have_no_period() -> None:
    cycles, distances = cycles_of(blank_columns(2, 10), np.full(2, np.inf), np.ones((2, 4)))
    assert cycles.tolist() == [0, 0]
    assert np.isnan(distances).all()


@given(st.lists(st.floats(0.1, 10.0), min_size=1, max_size=20))
def test_widths_of_cells_add_up_to_the_range(steps: list[float]) -> None:
    values = np.cumsum(steps)
    assert cells(values).sum() == pytest.approx(values[-1] - values[0], abs=1e-12)


def test_windows_and_the_series_of_doublings() -> None:
    found = diagram({"from rest": [1, 1, 2, 4, 8, -1, 3, 3, -1]}, [1, 2, 3, 4, 5, 6, 7, 8, 9])
    spans = found.windows()
    assert [window.verdict for window in spans] == [
        "period-1",
        "period-2",
        "period-4",
        "period-8",
        "strange",
        "period-3",
        "strange",
    ]
    assert [window.width for window in spans] == [1.5, 1.0, 1.0, 1.0, 1.0, 2.0, 0.5]
    assert (spans[5].low, spans[5].high, spans[5].columns) == (7.0, 8.0, 2)
    rising, falling = found.routes()
    assert rising.cascade
    assert rising.periods == [1, 2, 4, 8]
    assert rising.first == 6.0
    assert not falling.cascade
    assert falling.periods == []
    assert falling.first == 9.0
    assert doublings(spans) == [spans[1]]
    assert "after a period-doubling cascade: period-1, period-2" in rising.sentence


def test_trains_that_settle_slowly_do_not_hide_a_series(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bifurcation, "_is_strange", lambda *_arguments: False)
    found = diagram({"from rest": [1, 0, 2, 2, 0, 4, 0, 0, 8, -1]}, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10])
    rising, falling = found.routes()
    assert rising.cascade
    assert rising.periods == [1, 2, 4, 8]
    assert rising.first == 10.0
    assert falling.first == 10.0
    monkeypatch.setattr(kept, "MOST_UNDECIDED", 2)
    rising, _ = found.routes()
    assert not rising.complete
    assert rising.first is None
    assert "the search stopped after 2 undecided" in rising.sentence


def test_a_route_that_begins_with_a_strange_train_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bifurcation, "_is_strange", lambda *_arguments: False)
    rising, _ = diagram({"from rest": [-1, 1]}, [1, 2]).routes()
    assert rising.sentence == "With rising values the very first train, at 1, is strange."


def test_without_a_strange_train_the_route_says_so() -> None:
    found = diagram({"from rest": [1, 2, 1]}, [1, 2, 3])
    rising, falling = found.routes()
    assert rising.first is None
    assert falling.periods == [1, 2, 1]
    assert "no train is strange" in rising.sentence
    with refused("direction"):
        found.windows("up")


def test_hysteresis_is_where_orbits_differ_whatever_their_phase() -> None:
    states = np.zeros((2, 4, 16))
    states[:, 1] = np.tile([1e-5, 2e-5], 8)
    states[1, 1] = np.roll(states[1, 1], 1)
    states[0, 2], states[1, 2] = 1e-5, 2e-5
    found = diagram({"up": [1, 2, 1, 0], "down": [1, 2, 1, 0]}, [1, 2, 3, 4], states)
    assert hysteresis(found).tolist() == [False, False, True, False]
    assert not hysteresis(diagram({"up": [1, 2]}, [1, 2])).any()


def test_a_dataset_and_files_hold_everything(hammer: "ph.Hammer", tmp_path: Path) -> None:
    found = ph.bifurcation(hammer, periods=[1.2e-3, 1.3e-3], direction="both", refine=0, **SHORT)
    chart = found.to_dataset()
    assert chart["x"].dims == ("direction", "column", "firing")
    assert {name: chart[name].attrs["units"] for name in ("x", "v", "value", "cycle")} == {
        "x": "m",
        "v": "m/s",
        "value": "s",
        "cycle": "1",
    }
    assert chart.attrs["hammer_fingerprint"] == hammer.fingerprint
    assert chart.attrs["parameter"] == "period"
    found.save(tmp_path / "diagram.nc")
    with xr.open_dataset(tmp_path / "diagram.nc", engine="scipy") as kept:
        np.testing.assert_array_equal(kept["x"], found.x)
        np.testing.assert_array_equal(kept["cycle"], found.cycles)
    found.save(tmp_path / "diagram.csv")
    table = pd.read_csv(tmp_path / "diagram.csv", comment="#")
    assert len(table) == 4
    assert table["verdict"].tolist() == found.verdicts.reshape(-1).tolist()
    assert list(found.to_dataframe())[:3] == ["direction", "period [s]", "verdict"]
    with refused(None, file="diagram.txt"):
        found.save(tmp_path / "diagram.txt")


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({}, "parameter"),
        ({"periods": [1e-3], "rates": [1e3]}, "parameter"),
        ({"parameter": "mass", "period": 1e-3}, "parameter"),
        ({"parameter": "masse", "values": [1e-3], "period": 1e-3}, "constant"),
        ({"parameter": "mass", "values": [1e-4]}, "period"),
        ({"periods": [1e-3], "period": 1e-3}, "period"),
        ({"periods": [1e-3, 1e-3]}, "period"),
        ({"periods": []}, "period"),
        ({"periods": ["soon"]}, "period"),
        ({"periods": [-1e-3]}, "period"),
        ({"periods": [1e-3], "transient": 999}, "transient"),
        ({"periods": [1e-3], "transient": -1}, "transient"),
        ({"periods": [1e-3], "firings": 0}, "firings"),
        ({"periods": [1e-3], "refine": 0.5}, "refine"),
        ({"periods": [1e-3], "direction": "left"}, "direction"),
        ({"periods": [1e-3], "phase": 1.0}, "phase"),
        ({"periods": [1e-3], "tolerance": 1.0}, "tolerance"),
        ({"periods": [1e-3], "state": (math.nan, 0.0)}, "state"),
        ({"parameter": "mass", "values": [-1.0], "period": 1e-3}, "mass"),
    ],
)
def test_what_makes_no_sense_is_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        ph.bifurcation(hammer, **options)


@pytest.mark.slow
def test_a_hammer_of_other_parts_and_a_force(hammer: "ph.Hammer") -> None:
    oscillator = ph.Hammer.build(1e-3, spring=PreloadSpring(preload=0.0, stiffness=900.0))
    force = ph.SineForce("0.5 N", "100 Hz")
    found = ph.bifurcation(
        oscillator,
        parameter="drive.amplitude",
        values=[0.5, 1.0],
        drive=force,
        refine=0,
        state=(0.0, 0.0),
        **SHORT,
    )
    # Linear: twice the force, twice the motion.
    np.testing.assert_allclose(found.x[0, 1], 2.0 * found.x[0, 0], rtol=1e-5, atol=1e-9)
    assert found.parameter == "drive.amplitude"
    assert dataclasses.is_dataclass(found)
    with refused("waveform"):
        ph.bifurcation(hammer.replace("waveform", None), periods=[1e-3])
