"""What the studio shows is what the laboratory computes."""

from typing import Any

import numpy as np
from tests.hammers import CRUDE
from tests.studio.server import STATE

import printhammer as ph
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.studio import bounds
from printhammer.studio.frames import unframe
from printhammer.studio.pictures import engine
from printhammer.studio.states.state import State, read_state

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


def test_a_hammer_that_never_ends_is_given_up_soon() -> None:
    stiff = ph.load(CRUDE).replace("backstop.stiffness", 1e20)
    data, motion = engine.motion_frame(of(text=stiff.to_toml(), pulses=64, rate=10.0), 1)
    heading, _ = unframe(data)
    assert heading["status"] == "step limit"
    assert f"more than {bounds.MOST_STEPS} steps" in heading["message"]
    assert len(data) < 10_000_000
    assert motion.steps == bounds.MOST_STEPS + 1
