"""A state as texts: each gives the same hammer, drive and motion again."""

import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.hammers import CRUDE
from tests.studio.server import STATE

import printhammer as ph
from printhammer.drive.file import read_drive
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import State, read_state
from printhammer.studio.states.texts import DRIVE_FILE, HAMMER_FILE, texts_of

TEXT = CRUDE.read_text("utf-8")
SAMPLED = {"shape": "sampled", "times": [0.0, 1e-4, 3e-4], "values": [0.0, 1.0, 0.0], "quantity": "current"}
CHANGES: list[dict[str, Any]] = [
    {},
    {"constants": {"pack.stiffness": 300.0, "mass": 0.5e-3}, "pulses": 2},
    {"waveform": {"shape": "half-sine", "amplitude": 0.7, "width": 3e-4}, "overlap": "replace"},
    {"pattern": "1101", "rate": 812.5},
    {"waveform": SAMPLED, "constants": {"platen": 3.5e-4}},
]


def of(changed: dict[str, Any]) -> State:
    return read_state({**STATE, "text": TEXT, **changed})


@pytest.mark.parametrize("changed", CHANGES)
def test_the_files_are_read_back_as_the_same(changed: dict[str, Any]) -> None:
    state = of(changed)
    texts = texts_of(state)
    hammer = ph.Hammer.from_toml(texts["hammer"])
    assert hammer.fingerprint == state.changed.fingerprint
    drive = read_drive(texts["drive"], hammer.waveform)
    assert drive.fingerprint == state.drive.fingerprint


@pytest.mark.parametrize("changed", CHANGES)
def test_the_python_makes_the_same_motion(
    changed: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    state = of(changed)
    names: dict[str, Any] = {}
    exec(texts_of(state)["python"], names)
    assert names["hammer"].fingerprint == state.changed.fingerprint
    assert names["drive"].fingerprint == state.drive.fingerprint
    expected = ph.simulate(state.changed, state.drive)
    np.testing.assert_array_equal(names["motion"].x, expected.x)
    assert len(capsys.readouterr().out.splitlines()) == 1 + len(state.drive.times)


@pytest.mark.parametrize("changed", CHANGES)
def test_the_command_runs_with_the_saved_files(
    changed: dict[str, Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from printhammer.cli.main import main

    texts = texts_of(of(changed))
    (tmp_path / HAMMER_FILE).write_text(texts["hammer"], "utf-8")
    (tmp_path / DRIVE_FILE).write_text(texts["drive"], "utf-8")
    monkeypatch.chdir(tmp_path)
    program, *arguments = shlex.split(texts["command"])
    assert program == "printhammer"
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0, capsys.readouterr().err


def test_a_shipped_hammer_is_named() -> None:
    texts = texts_of(read_state({**STATE, "hammer": "hendriks-1983"}))
    assert "ph.load('hendriks-1983')" in texts["python"]
    assert texts["command"].startswith("printhammer run hendriks-1983 --rate '1200.0 Hz' --pulses 9")


def test_a_shipped_hammer_that_the_studio_opened_with_is_named_too() -> None:
    texts = texts_of(read_state({**STATE, "hammer": "hendriks-1983"}, Shelf(ph.load("hendriks-1983"))))
    assert "ph.load('hendriks-1983')" in texts["python"]
    assert texts["command"].startswith("printhammer run hendriks-1983 ")


def test_a_hammer_that_was_made_in_python_is_written_out() -> None:
    hammer = ph.load("hendriks-1983").replace("mass", "0.5 g")
    texts = texts_of(read_state({**STATE, "hammer": "hendriks-1983"}, Shelf(hammer)))
    assert "ph.Hammer.from_toml(" in texts["python"]
    assert texts["command"].startswith(f"printhammer run {HAMMER_FILE} ")


def test_the_hammer_that_the_studio_opened_with_is_named_by_its_file() -> None:
    hammer = ph.load(CRUDE)
    state = read_state({**STATE, "hammer": hammer.name}, Shelf(hammer))
    assert texts_of(state)["command"].startswith(f"printhammer run {CRUDE}")
