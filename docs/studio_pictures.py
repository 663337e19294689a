"""Pictures of the studio for these pages, by a headless Chromium: python docs/studio_pictures.py."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images" / "studio"
VIEWS = ("motion", "sketch", "map", "forces", "phase", "strobe", "loops", "energy", "line")
STATE = "#rate=1250&pulses=9"


def main() -> None:
    sys.path.insert(0, str(ROOT))
    from PIL import Image
    from tests.studio.browser import browser
    from tests.studio.server import studio

    IMAGES.mkdir(parents=True, exist_ok=True)
    with studio("hendriks-1983") as running, browser() as tab:
        page = tab()
        page.size(1280, 720)
        page.open(running.address + STATE)
        page.wait("window.studio?.studio?.frames.strobe?.verdict && window.studio.studio.frames.line")
        # A pinned run behind one with thicker forms.
        page.run("window.studio.studio.pin()")
        page.run("document.querySelector('[data-key=\"forms thickness\"]').focus()")
        for _ in range(40):
            page.press("ArrowRight")
        page.wait("!window.studio.studio.busy && !window.studio.studio.stale")
        page.wait(
            "window.studio.studio.frames.strobe.verdict && window.studio.studio.frames.map.detail === 'full'"
        )
        page.wait("window.studio.studio.frames.line.serial > window.studio.studio.frames.dots.serial - 2")
        page.run("window.studio.studio.setCursor(1.15e-3)")
        page.run("new Promise((done) => setTimeout(done, 1500))")
        page.picture(IMAGES / "light.png")
        page.size(1920, 1080, dark=True)
        page.run("new Promise((done) => setTimeout(done, 800))")
        page.picture(IMAGES / "dark.png")
        page.size(1500, 900)
        page.run("new Promise((done) => setTimeout(done, 800))")
        for view in VIEWS:
            page.picture(IMAGES / f"{view}.png", f".view-{view}")
    for path in IMAGES.glob("*.png"):
        Image.open(path).convert("RGB").save(path, optimize=True)


if __name__ == "__main__":
    main()
