"""Response time of the studio, from a key press on a slider to the updated plot, in a headless Chromium.

    python benchmarks/studio.py [HAMMER] [--openings N] [--times N] [--ratio 2] [--rail]

A key is pressed four times a second. The browser measures the time from the time stamp of the key event to
the first task after the plot has been drawn.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from pathlib import Path
from urllib.parse import quote

ALL = "motion-sketch-map-forces-phase-strobe-loops-energy-line"
GROUPS: dict[str, tuple[str, list[tuple[str, str | None]]]] = {
    "motion, forces and phase plane": ("motion-forces-phase", [("motion", None)]),
    "map": ("map", [("map", "preview"), ("map", "full")]),
    "the four views of the opening": ("", [("motion", None), ("map", "preview"), ("map", "full")]),
    "all nine views": (ALL, [("motion", None), ("map", "preview"), ("map", "full")]),
}
WHAT = {"motion": "the first curve", "preview": "the first map", "full": "the full map"}
CONTROLS = ("waveform.width", "forms thickness")
"""Controls of a hammer with its current pulse whose response times are measured."""
RAIL_CONTROLS = ("waveform.width", "waveform.voltage", "coil.temperature")
"""Controls of the hammer with a rail driver, measured alternately with `CONTROLS`."""
LISTEN = """
window.seen = [];
const note = ({ detail }) => { window.seen.push({ ...detail, at: performance.now() }); };
addEventListener("painted", note, true);
"""
"""Script that records each painted plot; `at` is the time since the page began to open, ms."""


def main() -> None:
    """Measure and print a table."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.studio.browser import browser

    from printhammer.hammer.hammer import load
    from printhammer.studio import Shelf, live_page
    from printhammer.studio.coil import rail_of
    from printhammer.studio.launch import keep_page

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("hammer", nargs="?", default="hendriks-1983")
    parser.add_argument("--times", type=int, default=40)
    parser.add_argument("--openings", type=int, default=5)
    parser.add_argument("--ratio", type=float, default=1.0, help="pixel ratio of the screen")
    parser.add_argument("--rail", action="store_true", help="also measure a rail-driven hammer, alternately")
    given = parser.parse_args()
    drives: dict[str, tuple[str, tuple[str, ...]]] = {"": ("", CONTROLS)}
    if given.rail:
        if (rail := rail_of(load(given.hammer))) is None:
            parser.error(f"{given.hammer} has no coil whose flux linkage is known")
        waveform = json.dumps({"shape": "rail", **rail})
        drives["rail, "] = (f"waveform={quote(waveform)}", RAIL_CONTROLS)
    with browser() as tab:
        page = tab()
        page.size(1280, 720, ratio=given.ratio)
        address = keep_page(live_page(Shelf(load(given.hammer)))).as_uri()
        page.call("Page.addScriptToEvaluateOnNewDocument", source=LISTEN)
        opened: dict[str, list[float]] = {"motion": [], "preview": [], "full": []}
        for _ in range(given.openings):
            page.open("about:blank")
            page.open(address)
            page.wait("window.studio?.studio?.frames.map?.detail === 'full'")
            time.sleep(0.5)
            for name, times in opened.items():
                paints = page.run("seen")
                times.append(
                    next(each["at"] for each in paints if name in (each["kind"], each.get("detail")))
                )
        for name, times in opened.items():
            show(f"from the file to {WHAT[name]}", sorted(times))
        for name, (views, kinds) in GROUPS.items():
            pairs = [(kind, link, each) for kind, (link, every) in drives.items() for each in every]
            for drive, link, control in pairs:
                page.open("about:blank")
                told = "&".join(part for part in (f"views={views}" if views else "", link) if part)
                page.open(address + (f"#{told}" if told else ""))
                page.wait("window.studio?.studio?.frames.motion")
                time.sleep(2.5)
                page.run(f"document.querySelector('[data-key=\"{control}\"]').focus()")
                for k in range(given.times + 10):
                    if k == 10:
                        page.run("window.seen.length = 0")
                    page.press("ArrowRight" if k % 20 < 10 else "ArrowLeft")
                    time.sleep(0.25)
                seen = page.run("window.seen")
                for kind, detail in kinds:
                    same = [each for each in seen if (each["kind"], each.get("detail")) == (kind, detail)]
                    took = sorted(each["took"] for each in same if each["took"] is not None)
                    show(f"{name}, {drive}{control}: {detail or 'curves'}", took)


def show(told: str, took: list[float]) -> None:
    """Print one row of the table: median, 90th percentile and number of times, ms."""
    if not took:
        print(f"{told:70s} none before the next key")
        return
    median, late = statistics.median(took), took[int(0.9 * len(took))]
    print(f"{told:70s} median {median:6.1f} ms, 90 % within {late:6.1f} ms, {len(took)} pictures")


if __name__ == "__main__":
    main()
