"""Draw the pictures of the studio for the pages with a headless Chromium: python docs/studio_pictures.py."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images" / "studio"
VIEWS = ("motion", "sketch", "map", "forces", "phase", "strobe", "loops", "energy", "line")
STORIES = ("one-dot", "figure-6", "buzz", "second-dot-lost", "strange", "hung-up")
DEVICES = ("bouncing-ball", "relay-5v")
STATE = "#rate=1250&pulses=9"
TIMES = (3.9e-4, 1.6e-3, 6.2e-3, 2.5e-3, 1.16e-2, 3.3e-3)
"""Time at which each story is pictured, s."""
SETTLED = "!window.studio.studio.busy && !window.studio.studio.stale"
SETTLED += " && !document.querySelector('.outdated')"
OPENED = f"window.studio?.studio?.frames.map?.detail === 'full' && {SETTLED}"
JUDGED = "(({ frames, store }) => !store.state.views.includes('strobe') || frames.strobe?.verdict)"
JUDGED += "(window.studio.studio)"
COMPLETE = f"{OPENED} && {JUDGED}"


def main() -> None:
    sys.path.insert(0, str(ROOT))
    from PIL import Image
    from tests.studio.browser import browser

    from printhammer.studio import Shelf, live_page
    from printhammer.studio.launch import keep_page

    IMAGES.mkdir(parents=True, exist_ok=True)
    address = keep_page(live_page(Shelf())).as_uri()
    with browser() as tab:
        page = tab()

        def rest(milliseconds: int = 1500) -> None:
            page.run(f"new Promise((done) => setTimeout(done, {milliseconds}))")

        page.size(1440, 900)
        page.open(address + STATE)
        page.wait(COMPLETE)
        # The opening, at a time at which the armature is on its way.
        page.run("window.studio.studio.setCursor(2.62e-3)")
        rest()
        page.picture(IMAGES / "light.png")
        for k, name in enumerate(STORIES):
            page.run(f"document.querySelectorAll('.story')[{k}].click()")
            page.wait(SETTLED)
            rest(3000)
            page.wait(f"{SETTLED} && {JUDGED}")
            page.run(f"window.studio.studio.setCursor({TIMES[k]})")
            rest()
            page.picture(IMAGES / f"story-{name}.png", ".stage")
        page.run("document.querySelector('.notice .shut').click()")
        for name in DEVICES:
            page.open("about:blank")
            page.open(f"{address}#hammer={name}")
            page.wait(COMPLETE)
            rest()
            page.picture(IMAGES / f"{name}.png")
        page.size(390, 844, ratio=2)
        page.open("about:blank")
        page.open(address + STATE)
        page.wait(COMPLETE)
        rest()
        page.picture(IMAGES / "phone.png")
        page.size(1440, 900)
        page.open("about:blank")
        page.open(f"{address}{STATE}&views={'-'.join(VIEWS)}")
        page.wait(COMPLETE)
        # A pinned run behind one with thicker forms.
        page.run("window.studio.studio.pin()")
        page.run("document.querySelector('[data-key=\"forms thickness\"]').focus()")
        for _ in range(40):
            page.press("ArrowRight")
        page.wait(SETTLED)
        page.wait(COMPLETE)
        rest(2500)
        page.run("window.studio.studio.setCursor(1.15e-3)")
        page.size(1920, 1080, dark=True)
        rest(800)
        page.picture(IMAGES / "dark.png")
        page.size(1500, 1000)
        rest(800)
        for view in VIEWS:
            page.picture(IMAGES / f"{view}.png", f".view-{view}")
    for path in IMAGES.glob("*.png"):
        Image.open(path).convert("RGB").save(path, optimize=True)


if __name__ == "__main__":
    main()
