"""Additional parts: a file on the command line, an installed package, and invalid laws."""

import json
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.parts import PARTS, outside
from printhammer.parts.outside import load_installed, load_parts

CUBIC = (Path(__file__).parents[2] / "examples" / "cubic_spring.py").read_text(encoding="utf-8")
HAMMER = """
format = 1
name = "oscillator"
mass = {{ value = 1, unit = "kg", status = "assumed", source = "test" }}
[spring]
law = "{law}"
stiffness = {{ value = 1, unit = "N/m", status = "assumed", source = "test" }}
cubic = {{ value = 1, unit = "N/m^3", status = "assumed", source = "test" }}
"""


@pytest.fixture(autouse=True)
def forgotten(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Remove the laws, modules and paths that a test has added."""
    parts, modules = dict(PARTS), set(sys.modules)
    monkeypatch.setattr(sys, "path", [*sys.path])
    load_installed.cache_clear()
    yield
    PARTS.clear()
    PARTS.update(parts)
    for name in set(sys.modules) - modules:
        if name.startswith("own_"):
            del sys.modules[name]
    load_installed.cache_clear()


def written(folder: Path, name: str, text: str = CUBIC) -> Path:
    """Write a part module whose law has the name of the file."""
    path = folder / f"{name}.py"
    path.write_text(text.replace('law = "hardening"', f'law = "{name}"'), encoding="utf-8")
    return path


def run(*words: object) -> int:
    from printhammer.cli.main import main

    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return int(end.value.code or 0)


def test_a_file_brings_a_law_to_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part, hammer = written(tmp_path, "own_first"), tmp_path / "hammer.toml"
    hammer.write_text(HAMMER.format(law="own_first"))
    assert run("hammer", "check", hammer) == 2
    assert "spring.law = 'own_first': expected one of" in capsys.readouterr().err
    assert run("hammer", "check", hammer, "--part", part) == 0
    assert "ok" in capsys.readouterr().out
    # Twice does no harm.
    assert run("hammer", "show", hammer, "--part", part, "--part", part) == 0
    capsys.readouterr()
    assert run("hammer", "schema", "--part", part) == 0
    laws = [
        table["properties"]["law"]["const"]
        for table in json.loads(capsys.readouterr().out)["properties"]["spring"]["oneOf"]
    ]
    assert {"linear", "own_first"} <= set(laws)


def test_a_law_for_the_schema_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "nothing.py"
    assert run("hammer", "schema", "--part", missing, "--out", tmp_path / "schema.json") == 2
    assert str(missing) in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_package_brings_a_law(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, "own_installed")
    monkeypatch.syspath_prepend(str(tmp_path))
    entry = EntryPoint("springs", "own_installed", outside.GROUP)
    monkeypatch.setattr(outside, "entry_points", lambda group: [entry] if group == outside.GROUP else [])
    hammer = tmp_path / "hammer.toml"
    hammer.write_text(HAMMER.format(law="own_installed"))
    assert ph.load(hammer).spring is not None
    monkeypatch.setattr(outside, "entry_points", lambda group: [EntryPoint("springs", "own_missing", group)])
    load_installed.cache_clear()
    with refused("springs"):
        ph.load(hammer)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        (
            "spring_force(c, x)",
            "spring_force(x)",
            "spring_force",
        ),
        ("spring_energy(c, x)", "spring_energy(c, x, v)", "spring_energy"),
        (
            "def spring_force",
            "def spring_forces",
            "force",
        ),
        ("@register\n", "", "part"),
        ("class CubicSpring", "class Cubic Spring", None),
        ("from printhammer.parts", "from printhammer.prats", None),
        (
            "def spring_energy(c, x):",
            "spring_energy = 3\ndef other(c, x):",
            "spring_energy",
        ),
        ("    travel = x - c[2]\n", "    travel = x - c[2]\n    print(travel)\n", "spring_force"),
        # A print in a function that the law calls.
        (
            "def spring_force(c, x):\n",
            "def shown(x):\n    print(x)\n\n\ndef spring_force(c, x):\n    shown(x)\n",
            "spring_force",
        ),
    ],
)
def test_a_law_that_is_none_is_a_sentence(tmp_path: Path, old: str, new: str, key: str | None) -> None:
    assert old in CUBIC
    path = written(tmp_path, f"own_{abs(hash(new))}", CUBIC.replace(old, new))
    with refused(key) as caught:
        load_parts(path)
    assert path.name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_law_in_a_cell_of_a_notebook_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = ModuleType("cell")
    monkeypatch.setitem(sys.modules, "cell", cell)
    exec(CUBIC.replace('"hardening"', '"of a cell"'), vars(cell))
    with refused("CubicSpring", "cell"):
        vars(cell)["CubicSpring"](stiffness=1.0, cubic=1.0)


def test_a_law_of_a_file_replaces_one_of_a_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = ModuleType("cell")
    monkeypatch.setitem(sys.modules, "cell", cell)
    exec(CUBIC.replace('"hardening"', '"own_cell"'), vars(cell))
    load_parts(written(tmp_path, "own_cell"))
    assert PARTS["spring", "own_cell"].__module__ == "own_cell"


def test_a_law_that_the_compiler_does_not_understand_is_a_sentence(tmp_path: Path) -> None:
    text = CUBIC.replace("    travel = x - c[2]\n", "    travel = float(str(x - c[2]).upper())\n", 1)
    load_parts(written(tmp_path, "own_words", text))
    spring: dict[str, Any] = {"law": "own_words", "stiffness": "1 N/m", "cubic": "1 N/m^3"}
    hammer = ph.Hammer.build("1 kg", spring=spring)
    with refused("spring_force") as caught:
        ph.simulate(hammer, ph.SineForce("0.1 N", "1 Hz"), duration=1.0)
    assert "own_words.py" in str(caught.value)


def test_a_wrong_law_is_a_sentence_in_python_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, "own_wrong", CUBIC.replace("spring_force(c, x)", "spring_force(x)"))
    monkeypatch.syspath_prepend(str(tmp_path))
    module: Any = __import__("own_wrong")
    spring: dict[str, Any] = {"law": "own_wrong", "stiffness": "1 N/m", "cubic": "1 N/m^3"}
    make: list[Callable[[], object]] = [
        lambda: ph.Hammer.build("1 kg", spring=spring),
        lambda: module.CubicSpring(stiffness=1.0, cubic=1.0),
    ]
    for made in make:
        with refused("spring_force"):
            made()


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("none.py", None),
        ("own-part.py", None),
        ("own.txt", None),
        ("random.py", "module"),
    ],
)
def test_a_file_that_cannot_be_imported_is_a_sentence(tmp_path: Path, name: str, key: str | None) -> None:
    if name != "none.py":
        (tmp_path / name).write_text(CUBIC)
    with refused(key):
        load_parts(tmp_path / name)
