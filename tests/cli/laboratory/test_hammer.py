import json
from pathlib import Path

import pytest

import printhammer as ph
from printhammer.hammer.hammer import shipped


def test_show_tells_every_constant_with_status_and_source(cli, hammer: "ph.Hammer") -> None:
    outcome = cli("hammer", "show")
    assert outcome.status == 0
    lines = outcome.out.splitlines()
    sources = outcome.out[outcome.out.index("\nsources") :]
    for key, constant in hammer.constants.items():
        name = key.rpartition(".")[2]
        (line,) = [line for line in lines if line.split()[:2] == [name, f"{constant.value:.9g}"]]
        assert constant.status in line
        assert constant.source in sources
    assert "a reconstruction: 3 stated, 1 derived, 13 reconstructed" in outcome.out
    assert "A reconstructed constant is not a measurement." in " ".join(outcome.out.split())


def test_show_tells_the_statics(cli, hammer: "ph.Hammer") -> None:
    text = cli("hammer", "show").out
    statics = text[text.index("statics") :]
    assert f"{ph.rest_state(hammer) * 1e6:.2f} µm" in statics
    assert f"{ph.release_current(hammer):.3f} A" in statics
    for found in ph.equilibria(hammer):
        assert f"{found.x * 1e6:.2f} µm" in statics
        assert ("stable" if found.stable else "unstable") in statics
    for x in (hammer.position, hammer.front, hammer.platen):
        assert f"{float(ph.holding_margin(hammer, x)):.2f} N" in statics


def test_show_in_inches(cli, hammer: "ph.Hammer") -> None:
    text = cli("hammer", "show", "--units", "inch").out
    assert f"{ph.rest_state(hammer) / 25.4e-6:.3f} mil" in text


def test_the_file_is_printed_as_it_is(cli, hammer: "ph.Hammer", tmp_path: Path) -> None:
    outcome = cli("hammer", "show", "--toml")
    assert outcome.out == hammer.to_toml()
    (tmp_path / "mine.toml").write_text(outcome.out, "utf-8")
    assert cli("hammer", "check", tmp_path / "mine.toml").status == 0


@pytest.mark.parametrize("part", ["magnet", "spring", "pack", "backstop", "waveform", "platen"])
def test_show_without_a_part(cli, hammer: "ph.Hammer", part: str, tmp_path: Path) -> None:
    hammer.replace(part, None).save(tmp_path / "less.toml")
    outcome = cli("hammer", "show", tmp_path / "less.toml")
    assert outcome.status == 0
    assert "rest state" in outcome.out


def test_check(cli) -> None:
    outcome = cli("hammer", "check", "hendriks-1983")
    assert outcome == (0, outcome.out, "")
    assert outcome.out.startswith("hendriks-1983: ok")


def test_schema(cli, hammer: "ph.Hammer", tmp_path: Path) -> None:
    printed = json.loads(cli("hammer", "schema").out)
    assert printed == hammer.schema()
    assert cli("hammer", "schema", "--out", tmp_path / "schema.json").status == 0
    assert json.loads((tmp_path / "schema.json").read_text()) == printed


def test_list(cli) -> None:
    outcome = cli("hammer", "list")
    for name in shipped():
        assert name in outcome.out
        assert ph.load(name).title in outcome.out


def test_version(cli) -> None:
    assert cli("--version") == (0, f"printhammer {ph.__version__}\n", "")


def test_without_arguments_the_help_is_shown(cli) -> None:
    outcome = cli()
    assert outcome.status == 2
    assert "Usage" in outcome.out
    assert outcome.err == ""
