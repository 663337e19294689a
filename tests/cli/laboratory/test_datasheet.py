from collections.abc import Callable
from pathlib import Path

import pytest

import printhammer as ph


def test_the_sheet_of_a_shipped_hammer_makes_that_hammer(cli: Callable, tmp_path: Path) -> None:
    sheet, made = tmp_path / "sheet.toml", tmp_path / "relay.toml"
    sheet.write_text(cli("hammer", "from-datasheet", "--example", "relay-5v").out)
    done = cli("hammer", "from-datasheet", sheet, "--out", made)
    assert done.status == 0
    assert "datasheet" in done.out
    assert "of the law" in done.out
    assert ph.load(made).name == "relay-5v"
    assert ph.load(made).constants["coil.resistance"].status == "datasheet"


def test_a_force_that_is_not_met_is_told(cli: Callable, tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.toml"
    text = cli("hammer", "from-datasheet", "--example", "dot-peen").out
    sheet.write_text(text.replace('"95 N"', '"9.5 N"'))
    done = cli("hammer", "from-datasheet", sheet)
    assert done.status == 0
    assert "the fit misses a force by" in done.err


def test_nothing_is_written_over(refused: Callable, cli: Callable, tmp_path: Path) -> None:
    sheet, made = tmp_path / "sheet.toml", tmp_path / "made.toml"
    sheet.write_text(cli("hammer", "from-datasheet", "--example", "dot-peen").out)
    made.write_text("mine")
    refused("hammer", "from-datasheet", sheet, "--out", made, said="expected a new file, but the file exists")
    refused("hammer", "from-datasheet", sheet, "--out", sheet, "--force", said="that is not an input file")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "SHEET"),
        (("no.toml",), "no.toml: the data sheet cannot be read"),
        (("--example", "relay"), "--example = 'relay'"),
    ],
)
def test_what_cannot_be_used(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("hammer", "from-datasheet", *words, said=said)
