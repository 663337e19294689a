"""The commands on the pages: each command parses, and the tutorials run from an empty folder."""

import os
import re
import shlex
import subprocess
import sysconfig
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest
import typer

from printhammer.cli.main import MODULES, program_of

ROOT = Path(__file__).parents[1]
PAGES = sorted(path for path in (ROOT / "docs").rglob("*.md") if "gallery" not in path.parts)
SHELL = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
# A command in the cell of a table, as on the cheat sheet.
CELL = re.compile(r"\| `(printhammer (?!.*\.widget)[^`]+)` \|")
COMMAND = re.compile(r"^printhammer .*$", re.MULTILINE)
PROGRAM: Any = typer.main.get_command(program_of())
VERB_NAMES = sorted((name.split() for name in MODULES), key=len, reverse=True)


def commands_of(page: Path) -> list[list[str]]:
    whole = page.read_text("utf-8")
    text = "".join((*SHELL.findall(whole), *(f"{cell}\n" for cell in CELL.findall(whole))))
    text = text.replace("\\\n", " ")
    lines = [shlex.split(line, comments=True)[1:] for line in COMMAND.findall(text)]
    return [list(takewhile(lambda word: word not in (">", "|", "&&"), words)) for words in lines]


@pytest.mark.parametrize(
    "page",
    [page for page in (ROOT / "README.md", *PAGES) if commands_of(page)],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_the_commands_on_a_page_can_be_read(page: Path) -> None:
    for words in commands_of(page):
        command = PROGRAM
        name = next((name for name in VERB_NAMES if words[: len(name)] == name), None)
        assert name is not None, words
        for part in name:
            command = command.commands[part]
        if "--help" not in words:
            command.make_context(" ".join(name), words[len(name) :])


@pytest.mark.slow
def test_the_commands_of_a_tutorial_run_in_a_shell(tmp_path: Path) -> None:
    """The commands of the other tutorials run in one process, in tests/cli/test_page_commands.py."""
    page = ROOT / "docs" / "tutorials" / "developer.md"
    done = subprocess.run(
        ["sh", "-ec", "".join(SHELL.findall(page.read_text("utf-8")))],
        cwd=tmp_path,
        env={**os.environ, "PATH": f"{sysconfig.get_path('scripts')}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
