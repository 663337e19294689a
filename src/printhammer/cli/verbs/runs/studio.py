"""The verb `studio`: hammer, drive and all their pictures in a browser, changing while a slider moves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Job, verb

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb("studio", "printhammer studio hendriks-1983 --port 8080")
def studio(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    port: int | None = opt.whole(
        "Port on 127.0.0.1 (19830, or a free one where that is taken; 0: a free one)."
    ),
    state: Path | None = opt.source("State to open with, as the studio's export saves it."),
    browser: bool = opt.switch(
        "Open the page in the browser of the desktop.", flag="--open/--no-open", default=True
    ),
) -> Answer:
    """Open the studio: a page on this machine, for its user alone; Ctrl-C ends it."""
    from printhammer.studio import serve

    def ready(address: str) -> None:
        job.screen.print(f"The studio is at {address}", soft_wrap=True)
        if browser:
            import webbrowser

            webbrowser.open(address)

    serve(hammer, port=port, state=state, ready=ready)
    return Answer()
