"""Links and state files: what can be taken is, the rest is told, and nothing of it does harm."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.server import STATE
from tests.studio.test_state import JSON, SAMPLES

from printhammer.hammer.hammer import load
from printhammer.studio.frames import unframe
from printhammer.studio.messages import answer
from printhammer.studio.states.drops import dropped
from printhammer.studio.states.links import file_of, read_file, taken
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import READERS, read_state

SHELF = Shelf()
NAME = "hendriks-1983"


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("pulses", 999, "pulses is expected to be a whole number from 1 to 64"),
        ("pattern", "zzz", "pattern is expected to be of 0 and 1"),
        ("rate", 1e99, "rate is expected to be a finite number from 10 to 20000"),
        ("rate", "fast", "rate is expected to be a number"),
        ("line", "x" * 201, "line is expected to be a text of at most 200 characters"),
        ("waveform", [1], "waveform.shape is expected"),
        ("waveform", "{", "waveform.shape is expected"),
        ("views", ["sky"], "views is expected"),
        ("overlap", "mix", "overlap is expected"),
        ("colour", "red", "'colour' is not known"),
    ],
)
def test_an_entry_that_cannot_be_taken_is_told_and_the_others_are(key: str, value: Any, reason: str) -> None:
    table, (note,) = taken({"low": 600.0, "hammer": NAME, key: value}, SHELF)
    assert reason in note
    assert key not in table
    assert table["low"] == 600.0


def test_an_unknown_hammer_is_told() -> None:
    table, (note,) = taken({"hammer": "no-such"}, SHELF)
    assert note.startswith("hammer = 'no-such': expected one of hendriks-1983")
    assert note.endswith("hendriks-1983 is shown instead")
    assert table["hammer"] == NAME
    table, (note,) = taken({"text": "x = ["}, SHELF)
    assert "expected a TOML file" in note
    assert (table["hammer"], table["text"]) == (NAME, "")


def test_constants_are_taken_one_by_one() -> None:
    constants = {"mass": 9.0, "pack.colour": 1.0, "platen": "x", "spring.Bs": 9.0}
    table, notes = taken({"hammer": NAME, "constants": constants}, SHELF)
    assert table["constants"] == {"spring.Bs": 9.0}
    assert len(notes) == 3
    table, notes = taken({"constants": [1]}, SHELF)
    assert ("constants" in table, len(notes)) == (False, 1)


def test_a_pulse_that_is_none_is_told() -> None:
    table, (note,) = taken({"waveform": {**SAMPLES, "times": [0.0, 2e-4, 1e-4]}}, SHELF)
    assert "waveform is left as the hammer has it" in note
    assert table["waveform"] is None


@given(JSON | st.dictionaries(st.sampled_from(sorted(STATE)), JSON, max_size=4))
def test_whatever_is_taken_is_a_state(content: Any) -> None:
    table, notes = taken(content, SHELF)
    start = {**STATE, "hammer": NAME}
    state = read_state({**start, **table}, SHELF)
    _ = state.changed, state.fired
    assert all(isinstance(note, str) and "\n" not in note for note in notes)


def test_a_state_file_is_opened_as_it_was_saved() -> None:
    guest = load(CRUDE)
    shelf = Shelf(guest.replace("name", "mine"))
    content = {**STATE, "hammer": "mine", "constants": {"mass": 4e-4}, "waveform": SAMPLES, "rate": 812.5}
    text = file_of(read_state(content, shelf))
    # Elsewhere, where there is no such hammer.
    heading, _ = unframe(dropped(3, "state.json", text, SHELF))
    assert (heading["what"], heading["notes"]) == ("state", [])
    found = read_state(heading["state"], SHELF)
    assert found.base.name == "mine"
    assert found.changed.fingerprint == read_state(content, shelf).changed.fingerprint
    assert found.drive.fingerprint == read_state(content, shelf).drive.fingerprint
    assert set(heading["state"]) == set(READERS)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "state"),
        ("{", "state"),
        ("[]", "state"),
        ("[" * 100_000, "state"),
        ('{"kind": "other"}', "state"),
        ('{"kind": "printhammer studio state", "format": 9}', "format"),
    ],
)
def test_what_is_no_state_file_is_refused_in_one_sentence(text: str, key: str) -> None:
    with refused(key, file="a.json"):
        read_file(text, "a.json", SHELF)


def test_a_page_without_a_state_opens_with_that_of_the_studio() -> None:
    shelf = Shelf()
    shelf.start = ({"rate": 700.0}, ["a note"])
    for content, rate, notes in (({}, 700.0, ["a note"]), ({"rate": 800.0}, 800.0, [])):
        heading, _ = unframe(answer("open", 1, content, shelf))
        assert (heading["state"]["rate"], heading["notes"]) == (rate, notes)


def test_a_long_list_of_notes_is_cut_short() -> None:
    _, notes = taken({f"entry {k}": 1 for k in range(500)}, SHELF)
    assert len(notes) == 7
    assert notes[-1] == "and 494 more like these"
    assert len(json.dumps(notes)) < 2000
