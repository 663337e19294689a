"""Tests of the program of the study: help, examples, commands on the pages, bad options."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main
from studies.reconstruction.__main__ import NAME, app
from studies.reconstruction.verbs import EXAMPLE, VERBS

from printhammer.cli.options import read_plain, read_whole
from printhammer.cli.runner import Verb

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "docs" / "howto" / f"{name}.md" for name in ("reconstruction", "schemes")]
NAMES = [verb.name for verb in VERBS]
# Required arguments of each verb, so that a test reaches the bad option.
NEEDED = {
    "search": ("new.jsonl",),
    "judge": ("a.jsonl", "new.jsonl"),
    "base-rates": ("new.json",),
    "schemes": ("new.json",),
    "front": ("a.jsonl",),
    "predictions": ("a.jsonl", "b.jsonl", "new.json"),
    "family": ("a.jsonl",),
    "ship": ("a.jsonl", "b.jsonl"),
}
# Examples that take minutes, with the tests that replace them.
ELSEWHERE = {
    "schemes": "test_verbs.py, and the count in judging/test_schemes.py",
    "search": "the example of predictions begins with a shorter one",
    "judge": "test_verbs.py, with claims at no cost; the example of predictions judges too",
    "family": "family/test_family.py, with claims at no cost; family/test_family_shipped.py judges a member",
    "base-rates": "test_verbs.py, with claims at no cost",
    "front": "test_verbs.py, with claims at no cost",
    "ship": "test_verbs.py, with the stated claims",
}


def check_readable(words: list[str]) -> None:
    command: Any = typer.main.get_command(app)
    if "--help" not in words:
        command.commands[words[0]].make_context(words[0], words[1:])


def commands_of(text: str) -> list[list[str]]:
    commands = [shlex.split(part, comments=True) for part in text.replace("\\\n", "").split(" && ")]
    start = NAME.split()
    assert all(words[: len(start)] == start for words in commands)
    return [words[len(start) :] for words in commands]


@pytest.mark.parametrize("verb", VERBS, ids=NAMES)
def test_help_carries_an_example_that_can_be_read(cli: Callable[..., Any], verb: Verb) -> None:
    done = cli(verb.name, "--help")
    assert done.status == 0
    lines = done.out.partition("Example: ")[2].splitlines()
    assert "".join(line.strip().removesuffix("\\") for line in lines).strip() == verb.example
    for words in commands_of(verb.example):
        check_readable(words)


def test_the_program_has_the_example_of_a_verb(cli: Callable[..., Any]) -> None:
    assert EXAMPLE in " ".join(cli("--help").out.split())
    assert EXAMPLE in {verb.example for verb in VERBS}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_the_commands_on_a_page_can_be_read(page: Path) -> None:
    lines = re.findall(rf"^{NAME} .*$", page.read_text("utf-8"), re.MULTILINE)
    assert lines or page.stem != "reconstruction"
    for line in lines:
        (words,) = commands_of(line)
        check_readable(words)


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb.name not in ELSEWHERE], ids=lambda v: v.name)
def test_the_example_in_the_help_runs(verb: Verb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)
    shell = verb.example.replace("python -m", f"{shlex.quote(sys.executable)} -m")
    done = subprocess.run(shell, shell=True, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    words = verb.example.split()
    names = [words[k + 1] for k, word in enumerate(words) if word == "--out"]
    names += re.findall(r"[\w.]+\.jsonl?\b", verb.example)
    assert {path.name for path in tmp_path.iterdir()} == {Path(name).parts[0] for name in names}


@pytest.mark.parametrize("verb", VERBS, ids=NAMES)
def test_an_option_that_is_none_is_refused(refused: Callable[..., None], verb: Verb) -> None:
    refused(verb.name, *NEEDED[verb.name], "--no-such-option", "1", said="--no-such-option")


def numbers() -> Iterator[Any]:
    for verb in VERBS:
        for name, option in verb.options.items():
            if option.read in (read_whole, read_plain):
                yield verb, option.flag_of(name)


def test_every_number_is_read_by_typer() -> None:
    assert list(numbers()) == []


def test_a_hammer_that_is_none_is_refused(refused: Callable[..., None]) -> None:
    words = ("schemes", "new.json", "--hammer", "nobody.toml")
    refused(*words, said=("nobody.toml", "no such file"))


def test_a_hammer_without_a_waveform_or_an_input_is_never_written_over(
    refused: Callable[..., None], tmp_path: Path
) -> None:
    import printhammer as ph

    path = tmp_path / "hammer.json"
    ph.load("hendriks-1983").save(path)
    refused("schemes", path, "--hammer", path, said="that is not an input file")


@pytest.mark.parametrize("name", ["base-rates", "schemes", "predictions"])
def test_a_file_that_is_there_is_not_written_over(
    refused: Callable[..., None], name: str, tmp_path: Path
) -> None:
    (tmp_path / "new.json").write_text("mine", "utf-8")
    refused(
        name, *NEEDED[name], said="new.json: expected a new file, but the file exists; --force overwrites"
    )


def test_the_front_is_written_to_a_new_file_of_a_known_kind(
    refused: Callable[..., None], tmp_path: Path
) -> None:
    (tmp_path / "front.csv").write_text("mine", "utf-8")
    refused("front", "a.jsonl", "--out", "front.csv", said="front.csv: expected a new file")
    refused("front", "a.jsonl", "--out", "front.txt", said="--out front.txt: expected a name that ends in")


def test_a_log_is_continued_without_force(cli: Callable[..., Any]) -> None:
    continued = {verb.name for verb in VERBS if any(files.continued for files in verb.files.values())}
    assert continued == {"search", "judge"}
    for verb in VERBS:
        assert ("--force" in cli(verb.name, "--help").out) == (verb.name not in continued)
