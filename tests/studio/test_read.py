"""External states, and states as texts: accepted, rejected and written states, in Node."""

import json
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.hammers import CRUDE
from tests.studio.reading import STATE, drive_of, node

import printhammer as ph
from printhammer.drive.waveforms.drivers import Rail
from printhammer.studio import Shelf
from printhammer.studio.coil import open_constants, rail_of
from printhammer.studio.controls import fields_of

NAME = "hendriks-1983-crude"
ASKED = """
  read: (content) => readState(content, shelf.readers),
  taken: (content) => taken(content, shelf),
  file: (text) => readFile(text, "a.json", shelf),
  texts: (state) => { const { hammer, python, command, state: file } = textsOf(state, shelf); return { hammer, python, command, file }; },
"""  # noqa: E501
SAMPLES = {"shape": "sampled", "times": [0.0, 1e-4, 2e-4], "values": [0.0, 1.0, 0.0], "quantity": "current"}
HALF_SINE = {"shape": "half-sine", "amplitude": 1.0, "width": 1e-3, "quantity": "current"}
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=4),
    max_leaves=8,
)
properties = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


@pytest.fixture(scope="module")
def ask() -> Iterator[Any]:
    own = ph.load(CRUDE).replace("name", NAME), ph.load("hendriks-1983-1"), ph.load("relay-5v")
    with node("engine/texts.js", ASKED, Shelf(*own, only=True)) as asked:
        yield asked


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"extra": 1}, "unknown key 'extra'"),
        ({"rate": "1200"}, "rate is expected to be a number"),
        ({"rate": True}, "rate is expected to be a number"),
        ({"rate": 1e99}, "rate is expected to be a finite number from 0.01 to 20000"),
        ({"pulses": 65}, "pulses is expected to be a whole number from 1 to 64"),
        ({"pattern": "102"}, "pattern is expected to be of 0 and 1"),
        ({"pattern": "000"}, "pattern is expected to be of 0 and 1"),
        ({"overlap": "mix"}, "overlap is expected to be one of add, replace"),
        ({"views": ["sky"]}, "views is expected to be one of"),
        ({"line": "x" * 201}, "line is expected to be a text of at most 200 characters"),
        ({"constants": {"mass": "1"}}, "mass is expected to be a number"),
        ({"waveform": [1]}, "waveform.shape is expected to be one of"),
        ({"waveform": {"shape": "constructor"}}, "waveform.shape is expected to be one of"),
        ({"waveform": {"shape": "half-sine", "amplitude": 1.0}}, "waveform.width is missing"),
        ({"waveform": {**HALF_SINE, "width": 0.51}}, "waveform.width is expected"),
        ({"waveform": {**HALF_SINE, "amplitude": 101.0}}, "waveform.amplitude is expected"),
        ({"waveform": {**HALF_SINE, "colour": 1}}, "waveform has the unknown key 'colour'"),
        ({"waveform": {"shape": "sampled", "file": "/etc/passwd"}}, "unknown key 'file'"),
        ({"waveform": {**SAMPLES, "times": [0.0] * 3000}}, "waveform.times is expected"),
    ],
)
def test_a_state_of_no_page_is_refused_with_a_reason(ask: Any, changed: dict[str, Any], reason: str) -> None:
    assert reason in ask("read", {**STATE, **changed})["refused"]
    taken = ask("taken", {"low": 600.0, **changed})["found"]
    assert taken["state"]["low"] == 600.0
    assert len(taken["notes"]) == 1


@pytest.mark.parametrize(
    "wave",
    [
        None,
        SAMPLES,
        HALF_SINE,
        {**HALF_SINE, "amplitude": 101.0, "quantity": "voltage"},
        *(fields_of(ph.load(name).waveform) for name in ("hendriks-1983-1", "relay-5v")),
        fields_of(Rail(voltage=150.0, width=2e-4, decay="diode", decay_resistance=159.0)),
    ],
)
def test_a_pulse_is_read_as_it_is_written(ask: Any, wave: Any) -> None:
    state = {**STATE, "waveform": wave}
    assert ask("read", state)["found"] == state


@properties
@given(JSON | st.dictionaries(st.sampled_from(sorted(STATE)), JSON, max_size=4))
def test_whatever_is_taken_is_a_state(ask: Any, content: Any) -> None:
    found = ask("taken", content)["found"]
    assert "found" in ask("read", {**STATE, **found["state"]})
    assert all(isinstance(note, str) and "\n" not in note for note in found["notes"])
    read = ask("read", content)
    assert ("found" in read) == (
        isinstance(content, dict) and set(content) == set(STATE) and not found["notes"]
    )


def test_hammers_and_constants_are_taken_by_name_and_within_their_range(ask: Any) -> None:
    found = ask("taken", {"hammer": "no-such"})["found"]
    assert found["notes"] == [
        f"hammer = 'no-such': expected one of {NAME}, hendriks-1983-1, relay-5v; {NAME} is shown instead"
    ]
    assert found["state"]["hammer"] == NAME
    constants = {"mass": 9.0, "pack.colour": 1.0, "platen": "x", "spring.Bs": 9.0, "coil.resistance": 1e4}
    found = ask("taken", {"hammer": "hendriks-1983-1", "constants": constants})["found"]
    assert found["state"]["constants"] == {"spring.Bs": 9.0}
    assert len(found["notes"]) == 4
    found = ask("taken", {f"entry {k}": 1 for k in range(500)})["found"]
    assert found["notes"][-1] == "and 494 more like these"


def test_of_very_many_constants_only_some_are_examined(ask: Any) -> None:
    notes = ask("taken", {"constants": {f"unknown {k}": 1.0 for k in range(100_000)}})["found"]["notes"]
    assert "100000 constants" in notes[0]
    assert notes[-1].startswith("and 59 more")


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "[" * 100_000, '{"kind": "other"}', '{"kind": "printhammer studio state", "format": 9}'],
)
def test_what_is_no_state_file_is_refused_in_one_sentence(ask: Any, text: str) -> None:
    assert ask("file", text)["refused"].startswith("a.json: ")


CHANGES: list[dict[str, Any]] = [
    {},
    {"constants": {"pack.stiffness": 300.0, "mass": 0.5e-3}, "pulses": 2},
    {"waveform": {**HALF_SINE, "amplitude": 0.7, "width": 3e-4}, "overlap": "replace"},
    {"pattern": "1101", "rate": 812.5},
    {"waveform": SAMPLES, "constants": {"platen": 3.5e-4}},
]


@pytest.mark.parametrize("changed", CHANGES)
def test_texts_describe_the_state(
    ask: Any, changed: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    """Hammer file and script reproduce the hammer of Python, and the state file is read again."""
    state = {**STATE, "hammer": NAME, **changed}
    hammer = ph.load(CRUDE).replace("name", NAME)
    hammer = hammer.replace(state["constants"]) if state["constants"] else hammer
    drive = drive_of(state, hammer.waveform)
    texts = ask("texts", state)["found"]
    assert ph.Hammer.from_toml(texts["hammer"]).fingerprint == hammer.fingerprint
    names: dict[str, Any] = {}
    exec(texts["python"], names)
    assert names["hammer"].fingerprint == hammer.fingerprint
    assert names["drive"].fingerprint == drive.fingerprint
    np.testing.assert_array_equal(names["motion"].x, ph.simulate(hammer, drive).x)
    assert len(capsys.readouterr().out.splitlines()) == 1 + len(drive.times)
    assert ask("file", texts["file"])["found"] == {"state": state, "notes": []}


def test_the_hammer_file_of_a_state_changes_entries_by_name(ask: Any) -> None:
    relay = ph.load("relay-5v")
    constants = {"spring.stiffness": 400.0, "contact.make.position": 3e-4, "contact.break.stiffness": 2500.0}
    state = {**STATE, "hammer": relay.name, "constants": constants}
    texts = ask("texts", state)["found"]
    assert ph.Hammer.from_toml(texts["hammer"]).fingerprint == relay.replace(constants).fingerprint
    assert ask("file", texts["file"])["found"] == {"state": state, "notes": []}
    wrong = {"constants": {"contact.make.position": 1.0, "contact.make.colour": 1.0}, "hammer": relay.name}
    notes = ask("taken", wrong)["found"]["notes"]
    assert "contact.make.position = 1 m: expected 0.00015 to 0.00065" in notes[0]
    assert "contact.make.colour is not known" in notes[1]


def test_the_command_runs_with_the_saved_file(
    ask: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from printhammer.cli.main import main

    texts = ask("texts", {**STATE, "hammer": NAME, "pulses": 2})["found"]
    (tmp_path / "studio-hammer.toml").write_text(texts["hammer"], "utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(shlex.split(texts["command"])[1:])
    assert ended.value.code == 0
    texts = ask("texts", {**STATE, "hammer": "hendriks-1983-1"})["found"]
    assert texts["command"] == "printhammer run hendriks-1983-1 --rate '1200.0 Hz' --pulses 9"
    assert '"hendriks-1983-1"' in texts["python"]


def test_a_rail_brings_the_coil_that_the_file_leaves_open(ask: Any) -> None:
    hammer = ph.load("hendriks-1983-1")
    wave = {"shape": "rail", **(rail_of(hammer) or {})}
    state = {**STATE, "hammer": hammer.name, "constants": {"coil.temperature": 60.0}, "waveform": wave}
    texts = ask("texts", state)["found"]
    further = {key: constant.si for key, (constant, _) in open_constants(hammer).items()}
    expected = hammer.replace({**further, "coil.temperature": 60.0})
    assert ph.Hammer.from_toml(texts["hammer"]).fingerprint == expected.fingerprint
    assert '"coil.resistance": 28.6' in texts["python"]
    # Where a current is fired, the temperature is that of no coil.
    texts = ask("texts", {**state, "waveform": None})["found"]
    assert ph.Hammer.from_toml(texts["hammer"]).fingerprint == hammer.fingerprint
    assert "coil" not in texts["python"]


def test_the_start_of_the_page_is_a_state(ask: Any, request: pytest.FixtureRequest) -> None:
    script = request.config.rootpath / "src" / "printhammer" / "studio" / "web" / "state.js"
    text = script.read_text("utf-8")
    start = text.partition("Object.freeze({")[2].partition("});")[0]
    views = json.loads(text.partition("VIEWS = ")[2].partition(";")[0])
    assert all(f"{key}: " in start for key in STATE)
    assert ask("read", {**STATE, "views": views})["found"]["views"] == views
