"""Hammer files dropped on a page: read as in Python if a hammer of the page has their laws, else rejected."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.studio.reading import node

import printhammer as ph
from printhammer.run.plain.entries import numbers_of
from printhammer.studio import Shelf
from printhammer.studio.controls import describe, fields_of

ASKED = "\n  adopt: (text) => shelf.hammers[adopter(shelf)(text)],\n"
NAMES = ("hendriks-1983-1", "tung-shaw-1988", "dot-peen", "duffing-holmes", "relay-5v")
RAISED = 1.07


@pytest.fixture(scope="module")
def ask() -> Iterator[Any]:
    with node("engine/adopt.js", ASKED, Shelf(*map(ph.load, NAMES), only=True)) as asked:
        yield asked


@pytest.mark.parametrize("name", NAMES)
def test_a_hammer_file_gives_the_numbers_of_python(ask: Any, name: str) -> None:
    hammer = ph.load(name)
    keys = [control["key"] for control in describe(hammer)["constants"]]
    changed = hammer.replace({key: RAISED * hammer.constants[key].si for key in keys}).replace("name", "mine")
    found = ask("adopt", changed.to_toml())["found"]
    for role, (_keys, numbers) in numbers_of(changed).items():
        own = [float(value) for value in found["numbers"][role][1]]
        assert own == pytest.approx([float(value) for value in numbers], rel=1e-12, nan_ok=True), role
    expected, described = describe(changed), found["described"]
    assert described["name"] == "mine"
    for control, other in zip(expected["constants"], described["constants"], strict=True):
        for entry in ("value", "low", "high"):
            assert other[entry] == pytest.approx(control[entry], rel=1e-9), control["key"]
    if hammer.waveform is not None:
        assert described["start"] == describe(hammer)["start"]
    assert described["places"] == pytest.approx(expected["places"])
    for contact, other in zip(expected["contacts"], described["contacts"], strict=True):
        assert other == {**contact, "position": pytest.approx(contact["position"])}
    for control, other in zip(expected["combined"], described["combined"], strict=True):
        assert (other["value"], other["low"]) == pytest.approx((control["value"], control["low"]))
    if hammer.waveform is not None:
        wave = {key: value for key, value in fields_of(changed.waveform).items() if value is not None}
        assert {key: value for key, value in described["waveform"].items() if value is not None} == wave


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("[spring]\n", "[spring]\ncolour = 'red'\n"), "spring.colour"),
        (('law = "power"', 'law = "hertz"'), "pack.law"),
        (("value = 0.803171", "value = -0.8"), "magnet.F0"),
        (("[waveform]", "[wave]"), "wave is not known"),
        (('law = "inverse-root"', 'law = "table"\nfile = "forces.csv"'), "magnet.file names a table"),
        (
            ("[spring]\n", "[[force]]\nlaw = 'sampled'\nfile = 'a.csv'\n[spring]\n"),
            "force.file names a table",
        ),
        (("mass = {", "mass = 3 #{"), "mass has no unit"),
        (("format = 1", "format = 1\n__proto__ = 1"), "not known"),
        (("format = 1", "format = 1\nviews = ['plan']"), "views is expected to be one of"),
    ],
)
def test_another_hammer_file_is_refused(ask: Any, change: tuple[str, str], reason: str) -> None:
    text = ph.load(NAMES[0]).to_toml()
    assert change[0] in text
    answer = ask("adopt", text.replace(*change, 1))
    assert reason in answer["refused"], json.dumps(answer)[:300]


def test_contacts_are_refused_where_python_refuses_them(ask: Any) -> None:
    relay = ph.load("relay-5v")
    text = relay.to_toml()
    assert "contact.break" in ask("adopt", relay.replace("contact.break", None).to_toml())["refused"]
    assert "contact.break.side = front" in ask("adopt", text.replace('"back"', '"front"'))["refused"]
    behind = relay.replace("contact.break.position", 1.25e-6).to_toml().replace("1.25e-06", "-1e-6")
    with pytest.raises(ph.InputError, match="position not before"):
        ph.Hammer.from_toml(behind)
    assert "contact.break.position = -0.000001 m" in ask("adopt", behind)["refused"]
    twice = text.replace('name = "break"', 'name = "make"')
    assert twice != text
    with pytest.raises(ph.InputError, match="a name of its own"):
        ph.Hammer.from_toml(twice)
    assert "contact.name = make: expected a name of its own" in ask("adopt", twice)["refused"]


def test_a_file_lists_its_views(ask: Any) -> None:
    text = ph.load(NAMES[0]).replace("views", ["phase", "motion"]).to_toml()
    assert ask("adopt", text)["found"]["described"]["views"] == ["phase", "motion"]
    assert ask("adopt", ph.load(NAMES[0]).to_toml())["found"]["described"]["views"] == []


def test_a_table_of_another_hammer_is_not_taken(tmp_path: Path) -> None:
    """A hammer of the page may refer to a table of the same name with other numbers."""
    rows = [(x, i, 0.8 - 0.3 * i + 0.01 * x) for x in (0.0, 200.0, 400.0) for i in (0.0, 1.0, 2.0)]
    table = "displacement [um],current [A],force [N]\n" + "".join(f"{x},{i},{f}\n" for x, i, f in rows)
    (tmp_path / "forces.csv").write_text(table, "utf-8")
    hammer = ph.load(NAMES[0])
    text = ph.Hammer.from_toml(hammer.to_toml(), folder=tmp_path)
    own = text.replace("magnet", {"law": "table", "file": "forces.csv"}).replace("name", "own")
    with node("engine/adopt.js", ASKED, Shelf(own, only=True)) as asked:
        assert "magnet.file names a table" in asked("adopt", own.to_toml())["refused"]


def test_a_value_in_another_unit_is_converted(ask: Any) -> None:
    hammer = ph.load(NAMES[0])
    mass = hammer.constants["mass"]
    written = f'value = {mass.value!r}, unit = "{mass.unit}"'
    text = hammer.to_toml()
    assert written in text
    found = ask("adopt", text.replace(written, 'value = 2, unit = "g"'))["found"]
    assert math.isclose(found["numbers"]["body"][1][0], 2e-3)
