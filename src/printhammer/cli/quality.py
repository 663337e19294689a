"""The verb `quality`: what a hammer prints at a rate, how fast it may go, and what materials would buy."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.limits import Limits

EXAMPLE: Final = "Example: printhammer quality hendriks-1983 --rate 900Hz --out quality.png"

_REPORT: Final = "Report"
_MORE: Final = "Instead of the report"
_GRID: Final = "Limits and grid of rates"


def _report(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=_REPORT)


def _more(flag: str, text: str, metavar: str | None = None) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_MORE)


def _grid(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=_GRID)


def quality(
    hammer: HammerArgument = HAMMER,
    rate: Annotated[str | None, _report("RATE", "Slots per second, such as 900Hz.")] = None,
    pattern: Annotated[
        str | None, _report("SLOTS", "Slots such as 10110111 (the de Bruijn cycle of order 8).")
    ] = None,
    pulses: Annotated[str | None, _report("N", "Dots without a gap, instead of a pattern.")] = None,
    pitch: Annotated[str | None, _report("LENGTH", "Distance of neighbouring slots (1/60 in).")] = None,
    table: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Drive by a compensation table (.csv, .json), not in an open loop."
        ),
    ] = None,
    feedback: Annotated[
        bool,
        typer.Option("--feedback", help="Drive with feedback, see `printhammer feedback`; takes a while."),
    ] = False,
    safe_rate: Annotated[
        bool, _more("--safe-rate", "Find the rate up to which all patterns of eight slots print well.")
    ] = False,
    yield_: Annotated[
        str | None,
        _more("--yield", "Draw hammers: how many pass at --rate; without it, their safe rates.", "N"),
    ] = None,
    damping: Annotated[
        bool, _more("--damping", "Exchange the materials of backstop and pack at the same print force.")
    ] = False,
    spread: Annotated[
        list[str] | None,
        _more("--spread", "With --yield: 1%, of all constants, or magnet.Am=2%; repeatedly.", "X|KEY=X"),
    ] = None,
    judged_by: Annotated[
        str | None, _more("--judged-by", "With --yield: by which single pulse dots are judged.", "own|design")
    ] = None,
    seed: Annotated[str | None, _more("--seed", "With --yield: seed of the draw (0).", "N")] = None,
    current: Annotated[
        str | None, _more("--current", "With --damping: largest current allowed (2 A).", "CURRENT")
    ] = None,
    limits: Annotated[
        str | None, _grid("NAME", "slots (10 %, 50 µs), dot-matrix (10 %, 100 µs) or engraved (10 %, 15 µs).")
    ] = None,
    force_limit: Annotated[str | None, _grid("X", "Other limit on the force, such as 10%.")] = None,
    arrival_limit: Annotated[str | None, _grid("TIME", "Other limit on the arrival, such as 50us.")] = None,
    first: Annotated[str | None, _grid("RATE", "First rate of the grid (100 Hz).")] = None,
    last: Annotated[str | None, _grid("RATE", "Last rate of the grid (4 kHz).")] = None,
    step: Annotated[str | None, _grid("RATE", "Step of the grid (5 Hz; 25 Hz for many hammers).")] = None,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Numbers (.nc, .csv, .json, .zarr, .parquet) or picture (.svg, .png, .pdf); repeatable.",
        ),
    ] = None,
) -> None:
    """Report what a hammer prints at a rate; or find its safe rate, its yield, or better materials.

    Ends with status 1 where a run stopped before its end.
    """
    from rich.markup import escape

    from printhammer.cli import quality_screen, run_files
    from printhammer.cli.feedback import feedback_strategy
    from printhammer.cli.progress import counting, telling
    from printhammer.cli.saving import PICTURES, check_endings, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty, load_checked
    from printhammer.drive.trains import PulseTrain
    from printhammer.errors import InputError
    from printhammer.results import ENDINGS
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    check_endings(wanted, (*ENDINGS, *PICTURES))
    read = [Path(hammer), *([] if table is None else [table])]
    check_outputs(wanted, read)
    options = {
        "rate": rate,
        "pattern": pattern,
        "pulses": pulses,
        "pitch": pitch,
        "spread": spread,
        "judged-by": judged_by,
        "seed": seed,
        "current": current,
        "first": first,
        "last": last,
        "step": step,
        "threads": threads,
        "table": table,
        "feedback": feedback or None,
    }
    task = _task(safe_rate=safe_rate, yield_=yield_, damping=damping)
    _only(task, {key for key, value in options.items() if value is not None})
    if task == "report" and rate is None:
        raise InputError("--rate: expected slots per second, such as --rate 900Hz, or --safe-rate")
    if pattern is not None and pulses is not None:
        raise InputError("--pattern and --pulses: expected one of them")
    if feedback and table is not None:
        raise InputError(f"--table {table} and --feedback: expected one of them")
    common: dict[str, Any] = {"limits": _limits(limits, force_limit, arrival_limit)}
    if tolerance is not None:
        common["tolerance"] = number(tolerance, "tolerance")
    steps = {"first": first, "last": last, "step": step}
    grid = {key: value for key, value in steps.items() if value is not None}
    many: dict[str, Any] = {**common, **grid, "threads": whole(threads, "threads")}
    loaded = load_checked(hammer)
    if loaded.waveform is None:
        raise InputError(f"{loaded.path}: the hammer has no [waveform] to fire, expected one")
    named = run_files.tables(loaded, Path(hammer), PulseTrain(loaded.waveform), None)
    check_outputs(wanted, [*read, *named])
    if table is not None:
        from printhammer.control.table.compensation import load_table

        loaded_table = load_table(table)
        common["strategy"] = many["strategy"] = loaded_table.strategy(loaded)
        # It says nothing of other rates.
        many = {"first": float(loaded_table.rates[0]), "last": float(loaded_table.rates[-1]), **many}
    announce_compiling()
    if feedback:
        common["strategy"] = many["strategy"] = feedback_strategy(loaded)
    screen = console()
    begin = perf_counter()
    bad = ""
    found: Any
    if task == "report":
        from printhammer.printing.rates.quality import quality as report

        slots = pattern if pulses is None else whole(pulses, "pulses")
        placed: dict[str, Any] = {} if pitch is None else {"pitch": pitch}
        found = report(loaded, rate or 0.0, slots, **common, **placed)
        lines = quality_screen.report(found, units)
        bad = "" if found.ok else f"the run ended early: {found.status}"
    elif task == "safe-rate":
        from printhammer.printing.rates.safe_rate import safe_rate as safe

        with telling("patterns") as say:
            found = safe(loaded, progress=lambda at: say(f"patterns up to {at:g} Hz"), **many)
        lines = quality_screen.safe_rate(found, units)
    elif task == "yield":
        from printhammer.printing.rates.tolerance import tolerance_yield

        if seed is not None:
            many["seed"] = whole(seed, "seed")
        if judged_by is not None:
            many["judged_by"] = judged_by
        spreads = _spreads(loaded, spread or [])
        count = whole(yield_, "--yield")
        if not count or count < 1:
            raise InputError(f"--yield {yield_}: expected a number of hammers, 1 or more")
        with counting("hammers") as tell:
            found = tolerance_yield(loaded, rate, number=count, progress=tell, **spreads, **many)
        lines = quality_screen.tolerance_yield(found, units)
    else:
        from printhammer.printing.rates.damping import damping_study

        if current is not None:
            many["current"] = current
        with counting("materials") as tell:
            found = damping_study(loaded, progress=tell, **many)
        lines = quality_screen.damping(found, units)
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    screen.print(f"[dim]computed in {perf_counter() - begin:.2g} s[/dim]\n")
    screen.print(lines)
    write_found(screen, wanted, found.plot, found.save)
    if bad:
        complain(bad)
        raise typer.Exit(1)


_TAKES: Final = {
    "report": {"rate", "pattern", "pulses", "pitch", "table", "feedback"},
    "safe-rate": {"table", "feedback", "first", "last", "step", "threads"},
    "yield": {"table", "rate", "spread", "judged-by", "seed", "first", "last", "step", "threads"},
    "damping": {"current", "first", "last", "step", "threads"},
}


def _task(*, safe_rate: bool, yield_: str | None, damping: bool) -> str:
    """Return what is asked for."""
    from printhammer.errors import InputError

    asked = {"safe-rate": safe_rate, "yield": yield_ is not None, "damping": damping}
    chosen = [name for name, wanted in asked.items() if wanted]
    if len(chosen) > 1:
        raise InputError(f"--{chosen[0]} and --{chosen[1]}: expected one of them")
    return chosen[0] if chosen else "report"


def _only(task: str, given: set[str]) -> None:
    """Refuse options of another task."""
    from printhammer.errors import InputError

    odd = sorted(given - _TAKES[task])
    if odd:
        others = [name for name, takes in _TAKES.items() if odd[0] in takes]
        where = " or ".join("the report" if name == "report" else f"--{name}" for name in others)
        raise InputError(f"--{odd[0]} is given, which belongs to {where}, not to {_asked(task)}")


def _asked(task: str) -> str:
    return "the report" if task == "report" else f"--{task}"


def _limits(name: str | None, force: str | None, arrival: str | None) -> Limits:
    from dataclasses import replace

    from printhammer.drive.input import read_number
    from printhammer.printing.dots.limits import limits_named

    found = limits_named("slots" if name is None else name)
    if force is not None:
        found = replace(found, force=_share(force, "--force-limit"))
    if arrival is not None:
        found = replace(found, arrival=read_number(arrival, "s", "--arrival-limit"))
    return found


def _share(text: str, name: str) -> float:
    """Read a part such as 0.1 or 10%."""
    value = text.strip()
    found = number(value.removesuffix("%"), name) or 0.0
    return found / 100.0 if value.endswith("%") else found


def _spreads(hammer: Hammer, given: list[str]) -> dict[str, Any]:
    """Read spreads: one number for all constants, and others by key."""
    from printhammer.errors import InputError
    from printhammer.printing.rates.tolerance import spreads_of

    if not given:
        return {}
    common = [text for text in given if "=" not in text]
    if len(common) > 1:
        raise InputError(f"--spread {common[1]}: expected one spread of all constants, {common[0]} is given")
    found = spreads_of(hammer, _share(common[0], "--spread")) if common else {}
    for text in given:
        key, sign, value = text.partition("=")
        if sign:
            found[key.strip()] = _share(value, f"--spread {key.strip()}")
    return {"spreads": found}
