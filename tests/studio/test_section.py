"""The strobe section of the studio is that of the laboratory."""

from typing import Any

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.server import STATE

import printhammer as ph
from printhammer.derivatives.states import strobe_exponent
from printhammer.studio import bounds
from printhammer.studio.frames import unframe
from printhammer.studio.pictures.section import check_strobe, strobe_frame
from printhammer.studio.states.state import State, read_state

TEXT = CRUDE.read_text("utf-8")


def of(**changed: Any) -> State:
    return read_state({**STATE, "text": TEXT, **changed})


def test_the_points_are_those_of_the_library() -> None:
    state = of(rate=1000.0)
    heading, found = unframe(strobe_frame(state, 1, 20))
    points = ph.strobe(state.changed, rate=1000.0, points=20, verdict=False)
    np.testing.assert_array_equal(found["x"], np.float32(points.x))
    assert (heading["verdict"], heading["exponent"]) == (None, None)


def test_points_that_follow_leave_those_before_as_they_are() -> None:
    state = of(rate=1350.0)
    few, many = (unframe(strobe_frame(state, 1, points))[1] for points in (25, 60))
    np.testing.assert_array_equal(few["x"], many["x"][:25])


def test_the_running_exponent_is_over_the_later_half() -> None:
    state = of(rate=1350.0)
    heading, _ = unframe(strobe_frame(state, 1, 40, exponent=True))
    hammer = state.changed
    whole = strobe_exponent(hammer, hammer.waveform, 1.0 / 1350.0, first=21, last=40)
    assert heading["exponent"]["value"] == pytest.approx(whole.value, rel=1e-9)
    assert heading["exponent"]["firings"] == [21, 40]


@pytest.mark.slow
def test_the_verdict_is_that_of_the_library() -> None:
    state = of(rate=1000.0)
    heading, _ = unframe(strobe_frame(state, 1, 20, judged=True))
    judged = ph.strobe(state.changed, rate=1000.0, points=20).verdict
    assert judged is not None
    assert heading["verdict"]["verdict"] == judged.name
    assert heading["verdict"]["phrases"] == judged.phrases


def test_a_section_that_takes_too_long_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    check_strobe(of())
    monkeypatch.setattr(bounds, "MOST_SECTION_STEPS", 100)
    with refused("the first 25 strobe points"):
        check_strobe(of())


def test_a_section_of_a_run_that_fails_is_refused() -> None:
    pulse = {"shape": "half-sine", "amplitude": -90.0, "width": 4e-4}
    with refused("the first 25 strobe points"):
        check_strobe(of(waveform=pulse))
