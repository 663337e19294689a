"""The verb `studio`: hammer, drive and all their pictures in a browser, changing while a slider moves."""

from __future__ import annotations

from typing import Annotated, Final

import typer

from printhammer.cli.numbers import whole
from printhammer.cli.run import HAMMER, HammerArgument

EXAMPLE: Final = "Example: printhammer studio hendriks-1983 --port 8080"


def studio(
    hammer: HammerArgument = HAMMER,
    port: Annotated[str | None, typer.Option(metavar="N", help="Port on 127.0.0.1 (a free one).")] = None,
    browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in the browser of the desktop.")
    ] = True,
) -> None:
    """Open the studio: a page on this machine, for its user alone; Ctrl-C ends it."""
    from printhammer.cli.terminal import announce_compiling, console, load_checked
    from printhammer.studio import serve

    loaded = load_checked(hammer)
    announce_compiling()

    def ready(address: str) -> None:
        console().print(f"The studio is at {address}", soft_wrap=True, highlight=False)
        if browser:
            import webbrowser

            webbrowser.open(address)

    serve(loaded, port=whole(port, "port") or 0, ready=ready)
