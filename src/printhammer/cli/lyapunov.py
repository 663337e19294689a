"""The verb `lyapunov`: how fast neighbouring motions part, and the 0-1 test as a second opinion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.chaos import Lyapunov, LyapunovChart
    from printhammer.support.arrays import FloatArray

EXAMPLE: Final = "Example: printhammer lyapunov hendriks-1983 --period '1.10 ms, 1.30 ms' --firings 300"

_FIRINGS, _TRANSIENT = 1000, 1000
_STEPS: Final = 100
_MOST_ROWS: Final = 40
_TRAINS: Final = "Trains (--period, --rate, or --from and --to)"


def _train(flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_TRAINS)


def lyapunov(
    hammer: HammerArgument = HAMMER,
    period: Annotated[
        str | None, _train("--period", "TIMES", "Times between firings, such as '1.10 ms, 1.30 ms'.")
    ] = None,
    rate: Annotated[str | None, _train("--rate", "RATES", "Firings per second, such as '952 Hz'.")] = None,
    lowest: Annotated[
        str | None, _train("--from", "TIME", "Shortest of many times between firings, such as '0.8 ms'.")
    ] = None,
    highest: Annotated[str | None, _train("--to", "TIME", "Longest of them.")] = None,
    steps: Annotated[str | None, _train("--steps", "N", f"Number of them ({_STEPS}).")] = None,
    overlap: Annotated[
        Overlap, _train("--overlap", "add|replace", "Overlapping pulses add up, or the latest replaces.")
    ] = Overlap.ADD,
    firings: Annotated[str, typer.Option(metavar="N", help="Firings over which growth is averaged.")] = str(
        _FIRINGS
    ),
    transient: Annotated[str, typer.Option(metavar="N", help="Firings left out before.")] = str(_TRANSIENT),
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (as many as cores).")] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Exponents (.csv, .nc, .json, SI) or picture (.svg, .png, .pdf); may be given repeatedly.",
        ),
    ] = None,
) -> None:
    """Tell how fast neighbouring motions part: Lyapunov exponents with errors, dimension, and the 0-1 test.

    Ends with status 1 where a run stopped before its end.
    """
    from rich.markup import escape

    from printhammer.chaos import LyapunovChart, lyapunovs
    from printhammer.chaos import lyapunov as exponents_of
    from printhammer.cli.progress import counting
    from printhammer.cli.saving import PICTURES, check_endings, load_fired, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty
    from printhammer.run.problem import TOLERANCE
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*LyapunovChart.ENDINGS, *PICTURES))
    check_outputs(wanted, [Path(hammer)])
    periods = _periods(period, rate, lowest, highest, steps)
    options: dict[str, Any] = {
        "firings": whole(firings, "firings"),
        "transient": whole(transient, "transient"),
        "overlap": overlap.value,
        "tolerance": TOLERANCE if tolerance is None else number(tolerance, "tolerance") or 0.0,
    }
    loaded = load_fired(hammer, wanted)
    announce_compiling()
    single = None
    if len(periods) == 1:
        single = exponents_of(loaded, period=float(periods[0]), **options)
        chart = LyapunovChart.of([single])
    else:
        with counting("trains") as tell:
            chart = lyapunovs(loaded, periods, threads=whole(threads, "threads"), progress=tell, **options)
    screen = console()
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    train = f"{chart.drive.waveform.shape} {chart.drive.quantity}, overlap {chart.drive.overlap}"
    screen.print(f"[dim]{escape(train)}; growth from firing {chart.first} to {chart.last}[/dim]\n")
    screen.print(many(chart) if single is None else summary(single))
    if single is None:
        screen.print(f"\n{tally(chart)}", soft_wrap=True)
    write_found(screen, wanted, (chart if single is None else single).plot, chart.save)
    stopped = sorted({status for status in chart.status if status != "ok"})
    if stopped:
        count = sum(status != "ok" for status in chart.status)
        complain(f"{count} of {len(chart.status)} runs ended early: {', '.join(stopped)}")
        raise typer.Exit(1)


def _periods(
    period: str | None, rate: str | None, lowest: str | None, highest: str | None, steps: str | None
) -> FloatArray:
    """Return the times between firings, s."""
    import numpy as np

    from printhammer.drive.input import read_positive
    from printhammer.errors import InputError

    ranged = lowest is not None or highest is not None
    if sum((period is not None, rate is not None, ranged)) != 1:
        raise InputError("--period, --rate, --from and --to: expected --period, --rate, or --from and --to")
    if not ranged:
        if steps is not None:
            raise InputError(f"--steps {steps}: expected --from and --to beside it")
        name, unit = ("--period", "s") if period is not None else ("--rate", "Hz")
        given = [text.strip() for text in (period or rate or "").split(",")]
        numbers = np.array([read_positive(text, unit, name) for text in given])
        return numbers if unit == "s" else 1.0 / numbers
    if lowest is None or highest is None:
        missing = "--from" if lowest is None else "--to"
        raise InputError(f"{missing} is missing, expected both --from and --to")
    low, high = read_positive(lowest, "s", "--from"), read_positive(highest, "s", "--to")
    count = _STEPS if steps is None else whole(steps, "--steps") or 0
    if not high > low:
        raise InputError(
            f"--from {low:.9g} s and --to {high:.9g} s: expected the second to be the longer one"
        )
    if count < 2:
        raise InputError(f"--steps {steps}: expected at least 2")
    return np.linspace(low, high, count)


def summary(found: Lyapunov) -> Table:
    """Return what is known of one train, a row each."""
    from printhammer.cli.terminal import plain_table

    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    table.add_row("period", f"{found.period:.9g} s")
    for k in (0, 1):
        each, second = float(found.exponents[k]), float(found.per_second[k])
        error = float(found.standard_errors[k])
        table.add_row(f"exponent {k + 1}", f"{each:+.4g} ± {error:.2g} per firing, {second:+.4g} per second")
    table.add_row("sum", f"{found.total:+.6g} ± {found.total_error:.2g} per firing")
    table.add_row("dimension", _dimension(found.dimension, found.dimension_error))
    test = found.zero_one
    table.add_row("0-1 test", "–" if test is None else f"{_coloured(test.verdict)}: {test.phrase}")
    if test is not None and test.reason:
        table.add_row("because", test.reason)
    table.add_row("verdict", _coloured(found.verdict.name))
    if found.verdict.reason:
        table.add_row("because", found.verdict.reason)
    said = {True: "agree", False: "[bold red]differ[/bold red]", None: "do not both decide"}[found.agree]
    table.add_row("both tests", said)
    if not found.smooth:
        table.add_row("remark", "the motion passes a touch without velocity, where it has no derivative")
    return table


def many(chart: LyapunovChart) -> Table:
    """Return a row for each train, of long charts only the first."""
    from printhammer.cli.terminal import plain_table
    from printhammer.units import from_si

    table = plain_table(
        (r"period \[ms]", "right"),
        ("exponent 1 [1/firing]", "right"),
        ("exponent 2 [1/firing]", "right"),
        ("dimension", "left"),
        ("K", "right"),
        ("0-1 test", "left"),
        ("verdict", "left"),
    )
    for row in range(min(len(chart.period), _MOST_ROWS)):
        pairs = zip(chart.exponents[row], chart.standard_errors[row], strict=True)
        table.add_row(
            f"{from_si(float(chart.period[row]), 's', 'ms'):.6g}",
            *(f"{value:+.4g} ± {error:.2g}" for value, error in pairs),
            _dimension(float(chart.dimension[row]), float(chart.dimension_error[row])),
            f"{round(float(chart.k[row]), 2) + 0.0:.2f}",
            _coloured(chart.zero_one[row]),
            _coloured(chart.verdict[row]),
        )
    return table


def tally(chart: LyapunovChart) -> str:
    """Count in one line how often both tests agree."""
    pairs = list(zip(chart.growth, chart.zero_one, strict=True))
    agree = sum(one == other != "undecided" for one, other in pairs)
    open_cases = sum("undecided" in pair for pair in pairs)
    differ = len(pairs) - agree - open_cases
    chaotic = sum(pair == ("chaotic", "chaotic") for pair in pairs)
    rows = f" (the first {_MOST_ROWS} are shown)" if len(pairs) > _MOST_ROWS else ""
    return (
        f"{len(pairs)} trains{rows}: both tests agree on {agree}, {chaotic} of them chaotic;"
        f" they differ on {differ}; on {open_cases} one of them is undecided"
    )


def _dimension(value: float, error: float) -> str:
    import math

    if math.isnan(value):
        return "–"
    return f"{value:.4g} ± {error:.1g}" if error else f"{value:.4g}"


def _coloured(name: str) -> str:
    style = "yellow" if name == "undecided" else "green"
    return f"[{style}]{name.replace('period-', 'period ')}[/{style}]"
