"""The verb `bifurcation`: the states at the firings against a parameter, windows, and the way into chaos."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.chaos.bifurcation.diagram import Bifurcation
    from printhammer.hammer.hammer import Hammer

EXAMPLE: Final = (
    "Example: printhammer bifurcation hendriks-1983 --from '1.2 ms' --to '1.35 ms' --values 60"
    " --direction both --out bifurcation.png"
)

_RANGE: Final = ("0.8 ms", "1.35 ms")
_VALUES: Final = 500
_PARAMETER: Final = "Parameter (default: period from 0.8 ms to 1.35 ms)"
_ROWS: Final = 12


class Direction(StrEnum):
    """How the state at the beginning of a train comes about."""

    REST = "from-rest"
    UP = "up"
    DOWN = "down"
    BOTH = "both"


def _of(flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_PARAMETER)


def bifurcation(
    hammer: HammerArgument = HAMMER,
    parameter: Annotated[
        str, _of("--parameter", "NAME", "period, rate, or any constant such as backstop.damping.")
    ] = "period",
    lowest: Annotated[str | None, _of("--from", "VALUE", "Least value, with its unit.")] = None,
    highest: Annotated[str | None, _of("--to", "VALUE", "Largest value, with its unit.")] = None,
    values: Annotated[str, _of("--values", "N", "Number of values.")] = str(_VALUES),
    period: Annotated[
        str | None, _of("--period", "TIME", "Time between firings, where another constant is changed.")
    ] = None,
    rate: Annotated[str | None, _of("--rate", "RATE", "Firings per second, likewise.")] = None,
    firings: Annotated[str, typer.Option(metavar="N", help="Firings at each value.")] = "300",
    transient: Annotated[str, typer.Option(metavar="N", help="Of these, left out at the beginning.")] = "100",
    direction: Annotated[
        Direction,
        typer.Option(
            metavar="from-rest|up|down|both",
            help="Begin at rest (default), or where the train at the value before, or after, ended.",
        ),
    ] = Direction.REST,
    refine: Annotated[
        str, typer.Option(metavar="N", help="Halve the steps between neighbours that differ so often.")
    ] = "2",
    exponents: Annotated[
        bool, typer.Option("--exponents", help="Tell strange trains from undecided ones; takes long.")
    ] = False,
    overlap: Annotated[
        Overlap,
        typer.Option(metavar="add|replace", help="Overlapping pulses add up, or the latest replaces."),
    ] = Overlap.ADD,
    show: Annotated[str, typer.Option(metavar="x|v", help="What a picture shows.")] = "x",
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="States (.nc), verdicts (.csv) or picture (.svg, .png, .pdf); may be given repeatedly.",
        ),
    ] = None,
) -> None:
    """Fire trains at many values of a parameter and tell which are periodic, and what leads to chaos.

    Ends with status 1 where a run stopped before its end. Ctrl-C writes what is done.
    """
    from rich.markup import escape

    from printhammer.chaos.bifurcation.bifurcation import InterruptedDiagram
    from printhammer.chaos.bifurcation.bifurcation import bifurcation as computed
    from printhammer.cli.progress import counting
    from printhammer.cli.saving import load_fired, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    _check(wanted, show)
    check_outputs(wanted, [Path(hammer)])
    options: dict[str, Any] = {
        "firings": whole(firings, "firings"),
        "transient": whole(transient, "transient"),
        "refine": whole(refine, "refine"),
        "direction": direction.value.replace("-", " "),
        "overlap": overlap.value,
        "exponents": exponents,
        "threads": whole(threads, "threads"),
    }
    if tolerance is not None:
        options["tolerance"] = number(tolerance, "tolerance")
    loaded = load_fired(hammer, wanted)
    options |= _values(loaded, parameter, (lowest, highest), whole(values, "values") or 0, period, rate)
    announce_compiling()
    screen = console()
    begin = perf_counter()
    stopped = None
    try:
        with counting("trains") as tell:
            found = computed(loaded, progress=tell, **options)
    except InterruptedDiagram as interrupt:
        stopped, found = interrupt, interrupt.diagram
    done = int((found.status != "not run").sum())
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    screen.print(
        f"[dim]{escape(found.parameter)}: {len(found.values)} values, {done} trains of"
        f" {int(found.firing[-1])} firings, tolerance {found.tolerance:g}; computed in"
        f" {perf_counter() - begin:.2g} s[/dim]\n"
    )
    if done:
        for name in found.directions:
            screen.print(summary(found, name))
        for line in sentences(found):
            screen.print(escape(line), soft_wrap=True)
        write_found(screen, wanted, partial(found.plot, show=show), found.save)
    if stopped is not None:
        raise KeyboardInterrupt from stopped
    failed = found.status[found.status != "ok"]
    if failed.size:
        kinds = ", ".join(sorted(set(failed.tolist())))
        complain(f"{failed.size} of {found.status.size} runs ended early: {kinds}")
        raise typer.Exit(1)


def _check(wanted: list[Path], show: str) -> None:
    from printhammer.chaos.bifurcation.diagram import Bifurcation
    from printhammer.cli.saving import PICTURES, check_endings
    from printhammer.errors import InputError

    check_endings(wanted, (*Bifurcation.ENDINGS, *PICTURES))
    if show not in ("x", "v"):
        raise InputError(f"--show {show}: expected x or v")


def _values(
    hammer: Hammer,
    parameter: str,
    ends: tuple[str | None, str | None],
    count: int,
    period: str | None,
    rate: str | None,
) -> dict[str, Any]:
    """Return the parameter and its values as arguments of `printhammer.bifurcation`."""
    import numpy as np

    from printhammer.drive.input import read_number
    from printhammer.errors import InputError
    from printhammer.run.regime import Regime

    timed = parameter in ("period", "rate")
    if timed and (period is not None or rate is not None):
        raise InputError(f"--period and --rate: expected none of them where the {parameter} is changed")
    regime = Regime.of(hammer, period=_RANGE[0] if timed else period, rate=rate)
    regime.value(parameter)
    unit, _meaning = regime.meaning_of(parameter)
    first, last = ends
    if parameter == "period":
        first, last = first or _RANGE[0], last or _RANGE[1]
    if first is None or last is None:
        raise InputError(f"--from and --to: expected both of them for {parameter}, in {unit}")
    low, high = (read_number(end, unit, name) for end, name in ((first, "--from"), (last, "--to")))
    if count < 2 or not low < high:
        raise InputError(
            f"--from {first}, --to {last} and --values {count}: expected the second to be the higher"
            " one, and at least 2 values"
        )
    grid = np.linspace(low, high, count)
    if timed:
        return {f"{parameter}s": grid}
    return {"parameter": parameter, "values": grid, "period": period, "rate": rate}


def summary(found: Bifurcation, direction: str) -> Table:
    """Return the verdicts of one direction: how many windows, how wide together, the widest one."""
    from printhammer.cli.terminal import plain_table

    windows = found.windows(direction)
    table = plain_table(
        ("verdict", "left"),
        ("windows", "right"),
        ("share", "right"),
        ("widest from", "right"),
        ("to", "right"),
        title=direction,
    )
    whole_width = sum(window.width for window in windows) or 1.0
    kinds = sorted({(window.period or 1000, window.verdict) for window in windows})
    for _period, verdict in kinds[:_ROWS]:
        some = [window for window in windows if window.verdict == verdict]
        widest = max(some, key=lambda window: window.width)
        table.add_row(
            verdict.replace("-", " "),
            str(len(some)),
            f"{100.0 * sum(window.width for window in some) / whole_width:.2f} %",
            f"{widest.low:.7g}",
            f"{widest.high:.7g}",
        )
    if len(kinds) > _ROWS:
        table.add_row(f"and {len(kinds) - _ROWS} more", "", "", "", "")
    return table


def sentences(found: Bifurcation) -> list[str]:
    """Return what the diagram tells: the routes to the first strange train, and hysteresis."""
    from printhammer.chaos.bifurcation.diagram import hysteresis
    from printhammer.chaos.bifurcation.windows import cells

    told = [""]
    for direction in found.directions:
        said = f"{direction}: " if len(found.directions) > 1 else ""
        told += [f"{said}{route.sentence}" for route in found.routes(direction)]
    if len(found.directions) > 1:
        apart = hysteresis(found)
        widths = cells(found.values)
        share = float(widths[apart].sum() / (widths.sum() or 1.0))
        told.append(f"Up and down lead to different attractors at {100.0 * share:.2f} % of the range.")
    return told
