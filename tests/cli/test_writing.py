"""Files written by the verbs: no file is overwritten without --force; names of the output options."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.errors import refused

from printhammer.report.build import check_place

THERE = "expected a new file, but the file exists; --force overwrites"


def test_force_writes_over(cli: Callable[..., Any], refused: Callable[..., None], tmp_path: Path) -> None:
    path = tmp_path / "schema.json"
    path.write_text("mine", "utf-8")
    refused("hammer", "schema", "--out", path, said=(str(path), THERE))
    assert cli("hammer", "schema", "--out", path, "--force").status == 0
    assert path.read_text("utf-8").startswith("{")


def test_a_link_that_leads_nowhere_is_there_too(refused: Callable[..., None], tmp_path: Path) -> None:
    (tmp_path / "schema.json").symlink_to(tmp_path / "elsewhere")
    refused("hammer", "schema", "--out", "schema.json", said=THERE)


def test_files_that_need_no_naming_are_not_written_over(refused: Callable[..., None], tmp_path: Path) -> None:
    (tmp_path / "printed.pdf").write_text("mine", "utf-8")
    refused("print", "HI", "--rate", "1 kHz", said=("printed.pdf", THERE))


def test_a_figure_is_not_written_over(refused: Callable[..., None], tmp_path: Path) -> None:
    (tmp_path / "figure03.pdf").write_text("mine", "utf-8")
    refused("figure", "3", "--out", ".", said=("figure03.pdf", THERE))


@pytest.mark.parametrize("name", ["index.html", "claims.json", "report.pdf", "figures/figure03.svg"])
def test_a_report_writes_over_no_other_file(refused: Callable[..., None], name: str, tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    (tmp_path / name).write_text("mine", "utf-8")
    refused("paper", "--out", ".", said=(name, "an earlier report", "--force"))


def test_a_report_replaces_an_earlier_one(tmp_path: Path) -> None:
    check_place(tmp_path / "not there")
    check_place(tmp_path)
    for name, text in (("claims.json", '[{"name": "stroke", "verdict": "holds"}]'), ("index.html", "page")):
        (tmp_path / name).write_text(text, "utf-8")
        check_place(tmp_path)
    (tmp_path / "claims.json").write_text('["of another program"]', "utf-8")
    with refused(None, file="index.html"):
        check_place(tmp_path)
