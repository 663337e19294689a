"""Measure the time to simulate and draw a page of 60 characters.

Run ``.venv/bin/python docs/measure/page.py``, which takes a few seconds. The table shows medians
over several pages of the wall-clock time and the processor time of all threads, without imports and
compilation.
"""

import io
import statistics
import time
from collections.abc import Callable

from measured import MOTION, Cell, Column, write

import printhammer as ph
from printhammer.printing.page.page import Page

HAMMER = ph.load("hendriks-1983")
TEXT = "The quick brown fox jumps over the lazy dog, 0123456789 time"
RATE = 1500.0
REPEATS = 9


def timed(call: Callable[[], object]) -> tuple[float, float]:
    """Return the median wall-clock and processor times of a call, s."""
    call()
    wall, busy = [], []
    for _ in range(REPEATS):
        begin = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - begin[0])
        busy.append(time.process_time() - begin[1])
    return statistics.median(wall), statistics.median(busy)


def whole() -> None:
    """Simulate a page and write its figure."""
    drawn(ph.print_page(HAMMER, TEXT, RATE))


def drawn(page: Page) -> None:
    """Write the figure of a page."""
    page.plot().savefig(io.BytesIO(), format="png", dpi=200)


def main() -> None:
    """Measure the table."""
    page = ph.print_page(HAMMER, TEXT, RATE)
    print(f"{len(TEXT)} characters, {page.line.size} dots, {page.status.size} runs\n")
    rows: list[list[Cell]] = []
    for name, call in (
        ("simulated", lambda: ph.print_page(HAMMER, TEXT, RATE)),
        ("drawn, PNG of 200 dots per inch", lambda: drawn(page)),
        ("both", whole),
    ):
        wall, busy = timed(call)
        rows.append([name, wall, busy])
    columns = [Column(name=f"{kind} time", unit="s", format=".2f") for kind in ("wall-clock", "processor")]
    settings = {"text": TEXT, "rate": RATE, "repeats": REPEATS, "dots": int(page.line.size)}
    rooms = (*MOTION, "printing/page", "printing/dots")
    write("page-time", [Column(name=""), *columns], rows, settings, rooms)


if __name__ == "__main__":
    main()
