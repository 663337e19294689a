"""Random actions on all controls of the studio: pauses, unmarked outdated views, and errors.

    python benchmarks/soak.py [HAMMER] [--minutes N] [--ratio 2] [--seed N]

A quarter of the slider movements go to an end of the range; input boxes receive numbers, units, sums and
invalid text. The script prints the longest pause of the page, the longest time until a state was displayed,
the views that were outdated for more than a second without a mark, errors, and the memory of the page after
each fifth of the time.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from pathlib import Path
from typing import Any

TEXTS = [
    "",
    "abc",
    "9000",
    "1/660us",
    "-1",
    "1e99",
    "0",
    "3*200us",
    "1.2 kHz",
    "1101",
    "HAMMER",
    "nan",
    "7 mil",
]
WATCH = """
window.watch = { gap: 0, late: 0, stale: [], last: performance.now() };
setInterval(() => {
  const now = performance.now();
  watch.gap = Math.max(watch.gap, now - watch.last);
  watch.last = now;
  const studio = window.studio.studio;
  const sent = Math.max(0, ...studio.sentAt.keys());
  const age = sent > (studio.frames.motion?.serial ?? 0) ? now - studio.sentAt.get(sent) : 0;
  watch.late = Math.max(watch.late, age);
  for (const view of ["motion", "forces", "phase", "sketch"]) {
    const panel = document.querySelector(`.view-${view}`);
    const marked = panel.hidden || panel.classList.contains("outdated");
    if (age > 1000 && !marked) watch.stale.push(`${view}, ${Math.round(age)} ms`);
  }
}, 50);
window.controls = () => [...document.querySelectorAll(
  ".studio input:not([type=file]), .studio select:not(.leave):not(.out), .studio button")]
  .filter((each) => !each.disabled && each.offsetParent && !each.closest("dialog"))
  .filter((each) => !/export|save|^Open /.test(`${each.getAttribute("aria-label") ?? ""}${each.title}`));
window.act = (where, value, end) => {
  const list = window.controls();
  const each = list[Math.floor(where * list.length)];
  document.querySelector("dialog[open]")?.close();
  if (each.tagName === "BUTTON") { each.click(); return `${each.title || each.textContent}`; }
  if (each.tagName === "SELECT") each.selectedIndex = Math.floor(value.place * each.options.length);
  else if (each.type === "range") {
    const low = Number(each.min), high = Number(each.max);
    each.value = end ? (value.place < 0.5 ? low : high) : low + value.place * (high - low);
  } else each.value = value.text;
  for (const kind of ["input", "change"]) each.dispatchEvent(new Event(kind, { bubbles: true }));
  return `${each.getAttribute("aria-label") ?? each.dataset.key ?? each.className}: ${each.value}`;
};
"""


def main() -> None:
    """Operate the controls at random, monitor the page, and print the results."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.studio.browser import browser

    from printhammer.hammer.hammer import load
    from printhammer.studio import Shelf, live_page
    from printhammer.studio.launch import keep_page

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("hammer", nargs="?", default="hendriks-1983")
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--ratio", type=float, default=2.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    draw = random.Random(given.seed)
    done: list[str] = []
    address = keep_page(live_page(Shelf(load(given.hammer)))).as_uri()
    with browser() as tab:
        page = tab()
        page.size(1440, 900, ratio=given.ratio)
        page.open(address)
        page.wait("window.studio?.studio?.frames.map")
        page.run(WATCH)
        begun = time.monotonic()
        for part in range(5):
            while time.monotonic() < begun + (part + 1) * 12.0 * given.minutes:
                value = {
                    "place": draw.random(),
                    "text": draw.choice([*TEXTS, str(draw.uniform(0.0, 3000.0))]),
                }
                end = str(draw.random() < 0.25).lower()
                done.append(page.run(f"window.act({draw.random()}, {value}, {end})"))
                time.sleep(draw.choice([0.02, 0.1, 0.5, 1.0]))
            told(page, len(done))
        seen: dict[str, Any] = page.run("({ ...watch, text: document.querySelector('.status').textContent })")
        print(f"longest pause of the page {seen['gap']:.0f} ms, until a state was seen {seen['late']:.0f} ms")
        print(f"stale without a mark: {seen['stale'][:5]}")
        print(f"errors: {page.complaints[:5]}")
        print(f"at the end: {seen['text']}")
        print("the last actions:", *done[-5:], sep="\n  ")


def told(page: Any, count: int) -> None:
    """Print the number of actions and the memory use of the page after garbage collection."""
    page.call("HeapProfiler.collectGarbage")
    heap = page.run("performance.memory.usedJSHeapSize") / 1e6
    print(f"{count} actions: page {heap:.0f} MB", flush=True)


if __name__ == "__main__":
    main()
