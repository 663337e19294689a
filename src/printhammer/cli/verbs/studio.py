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
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import Column, table
from printhammer.cli.terminal import say

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "studio",
    "printhammer studio hendriks-1983 --port 8080",
    out=opt.file(
        "Output file for a page that computes by itself, without a server or a network (.html); with this"
        " option the studio is not started.",
        ".html",
    ),
)
def studio(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    port: int | None = opt.whole(
        "Port on 127.0.0.1 (default: 19830, or a free port if that is taken; 0: a free port)."
    ),
    state: Path | None = opt.source("Saved state to open: a file exported by the studio."),
    browser: bool = opt.switch(
        "Open the page in the default browser.", flag="--open/--no-open", default=True
    ),
) -> Answer:
    """Start the studio, a local web page accessible only to its user; Ctrl-C stops it."""
    if job.outputs:
        from printhammer.studio.live import live_page
        from printhammer.studio.states.links import open_file
        from printhammer.studio.states.shelf import Shelf

        shelf = Shelf(hammer)
        if state is not None:
            open_file(state, shelf)
        return Answer(files={"out": Content.text(lambda: live_page(shelf))})
    from printhammer.studio import serve

    def ready(address: str) -> None:
        job.screen.print(f"The studio is at {address}", soft_wrap=True)
        if browser:
            import webbrowser

            webbrowser.open(address)

    serve(hammer, port=port, state=state, ready=ready)
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
    # Last: it shares most code with maps, which two processes would otherwise compile at once.
    "strobe points": _strobes,
}


def _compile_code(name: str, hammer: Hammer) -> tuple[str, float]:
    """Compile or load one kind of machine code in a separate process; return its name and the duration, s."""
    start = time.perf_counter()
    _KERNELS[name](hammer)
    return name, time.perf_counter() - start


def _announce(sentences: SimpleQueue[str | None]) -> None:
    from printhammer.run.simulate import announce_compiling

    announce_compiling(sentences.put)


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
        # In the order of `_KERNELS`: the longest compilation and the one needed first start first.
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
