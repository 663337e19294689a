"""The program `printhammer`: its verbs, and how it ends.

Exit status: 0; 1 where a run did not reach its end, or with ``--strict`` a claim fails; 2 for bad input, told
in one sentence on the standard error; 130 after Ctrl-C.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Final, NoReturn

import typer

from printhammer import __version__
from printhammer.cli import (
    basins,
    bench,
    bifurcation,
    continuation,
    energy,
    feedback,
    figure,
    fit,
    hammer,
    lyapunov,
    measure,
    orbits,
    paper,
    print_,
    quality,
    reconstruct,
    run,
    strobe,
    studio,
    sweep,
    tune,
)
from printhammer.cli import map as frequency_map
from printhammer.cli.terminal import complain
from printhammer.errors import PrinthammerError

if TYPE_CHECKING:
    from collections.abc import Sequence

BAD_INPUT = 2
INTERRUPTED = 130

# What typer raises for a command line that it cannot use; it has no public name in every version of typer.
_REFUSED: Final[type[Exception]] = typer.BadParameter.__mro__[2]

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
app.command("map", epilog=frequency_map.EXAMPLE)(frequency_map.map_)
app.command("strobe", epilog=strobe.EXAMPLE)(strobe.strobe)
app.command("orbits", epilog=orbits.EXAMPLE)(orbits.orbits)
app.command("bifurcation", epilog=bifurcation.EXAMPLE)(bifurcation.bifurcation)
app.command("basins", epilog=basins.EXAMPLE)(basins.basins)
app.command("continue", epilog=continuation.EXAMPLE)(continuation.continue_)
app.command("lyapunov", epilog=lyapunov.EXAMPLE)(lyapunov.lyapunov)
app.command("print", epilog=print_.EXAMPLE)(print_.print_)
app.command("energy", epilog=energy.EXAMPLE)(energy.energy)
app.command("feedback", epilog=feedback.EXAMPLE)(feedback.feedback)
app.command("quality", epilog=quality.EXAMPLE)(quality.quality)
app.command("tune", epilog=tune.EXAMPLE)(tune.tune)
app.command("bench", epilog=bench.EXAMPLE)(bench.bench)
app.command("studio", epilog=studio.EXAMPLE)(studio.studio)
app.command("sweep", epilog=sweep.EXAMPLE)(sweep.sweep)
app.command("measure", epilog=measure.EXAMPLE)(measure.measure)
app.add_typer(hammer.app, name="hammer")
app.add_typer(fit.app, name="fit")
app.add_typer(reconstruct.app, name="reconstruct")


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
        status = app(
            None if arguments is None else list(arguments), prog_name="printhammer", standalone_mode=False
        )
    except PrinthammerError as error:
        complain(str(error))
        sys.exit(BAD_INPUT)
    except _REFUSED as error:
        # Without arguments the help has been shown, and nothing is left to say.
        if message := getattr(error, "format_message", str)().strip():
            complain(f"{message.rstrip('.')} (see --help)")
        sys.exit(BAD_INPUT)
    except KeyboardInterrupt:
        status = INTERRUPTED
    if status == INTERRUPTED:
        complain("interrupted")
    sys.exit(status if isinstance(status, int) else 0)
