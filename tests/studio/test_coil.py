"""What the studio sets of a coil: its temperature, the winding of a hammer that states none, drivers."""

import json
from typing import Any

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.server import STATE

from printhammer.hammer.hammer import load
from printhammer.studio.frames import unframe
from printhammer.studio.pictures.chart import FULL, map_frame
from printhammer.studio.pictures.engine import motion_frame
from printhammer.studio.states import controls
from printhammer.studio.states.coil import open_constants, rail_of
from printhammer.studio.states.drops import dropped
from printhammer.studio.states.links import read_file, taken
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import State, read_state
from printhammer.studio.states.texts import texts_of
from printhammer.studio.work import alike


def of(hammer: str = "hendriks-1983", **changed: Any) -> State:
    return read_state({**STATE, "hammer": hammer, "pulses": 1, **changed}, Shelf())


def rail(**changed: Any) -> dict[str, Any]:
    made = rail_of(load("hendriks-1983"))
    assert made is not None
    return {"shape": "rail", **made, **changed}


def test_a_hammer_without_a_coil_is_driven_by_a_rail_as_by_its_current() -> None:
    before, behind = of(), of(waveform=rail())
    peaks = [unframe(motion_frame(state, 1)[0])[0]["peak"] for state in (before, behind)]
    assert peaks[1] == pytest.approx(peaks[0], rel=0.03)
    assert before.settings == {}
    assert before.changed.coil is None
    assert behind.settings.keys() == {"coil.resistance", "coil.inductance", "coil.temperature"}
    texts = texts_of(behind)
    assert "[coil]" in texts["hammer"]
    assert "'coil.resistance': 28.6" in texts["python"]
    assert texts["command"].endswith("--drive studio-drive.toml")
    assert "studio-hammer.toml" in texts["command"]


def test_the_coil_of_a_current_is_left_as_it_is() -> None:
    """A temperature that was set behind a rail changes nothing where currents are fired."""
    state = of(constants={"coil.temperature": 80.0, "coil.resistance": 30.0})
    assert state.settings == {}
    assert state.changed == state.base


def test_a_winding_gets_warm() -> None:
    state = of("relay-5v", constants={"coil.temperature": 80.0})
    assert state.changed.coil.warm_resistance == pytest.approx(70.0 * (1.0 + 0.00393 * 60.0))
    cold, warm = (unframe(motion_frame(each, 1)[0])[0]["peak"] for each in (of("relay-5v"), state))
    assert warm < 0.95 * cold


@pytest.mark.parametrize(
    ("hammer", "key", "value", "wrong_key"),
    [
        ("relay-5v", "coil.temperature", 500.0, "coil.temperature"),
        ("hendriks-1983", "coil.resistance", 1e4, "coil.resistance"),
        ("bouncing-ball", "coil.temperature", 30.0, "constants.coil.temperature"),
    ],
)
def test_open_constants_have_a_range(hammer: str, key: str, value: float, wrong_key: str) -> None:
    with refused(wrong_key):
        _ = of(hammer, constants={key: value}).changed


@pytest.mark.parametrize("name", ["relay-5v", "hendriks-1983", "bouncing-ball", str(CRUDE)])
def test_open_constants_have_controls(name: str) -> None:
    hammer = load(name)
    described = controls.describe(hammer)
    assert [each["key"] for each in described["open"]] == list(open_constants(hammer))
    assert (described["rail"] is None) == (hammer.magnet is None)
    for each in described["open"]:
        assert each["low"] < each["value"] < each["high"]
        assert (each["section"], len(each["equation"]) > 10) == ("coil", True)
    assert json.dumps(controls.vocabulary(hammer))


def test_links_and_files_keep_a_rail_and_a_temperature() -> None:
    content = {"hammer": "hendriks-1983", "waveform": rail(), "constants": {"coil.temperature": 60.0}}
    assert taken(content, Shelf()) == (content, [])
    state = of(waveform=rail(decay="zener", decay_voltage=120.0), constants={"coil.temperature": 60.0})
    table, notes = read_file(texts_of(state)["state"], "state.json", Shelf())
    assert notes == []
    assert read_state(table, Shelf()) == state
    _, notes = taken({**content, "waveform": rail(decay="battery")}, Shelf())
    assert "waveform.decay is expected to be one of diode, zener, rail" in notes[0]


def test_slow_and_large_devices_are_shown_in_larger_units() -> None:
    names = {
        name: [controls.vocabulary(load(name))["units"][si][0]["name"] for si in ("s", "m")]
        for name in ("hendriks-1983", "relay-5v", "pinball-coil")
    }
    assert names == {"hendriks-1983": ["µs", "µm"], "relay-5v": ["ms", "µm"], "pinball-coil": ["ms", "mm"]}


def test_current_and_voltage_are_both_sent() -> None:
    heading, arrays = unframe(motion_frame(of(waveform=rail(decay="rail", decay_resistance=0.0)), 1)[0])
    assert (heading["quantity"], heading["supply"]) == ("voltage", rail()["voltage"])
    assert arrays["u"].max() == pytest.approx(rail()["voltage"])
    assert arrays["u"].min() == pytest.approx(-rail()["voltage"])
    assert np.abs(arrays["drive"]).max() == pytest.approx(heading["peak"])
    assert "u" not in unframe(motion_frame(of(), 1)[0])[1]


def test_states_of_drivers_are_compared_by_what_they_have() -> None:
    one = of(waveform=rail())
    assert alike(one, of(waveform=rail(width=1.1 * rail()["width"]), constants={"coil.temperature": 22.0}))
    assert not alike(one, of(waveform=rail(), constants={"coil.temperature": 80.0}))
    assert not alike(one, of(waveform=rail(decay_voltage=3.0)))


@pytest.mark.slow
def test_a_full_map_tells_the_dots_of_its_runs_also_where_touches_are_short() -> None:
    state = of("dot-peen", pulses=3, low=10.0, high=40.0)
    _, arrays = unframe(map_frame(state, 1, FULL, lambda: False))
    assert arrays["struck"].shape == (FULL[0], 3)
    assert arrays["struck"].all()
    assert "struck" not in unframe(map_frame(state, 1, (4, 8), lambda: False))[1]


def test_a_measured_voltage_is_taken_from_a_table() -> None:
    heading, arrays = unframe(dropped(1, "u.csv", "time [us],voltage [V]\n0,0\n100,38\n200,0\n"))
    assert heading["what"] == "curves"
    assert arrays["voltage"].tolist() == [0.0, 38.0, 0.0]
    samples = {"times": arrays["t"].tolist(), "values": arrays["voltage"].tolist(), "quantity": "voltage"}
    state = of("impact-wire", waveform={"shape": "sampled", **samples})
    heading, arrays = unframe(motion_frame(state, 1)[0])
    assert arrays["u"].max() == pytest.approx(38.0, rel=0.01)
