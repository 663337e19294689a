"""The verb `strobe`: the state at the moment of firing, and whether the train is periodic or strange."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.chaos import Strobe

EXAMPLE: Final = "Example: printhammer strobe hendriks-1983 --period '1.10 ms' --points 200 --out points.csv"

_POINTS: Final = 200
_TRAIN: Final = "Train (one of --period and --rate)"


def _train(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=_TRAIN)


def strobe(
    hammer: HammerArgument = HAMMER,
    period: Annotated[str | None, _train("TIME", "Time between firings, such as '1.10 ms'.")] = None,
    rate: Annotated[str | None, _train("RATE", "Firings per second, such as '952 Hz'.")] = None,
    overlap: Annotated[
        Overlap, _train("add|replace", "Overlapping pulses add up (default), or the latest replaces.")
    ] = Overlap.ADD,
    points: Annotated[str, typer.Option(metavar="N", help="Number of points.")] = str(_POINTS),
    transient: Annotated[str, typer.Option(metavar="N", help="Firings left out before the first.")] = "0",
    phase: Annotated[
        str, typer.Option(metavar="P", help="Part of the period between a firing and its point, from 0 to 1.")
    ] = "0",
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    verdict: Annotated[
        bool, typer.Option("--verdict/--no-verdict", help="Judge firings 1001 to 2000.")
    ] = True,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Points (.csv, .nc, .json, .zarr, .parquet) or picture (.svg, .png, .pdf); repeatable.",
        ),
    ] = None,
) -> None:
    """Fire a hammer without end and tell what its state is at each firing: periodic, or strange.

    Ends with status 1 where the run stopped before its end.
    """
    from rich.markup import escape

    from printhammer.chaos import Strobe
    from printhammer.chaos import strobe as strobed
    from printhammer.cli.saving import PICTURES, check_endings, load_fired, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty
    from printhammer.errors import InputError
    from printhammer.run.problem import TOLERANCE
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*Strobe.ENDINGS, *PICTURES))
    check_outputs(wanted, [Path(hammer)])
    if (period is None) == (rate is None):
        raise InputError("--period and --rate: expected one of them, such as --period '1.10 ms'")
    loaded = load_fired(hammer, wanted)
    announce_compiling()
    found = strobed(
        loaded,
        period=period,
        rate=rate,
        points=whole(points, "points") or 0,
        transient=whole(transient, "transient") or 0,
        phase=number(phase, "phase") or 0.0,
        overlap=overlap.value,
        tolerance=TOLERANCE if tolerance is None else number(tolerance, "tolerance") or 0.0,
        verdict=verdict,
    )
    screen = console()
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    train = f"{found.drive.waveform.shape} {found.drive.quantity} every {found.period:.9g} s"
    screen.print(f"[dim]{escape(train)}, overlap {found.drive.overlap}[/dim]\n")
    screen.print(summary(found, units))
    write_found(screen, wanted, found.plot, found.save)
    if not found.ok:
        complain(f"the run ended early: {found.status}")
        raise typer.Exit(1)


def summary(found: Strobe, units: Units) -> Table:
    """Return points and verdict, one row each."""
    import numpy as np

    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import with_unit

    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    known = np.isfinite(found.x)
    first, last = int(found.firing[0]), int(found.firing[-1])
    at = f", {found.phase:g} of a period later" if found.phase else ""
    table.add_row("points", f"{int(known.sum())}, at the firings {first} to {last}{at}")
    for name, values, kind in (("displacement", found.x, "length"), ("velocity", found.v, "speed")):
        if known.any():
            ends = [with_unit(float(end), kind, units) for end in (values[known].min(), values[known].max())]
            table.add_row(name, " to ".join(ends))
    judged = found.verdict
    if judged is not None:
        style = "yellow" if judged.name == "undecided" else "green"
        table.add_row("verdict", f"[bold {style}]{judged.name.replace('-', ' ')}[/bold {style}]")
        if judged.reason:
            table.add_row("because", judged.reason)
        for row, phrase in enumerate(judged.phrases):
            table.add_row("" if row else "evidence", phrase)
    return table
