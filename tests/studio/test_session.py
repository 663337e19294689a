"""Sessions: the latest state wins, what is quick goes first, and nothing is told after the end."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from tests.hammers import CRUDE
from tests.studio.server import STATE

from printhammer.hammer.hammer import Hammer
from printhammer.studio import bounds
from printhammer.studio import session as sessions
from printhammer.studio.bounds import LARGEST_MESSAGE
from printhammer.studio.frames import unframe
from printhammer.studio.messages import read_message
from printhammer.studio.pictures.section import AT_ONCE, LATER
from printhammer.studio.session import Session
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import ProtocolError
from printhammer.studio.workers import jobs
from printhammer.studio.workers.crew import Crew
from printhammer.studio.workers.worker import ThreadWorker

TEXT = CRUDE.read_text("utf-8")


class Page:
    """Takes frames, as slowly as it is told to."""

    def __init__(self) -> None:
        self.frames: list[dict[str, Any]] = []
        self.arrived = threading.Condition()
        self.open = threading.Event()
        self.open.set()

    def take(self, data: bytes) -> None:
        self.open.wait(60)
        with self.arrived:
            self.frames.append(unframe(data)[0])
            self.arrived.notify_all()

    def until(self, kind: str, **told: Any) -> list[dict[str, Any]]:
        def there() -> bool:
            return any(
                frame["kind"] == kind and all(frame.get(name) == value for name, value in told.items())
                for frame in self.frames
            )

        with self.arrived:
            assert self.arrived.wait_for(there, 120), self.frames
        return list(self.frames)


@contextmanager
def opened(shelf: Shelf | None = None) -> Iterator[tuple[Session, Page]]:
    page = Page()
    made = Session(page.take, shelf, Crew(ThreadWorker))
    try:
        yield made, page
    finally:
        page.open.set()
        made.close()
        made.join(60)


def state(serial: int, **changed: Any) -> str:
    return json.dumps({"kind": "state", "serial": serial, "state": {**STATE, "text": TEXT, **changed}})


def test_curves_come_first_and_previews_before_detail() -> None:
    with opened() as (made, page):
        made.receive(state(1, views=["motion", "map"]))
        found = page.until("map", detail="full")
    told = [
        (frame["kind"], frame.get("detail")) for frame in found if frame["kind"] not in ("dots", "progress")
    ]
    assert told == [("motion", None), ("map", "preview"), ("map", "full")]


def test_the_latest_state_wins_and_none_waits_behind_a_slow_page() -> None:
    with opened() as (made, page):
        made.receive(state(1, views=["motion"]))
        page.until("dots", serial=1)
        page.open.clear()
        for serial in range(2, 40):
            made.receive(state(serial, views=["motion"], rate=1000.0 + serial))
        page.open.set()
        found = page.until("dots", serial=39)
    served = [frame["serial"] for frame in found if frame["kind"] == "motion"]
    assert served[0] == 1
    assert served[-1] == 39
    assert len(served) <= 4


def test_a_map_that_is_shown_is_not_computed_again() -> None:
    with opened() as (made, page):
        made.receive(state(1, views=["motion", "map"]))
        page.until("map", detail="full")
        made.receive(state(2, views=["motion", "map"], rate=900.0))
        found = page.until("dots", serial=2)
        made.receive(state(3, views=["motion", "map"], pulses=3))
        found = page.until("map", serial=3, detail="full")
    assert [frame["serial"] for frame in found if frame["kind"] == "map"] == [1, 1, 3, 3]


def test_a_map_is_computed_again_after_a_coarse_one_of_another_state() -> None:
    with opened() as (made, page):
        made.receive(state(1, views=["motion", "map"]))
        page.until("map", detail="full")
        made.receive(state(2, views=["motion", "map"], pulses=3))
        page.until("map", serial=2, detail="preview")
        made.receive(state(3, views=["motion", "map"]))
        page.until("map", serial=3, detail="full")


def test_views_that_do_not_belong_to_a_state_are_told_with_its_curves() -> None:
    with opened() as (made, page):
        made.receive(state(1, views=["motion", "map"]))
        page.until("map", detail="full")
        made.receive(state(2, views=["motion", "map"], rate=900.0))
        page.until("dots", serial=2)
        made.receive(state(3, views=["motion", "map"], pulses=3))
        found = page.until("dots", serial=3)
    told = [frame["outdated"] for frame in found if frame["kind"] == "motion"]
    assert told == [{"map": "being computed"}, {}, {"map": "this still belongs to what was set before"}]


def test_what_describes_no_hammer_is_told_and_the_next_state_is_served() -> None:
    with opened() as (made, page):
        made.receive(state(1, constants={"mass": 1.0}))
        (told,) = page.until("refusal", serial=1)
        assert "mass = 1 kg: expected" in told["reason"]
        made.receive(state(2, views=["motion"]))
        page.until("dots", serial=2)


def test_questions_are_answered() -> None:
    with opened() as (made, page):
        made.receive(json.dumps({"kind": "hammer", "serial": 1, "name": "", "text": TEXT}))
        made.receive(json.dumps({"kind": "hammer", "serial": 2, "name": "no such hammer", "text": ""}))
        page.until("refusal", serial=2)
        found = page.until("hammer", serial=1)
    (told,) = [frame for frame in found if frame["kind"] == "hammer"]
    assert {constant["key"] for constant in told["hammer"]["constants"]} >= {"mass", "pack.stiffness"}
    assert "hendriks-1983" in told["offered"]


def test_a_reason_is_no_longer_than_it_can_be_read() -> None:
    question = {"kind": "hammer", "serial": 1, "name": "x" * 100_000, "text": ""}
    with opened() as (made, page):
        made.receive(json.dumps(question))
        (told,) = page.until("refusal")
    assert len(told["reason"]) == bounds.LONGEST_REASON


def test_nothing_is_sent_after_the_end_and_all_threads_end() -> None:
    page = Page()
    made = Session(page.take, crew=Crew(ThreadWorker))
    made.receive(state(1, views=["motion", "map", "strobe"]))
    page.until("motion")
    made.close()
    made.join(60)
    count = len(page.frames)
    made.receive(state(2))
    assert not any(thread.is_alive() for thread in made._threads)
    assert len(page.frames) == count


def test_a_page_that_is_gone_ends_the_work() -> None:
    def gone(_data: bytes) -> None:
        raise ConnectionError

    made = Session(gone, crew=Crew(ThreadWorker))
    made.receive(state(1))
    made.join(60)
    assert not any(thread.is_alive() for thread in made._threads)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "JSON"),
        ("{", "JSON"),
        ("[" * 100_000, "JSON"),
        ("[]", "table"),
        ('{"kind": "state"}', "serial"),
        ('{"kind": "state", "serial": 0, "state": {}}', "serial"),
        ('{"kind": "state", "serial": true, "state": {}}', "serial"),
        ('{"kind": "shell", "serial": 1}', "kind"),
        ('{"kind": ["state"], "serial": 1}', "kind"),
        ('{"kind": "state", "serial": 1, "state": {}, "more": 1}', "has the keys"),
        ('{"kind": "hammer", "serial": 1, "name": 1, "text": ""}', "texts"),
        (" " * (LARGEST_MESSAGE + 1), "characters"),
    ],
)
def test_a_malformed_message_is_refused_with_a_reason(text: str, reason: str) -> None:
    with pytest.raises(ProtocolError, match=reason):
        read_message(text)


def test_too_many_questions_at_once_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    hold = threading.Event()
    monkeypatch.setattr(sessions, "answer", lambda *_: hold.wait(60) and b"")
    made = Session(lambda _data: None, crew=Crew(ThreadWorker))
    question = json.dumps({"kind": "hammer", "serial": 1, "name": "", "text": ""})

    def ask(times: int) -> None:
        for _ in range(times):
            made.receive(question)

    try:
        with pytest.raises(ProtocolError, match="16 questions"):
            ask(40)
    finally:
        hold.set()
        made.close()
        made.join(60)


def test_points_arrive_before_the_verdict() -> None:
    with opened() as (made, page):
        made.receive(state(1, views=["strobe"], rate=900.0))
        with page.arrived:
            assert page.arrived.wait_for(lambda: judged(page.frames), 300), [
                (frame["kind"], frame.get("reason")) for frame in page.frames
            ]
        found = [frame for frame in page.frames if frame["kind"] == "strobe"]
    counts = [frame["arrays"][0]["shape"][0] for frame in found]
    assert counts == [*AT_ONCE, *LATER, LATER[-1]]
    assert [frame["exponent"] is not None for frame in found] == [False] * 3 + [True] * 4 + [False]
    assert [frame["verdict"] is not None for frame in found] == [False] * 7 + [True]


def judged(found: list[dict[str, Any]]) -> bool:
    return any(frame["kind"] == "strobe" and frame["verdict"] for frame in found)


def test_a_map_that_takes_too_long_is_told_and_the_rest_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "MOST_MAP_STEPS", 20)
    with opened() as (made, page):
        made.receive(state(1, views=["motion", "map", "strobe"]))
        page.until("dots")
        found = page.until("strobe")
    maps = [frame for frame in found if frame["kind"] == "map"]
    assert len(maps) == 1
    assert "expected fewer" in maps[0]["reason"]
    assert {frame["kind"] for frame in found} == {"motion", "map", "dots", "strobe"}


def test_what_nobody_thought_of_is_told_and_the_page_lives_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*_: Any) -> bytes:
        raise ZeroDivisionError("nobody thought of this")

    with opened() as (made, page):
        with monkeypatch.context() as patched:
            patched.setattr(jobs, "motion_frame", broken)
            made.receive(state(1))
            (told,) = page.until("refusal", serial=1)
        made.receive(state(2, views=["motion"]))
        page.until("dots", serial=2)
    assert told["reason"] == "this could not be computed, ZeroDivisionError: nobody thought of this"
    assert "nobody thought of this" in caplog.text


def test_what_fails_before_a_worker_is_asked_is_told_and_the_page_lives_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*_: Any) -> Any:
        raise ZeroDivisionError("nobody thought of this")

    with opened() as (made, page):
        with monkeypatch.context() as patched:
            patched.setattr(sessions, "kernel_key", broken)
            made.receive(state(1))
            page.until("refusal", serial=1)
        made.receive(state(2, views=["motion"]))
        page.until("dots", serial=2)
    assert "nobody thought of this" in caplog.text


def test_two_studios_in_one_process_have_hammers_of_their_own() -> None:
    hammer = Hammer.from_toml(TEXT.replace('"hendriks-1983"', '"mine"', 1), name="mine.toml")
    question = json.dumps({"kind": "hammer", "serial": 1, "name": hammer.name, "text": ""})
    with opened(Shelf(hammer)) as (made, page), opened() as (other, empty):
        made.receive(question)
        other.receive(question)
        (told,) = page.until("hammer")
        (refused,) = empty.until("refusal")
    assert told["hammer"]["name"] == hammer.name
    assert hammer.name in told["offered"]
    assert hammer.name in refused["reason"]
