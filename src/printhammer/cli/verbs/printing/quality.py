"""The verb `quality`: what a hammer prints at a rate, how fast it may go, and what materials would buy."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.verbs.printing.strategy import FEEDBACK, SERIAL, TABLE, chosen_strategy
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

_MORE: Final = "Instead of the report"
_GRID: Final = "Limits and grid of rates"
_report = partial(opt.text, panel="Report")
_more = partial(opt.text, panel=_MORE)
_grid = partial(opt.text, panel=_GRID)
_instead = partial(opt.switch, panel=_MORE)


@verb(
    "quality",
    "printhammer quality hendriks-1983 --rate 900Hz --out quality.png",
    out=opt.results("Numbers"),
)
def quality(
    job: Job,
    hammer: Hammer = opt.FIRED,
    rate: str | None = _report("RATE", "Slots per second, such as 900Hz."),
    pattern: str | None = _report("SLOTS", "Slots such as 10110111 (the de Bruijn cycle of order 8)."),
    pulses: int | None = opt.whole("Dots without a gap, instead of a pattern.", panel="Report"),
    pitch: str | None = _report("LENGTH", "Distance of neighbouring slots (1/60 in)."),
    paper: Path | None = opt.source("How the paper varies along the line (.toml).", panel="Report"),
    table: Path | None = TABLE,
    serial: str | None = SERIAL,
    feedback: bool = FEEDBACK,
    safe_rate: bool = _instead("Find the rate up to which all patterns of eight slots print well."),
    yield_: int | None = opt.whole(
        "Draw hammers: how many pass at --rate; without it, their safe rates.", flag="--yield", panel=_MORE
    ),
    damping: bool = _instead("Exchange the materials of backstop and pack at the same print force."),
    spread: list[str] | None = _more(
        "X|KEY=X", "With --yield: 1%, of all constants, or magnet.Am=2%; repeatedly.", many=True
    ),
    judged_by: str | None = _more("own|design", "With --yield: by which single pulse dots are judged."),
    seed: int | None = opt.whole("With --yield: seed of the draw (0).", panel=_MORE),
    current: str | None = _more("CURRENT", "With --damping: largest current allowed (2 A)."),
    limits: str = _grid(
        "NAME", "slots (10 %, 50 µs), dot-matrix (10 %, 100 µs) or engraved (10 %, 15 µs).", default="slots"
    ),
    force_limit: str | None = _grid("X", "Other limit on the force, such as 10%."),
    arrival_limit: float | None = opt.quantity(
        "s", "TIME", "Other limit on the arrival, such as 50us.", panel=_GRID
    ),
    first: str | None = _grid("RATE", "First rate of the grid (100 Hz)."),
    last: str | None = _grid("RATE", "Last rate of the grid (4 kHz)."),
    step: str | None = _grid("RATE", "Step of the grid (5 Hz; 25 Hz for many hammers)."),
    tolerance: float | None = opt.TOLERANCE,
    threads: int | None = opt.THREADS,
    units: Units = opt.UNITS,
) -> Answer:
    """Report what a hammer prints at a rate; or find its safe rate, its yield, or better materials.

    Ends with status 1 where a run stopped before its end.
    """
    from printhammer.cli.verbs.printing import quality_report
    from printhammer.printing.dots.judging import limits_named

    instead = {"safe-rate": safe_rate, "yield": yield_ is not None, "damping": damping}
    tasks = [name for name, wanted in instead.items() if wanted] or ["report"]
    if len(tasks) > 1:
        raise InputError(f"--{tasks[0]} and --{tasks[1]}: expected one of them", key=f"--{tasks[0]}")
    task = tasks[0]
    of_report = opt.given(rate=rate, pattern=pattern, pulses=pulses, pitch=pitch, paper=paper)
    of_drive = opt.given(table=table, serial=serial, feedback=feedback or None)
    of_grid = opt.given(first=first, last=last, step=step)
    of_draw = opt.given(spread=spread, judged_by=judged_by, seed=seed)
    _only(task, {*of_report, *of_drive, *of_grid, *of_draw, *opt.given(current=current, threads=threads)})
    if task == "report" and rate is None:
        raise InputError(
            "--rate: expected slots per second, such as --rate 900Hz, or --safe-rate", key="--rate"
        )
    if pattern is not None and pulses is not None:
        raise InputError("--pattern and --pulses: expected one of them", key="--pattern")
    share = None if force_limit is None else opt.read_share(force_limit, "--force-limit")
    bounds = replace(limits_named(limits), **opt.given(force=share, arrival=arrival_limit))
    strategy, loaded_table = chosen_strategy(job, hammer, table, feedback, serial)
    common: dict[str, Any] = {"limits": bounds, **opt.given(tolerance=tolerance), **strategy}
    many: dict[str, Any] = {**common, **of_grid, "threads": threads}
    if loaded_table is not None:
        # It says nothing of other rates.
        many = {"first": float(loaded_table.rates[0]), "last": float(loaded_table.rates[-1]), **many}
    result: Any
    if task == "report":
        from printhammer.printing.dots.paper import Paper
        from printhammer.printing.rates.quality import quality as report

        with job.telling("printing"):
            slots = pattern if pulses is None else pulses
            varied = None if paper is None else Paper.load(paper)
            result = report(hammer, rate or 0.0, slots, **common, **opt.given(pitch=pitch, paper=varied))
        bad = [] if result.ok else [f"the run ended early: {result.status}"]
        lines = quality_report.report(result, units)
    elif task == "safe-rate":
        from printhammer.printing.rates.safe_rate import safe_rate as safe

        with job.telling("patterns") as say:
            result = safe(hammer, progress=lambda at: say(f"patterns up to {at:g} Hz"), **many)
        lines, bad = quality_report.safe_rate(result, units), []
    elif task == "yield":
        from printhammer.printing.rates.tolerance import tolerance_yield

        spreads = _spreads(hammer, spread or [])
        if yield_ is None or yield_ < 1:
            raise InputError(f"--yield {yield_}: expected a number of hammers, 1 or more", key="--yield")
        drawn = opt.given(seed=seed, judged_by=judged_by)
        with job.counting("hammers") as tell:
            result = tolerance_yield(hammer, rate, number=yield_, progress=tell, **spreads, **drawn, **many)
        lines, bad = quality_report.tolerance_yield(result, units), []
    else:
        from printhammer.printing.rates.damping import damping_study

        with job.counting("materials") as tell:
            result = damping_study(hammer, progress=tell, **opt.given(current=current), **many)
        lines, bad = quality_report.damping(result, units), []
    return Answer(
        [lines],
        note=f"computed in {job.seconds:.2g} s",
        files={"out": Content.of(result)},
        complaints=bad,
    )


_TAKES: Final = {
    "report": {"rate", "pattern", "pulses", "pitch", "paper", "table", "serial", "feedback"},
    "safe-rate": {"table", "serial", "feedback", "first", "last", "step", "threads"},
    "yield": {"table", "serial", "rate", "spread", "judged_by", "seed", "first", "last", "step", "threads"},
    "damping": {"current", "first", "last", "step", "threads"},
}


def _only(task: str, options: set[str]) -> None:
    """Refuse options of another task."""

    def named(name: str) -> str:
        return "the report" if name == "report" else f"--{name}"

    odd = sorted(options - _TAKES[task])
    if odd:
        where = " or ".join(named(name) for name, takes in _TAKES.items() if odd[0] in takes)
        flag = odd[0].replace("_", "-")
        raise InputError(
            f"--{flag} is given, which belongs to {where}, not to {named(task)}", key=f"--{flag}"
        )


def _spreads(hammer: Hammer, texts: list[str]) -> dict[str, Any]:
    """Read spreads: one number for all constants, and others by key."""
    from printhammer.printing.rates.tolerance import spreads_of

    if not texts:
        return {}
    common = [written for written in texts if "=" not in written]
    if len(common) > 1:
        raise InputError(
            f"--spread {common[1]}: expected one spread of all constants, {common[0]} is given",
            key="--spread",
        )
    spreads = spreads_of(hammer, opt.read_share(common[0], "--spread")) if common else {}
    for written in texts:
        key, sign, value = written.partition("=")
        if sign:
            spreads[key.strip()] = opt.read_share(value, f"--spread {key.strip()}")
    return {"spreads": spreads}
