"""The verb `continue`: a periodic orbit followed through a constant, all regimes in the rate, or a chart."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from printhammer.chaos.continuation.branch import Branch
    from printhammer.chaos.continuation.regimes import Branches
    from printhammer.chaos.continuation.stability_chart import StabilityChart
    from printhammer.hammer.hammer import Hammer

EXAMPLE: Final = (
    "Example: printhammer continue hendriks-1983 --period '1.3 ms' --parameter period"
    " --from '1.27 ms' --to '1.34 ms' --out branch.png"
)

_MOST, _LONGEST, _SEEDS = 1000, 3, 6
_GRID: Final = 32
_START: Final = "Start (one of --period and --rate, or --regimes)"
_ALL: Final = "All regimes in the rate"
_CHART: Final = "Chart of two constants"


def _option(flag: str, panel: str | None, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=panel)


def continue_(
    hammer: HammerArgument = HAMMER,
    parameter: Annotated[
        str, _option("--parameter", None, "NAME", "'rate', 'period' or a key such as 'backstop.damping'.")
    ] = "rate",
    lowest: Annotated[
        str | None, _option("--from", None, "VALUE", "Its least value, such as '700 Hz'.")
    ] = None,
    highest: Annotated[str | None, _option("--to", None, "VALUE", "Its largest value.")] = None,
    period: Annotated[
        str | None, _option("--period", _START, "TIME", "Time between firings, such as '1.3 ms'.")
    ] = None,
    rate: Annotated[str | None, _option("--rate", _START, "RATE", "Firings per second.")] = None,
    overlap: Annotated[
        Overlap,
        _option("--overlap", _START, "add|replace", "Overlapping pulses add up, or the latest replaces."),
    ] = Overlap.ADD,
    firings: Annotated[
        str | None, _option("--firings", _START, "N", "Firings after which the orbit repeats.")
    ] = None,
    state: Annotated[
        str | None, _option("--state", _START, "X,V", "State near the orbit, such as '46.2 um, 12 mm/s'.")
    ] = None,
    phase: Annotated[
        str, _option("--phase", _START, "P", "Part of the period between firing and section, from 0 to 1.")
    ] = "0",
    doublings: Annotated[
        str, typer.Option(metavar="N", help="How often period doublings are followed as well.")
    ] = "0",
    most: Annotated[str, typer.Option(metavar="N", help="Steps in either direction.")] = str(_MOST),
    regimes: Annotated[
        bool, typer.Option("--regimes", help="Search for orbits and follow all.", rich_help_panel=_ALL)
    ] = False,
    longest: Annotated[
        str, _option("--longest", _ALL, "N", "Most firings after which a motion repeats.")
    ] = str(_LONGEST),
    seeds: Annotated[str, _option("--seeds", _ALL, "N", "Rates at which orbits are searched for.")] = str(
        _SEEDS
    ),
    second: Annotated[
        str | None, _option("--second", _CHART, "NAME", "Second constant, such as 'backstop.damping'.")
    ] = None,
    second_from: Annotated[str | None, _option("--second-from", _CHART, "VALUE", "Its least value.")] = None,
    second_to: Annotated[str | None, _option("--second-to", _CHART, "VALUE", "Its largest value.")] = None,
    grid: Annotated[
        str, _option("--grid", _CHART, "N", "Values of either constant at which trains from rest are judged.")
    ] = str(_GRID),
    show: Annotated[
        str, typer.Option(metavar="NAME", help="What pictures show: v, x, flight_time, peak_force.")
    ] = "v",
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Branches (.csv, .nc, .json, SI) or picture (.svg, .png, .pdf); may be given repeatedly.",
        ),
    ] = None,
) -> None:
    """Follow a periodic motion, stable or not, through the values of a constant, to where it ends and why.

    Ctrl-C keeps the branches that were followed by then. Ends with status 1 where there is none.
    """
    from rich.markup import escape

    from printhammer.chaos.continuation.regimes import Branches, InterruptedBranches
    from printhammer.cli.saving import PICTURES, check_endings, load_fired, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty
    from printhammer.errors import InputError
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*Branches.ENDINGS, *PICTURES))
    check_outputs(wanted, [Path(hammer)])
    if lowest is None or highest is None:
        missing = "--from" if lowest is None else "--to"
        raise InputError(f"{missing} is missing, expected the range of {parameter}")
    if regimes and (period, rate, firings, state, second) != (None,) * 5:
        raise InputError("--regimes: expected no --period, --rate, --firings, --state or --second beside it")
    if not regimes and (period is None) == (rate is None):
        raise InputError("--period and --rate: expected one of them, such as --period '1.3 ms'")
    if second is not None and (second_from is None or second_to is None):
        missing = "--second-from" if second_from is None else "--second-to"
        raise InputError(f"{missing} is missing, expected the range of {second}")
    loaded = load_fired(hammer, wanted)
    announce_compiling()
    common = {"most": whole(most, "most"), "overlap": overlap.value, **_tolerance(tolerance)}
    screen = console()
    stopped = None
    try:
        if regimes:
            if parameter != "rate":
                raise InputError(f"--parameter {parameter}: expected 'rate' with --regimes")
            found = _regimes(
                loaded,
                (lowest, highest),
                longest=whole(longest, "longest"),
                seeds=whole(seeds, "seeds"),
                doublings=whole(doublings, "doublings"),
                **common,
            )
        else:
            found = _followed(
                loaded,
                parameter,
                (lowest, highest),
                whole(doublings, "doublings") or 0,
                period=period,
                rate=rate,
                firings=whole(firings, "firings"),
                state=_state(state),
                phase=number(phase, "phase"),
                **common,
            )
    except InterruptedBranches as interrupt:
        stopped, found = interrupt, interrupt.branches
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}\n")
    tell(screen, found)
    chart = None
    if second is not None and stopped is None:
        chart = _charted(found[0], second, (second_from or "", second_to or ""), whole(grid, "grid") or 0)
        screen.print(f"\n{escape(chart.message)}", soft_wrap=True)
    if chart is not None:
        write_found(screen, wanted, chart.plot, chart.save)
    elif second is None and len(found):
        write_found(screen, wanted, partial(found.plot, show=show), found.save)
    if stopped is not None:
        raise KeyboardInterrupt from stopped
    if not len(found):
        complain("no branch was found; more --seeds or a larger --longest may find one")
        raise typer.Exit(1)


def _tolerance(text: str | None) -> dict[str, float]:
    value = number(text, "tolerance")
    return {} if value is None else {"tolerance": value}


def _state(text: str | None) -> tuple[float, float] | None:
    from printhammer.drive.input import read_number
    from printhammer.errors import InputError

    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise InputError(f"--state {text!r}: expected displacement and velocity, such as '46.2 um, 12 mm/s'")
    return read_number(parts[0], "m", "--state"), read_number(parts[1], "m/s", "--state")


def _followed(
    hammer: Hammer, parameter: str, bounds: tuple[str, str], levels: int, **options: Any
) -> Branches:
    from printhammer.chaos.continuation.continuation import continuation
    from printhammer.chaos.continuation.regimes import follow_doublings
    from printhammer.cli.progress import counting
    from printhammer.errors import InputError

    if levels < 0:
        raise InputError(f"doublings = {levels}, expected a whole number from 0 on")
    with counting("orbits", remaining=False) as told:
        branch = continuation(hammer, parameter, bounds, progress=told, **options)
    return follow_doublings(branch, levels, most=options["most"])


def _regimes(hammer: Hammer, rates: tuple[str, str], **options: Any) -> Branches:
    from printhammer.chaos.continuation.regimes import regimes
    from printhammer.cli.progress import counting

    with counting("regimes", remaining=False) as told:
        return regimes(hammer, rates, progress=told, **options)


def _charted(branch: Branch, second: str, bounds: tuple[str, str], grid: int) -> StabilityChart:
    from printhammer.chaos.continuation.stability_chart import stability_chart
    from printhammer.cli.progress import counting

    with counting("curves", remaining=False) as told:
        return stability_chart(branch, second, bounds, grid=(grid, grid), progress=told)


def tell(screen: Console, found: Branches) -> None:
    """Print what branches were found, what happens on them, and why they end."""
    from rich.markup import escape

    for i, branch in enumerate(found):
        screen.print(f"[bold]{i + 1}[/bold]  {escape(branch.message)}", soft_wrap=True)
        for low, high in branch.stable_ranges:
            screen.print(f"   [green]stable[/green] from {low:.9g} to {high:.9g} {branch.unit}")
        if branch.events:
            screen.print(events(branch))
        screen.print()
    screen.print(escape(found.message), soft_wrap=True)
    for sentence in found.refused:
        screen.print(f"[yellow]not followed[/yellow] {escape(sentence)}", soft_wrap=True)


def events(branch: Branch) -> Table:
    """Return what happens along a branch, a row each."""
    from printhammer.cli.terminal import plain_table

    unit = rf" \[{branch.unit}]" if branch.unit != "1" else ""
    table = plain_table(
        (f"{branch.parameter}{unit}", "right"),
        ("what happens", "left"),
        ("multipliers", "right"),
        ("", "left"),
    )
    for event in branch.events:
        multipliers = "  ".join(_number(complex(value)) for value in event.multipliers)
        table.add_row(
            f"{event.value:.9g}", event.message, multipliers, "" if event.sharp else "between two orbits"
        )
    return table


def _number(multiplier: complex) -> str:
    real = f"{multiplier.real:+.4g}"
    return real if multiplier.imag == 0.0 else f"{real}{multiplier.imag:+.4g}i"
