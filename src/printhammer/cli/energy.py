"""The verb `energy`: a burst of dots with least work, rest to rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, rates_between, whole
from printhammer.cli.run import HAMMER, HammerArgument, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.control.least_work.burst import LeastWork
    from printhammer.control.least_work.supply import SupplyCheck
    from printhammer.hammer.hammer import Hammer

EXAMPLE: Final = "Example: printhammer energy hendriks-1983 --rate '1 kHz' --dots 2 --out burst.png"

_MOST_RATES: Final = 200


def energy(
    hammer: HammerArgument = HAMMER,
    rate: Annotated[str, typer.Option(metavar="RATE", help="Dots per second, such as '1.2 kHz'.")] = "1 kHz",
    rates: Annotated[
        str | None,
        typer.Option(
            metavar="LOW, HIGH, N", help="Bursts at several rates instead, such as '600 Hz, 1.8 kHz, 7'."
        ),
    ] = None,
    dots: Annotated[str, typer.Option(metavar="N", help="Number of dots.")] = "8",
    force: Annotated[
        str | None,
        typer.Option(metavar="X", help="Least force in parts of that of the single pulse (0.9)."),
    ] = None,
    largest: Annotated[
        str, typer.Option(metavar="CURRENT", help="Largest current of either sign, such as '2 A'.")
    ] = "2 A",
    slew: Annotated[
        str | None,
        typer.Option(metavar="A/S", help="Largest slope of the current, A/s (the hammer's own waveform's)."),
    ] = None,
    spacing: Annotated[
        str | None, typer.Option(metavar="TIME", help="Time between nodes of the current, such as '50 us'.")
    ] = None,
    heat: Annotated[
        bool, typer.Option("--heat", help="Make the squared current least instead of the positive work.")
    ] = False,
    pulses: Annotated[
        bool,
        typer.Option("--pulses", help="Only pulses of the hammer, of times and widths that are sought."),
    ] = False,
    supply: Annotated[
        bool,
        typer.Option("--supply", help="Show as well how the burst fares with other currents, up to 3 %."),
    ] = False,
    tolerance: Annotated[
        str | None, typer.Option(metavar="X", help="Error allowed in one step of the search.")
    ] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Burst (.nc), its current as a sampled waveform (.csv), or picture (.svg, .png, .pdf);"
            " may be given repeatedly.",
        ),
    ] = None,
) -> None:
    """Find the current that prints a burst with least work: the swing drive of the paper's discussion.

    Every dot has the force asked for, the hammer starts from rest and comes to rest again. Ends with status 1
    where a dot of the burst found is not adequate.
    """
    from rich.markup import escape

    from printhammer.cli.progress import counting
    from printhammer.cli.saving import PICTURES, check_endings, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty, load_checked
    from printhammer.control.least_work.burst import LeastWork, least_work
    from printhammer.errors import InputError
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*LeastWork.ENDINGS, *PICTURES))
    check_outputs(wanted, [Path(hammer)])
    given: dict[str, Any] = {
        "force": number(force, "force"),
        "slew": number(slew, "slew"),
        "spacing": spacing,
        "tolerance": number(tolerance, "tolerance"),
    }
    options = {key: value for key, value in given.items() if value is not None}
    count = whole(dots, "dots")
    assert count is not None
    options |= {"dots": count, "largest": largest, "least": "heat" if heat else "positive work"}
    options["shape"] = "pulses" if pulses else "free"
    if pulses and any(path.suffix.lower() == ".csv" for path in wanted):
        raise InputError("--pulses is given, expected no current (.csv) beside it")
    many = None if rates is None else rates_between(rates, "--rates", most=_MOST_RATES)
    if many is not None and (supply or any(path.suffix.lower() == ".csv" for path in wanted)):
        raise InputError("--rates is given, expected neither --supply nor a current (.csv) beside it")
    loaded = load_checked(hammer)
    announce_compiling()
    screen = console()
    if many is not None:
        _at_rates(loaded, many, options, wanted)
        return
    with counting("dots planned") as tell:
        found = least_work(loaded, rate, progress=tell, **options)
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}\n")
    screen.print(told(found, units))
    if supply:
        screen.print()
        screen.print(supplied(found.under_supply(), found.count, units))
    write_found(screen, wanted, found.plot, found.save)
    if found.adequate < found.count:
        complain(f"{found.adequate} of {found.count} dots are adequate")
        raise typer.Exit(1)


def told(found: LeastWork, units: Units) -> Table:
    """Return what the burst prints, and what it costs."""
    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import with_unit

    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    work, ledger = found.work, found.ledger
    weakest = (
        f", the weakest with {found.forces.min():.4f} of the single pulse's force" if found.contacts else ""
    )
    table.add_row("dots", f"{found.adequate} of {found.count} adequate at {found.rate:.6g} Hz{weakest}")
    allowed = f"{found.slew:.4g} A/s allowed" if found.shape == "free" else "pulses of the hammer"
    table.add_row("current", f"at most {with_unit(found.drive.peak, 'current', units)}, {allowed}")
    table.add_row("at rest", f"after {with_unit(found.rest_time, 'time', units)}")
    table.add_row("absorbed by the pack", with_unit(ledger.pack_loss, "energy", units))
    table.add_row("lost at the backstop", with_unit(ledger.backstop_loss, "energy", units))
    table.add_row(
        "net work W",
        f"{with_unit(work.net, 'energy', units)}, [bold]{found.net_ratio:.4f}[/bold] of what the pack"
        f" absorbs; {found.single_ratio:.2f} with single pulses",
    )
    table.add_row(
        "positive work W+",
        f"{with_unit(work.positive, 'energy', units)}, [bold]{found.positive_ratio:.4f}[/bold] of it;"
        f" no current does with less than {found.bound_ratio:.4f} for this force",
    )
    if work.heat is not None:
        table.add_row("heat of the coil", with_unit(work.heat, "energy", units))
    table.add_row("ledger", f"residual {ledger.residual / ledger.throughput:.1e} of the throughput")
    return table


def supplied(found: SupplyCheck, count: int, units: Units) -> Table:
    """Return how the burst fares with other currents."""
    import math

    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import shown, unit

    time = unit("time", units)
    table = plain_table(
        ("current", "right"),
        ("adequate dots", "right"),
        ("weakest force", "right"),
        (f"late by [{time}]", "right"),
    )
    rows = zip(
        found.changes.tolist(),
        found.adequate.tolist(),
        found.weakest.tolist(),
        found.spread.tolist(),
        strict=True,
    )
    for change, adequate, weakest, late in rows:
        told_late = shown(None if math.isnan(late) else late, "time", units)
        table.add_row(f"{100.0 * change:+.1f} %", f"{adequate} of {count}", f"{weakest:.3f}", told_late)
    return table


def _at_rates(hammer: Hammer, rates: list[float], options: dict[str, Any], wanted: list[Path]) -> None:
    from rich.markup import escape

    from printhammer.cli.progress import counting
    from printhammer.cli.saving import write_found
    from printhammer.cli.terminal import complain, console, honesty, plain_table
    from printhammer.control.least_work.rates import FOUND, least_work_rates

    with counting("rates") as tell:
        found = least_work_rates(hammer, rates, progress=tell, **options)
    screen = console()
    screen.print(f"[bold]{escape(hammer.name)}[/bold]  {honesty(hammer)}\n")
    headings = ("rate [Hz]", "adequate dots", "W", "W+", "least W+", "")
    table = plain_table(*((heading, "right") for heading in headings))
    for row, status in enumerate(found.status.tolist()):
        ratios = (found.net_ratio[row], found.positive_ratio[row], found.bound_ratio[row])
        known = [f"{ratio:.4f}" if status == FOUND else "–" for ratio in ratios]
        said = "" if status == FOUND else status
        table.add_row(f"{found.rates[row]:.6g}", f"{found.adequate[row]} of {found.count}", *known, said)
    screen.print(table)
    write_found(screen, wanted, found.plot, found.save)
    missing = int((found.status != FOUND).sum())
    if missing:
        complain(f"no current was found at {missing} of {found.status.size} rates")
        raise typer.Exit(1)
