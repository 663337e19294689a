"""The verb `feedback`: a drive that sees the hammer, beside the open loop."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.table import Table

    from printhammer.control.feedback.comparison import Feedback, FeedbackStrategy
    from printhammer.hammer.hammer import Hammer

EXAMPLE: Final = "Example: printhammer feedback hendriks-1983 --rate '1.6 kHz' --out feedback.png"

_RUN: Final = "The run that is shown"


def feedback(
    hammer: HammerArgument = HAMMER,
    rate: Annotated[str, typer.Option(metavar="RATE", help="Slots per second.")] = "1.6 kHz",
    noise: Annotated[
        str | None,
        typer.Option(metavar="X", help="Noise of a sample, in parts of the way to the pack (0.01)."),
    ] = None,
    delay: Annotated[str | None, typer.Option(metavar="TIME", help="Delay of the sensor ('20 us').")] = None,
    interval: Annotated[str | None, typer.Option(metavar="TIME", help="Between samples ('2 us').")] = None,
    step: Annotated[
        str | None,
        typer.Option(metavar="X", help="Quantisation, in parts of the way to the pack (1/1024)."),
    ] = None,
    seed: Annotated[str | None, typer.Option(metavar="N", help="Of the noise (0).")] = None,
    current: Annotated[
        str, typer.Option(metavar="CURRENT", help="Largest current of either sign, such as '2 A'.")
    ] = "2 A",
    edge: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Time constant of the driver (the hammer's own decay)."),
    ] = None,
    supply: Annotated[
        str, typer.Option(metavar="X", help="Current of the hammer driven, in parts of the nominal one.")
    ] = "1",
    travel: Annotated[
        str, typer.Option(metavar="LENGTH", help="By how much its pack lies farther away, such as '10 um'.")
    ] = "0 um",
    table: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Compensation table to compare with, from `printhammer tune`."),
    ] = None,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="Deviations (.nc) or picture (.svg, .png, .pdf); may be given repeatedly."
        ),
    ] = None,
    run: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Picture of one run (.svg, .png, .pdf), or its drive (.toml); may be given repeatedly.",
            rich_help_panel=_RUN,
        ),
    ] = None,
) -> None:
    """Drive a hammer with feedback: all patterns of eight slots, and two dots at all distances.

    Ends with status 1 where a pattern is not printed within limits with feedback.
    """
    from rich.markup import escape

    from printhammer.cli.saving import PICTURES, check_endings, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty, load_checked
    from printhammer.control.feedback.comparison import feedback as compared
    from printhammer.control.feedback.tables import save_feedback
    from printhammer.drive.file import save_drive
    from printhammer.drive.input import read_number, read_positive
    from printhammer.support.outputs import check_outputs

    wanted, shown = out or [], run or []
    check_endings(wanted, (".nc", *PICTURES))
    check_endings(shown, (".toml", *PICTURES), "--run")
    check_outputs([*wanted, *shown], [Path(hammer)] if table is None else [Path(hammer), table])
    sensor = {
        "noise": number(noise, "noise"),
        "delay": None if delay is None else read_number(delay, "s", "delay"),
        "interval": None if interval is None else read_positive(interval, "s", "interval"),
        "step": number(step, "step"),
        "seed": whole(seed, "seed"),
    }
    given: dict[str, Any] = {
        "edge": edge,
        "tolerance": number(tolerance, "tolerance"),
        "threads": whole(threads, "threads"),
    }
    options = {key: value for key, value in given.items() if value is not None}
    loaded = load_checked(hammer)
    if table is not None:
        options["beside"] = [_table(table, loaded)]
    announce_compiling()
    found = _computed(
        lambda: compared(
            loaded,
            rate,
            driven=_driven(loaded, supply, travel),
            sensor=_sensor(sensor),
            current=current,
            **options,
        )
    )
    screen = console()
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}\n")
    screen.print(told(found, units))
    write_found(screen, wanted, found.plot, partial(save_feedback, found))
    write_found(screen, shown, found.plot_run, partial(save_drive, found.seen.motion.drive))
    bad = int((~found.passed[-1]).sum())
    if bad:
        complain(f"{bad} of {found.passed.shape[1]} patterns are not printed within limits with feedback")
        raise typer.Exit(1)


def told(found: Feedback, units: Units) -> Table:
    """Return for each way to drive how many patterns are within limits, and how far dots are off."""
    import numpy as np

    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import with_unit

    table = plain_table(
        ("", "left"),
        ("patterns within limits", "right"),
        ("force off", "right"),
        ("arrival off", "right"),
        ("lost", "right"),
        ("extra", "right"),
        ("peak current", "right"),
    )
    for number_, name in enumerate(found.strategies):
        force, late = found.force[number_], found.arrival[number_]
        struck = bool(np.isfinite(force).any())
        table.add_row(
            name,
            f"{int(found.passed[number_].sum())} of {found.passed.shape[1]}",
            f"{100.0 * np.nanmin(force):+.1f} to {100.0 * np.nanmax(force):+.1f} %" if struck else "–",
            " to ".join(with_unit(float(end), "time", units) for end in (np.nanmin(late), np.nanmax(late)))
            if struck
            else "–",
            str(int(found.lost[number_])),
            str(int(found.extra_contacts[number_])),
            with_unit(float(found.peak_current[number_]), "current", units),
        )
    return table


def _sensor(given: dict[str, Any]) -> Any:
    from printhammer.control.feedback.estimator.sensor import PositionSensor

    return PositionSensor(**{key: value for key, value in given.items() if value is not None})


def _driven(hammer: Hammer, supply: str, travel: str) -> Hammer:
    """Return the hammer that is driven, which may differ from the nominal one."""
    from printhammer.drive.input import read_number, read_positive
    from printhammer.printing.rates.perturbation import Perturbation, perturbed

    current = read_positive(number(supply, "supply") or 0.0, "1", "supply") - 1.0
    return perturbed(hammer, Perturbation(current=current, travel=read_number(travel, "m", "travel")))


def _table(path: Path, hammer: Hammer) -> Any:
    from printhammer.control.table.compensation import TableStrategy, load_table

    return TableStrategy(load_table(path), hammer)


def feedback_strategy(hammer: Hammer) -> FeedbackStrategy:
    """Return feedback as a way to drive a hammer, with its usual driver and sensor."""
    from rich.console import Console

    from printhammer.control.feedback.comparison import FeedbackStrategy
    from printhammer.control.feedback.controller import Controller
    from printhammer.control.feedback.driver import driver_of

    with Console(stderr=True).status("tables of the controller"):
        return FeedbackStrategy(Controller(hammer, driver_of(hammer)))


def _computed(compute: Callable[[], Feedback]) -> Feedback:
    """Compute, and show that it goes on."""
    from rich.console import Console

    with Console(stderr=True).status("tables, closed loops, comparisons"):
        return compute()
