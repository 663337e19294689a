"""Every script of the gallery runs by itself, without warnings, with public names only."""

import ast
import runpy
from pathlib import Path

import pytest
from tests.scripts import EXAMPLES, ROOT, run_apart, run_here

PARTS = {"cubic_spring"}
SCRIPTS = sorted(path for path in EXAMPLES.glob("*.py") if path.stem not in PARTS)
# Scripts that compute what another test computes; `make docs` runs them.
ELSEWHERE = {
    "feedback": "the example in the help of the verb, in tests/control/feedback/test_comparison.py",
    "least_work": "a burst of as many dots in tests/truth/test_least_work.py",
    "orbits": "the code on the page on orbits, in tests/test_docs.py",
    "strobe": "the code on the page on strobes, in tests/test_docs.py",
}
# What takes a minute as printed runs on fewer values; `make docs` runs all.
FEWER = {
    "continuation": {'("1.23 ms", "1.36 ms")': '("1.24 ms", "1.26 ms")'},
    "damping_materials": {
        "first=300, step=100": "first=300, step=400",
        '    ph.Material("hard", "half the damping", {"backstop.damping": 0.5 * damping}),\n': "",
        '    ph.Material("hard", "twice the damping", {"backstop.damping": 2 * damping}),\n': "",
        '    ph.Material("elastomer", "soft elastomer", elastomer(8e7, 100e-6)),\n': "",
    },
    "print_quality": {"step=25": "step=100"},
    "sensitivities": {"2e-3, 161)": "2e-3, 9)"},
    "sweep": {'"count": 41': '"count": 5', '"count": 151': '"count": 9'},
    "tung_shaw": {
        "1.6e-3, 121)": "1.6e-3, 13)",
        "1.468e-3, 97)": "1.468e-3, 9)",
        "1.407e-3, 79)": "1.407e-3, 9)",
    },
}
# Scripts that run in an interpreter of their own, which has imported nothing before.
APART = {"own_part", "single_pulse"}
# What a part from outside the package is made of.
FOR_PARTS = {"printhammer.support.constants", "printhammer.parts"}


def imported(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def test_there_are_examples() -> None:
    assert len(SCRIPTS) >= 10


def test_every_example_has_its_place_in_the_gallery() -> None:
    order = runpy.run_path(str(ROOT / "docs" / "_ext" / "gallery_style.py"))["ORDER"]
    assert sorted(order) == sorted(path.stem for path in SCRIPTS)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_uses_the_public_names(script: Path) -> None:
    ours = {name for name in imported(script) if name.partition(".")[0] == "printhammer"}
    assert ours == {"printhammer"}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_picture_is_the_last_value_of_its_block_or_has_a_name(script: Path) -> None:
    # What the gallery does not find it does not show.
    lost = [
        ast.unparse(node)
        for block in script.read_text("utf-8").split("# %%")
        for node in ast.parse(block).body[:-1]
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Call)
        and isinstance(node.value.func, ast.Attribute)
        and node.value.func.attr == "plot"
        and not node.value.args
    ]
    assert lost == []


@pytest.mark.parametrize("name", sorted(PARTS))
def test_a_part_from_outside_uses_what_parts_are_made_of(name: str) -> None:
    ours = {name for name in imported(EXAMPLES / f"{name}.py") if name.startswith("printhammer")}
    assert ours == FOR_PARTS


@pytest.mark.slow
@pytest.mark.parametrize(
    "script", [path for path in SCRIPTS if path.stem not in ELSEWHERE], ids=lambda path: path.stem
)
def test_an_example_runs(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if script.stem in FEWER:
        text = script.read_text("utf-8")
        for many, few in FEWER[script.stem].items():
            assert text.count(many) == 1
            text = text.replace(many, few)
        script = tmp_path / script.name
        script.write_text(text, "utf-8")
    if script.stem in APART:
        done = run_apart(script, tmp_path)
        out, err = done.stdout, done.stderr
    else:
        run_here(script, tmp_path, monkeypatch)
        out, err = capsys.readouterr()
    assert err == ""
    assert out != ""
