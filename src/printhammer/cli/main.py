"""The program `printhammer`: its verbs, and how it ends.

Exit status: 0; 1 where a run did not reach its end, or with ``--strict`` a claim fails; 2 for bad input, told
in one sentence on the standard error; 130 after Ctrl-C.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from printhammer import __version__
from printhammer.cli import figure, hammer, paper, run
from printhammer.cli.terminal import complain
from printhammer.errors import PrinthammerError

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 130
BROKEN_PIPE = 141

app = typer.Typer(
    name="printhammer",
    help="A laboratory for impact print hammers: motion, contacts, dots, and the claims of Hendriks (1983).",
    epilog="Example: printhammer run hendriks-1983 --rate '1.2 kHz' --pulses 9",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run", epilog=run.EXAMPLE)(run.run)
app.command("figure", epilog=figure.EXAMPLE)(figure.figure)
app.command("paper", epilog=paper.EXAMPLE)(paper.paper)
app.add_typer(hammer.app, name="hammer")


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"printhammer {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Hold the options of the program itself."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit.

    Parameters
    ----------
    arguments : sequence of str, optional
        By default those of the process.
    """
    try:
        app(None if arguments is None else list(arguments), prog_name="printhammer")
    except PrinthammerError as error:
        complain(str(error))
        sys.exit(2)
    except KeyboardInterrupt:
        complain("interrupted")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        # Whoever read the output has had enough; keep the interpreter from complaining at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(BROKEN_PIPE)
    sys.exit(0)
