"""States: what the page may send, and nothing else."""

import json
import math
import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.server import STATE

from printhammer.hammer.hammer import load
from printhammer.studio import bounds
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import ProtocolError, dropped_hammer, read_state

NAME = "tung-shaw-1988"
TEXT = CRUDE.read_text("utf-8")
SAMPLES = {"shape": "sampled", "times": [0.0, 1e-4, 2e-4], "values": [0.0, 1.0, 0.0], "quantity": "current"}


def state(**changed: Any) -> Any:
    return read_state({**STATE, "text": TEXT, **changed})


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=4),
    max_leaves=8,
)


@given(JSON)
def test_anything_is_a_state_or_refused(given_: Any) -> None:
    with pytest.raises(ProtocolError):
        read_state(given_)


@given(st.sampled_from(sorted(STATE)), JSON)
def test_any_value_of_a_key_is_taken_or_refused(key: str, value: Any) -> None:
    try:
        found = read_state({**STATE, key: value})
    except ProtocolError:
        return
    assert found.pulses <= bounds.MOST_PULSES
    assert bounds.RATES[0] <= found.rate <= bounds.RATES[1]
    assert len(found.text) <= bounds.LARGEST_FILE
    hash(found)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"extra": 1}, "unknown key 'extra'"),
        ({"rate": "1200"}, "rate is expected to be a number"),
        ({"rate": True}, "rate"),
        ({"rate": math.nan}, "rate"),
        ({"rate": 10**400}, "rate"),
        ({"pulses": 65}, "pulses"),
        ({"pattern": "102"}, "pattern"),
        ({"pattern": "000"}, "pattern"),
        ({"overlap": "mix"}, "overlap"),
        ({"views": ["sky"]}, "views"),
        ({"constants": {"mass": "1"}}, "mass"),
        ({"waveform": {"shape": "spline"}}, "waveform.shape"),
        ({"waveform": {"shape": "half-sine", "amplitude": 1.0}}, "waveform.width is missing"),
        ({"waveform": {"shape": "half-sine", "amplitude": 1.0, "width": 1.0}}, "waveform.width"),
        ({"waveform": {"shape": "sampled", "file": "/etc/passwd"}}, "unknown key 'file'"),
        ({"waveform": {**SAMPLES, "times": [0.0] * 3000}}, "times"),
    ],
)
def test_a_message_of_no_page_is_refused_with_a_reason(changed: dict[str, Any], reason: str) -> None:
    with pytest.raises(ProtocolError, match=reason):
        read_state({**STATE, **changed})


def test_a_missing_key_is_named() -> None:
    with pytest.raises(ProtocolError, match=r"state\.rate is missing"):
        read_state({key: value for key, value in STATE.items() if key != "rate"})


def test_a_state_is_its_hammer_and_drive() -> None:
    found = state(constants={"pack.stiffness": 300.0}, rate=1000.0, pulses=3)
    assert found.changed.pack.stiffness == 300.0
    assert found.changed.mass == load(CRUDE).mass
    assert found.drive.times.tolist() == [0.0, 0.001, 0.002]
    assert found.fired == load(CRUDE).waveform
    assert state(pattern="1011", rate=1000.0).drive.times.tolist() == [0.0, 0.002, 0.003]


def test_a_set_waveform_is_fired() -> None:
    found = state(waveform={"shape": "half-sine", "amplitude": 1.5, "width": 2e-4})
    assert found.drive.waveform.shape == "half-sine"
    assert found.drive.peak == 1.5
    assert state(waveform=SAMPLES).drive.peak == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("constants", "key"),
    [
        ({"pack.colour": 1.0}, "constants.pack.colour"),
        ({"waveform.width": 1e-4}, "constants.waveform.width"),
        ({"backstop.stiffness": 1e30}, "backstop.stiffness"),
        ({"mass": -1.0}, "mass"),
    ],
)
def test_constants_stay_near_those_of_the_hammer(constants: dict[str, float], key: str) -> None:
    with refused(key):
        _ = state(constants=constants).changed


def test_a_hammer_is_offered_by_name_and_never_read_from_a_path() -> None:
    assert Shelf().hammer(NAME).name == NAME
    for name in (str(CRUDE), "../hammers/" + NAME, "", NAME + ".toml"):
        with refused("hammer"):
            Shelf().hammer(name)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("x = [", None),
        ("name = 'a'", "format"),
        (
            'name = "a"\n[waveform]\nshape = "sampled"\nfile = "/etc/passwd"\n',
            "waveform.file",
        ),
        (
            'format = 1\nname = "a"\n[magnet]\nlaw = "table"\nfile = "t.csv"\n',
            "magnet.file",
        ),
        # These would take minutes to read.
        ("a." * 150_000 + "b = 1", "dots"),
        ("x = {" + "a." * 150_000 + "b = 1}", "dots"),
        ("[" + "a." * 150_000 + "b]", "dots"),
    ],
)
def test_a_dropped_file_is_a_hammer_that_names_no_other_file(text: str, key: str | None) -> None:
    with refused(key):
        dropped_hammer(text)


def test_the_start_of_the_page_is_a_state(request: pytest.FixtureRequest) -> None:
    page = request.config.rootpath / "src" / "printhammer" / "studio" / "web" / "state.js"
    text = page.read_text("utf-8")
    start = text.partition("Object.freeze({")[2].partition("});")[0]
    views = json.loads(text.partition("VIEWS = ")[2].partition(";")[0])
    assert set(re.findall(r"(\w+): ", start)) == set(STATE)
    assert read_state({**STATE, "views": views}).views == tuple(views)


def test_a_driver_by_voltage_is_a_state_of_the_page() -> None:
    from printhammer.drive.waveforms.drivers import Rail
    from printhammer.studio.states.controls import fields_of
    from printhammer.studio.states.state import READERS

    rail = Rail(voltage=150.0, width=2e-4, decay="diode", decay_resistance=159.0)
    assert dict(READERS["waveform"](fields_of(rail))) == fields_of(rail)
