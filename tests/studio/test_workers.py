"""Workers: what is stuck is ended, what compiles is left to it, and nothing computes for nobody."""

import json
import subprocess
import sys
import time
from typing import Any

import pytest
from tests.studio.server import STATE
from tests.studio.test_session import TEXT, Page, state

from printhammer.studio import session as sessions
from printhammer.studio.frames import frame
from printhammer.studio.session import Session
from printhammer.studio.states.state import read_state
from printhammer.studio.workers import crew as crews
from printhammer.studio.workers.crew import Crew
from printhammer.studio.workers.order import Order
from printhammer.studio.workers.worker import ProcessWorker, Worker

STUCK = 999.0
CHILD = f"""
import time
from printhammer.studio.workers import child, jobs
def answer(order, desk):
    if order.state.rate == {STUCK}:
        time.sleep(600.0)
    desk.tell(jobs.refusal(order.serial, "none is wanted"), "refusal")
jobs.ROLES["curves"] = answer
child.main()
"""


class Hired:
    """Makes processes that are stuck at one rate, and knows them."""

    def __init__(self) -> None:
        self.workers: list[ProcessWorker] = []

    def __call__(self) -> ProcessWorker:
        self.workers.append(ProcessWorker(command=("-c", CHILD)))
        return self.workers[-1]

    def running(self) -> int:
        return sum(worker.process.poll() is None for worker in self.workers)


def until(condition: Any, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_what_is_stuck_is_ended_for_a_newer_state_and_with_the_page() -> None:
    page, hired = Page(), Hired()
    made = Session(page.take, crew=(crew := Crew(hired)))
    try:
        made.receive(state(1, rate=STUCK))
        until(lambda: hired.workers)
        made.receive(json.dumps({"kind": "hammer", "serial": 2, "name": "", "text": TEXT}))
        page.until("hammer", serial=2)
        made.receive(state(3, rate=900.0))
        page.until("refusal", serial=3)
        assert hired.workers[0].process.poll() is not None
        made.receive(state(4, rate=STUCK))
        time.sleep(0.2)
        made.close()
        made.join(30)
        assert not any(thread.is_alive() for thread in made._threads)
    finally:
        made.close()
        crew.close()
    until(lambda: hired.running() == 0)


def test_what_is_stuck_is_given_up_after_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "PATIENCE", 0.5)
    monkeypatch.setattr(sessions, "_SPARE", 0.0)
    page, hired = Page(), Hired()
    made = Session(page.take, crew=(crew := Crew(hired)))
    try:
        made.receive(state(1, rate=STUCK))
        (told,) = page.until("refusal", serial=1)
        assert told["reason"] == "the curves would take more than 0.5 s for this hammer"
    finally:
        made.close()
        crew.close()


def test_a_worker_whose_studio_was_killed_ends() -> None:
    script = (
        "import sys, time\nfrom printhammer.studio.workers.worker import ProcessWorker\n"
        "print(ProcessWorker().process.pid, flush=True)\ntime.sleep(600)\n"
    )
    studio = subprocess.Popen((sys.executable, "-c", script), stdout=subprocess.PIPE, text=True)
    assert studio.stdout is not None
    worker = int(studio.stdout.readline())
    studio.kill()
    studio.wait(20)
    studio.stdout.close()
    until(lambda: not runs(worker))


def runs(process: int) -> bool:
    """Return whether a process runs; one that nobody has waited for is a zombie."""
    try:
        with open(f"/proc/{process}/stat", encoding="utf-8") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


class Compiler(Worker):
    """Compiles for as long as it is not told to be done."""

    def __init__(self) -> None:
        super().__init__()
        self.orders: list[Order] = []
        self.superseded = 0
        self.ended = False

    def begin(self, order: Order) -> None:
        self.orders.append(order)
        self.messages.put(("compiling", "compiling it"))

    def supersede(self) -> None:
        self.superseded += 1

    def end(self) -> None:
        self.ended = True


def test_what_compiles_is_left_to_it_and_another_serves_what_needs_other_machine_code() -> None:
    hired: list[Compiler] = []

    def hire() -> Compiler:
        hired.append(Compiler())
        return hired[-1]

    page = Page()
    made = Session(page.take, crew=(crew := Crew(hire)))
    other = {"shape": "trapezoid", "amplitude": 1.0, "rise": 5e-5, "width": 2e-4, "fall": 5e-5}
    try:
        made.receive(state(1, views=["motion"]))
        told = page.until("progress")[-1]
        assert (told["role"], told["what"]) == ("curves", "compiling it")
        # The same machine code: nobody else compiles it as well.
        made.receive(state(2, views=["motion"], rate=800.0))
        until(lambda: hired[0].superseded)
        time.sleep(0.2)
        assert len(hired) == 1
        # Another pulse.
        made.receive(state(3, views=["motion"], waveform=other))
        until(lambda: len(hired) == 2 and hired[1].orders)
        assert hired[1].orders[0].serial == 3
        hired[0].messages.put(("compiling", ""))
        hired[0].messages.put(("done",))
        hired[1].messages.put(("frame", "motion", True, frame("motion", 3)))
        hired[1].messages.put(("done",))
        page.until("motion", serial=3)
        until(lambda: len(crew._idle["curves"]) == 2)
        assert not any(worker.ended for worker in hired)
    finally:
        made.close()
        crew.close()
        made.join(30)
    assert all(worker.ended for worker in hired)


def test_a_worker_that_was_left_and_neither_compiles_nor_ends_is_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(crews, "PATIENT", 0.1)
    hired: list[Compiler] = []

    def hire() -> Compiler:
        hired.append(Compiler())
        return hired[-1]

    crew = Crew(hire)
    worker = crew.lend("map", None, lambda: True)
    assert worker is not None
    crew.leave("map", worker)
    until(lambda: hired[0].ended)
    until(lambda: len(hired) == 2)
    crew.close()


def test_an_order_goes_through_a_pipe() -> None:
    worker = ProcessWorker()
    try:
        worker.begin(Order("curves", 5, read_state({**STATE, "text": TEXT}), (), {"map": "old"}))
        message = worker.next(60.0)
        while message is not None and message[0] == "compiling":
            message = worker.next(60.0)
        assert message is not None
        assert message[:3] == ("frame", "motion", True)
    finally:
        worker.end()
