"""Pictures drawn ahead: those of the hammers as they ship, and shown only while there is nothing better."""

import json

import numpy as np
import pytest
from tests.studio.server import STATE
from tests.studio.test_session import Page
from tests.studio.test_workers import Compiler, until

from printhammer.hammer.hammer import load, shipped
from printhammer.studio.frames import unframe
from printhammer.studio.pictures.ahead import frames_ahead, opening
from printhammer.studio.pictures.engine import motion_frame
from printhammer.studio.session import Session
from printhammer.studio.states.state import START, read_state
from printhammer.studio.workers.crew import Crew

VIEWS = ["motion", "map"]


@pytest.mark.parametrize("name", sorted(shipped()))
def test_they_are_what_is_computed(name: str) -> None:
    """Where this fails, `python -m printhammer.studio.pictures.ahead` draws them anew."""
    state = opening(name)
    ahead = {(part := unframe(data))[0]["kind"]: part for data in frames_ahead(state, 7)}
    assert set(ahead) == {"motion", "dots"}
    heading, arrays = ahead["motion"]
    assert (heading["serial"], heading["ahead"]) == (7, True)
    told, known = unframe(motion_frame(state, 7)[0])
    assert set(heading) == {*told, "ahead"}
    assert set(arrays) == set(known)
    stroke = np.ptp(known["x"])
    places = np.interp(known["t"], arrays["t"], arrays["x"])
    # The tolerance for pictures, and what lies between their points.
    assert np.abs(places - known["x"]).max() < 1e-2 * stroke


def test_only_an_opening_has_them() -> None:
    content = {**STATE, "hammer": "hendriks-1983", "views": VIEWS}
    assert len(frames_ahead(read_state(content), 1)) == 3
    other = {"hammer": "bouncing-ball"}
    for changed in ({"rate": 1201.0}, {"constants": {"mass": 1e-3}}, {"pulses": 2}, other):
        assert frames_ahead(read_state({**content, **changed}), 1) == []
    text = load("hendriks-1983").to_toml()
    assert frames_ahead(read_state({**content, "hammer": "", "text": text}), 1) == []


def test_the_start_is_that_of_the_page() -> None:
    assert {key: value for key, value in STATE.items() if key not in ("hammer", "views")} == {
        key: value for key, value in START.items() if key != "views"
    }


def test_they_are_shown_while_machine_code_is_made() -> None:
    page = Page()
    hired: list[Compiler] = []

    def hire() -> Compiler:
        hired.append(Compiler())
        return hired[-1]

    made = Session(page.take, crew=(crew := Crew(hire)))
    content = {**STATE, "hammer": "hendriks-1983", "views": VIEWS}
    try:
        made.receive(json.dumps({"kind": "state", "serial": 1, "state": content}))
        found = page.until("map")
        assert [frame["kind"] for frame in found if frame.get("ahead")] == ["motion", "dots", "map"]
        assert found[-1]["ahead"]
        until(lambda: hired)
    finally:
        made.close()
        crew.close()
        made.join(30)
