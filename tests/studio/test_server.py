"""The server: who is let in, what ends a connection, and that nothing harms another one."""

import json
import os
import random
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from tests.studio.server import STATE, Studio, frames, say, studio
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from printhammer.studio.bounds import LARGEST_MESSAGE, MOST_TABS

REFUSED = 1008
TOO_LARGE = 1009
BUSY = 1013


@pytest.fixture
def socket_(running: Studio) -> Iterator[ClientConnection]:
    with running.connect() as opened:
        yield opened


def end_of(connection: ClientConnection) -> tuple[int, str]:
    """Return code and reason with which the server ends a connection."""
    for _ in iter(lambda: received(connection), None):
        pass
    assert connection.close_code is not None
    return connection.close_code, connection.close_reason or ""


def received(connection: ClientConnection) -> Any:
    """Return the next message, or None at the end of the connection."""
    try:
        return connection.recv(timeout=30)
    except ConnectionClosed:
        return None


def memory_of(process: int) -> int:
    """Return what a process holds in memory, kB."""
    lines = Path(f"/proc/{process}/status").read_text("utf-8").splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith("VmRSS")))


def get(running: Studio, path: str, **headers: str) -> tuple[int, Any]:
    request = Request(f"http://{running.host}{path}", headers=headers)
    try:
        with urlopen(request) as answer:
            return answer.status, answer.headers
    except HTTPError as error:
        with error:
            return error.code, error.headers


def test_a_token_in_the_address_is_the_right_one(running: Studio) -> None:
    # Without one the page is only its files, which are the same for everybody.
    for path in ("/", f"/?token={running.token}"):
        assert get(running, path)[0] == 200
    for path in ("/?token=", "/?token=wrong", f"/?token={running.token[:-1]}"):
        assert get(running, path)[0] == 403


def test_nothing_is_computed_without_the_token(running: Studio) -> None:
    origin = f"http://{running.host}"
    with (
        pytest.raises(InvalidStatus, match="403"),
        connect(f"ws://{running.host}/socket", origin=Origin(origin)),
    ):
        pass


def test_the_host_is_this_machine(running: Studio) -> None:
    for path in (f"/?token={running.token}", "/mount.js"):
        assert get(running, path, Host="evil.example")[0] == 403


def test_nothing_but_the_files_of_the_page_is_served(running: Studio) -> None:
    assert get(running, "/vendor/uPlot.js")[0] == 200
    for path in (
        "/..%2fapp.py",
        "/../app.py",
        "/app.py",
        "/vendor/",
        "/etc/passwd",
        "//etc/passwd",
        "/%2e%2e/app.py",
    ):
        assert get(running, path)[0] == 404, path


def test_a_browser_is_told_to_fetch_nothing_from_elsewhere(running: Studio) -> None:
    for path in (f"/?token={running.token}", "/studio.css", "/nothing"):
        policy = get(running, path)[1]["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy


def test_only_this_machine_can_connect(running: Studio) -> None:
    name, port = running.host.split(":")
    assert name == "127.0.0.1"
    for found in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET, socket.SOCK_STREAM):
        if not found[4][0].startswith("127."):
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((str(found[4][0]), int(port)), 5).close()


@pytest.mark.parametrize(
    "options", [{"token": ""}, {"token": "wrong"}, {"origin": "http://evil.example"}, {"origin": None}]
)
def test_a_foreign_connection_is_refused(running: Studio, options: dict[str, Any]) -> None:
    with pytest.raises(InvalidStatus, match="403"), running.connect(**options):
        pass


def test_a_state_is_answered(running: Studio, socket_: ClientConnection) -> None:
    say(socket_, "state", 1, state=running.state(views=["motion", "map"]))
    found = frames(socket_, "map", detail="full")
    assert [heading["kind"] for heading, _ in found if heading["kind"] != "dots"] == ["motion", "map", "map"]


@pytest.mark.parametrize(
    ("message", "code", "reason"),
    [
        ("{bad", REFUSED, "JSON"),
        (b"\x00\x01", REFUSED, "text"),
        ('{"kind": "run", "serial": 1}', REFUSED, "kind is expected"),
        ('{"kind": "state", "serial": 1, "state": {"rate": 1}}', REFUSED, "is missing"),
        (json.dumps({"kind": "state", "serial": 1, "state": {**STATE, "pulses": 10**9}}), REFUSED, "pulses"),
        ("x" * (LARGEST_MESSAGE + 1), TOO_LARGE, ""),
    ],
)
def test_a_malformed_message_ends_its_connection_and_no_other(
    running: Studio, socket_: ClientConnection, message: Any, code: int, reason: str
) -> None:
    with running.connect() as other:
        other.send(message)
        ended = end_of(other)
    assert ended[0] == code
    assert reason in ended[1]
    say(socket_, "state", 1, state=running.state(views=["motion"]))
    assert frames(socket_, "dots")[-1][0]["serial"] == 1


def test_there_is_an_end_to_the_number_of_tabs(running: Studio) -> None:
    opened = []
    try:
        for _ in range(MOST_TABS):
            manager = running.connect()
            opened.append(manager)
            say(manager.__enter__(), "hammer", 1, name="", text="")
        with running.connect() as more:
            assert end_of(more)[0] == BUSY
    finally:
        for manager in opened:
            manager.__exit__(None, None, None)


def random_message(source: random.Random) -> str | bytes:
    """Return a message that is malformed, or a state that has been tampered with."""
    whole = json.dumps({"kind": "state", "serial": source.randint(-1, 5), "state": STATE})
    match source.randrange(4):
        case 0:
            return source.randbytes(source.randrange(200))
        case 1:
            return "".join(chr(source.randrange(32, 0x2FF)) for _ in range(source.randrange(200)))
        case 2:
            place = source.randrange(len(whole))
            return whole[:place] + chr(source.randrange(32, 127)) + whole[place + 1 :]
        case _:
            odd = source.choice([None, -1, 1e308, "x" * 500, [], {}, [[]] * 50, True])
            return json.dumps(
                {"kind": "state", "serial": 1, "state": {**STATE, source.choice(list(STATE)): odd}}
            )


@pytest.mark.slow
def test_a_thousand_random_messages_and_fifty_disconnects_leave_it_as_it_was(running: Studio) -> None:
    source = random.Random(7)

    def round_(messages: int, disconnects: int) -> int:
        sent = 0
        while sent < messages:
            with running.connect() as connection:
                try:
                    for _ in range(20):
                        connection.send(random_message(source))
                        sent += 1
                except ConnectionClosed:
                    pass
        for _ in range(disconnects):
            manager = running.connect()
            connection = manager.__enter__()
            say(connection, "state", 1, state=running.state())
            # Gone without a word, while the answer is under way.
            connection.socket.shutdown(socket.SHUT_RDWR)
            connection.socket.close()
            manager.__exit__(None, None, None)
        time.sleep(1.0)
        with running.connect() as connection:
            say(connection, "state", 1, state=running.state(views=["motion", "map"]))
            frames(connection, "map", detail="full")
        return memory_of(running.process.pid)

    before = round_(200, 10)
    after = round_(1000, 50)
    assert running.process.poll() is None
    # A leak of the frames of one page, of half a megabyte each, would be several times as much.
    assert after - before < 16_000


def test_ctrl_c_ends_it_within_a_second_whatever_it_does() -> None:
    with studio() as running, running.connect() as connection:
        say(connection, "state", 1, state=running.state(rate=905.0))
        frames(connection, "motion")
        workers = children_of(running.process.pid)
        assert workers
        begun = time.monotonic()
        running.process.send_signal(signal.SIGINT)
        running.process.wait(20)
        # A second, and what a busy machine needs to do anything at all.
        assert time.monotonic() - begun < 2.0
        end = time.monotonic() + 5.0
        while any(Path(f"/proc/{worker}").exists() for worker in workers):
            assert time.monotonic() < end
            time.sleep(0.02)


def test_nothing_runs_where_no_page_is_open() -> None:
    with studio() as running:
        with running.connect() as connection:
            say(connection, "state", 1, state=running.state())
            frames(connection, "motion")
        processes = [running.process.pid, *children_of(running.process.pid)]
        # What is under way is given up at the next question whether to go on, or ended after a while.
        time.sleep(3.0)
        processes += children_of(running.process.pid)
        before = time_of(processes)
        time.sleep(1.0)
        assert time_of(processes) - before < 0.1


def children_of(process: int) -> list[int]:
    """Return the processes that one has started."""
    found = []
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        found += [int(number) for number in path.read_text("utf-8").split()]
    return found


def time_of(processes: list[int]) -> float:
    """Return the time of the processor that some processes have used, s; of those that ended none."""
    ticks = 0
    for process in set(processes):
        try:
            fields = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()
        except OSError:
            continue
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")
