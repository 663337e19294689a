"""Work distributed to threads: completeness, progress, interruption, errors."""

import os
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.support import threads
from printhammer.support.threads import in_threads, thread_count


class Works:
    """Work that records which items were done, and in which thread."""

    def __init__(self, sizes: list[int]) -> None:
        self.done = [[0] * size for size in sizes]
        self.pieces: list[tuple[int, int, int]] = []
        self.threads: set[int] = set()
        self.lock = threading.Lock()

    def work(self, which: int) -> threads.Piece:
        def piece(first: int, last: int) -> None:
            with self.lock:
                self.pieces.append((which, first, last))
                self.threads.add(threading.get_ident())
                for i in range(first, last):
                    self.done[which][i] += 1

        return piece

    @property
    def all(self) -> list[threads.Piece]:
        return [self.work(which) for which in range(len(self.done))]


@given(
    sizes=st.lists(st.integers(0, 70), max_size=4),
    count=st.integers(1, 4),
    length=st.one_of(st.none(), st.integers(1, 20)),
)
def test_every_number_is_done_once(sizes: list[int], count: int, length: int | None) -> None:
    works = Works(sizes)
    told: list[tuple[int, int]] = []
    lengths = None if length is None else [length] * len(sizes)
    in_threads(works.all, sizes, count, lambda done, total: told.append((done, total)), lengths)
    assert works.done == [[1] * size for size in sizes]
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert {total for _, total in told} <= {sum(sizes)}
    if sum(sizes):
        assert told[-1] == (sum(sizes), sum(sizes))
    if length is not None:
        assert all(last - first <= length for _, first, last in works.pieces)


def test_one_thread_is_the_calling_one() -> None:
    works = Works([40])
    in_threads(works.all, [40], 1)
    assert works.threads == {threading.get_ident()}
    # So it goes in order.
    assert works.pieces == sorted(works.pieces)


def test_threads_work_at_the_same_time() -> None:
    """Two items that wait for each other end only if both are in progress."""
    meet = threading.Barrier(2, timeout=30.0)
    in_threads([lambda first, last: meet.wait() and None], [2], 2, lengths=[1])
    assert not meet.broken


def test_progress_comes_from_the_calling_thread() -> None:
    told: set[int] = set()
    in_threads([lambda first, last: None], [64], 3, lambda done, total: told.add(threading.get_ident()))
    assert told == {threading.get_ident()}


class OddError(Exception):
    """Exception raised by an item of work."""


@pytest.mark.parametrize("count", [1, 2, 3])
def test_an_error_in_a_piece_comes_out_and_ends_the_work(count: int) -> None:
    works = Works([400])
    note = works.work(0)

    def piece(first: int, last: int) -> None:
        note(first, last)
        if first == 5:
            raise OddError("piece five")

    before = threading.active_count()
    with pytest.raises(OddError, match="piece five"):
        in_threads([piece], [400], count, lengths=[1])
    assert threading.active_count() == before
    assert max(max(row) for row in works.done) == 1


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("error", [KeyboardInterrupt, OddError])
def test_an_interruption_in_progress_stops_the_work(count: int, error: type[BaseException]) -> None:
    works = Works([3000])
    note = works.work(0)
    stopped = threading.Event()

    def piece(first: int, last: int) -> None:
        # Whoever is not the first waits until progress was told of, or there would be nothing left to stop.
        if first > 100 and count > 1:
            stopped.wait(30.0)
        note(first, last)

    def progress(done: int, total: int) -> None:
        if done > 10:
            stopped.set()
            raise error

    with pytest.raises(error):
        in_threads([piece], [3000], count, progress, lengths=[1])
    assert 10 < sum(works.done[0]) < 3000


def test_the_number_of_threads() -> None:
    assert thread_count(3) == 3
    assert 1 <= thread_count(None) <= (os.cpu_count() or 1)
    with refused("threads"):
        thread_count(0)
