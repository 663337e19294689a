"""What the studio shows is what the laboratory computes."""

from typing import Any

import numpy as np
import pytest
from tests.hammers import CRUDE
from tests.studio.server import STATE

import printhammer as ph
from printhammer.ensemble import DISPLAY_TOLERANCE
from printhammer.maps import TAIL
from printhammer.studio import bounds, engine
from printhammer.studio.frames import unframe
from printhammer.studio.state import State, read_state

TEXT = CRUDE.read_text("utf-8")


def of(**changed: Any) -> State:
    return read_state({**STATE, "text": TEXT, **changed})


def test_the_curves_are_those_of_the_run() -> None:
    state = of(pulses=3)
    data, _ = engine.motion_frame(state, 5)
    heading, found = unframe(data)
    motion = ph.simulate(state.changed, state.drive, tolerance=DISPLAY_TOLERANCE, times=found["t"])
    np.testing.assert_array_equal(found["x"], np.float32(motion.x))
    np.testing.assert_array_equal(found["v"], np.float32(motion.v))
    np.testing.assert_array_equal(found["drive"], np.float32(motion.current))
    for name, force in motion.force.items():
        np.testing.assert_array_equal(found[f"F {name}"], np.float32(force))
    assert np.isin(motion.step_times, found["t"]).all()
    assert (heading["serial"], heading["status"], heading["quantity"]) == (5, "ok", "current")
    assert heading["places"]["backstop"] == state.changed.position
    assert len(found["strobe t"]) == 3


def test_the_dots_are_those_of_the_run() -> None:
    state = of(pulses=4, rate=1000.0)
    _, motion = engine.motion_frame(state, 1)
    heading, _ = unframe(engine.dots_frame(1, motion))
    assert [dot["flight_time"] for dot in heading["dots"]] == [dot.flight_time for dot in motion.dots]
    assert heading["quality"]["struck"] == sum(dot.struck for dot in motion.dots)
    assert heading["energy"]["coil_work"] == motion.energy.coil_work


def test_the_map_is_that_of_the_library_to_its_codes() -> None:
    state = of(low=700.0, high=1500.0, pulses=3)
    heading, found = unframe(engine.map_frame(state, 1, (8, 40), lambda: False))
    end = 2 / 700.0 + TAIL
    times = np.linspace(0.0, end, 40)
    rates = np.linspace(700.0, 1500.0, 8)
    chart = ph.frequency_map(state.changed, rates, pulses=3, times=times, tolerance=DISPLAY_TOLERANCE)
    x = np.clip(chart["displacement"].values, heading["low"], heading["high"])
    shown = heading["low"] + found["codes"] / (engine.GAP - 1) * (heading["high"] - heading["low"])
    assert np.abs(shown - x).max() <= 1.01 * (heading["high"] - heading["low"]) / (engine.GAP - 1)
    assert heading["end"] == pytest.approx(end)


def test_a_gap_of_the_map_has_a_code_of_its_own() -> None:
    x = np.float32([[np.nan, 0.0, 1.0, -5.0, 9.0]])
    assert engine.codes_of(x, 0.0, 1.0).tolist() == [[engine.GAP, 0, engine.GAP - 1, 0, engine.GAP - 1]]


def test_a_map_is_given_up_for_a_newer_state() -> None:
    with pytest.raises(engine.GivenUp):
        engine.map_frame(of(), 1, (64, 64), lambda: True)


def test_the_strobe_points_are_those_of_the_library() -> None:
    state = of(rate=1000.0)
    heading, found = unframe(engine.strobe_frame(state, 1, 20, judged=False))
    points = ph.strobe(state.changed, rate=1000.0, points=20, verdict=False)
    np.testing.assert_array_equal(found["x"], np.float32(points.x))
    assert heading["verdict"] is None


@pytest.mark.slow
def test_the_verdict_is_that_of_the_library() -> None:
    state = of(rate=1000.0)
    heading, _ = unframe(engine.strobe_frame(state, 1, 20, judged=True))
    judged = ph.strobe(state.changed, rate=1000.0, points=20).verdict
    assert heading["verdict"]["verdict"] == judged.name
    assert heading["verdict"]["phrases"] == judged.phrases


def test_a_run_of_too_many_steps_is_no_map() -> None:
    state = of(pulses=2)
    _, motion = engine.motion_frame(state, 1)
    assert engine.too_long(motion) == ""

    class Long:
        steps = 10**9

    assert "expected at most" in engine.too_long(Long())  # type: ignore[arg-type]


def test_a_hammer_that_never_ends_is_given_up_soon() -> None:
    stiff = ph.load(CRUDE).replace("backstop.stiffness", 1e20)
    data, motion = engine.motion_frame(of(text=stiff.to_toml(), pulses=64, rate=10.0), 1)
    heading, _ = unframe(data)
    assert heading["status"] == "step limit"
    assert f"more than {bounds.MOST_STEPS} steps" in heading["message"]
    assert len(data) < 10_000_000
    assert engine.too_long(motion)
