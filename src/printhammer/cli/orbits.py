"""The verb `orbits`: the periodic motions of a train, stable and unstable."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.chaos.orbits.search import Orbits

EXAMPLE: Final = "Example: printhammer orbits hendriks-1983 --period '1.05 ms' --longest 4 --out orbits.csv"

_LONGEST: Final = 8
_STARTS: Final = 1024
_GUESSES: Final = 48
_TRAIN: Final = "Train (one of --period and --rate)"
_SEARCH: Final = "Search"
_KINDS: Final = {"stable": "green", "saddle": "cyan", "unstable": "magenta", "undecided": "yellow"}


def _option(panel: str, metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=panel)


def orbits(
    hammer: HammerArgument = HAMMER,
    period: Annotated[str | None, _option(_TRAIN, "TIME", "Time between firings, such as '1.05 ms'.")] = None,
    rate: Annotated[str | None, _option(_TRAIN, "RATE", "Firings per second, such as '952 Hz'.")] = None,
    overlap: Annotated[
        Overlap,
        _option(_TRAIN, "add|replace", "Overlapping pulses add up (default), or the latest replaces."),
    ] = Overlap.ADD,
    longest: Annotated[str, _option(_SEARCH, "N", "Most firings after which a motion repeats.")] = str(
        _LONGEST
    ),
    starts: Annotated[str, _option(_SEARCH, "N", "States from which motions are followed.")] = str(_STARTS),
    guesses: Annotated[
        str, _option(_SEARCH, "N", "Guesses that are tried for each number of firings.")
    ] = str(_GUESSES),
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Orbits (.csv, .nc, .json, SI) or picture (.svg, .png, .pdf); may be given repeatedly.",
        ),
    ] = None,
) -> None:
    """Search for the motions that repeat after some firings, stable or not, and tell what they do.

    Ends with status 1 where none was found.
    """
    from rich.markup import escape

    from printhammer.chaos.orbits.search import Orbits
    from printhammer.chaos.orbits.search import orbits as search
    from printhammer.chaos.strobe.map import MAP_TOLERANCE
    from printhammer.cli.progress import counting
    from printhammer.cli.saving import PICTURES, check_endings, load_fired, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty
    from printhammer.errors import InputError
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*Orbits.ENDINGS, *PICTURES))
    check_outputs(wanted, [Path(hammer)])
    if (period is None) == (rate is None):
        raise InputError("--period and --rate: expected one of them, such as --period '1.05 ms'")
    loaded = load_fired(hammer, wanted)
    announce_compiling()
    options: dict[str, Any] = {
        "longest": whole(longest, "longest") or 0,
        "starts": whole(starts, "starts") or 0,
        "guesses": whole(guesses, "guesses") or 0,
        "tolerance": MAP_TOLERANCE if tolerance is None else number(tolerance, "tolerance"),
    }
    with counting("orbits", remaining=False) as tell:
        found = search(loaded, period=period, rate=rate, overlap=overlap.value, progress=tell, **options)
    screen = console()
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    fired = found.regime.fired
    train = f"{fired.shape} {fired.quantity} every {found.regime.period:.9g} s"
    screen.print(f"[dim]{escape(train)}, overlap {found.regime.overlap}[/dim]\n")
    if len(found):
        screen.print(summary(found, units))
        screen.print()
    screen.print(found.message, soft_wrap=True)
    write_found(screen, wanted, found.plot, found.save)
    if not len(found):
        complain("no periodic orbit was found; more --starts or --guesses may find one")
        raise typer.Exit(1)


def summary(found: Orbits, units: Units) -> Table:
    """Return what is known of the orbits, one row each."""
    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import shown, unit

    energy = unit("energy", units)
    table = plain_table(
        ("firings", "right"),
        ("kind", "left"),
        ("multipliers", "right"),
        ("backstop\ncontacts", "right"),
        ("dots", "right"),
        ("lost", "right"),
        (f"coil work\n[{energy}]".replace("[", r"\["), "right"),
        (f"pack loss\n[{energy}]".replace("[", r"\["), "right"),
        (f"backstop loss\n[{energy}]".replace("[", r"\["), "right"),
    )
    for orbit in found:
        energies = orbit.energy
        style = _KINDS[orbit.kind]
        table.add_row(
            str(orbit.firings),
            f"[{style}]{orbit.kind}[/{style}]",
            "  ".join(_number(multiplier) for multiplier in orbit.multipliers),
            str(orbit.backstop_contacts),
            str(orbit.printed),
            str(orbit.lost),
            *(
                shown(None if energies is None else getattr(energies, name), "energy", units)
                for name in ("coil_work", "pack_loss", "backstop_loss")
            ),
        )
    return table


def _number(multiplier: complex) -> str:
    """Return a multiplier as text; without an imaginary part where it has none."""
    real = f"{multiplier.real:+.4g}"
    return real if multiplier.imag == 0.0 else f"{real}{multiplier.imag:+.4g}i"
