"""The verb `studio`: it opens with a state, says where it is, and ends with Ctrl-C."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import pytest
from tests.studio.server import STATE, Studio, frames, say

from printhammer.studio.states.links import file_of
from printhammer.studio.states.state import read_state


@contextmanager
def opened(*arguments: str, home: Path) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """Run the verb without a browser; give its process and its address."""
    command = (sys.executable, "-m", "printhammer", "studio", "--no-open", *arguments)
    environment = {**os.environ, "XDG_STATE_HOME": str(home), "LOCALAPPDATA": str(home), "HOME": str(home)}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        yield process, process.stdout.readline().strip().removeprefix("The studio is at ")
    finally:
        process.kill()
        process.wait(20)
        process.stdout.close()
        process.stderr.close()


def test_it_opens_with_a_state_and_ends_with_ctrl_c(tmp_path: Path) -> None:
    saved = tmp_path / "state.json"
    saved.write_text(file_of(read_state({**STATE, "hammer": "hendriks-1983", "rate": 777.0})), "utf-8")
    with opened("--state", str(saved), "--port", "0", home=tmp_path) as (process, address):
        studio = Studio(address, "hendriks-1983", process)
        with urlopen(address) as answer:
            assert answer.status == 200
        with studio.connect() as connection:
            say(connection, "open", 1, state={})
            heading, _ = frames(connection, "open")[-1]
        assert heading["state"]["rate"] == 777.0
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
        assert errors.strip() == "printhammer: interrupted"
        assert process.returncode == 130


def test_its_token_and_its_port_are_the_same_next_time_where_that_is_free(tmp_path: Path) -> None:
    with opened(home=tmp_path) as (_, first), opened(home=tmp_path) as (_, second):
        # The port is taken when the second one starts.
        assert second
    assert first.partition("token=")[2] == second.partition("token=")[2]
    assert first != second


@pytest.mark.parametrize(("content", "reason"), [("{", "expected a state file"), (None, "there is no")])
def test_a_state_that_is_none_is_refused_in_one_sentence(
    tmp_path: Path, content: str | None, reason: str
) -> None:
    path = tmp_path / "state.json"
    if content is not None:
        path.write_text(content, "utf-8")
    with opened("--state", str(path), home=tmp_path) as (process, _):
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "Traceback" not in errors
    assert str(path) in errors.replace("\n", "")
