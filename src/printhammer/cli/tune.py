"""The verb `tune`: a compensation table for the firmware, and what it gains and loses."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, rates_between, whole
from printhammer.cli.run import HAMMER, HammerArgument, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.control.table.compensation import CompensationTable
    from printhammer.control.table.report import TableReport

EXAMPLE: Final = (
    "Example: printhammer tune hendriks-1983 --rate 1.3kHz --history 2 --out table.csv --out table.h"
)

_MOST_RATES: Final = 2000
_ROWS: Final = 12


def tune(
    hammer: HammerArgument = HAMMER,
    rate: Annotated[
        str | None, typer.Option(metavar="RATE", help="Slots per second, such as 1.3kHz (all rates).")
    ] = None,
    rates: Annotated[
        str | None,
        typer.Option(metavar="LOW, HIGH, N", help="Several rates, such as '1.2 kHz, 1.4 kHz, 41'."),
    ] = None,
    history: Annotated[str, typer.Option(metavar="N", help="Gaps that a history holds, 1 to 4.")] = "2",
    reach: Annotated[str, typer.Option(metavar="N", help="Longest gap that counts, slots.")] = "2",
    brake: Annotated[bool, typer.Option("--brake/--no-brake", help="Allow brake pulses.")] = True,
    robust: Annotated[
        bool, typer.Option("--robust", help="Tune on hammers that differ a little as well.")
    ] = False,
    largest_current: Annotated[str, typer.Option(metavar="CURRENT", help="Bound on the current.")] = "2 A",
    judge: Annotated[
        bool,
        typer.Option(
            "--judge/--no-judge", help="Judge the table beside open loop on what it was not tuned on."
        ),
    ] = True,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Table (.csv, .json, .h, .nc, ...) or picture (.svg, .png, .pdf); may be given repeatedly.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Picture of gain and loss (.svg, .png, .pdf) or numbers (.nc, .csv, ...)."
        ),
    ] = None,
) -> None:
    """Tune pulse width and advance as a function of the last gaps, so that every dot is like one from rest.

    Ends with status 1 where the table does not keep to the limits on the hammer it is made for.
    """
    from rich.markup import escape

    from printhammer.cli.progress import counting
    from printhammer.cli.saving import PICTURES, check_endings, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty, load_checked
    from printhammer.control.table.compensation import CompensationTable
    from printhammer.control.table.report import TableReport, judge_table
    from printhammer.control.table.tuning import tune as tuned
    from printhammer.errors import InputError
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    reports = [] if report is None else [report]
    check_endings(wanted, (*CompensationTable.ENDINGS, *PICTURES))
    check_endings(reports, (*TableReport.ENDINGS, *PICTURES), "--report")
    if reports and not judge:
        raise InputError(f"--report {report} is given, expected none beside --no-judge")
    check_outputs([*wanted, *reports], [Path(hammer)])
    if rate is not None and rates is not None:
        raise InputError("--rate and --rates are given, expected one of them")
    loaded = load_checked(hammer)
    given: dict[str, Any] = {
        "tolerance": number(tolerance, "tolerance"),
        "threads": whole(threads, "threads"),
    }
    options = {key: value for key, value in given.items() if value is not None}
    announce_compiling()
    screen, begin = console(), perf_counter()
    with counting("tuning") as tell:
        table = tuned(
            loaded,
            rate=rate,
            rates=None if rates is None else rates_between(rates, "--rates", most=_MOST_RATES),
            history=whole(history, "history") or 0,
            reach=whole(reach, "reach") or 0,
            brake=brake,
            robust=robust,
            largest_current=largest_current,
            progress=tell,
            **options,
        )
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    screen.print(f"[dim]tuned in {perf_counter() - begin:.2g} s[/dim]\n")
    screen.print(told(table, units))
    found: TableReport | None = None
    if judge:
        with counting("judging") as tell:
            found = judge_table(loaded, table, progress=tell, **options)
        screen.print()
        screen.print(judged(found))
    write_found(screen, wanted, table.plot, table.save)
    if found is not None:
        write_found(screen, reports, found.plot, found.save)
    if found is not None and not found.passed[1, 0].all():
        off = ", ".join(f"{one:g} Hz" for one in found.rates[~found.passed[1, 0]].tolist())
        complain(f"with the table not all dots are within the limits at {off}")
        raise typer.Exit(1)


def told(table: CompensationTable, units: Units) -> Table:
    """Return the entries at the highest rate, a row each."""
    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import shown, unit
    from printhammer.control.table.histories import gap_text, histories, number_of

    time = unit("time", units)
    count = table.rates.size
    span = f"{table.rates[0]:g} Hz to {table.rates[-1]:g} Hz, {count} rates, at" if count > 1 else ""
    found = plain_table(
        ("gaps before", "left"),
        (f"advance [{time}]", "right"),
        (f"width [{time}]", "right"),
        (f"brake after [{time}]", "right"),
        (f"brake [{time}]", "right"),
        ("worst, of the limits", "right"),
        title=" ".join(f"Table for {span} {table.rates[-1]:g} Hz".split()),
    )
    every = histories(table.gaps, table.reach)
    for history in every[:_ROWS]:
        column = number_of(history, table.reach)
        values = {
            name: float(getattr(table, name)[-1, column])
            for name in ("advance", "width", "brake_delay", "brake_width", "deviation")
        }
        braked = values["brake_width"] > 0.0
        found.add_row(
            "-".join(map(gap_text, history)),
            shown(values["advance"], "time", units),
            shown(values["width"], "time", units),
            shown(values["brake_delay"] if braked else None, "time", units),
            shown(values["brake_width"] if braked else None, "time", units),
            f"{100.0 * values['deviation']:.1f} %",
        )
    if len(every) > _ROWS:
        found.add_row(f"and {len(every) - _ROWS} more", "", "", "", "", "")
    return found


def judged(report: TableReport) -> Table:
    """Return what the table gains and loses, a row a hammer."""
    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import shown

    rates = report.rates
    span = f"{rates[0]:g} Hz" if rates.size == 1 else f"{rates.min():g} Hz to {rates.max():g} Hz"
    found = plain_table(
        ("hammer driven", "left"),
        ("open loop: good dots", "right"),
        ("lost", "right"),
        ("table: good dots", "right"),
        ("lost", "right"),
        ("worst force", "right"),
        ("worst arrival [µs]", "right"),
        title=f"On patterns it was not tuned on, {span}",
    )
    share = 100.0 * report.good.mean(axis=(2, 3))
    lost = report.lost.sum(axis=(2, 3))
    for row, name in enumerate(report.hammers):
        found.add_row(
            name,
            f"{share[0, row]:.2f} %",
            f"{lost[0, row]:.0f}",
            f"[bold]{share[1, row]:.2f} %[/bold]",
            f"{lost[1, row]:.0f}",
            f"{100.0 * report.force[1, row].max():.1f} %",
            shown(float(report.arrival[1, row].max()), "time", Units.SI),
        )
    return found
