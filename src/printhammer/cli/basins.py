"""The verb `basins`: which initial states lead where; with `--quench`, which second pulses lose their dot."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.chaos.basins.basins import Basins
    from printhammer.chaos.basins.quench import QuenchMap

EXAMPLE: Final = (
    "Example: printhammer basins hendriks-1983 --period '1.05 ms' --x '30 um, 260 um, 24'"
    " --v '-1 m/s, 1 m/s, 20' --out basins.png"
)

_TRAIN: Final = "Basins (one of --period and --rate)"
_QUENCH: Final = "Quench map"
_ROWS: Final = 12


def _train(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=_TRAIN)


def _quench(flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_QUENCH)


def basins(
    hammer: HammerArgument = HAMMER,
    period: Annotated[str | None, _train("TIME", "Time between firings, such as '1.05 ms'.")] = None,
    rate: Annotated[str | None, _train("RATE", "Firings per second, such as '769 Hz'.")] = None,
    x: Annotated[
        str | None, _train("LOW, HIGH, N", "Displacements, such as '30 um, 260 um, 128' (the strobe window).")
    ] = None,
    v: Annotated[
        str | None, _train("LOW, HIGH, N", "Velocities, such as '-1 m/s, 1 m/s, 128' (the strobe window).")
    ] = None,
    firings: Annotated[str | None, _train("N", "Firings of a round (200).")] = None,
    rounds: Annotated[str | None, _train("N", "Rounds that a cell gets at most (4).")] = None,
    box: Annotated[str | None, _train("N", "Cells along the side of a box, for the entropy (4).")] = None,
    overlap: Annotated[
        Overlap | None, _train("add|replace", "Overlapping pulses add up (default), or the latest replaces.")
    ] = None,
    quench: Annotated[
        bool,
        typer.Option("--quench", help="Map two pulses from rest instead.", rich_help_panel=_QUENCH),
    ] = False,
    gaps: Annotated[
        str | None,
        _quench("--gaps", "LOW, HIGH, N", "Times between the two firings ('0.5 ms, 0.9 ms, 128')."),
    ] = None,
    widths: Annotated[
        str | None,
        _quench("--widths", "LOW, HIGH, N", "Widths of the second pulse (half to 1.5 of the first, 128)."),
    ] = None,
    tail: Annotated[
        str | None, _quench("--tail", "TIME", "Time within which a second dot is waited for (1 ms).")
    ] = None,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="Cells (.nc, .csv) or picture (.svg, .png, .pdf); may be given repeatedly."
        ),
    ] = None,
) -> None:
    """Tell which states lead to which attractor, or with --quench which second pulses lose their dot.

    Ends with status 1 where a run stopped before its end.
    """
    from rich.markup import escape

    from printhammer.cli.progress import counting
    from printhammer.cli.saving import PICTURES, check_endings, load_fired, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty
    from printhammer.results import ENDINGS
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*ENDINGS, *PICTURES))
    check_outputs(wanted, [Path(hammer)])
    of_basins = {
        "period": period,
        "rate": rate,
        "x": _range(x, "--x"),
        "v": _range(v, "--v"),
        "firings": whole(firings, "firings"),
        "rounds": whole(rounds, "rounds"),
        "overlap": None if overlap is None else overlap.value,
    }
    of_quench = {"gaps": _range(gaps, "--gaps"), "widths": _range(widths, "--widths"), "tail": tail}
    side = whole(box, "box")
    _one_kind(quench, {**of_basins, "box": side}, of_quench)
    loaded = load_fired(hammer, wanted)
    announce_compiling()
    given = {"tolerance": number(tolerance, "tolerance"), "threads": whole(threads, "threads")}
    options: dict[str, Any] = {
        key: value for key, value in {**given, **of_basins, **of_quench}.items() if value is not None
    }
    screen = console()
    begin = perf_counter()
    found: Basins | QuenchMap
    if quench:
        from printhammer.chaos.basins.quench import quench_map

        with counting("cells") as tell:
            found = mapped = quench_map(loaded, progress=tell, **options)
        lines = quenched(mapped, units)
        failed = mapped.status[mapped.status != "ok"]
    else:
        from printhammer.chaos.basins.basins import NO_STATE_STATUS
        from printhammer.chaos.basins.basins import basins as computed

        with counting("cells") as tell:
            found = planes = computed(loaded, progress=tell, **options)
        lines = told(planes, side, units)
        failed = planes.status[(planes.status != "ok") & (planes.status != NO_STATE_STATUS)]
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    screen.print(f"[dim]{found.status.size} cells, computed in {perf_counter() - begin:.2g} s[/dim]\n")
    screen.print(lines)
    write_found(screen, wanted, found.plot, found.save)
    if failed.size:
        kinds = ", ".join(sorted(set(failed.tolist())))
        complain(f"{failed.size} of {found.status.size} runs ended early: {kinds}")
        raise typer.Exit(1)


def _range(text: str | None, name: str) -> tuple[str, str, int] | None:
    """Read two ends with their units and a number of values, such as '0 um, 100 um, 64'."""
    from printhammer.errors import InputError

    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3:
        raise InputError(f"{name} {text!r}: expected two ends and a number, such as '30 um, 90 um, 128'")
    return parts[0], parts[1], whole(parts[2], name) or 0


def _one_kind(quench: bool, of_basins: dict[str, Any], of_quench: dict[str, Any]) -> None:
    """Refuse options of the one beside the other."""
    from printhammer.errors import InputError

    wrong = of_basins if quench else of_quench
    odd = [key for key, value in wrong.items() if value is not None]
    if odd:
        expected = "none beside --quench" if quench else "--quench beside it"
        raise InputError(f"--{odd[0]} is given, expected {expected}")
    if not quench and (of_basins["period"] is None) == (of_basins["rate"] is None):
        raise InputError("--period and --rate: expected one of them, such as --period '1.05 ms', or --quench")


def told(found: Basins, box: int | None, units: Units) -> Table:
    """Return the attractors with their shares, the cells that lead to none, and the basin entropy."""
    import math

    from printhammer.chaos.basins.entropy import BOX
    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import with_unit

    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    share, error = found.shares
    for number_, attractor in enumerate(found.attractors[:_ROWS], 1):
        x, v = attractor.states[0].tolist()
        where = "" if attractor.period is None else f", first at {with_unit(x, 'length', units)},"
        where += "" if attractor.period is None else f" {with_unit(v, 'speed', units)}"
        table.add_row(
            f"attractor {number_}",
            f"[bold]{attractor.name.replace('-', ' ')}[/bold], {100.0 * share[number_ - 1]:.2f} ±"
            f" {100.0 * error[number_ - 1]:.2f} % of the states{where}",
        )
    if len(found.attractors) > _ROWS:
        table.add_row("", f"and {len(found.attractors) - _ROWS} more")
    for label, name in ((0, "undecided"), (-1, "ended early"), (-2, "no state")):
        if found.counts[label] or label == 0:
            table.add_row(name, f"{found.counts[label]} of {found.labels.size} cells")
    entropy = found.entropy(box=min(BOX, *found.labels.shape) if box is None else box)
    boundary = (
        "no box on a boundary"
        if math.isnan(entropy.boundary_entropy)
        else f"{entropy.boundary_entropy:.4f} in the {entropy.boundary_boxes} boxes on a boundary"
        f"{', more than ln 2: a fractal one' if entropy.fractal else ''}"
    )
    table.add_row(
        "basin entropy",
        f"{entropy.entropy:.4f} in {entropy.boxes} boxes of {entropy.box} x {entropy.box} cells, {boundary}",
    )
    return table


def quenched(found: QuenchMap, units: Units) -> Table:
    """Return how many second dots are lost, and how the others differ from the first."""
    import numpy as np

    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import with_unit

    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    lost, size = int(found.lost.sum()), found.status.size
    table.add_row("second dots", f"{int(found.struck.sum())} printed, {lost} of {size} lost")
    single = (
        with_unit(found.single_force, "force", units),
        with_unit(found.single_flight_time, "time", units),
    )
    table.add_row("first alone", f"{single[0]}, flight time {single[1]}")
    if found.struck.any() and np.isfinite(found.single_force):
        ratio, gain = found.force_ratio[found.struck], found.flight_gain[found.struck]
        table.add_row("force ratio", f"{ratio.min():.3f} to {ratio.max():.3f}")
        ends = [with_unit(float(end), "time", units) for end in (gain.min(), gain.max())]
        table.add_row("flies shorter by", " to ".join(ends))
    return table
