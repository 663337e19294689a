"""The verb `studio`: it tells its address, and ends on request; what it cannot use is refused."""

import os
import re
import signal
import socket
import subprocess
import sysconfig
from collections.abc import Callable
from pathlib import Path
from urllib.request import urlopen

import pytest
from tests.hammers import CRUDE

SCRIPT = Path(sysconfig.get_path("scripts")) / "printhammer"


@pytest.mark.parametrize("port", ["one", "-1", "65536", "1.5"])
def test_what_is_no_port_is_refused(refused: Callable, port: str) -> None:
    refused("studio", CRUDE, "--no-open", "--port", port, said=("port = ", port))


def test_a_port_in_use_is_refused(cli: Callable) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        outcome = cli("studio", str(CRUDE), "--no-open", "--port", str(port))
    assert outcome.status == 2
    assert f"port = {port}: it cannot be used" in outcome.err


def test_it_tells_its_address_and_ends_with_ctrl_c() -> None:
    command = (SCRIPT, "studio", CRUDE, "--no-open")
    environment = {**os.environ, "COLUMNS": "60"}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{24,}$", line.strip())
        assert address, line
        with urlopen(address[0]) as answer:
            assert b"printhammer studio" in answer.read()
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in told
