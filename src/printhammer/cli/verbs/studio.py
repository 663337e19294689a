"""The verbs `studio` and `warm`: the studio in a browser, and compilation ahead of time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import (
    Answer,
    Content,
    Job,
    announce_compiling,
    load_hammer,
    tables_beside,
    verb,
)
from printhammer.cli.screen import Column, table
from printhammer.cli.terminal import say

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "studio",
    "printhammer studio hendriks-1983 --state 'rate=1450&pulses=4'",
    out=opt.file("Output file for the page (.html); with this option the page is not opened.", ".html"),
)
def studio(
    job: Job,
    hammers: list[str] | None = opt.argument(
        "HAMMER",
        "Names or files of hammers, the first of which is shown (default: the shipped hammers).",
        many=True,
        is_input=True,
    ),
    only: bool = opt.switch("Leave out the shipped hammers that are not named, for a smaller page."),
    state: str | None = opt.text(
        "FILE|TEXT",
        "Page state to open: a file exported by the studio, or the part of a page address after the #.",
    ),
    browser: bool = opt.switch(
        "Open the page in the default browser.", flag="--open/--no-open", default=True
    ),
) -> Answer:
    """Write the studio as one self-contained HTML file, and open the file in the browser.

    The page needs neither a server nor a network. Without --out the file is written to the user's cache.
    """
    from printhammer.studio.launch import keep_page, read_start
    from printhammer.studio.live import live_page
    from printhammer.studio.shelf import Shelf

    own = []
    for name in hammers or []:
        own.append(load_hammer(name, fired=False))
        job.check(*tables_beside(Path(name), *own[-1].files.values()))
    # A page with laws that no shipped hammer has compiles a WebAssembly module.
    announce_compiling()
    start, inside = read_start(state) if state else ("", None)
    shelf = Shelf(*([inside] if inside else []), *own, only=only)
    if job.outputs:
        return Answer(files={"out": Content.text(lambda: live_page(shelf, start))})
    path = keep_page(live_page(shelf, start))
    job.screen.print(f"The studio is the page {path}", soft_wrap=True)
    if browser:
        import webbrowser

        webbrowser.open(path.as_uri())
    return Answer()


def _runs(hammer: Hammer) -> None:
    from printhammer import PulseTrain, simulate

    assert hammer.waveform is not None
    _ = simulate(hammer, PulseTrain(hammer.waveform)).dots


def _lanes(hammer: Hammer) -> None:
    from printhammer import frequency_map

    frequency_map(hammer, [500.0, 600.0], threads=1)


def _strobes(hammer: Hammer) -> None:
    from printhammer import strobe

    strobe(hammer, period=2e-3, points=1, verdict=False)


def _exponents(hammer: Hammer) -> None:
    from printhammer import lyapunov

    lyapunov(hammer, period=2e-3, firings=1, transient=0)


_KERNELS: Final[dict[str, Callable[[Hammer], None]]] = {
    "runs, their dots and peaks": _runs,
    "maps and sweeps": _lanes,
    "exponents, orbits, sensitivities": _exponents,
    # Last, since it shares most code with maps: two processes would otherwise compile the same functions.
    "strobe points": _strobes,
}


def _compile_code(name: str, hammer: Hammer) -> tuple[str, float]:
    """Compile or load the kind `name` of machine code; return the name and the duration, s."""
    start = time.perf_counter()
    _KERNELS[name](hammer)
    return name, time.perf_counter() - start


def _announce(sentences: SimpleQueue[str | None]) -> None:
    from printhammer.run.simulate import announce_compiling as announce

    announce(sentences.put)


@contextmanager
def _print_messages(sentences: SimpleQueue[str | None]) -> Iterator[None]:
    """Print the messages that worker processes put into a queue."""

    def work() -> None:
        while (sentence := sentences.get()) is not None:
            say(sentence)

    thread = Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        sentences.put(None)
        thread.join()


@verb("warm", "printhammer warm hendriks-1983")
def warm(job: Job, hammer: Hammer = opt.FIRED) -> Answer:
    """Compile the machine code of a hammer ahead of time, on two cores.

    Hammers with the same laws share the code. The code is stored beside the program, or in the folder
    NUMBA_CACHE_DIR, which may be copied to a machine with the same processor and versions, and may be
    read-only there. If stored code does not fit the machine, the program states the reason and compiles
    again.
    """
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    rows = []
    spawn = get_context("spawn")
    sentences = spawn.SimpleQueue()
    with (
        job.progress_bar("machine code", remaining=False) as tell,
        _print_messages(sentences),
        ProcessPoolExecutor(2, spawn, _announce, (sentences,)) as pool,
    ):
        # Started in the order of `_KERNELS`: the longest compilation, and that of the code needed first,
        # lead.
        tasks = [pool.submit(_compile_code, name, hammer) for name in _KERNELS]
        tell(0, len(tasks))
        for done, task in enumerate(as_completed(tasks), 1):
            rows.append(task.result())
            tell(done, len(tasks))
    return Answer(
        [
            table(
                [
                    Column("machine code", lambda row: row[0], left=True),
                    Column("took", lambda row: row[1], unit="s", format=".1f"),
                ],
                sorted(rows, key=lambda row: list(_KERNELS).index(row[0])),
            )
        ]
    )
