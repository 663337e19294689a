"""The verb `tune`: a compensation table for the firmware, and what it gains and loses."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import Column, table
from printhammer.cli.verbs.printing.axis_tables import tuned_along
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.table.compensation import CompensationTable
    from printhammer.control.table.report import TableReport
    from printhammer.hammer.hammer import Hammer

_MOST_RATES: Final = 2000
_ROWS: Final = 12


@verb(
    "tune",
    "printhammer tune hendriks-1983 --rate 1.3kHz --history 2 --out table.csv --out table.h",
    {
        "rate": opt.text("RATE", "Slots per second, such as 1.3kHz (all rates)."),
        "rates": opt.rates_between("Several rates, such as '1.2 kHz, 1.4 kHz, 41'.", _MOST_RATES),
        "history": opt.whole("Gaps that a history holds, 1 to 4.", default=2),
        "reach": opt.whole("Longest gap that counts, slots.", default=2),
        "brake": opt.switch("Allow brake pulses.", default=True),
        "robust": opt.switch("Tune on hammers that differ a little as well."),
        "driver": opt.choice(
            "own|switch", "The hammer's own pulse, or that of a fast switch.", default="own"
        ),
        "largest_current": opt.text("CURRENT", "Bound on the current.", default="2 A"),
    },
    out=opt.results("Table", ".h"),
    report=opt.files(
        "Picture of gain and loss (.svg, .png, .pdf) or numbers (.nc, .csv, ...).", *opt.DATA, many=False
    ),
)
def tune(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    judge: bool = opt.switch("Judge the table beside open loop on what it was not tuned on.", default=True),
    tick: float | None = opt.quantity(
        "s", "TIME", "Tick of the timer, such as '1 us' (1 ns).", positive=True
    ),
    budget: int | None = opt.whole("Most bytes that the arrays of the C header may take."),
    along: str | None = opt.text(
        "AXIS LOW, HIGH, N",
        "Tables along rail, temperature (of the coil), gap or forms, such as 'rail 90 V, 110 V, 3'.",
    ),
    variability: bool = opt.switch("Choose for the spread of a production."),
    tolerance: float | None = opt.TOLERANCE,
    threads: int | None = opt.THREADS,
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Tune pulse width and advance as a function of the last gaps, so that every dot is like one from rest.

    Ends with status 1 where the table does not keep to the limits on the hammer it is made for.
    """
    from printhammer.control.table.report import judge_table
    from printhammer.control.table.tuning import tune as tuned

    if job.wanted["report"] and not judge:
        raise InputError(
            f"--report {job.wanted['report'][0]} is given", key="--report", expected="none beside --no-judge"
        )
    if "rate" in passed and "rates" in passed:
        raise InputError("--rate and --rates are given", key="--rate", expected="one of them")
    if variability:
        from printhammer.printing.rates.variability import Variability

        passed["variability"] = Variability.of(hammer)
    options = opt.given(tolerance=tolerance, threads=threads)
    if along is not None:
        if job.wanted["report"]:
            raise InputError(
                f"--report {job.wanted['report'][0]} is given", key="--report", expected="none beside --along"
            )
        return tuned_along(job, hammer, along, opt.given(tick=tick), budget, {**passed, **options}, units)
    with job.counting("tuning") as tell:
        made = tuned(hammer, progress=tell, **passed, **options)
    header = opt.given(tick=tick)
    if tick is not None:
        made = made.quantised(tick)
    made.to_header(budget=budget, **header)
    size = f", {made.size(**header)} bytes in a C header"
    job.show(entries(made, units), note=f"tuned in {job.seconds:.2g} s{size}")
    files = {"out": Content(partial(save_table, made, header), made.plot)}
    if not judge:
        return Answer(files=files)
    with job.counting("judging") as tell:
        report = judge_table(hammer, made, progress=tell, **options)
    files["report"] = Content.of(report)
    good = report.passed[1, 0]
    off = ", ".join(f"{each:g} Hz" for each in report.rates[~good].tolist())
    complaint = f"with the table not all dots are within the limits at {off}"
    return Answer(["", judged(report)], files=files, complaints=[] if good.all() else [complaint])


def save_table(made: CompensationTable, header: dict[str, Any], path: Path) -> None:
    """Write a table, a C header in ticks of the timer."""
    from printhammer.support.files import write_file

    if path.suffix.lower() == ".h":
        write_file(path, made.to_header(**header))
    else:
        made.save(path)


def entries(made: CompensationTable, units: Units) -> Table:
    """Return the entries at the highest rate, a row each."""
    from printhammer.control.table.drive import gap_text, histories, number_of

    def entry(name: str, history: tuple[int, ...]) -> float:
        return float(getattr(made, name)[-1, number_of(history, made.reach)])

    def brake(name: str, history: tuple[int, ...]) -> float | None:
        return entry(name, history) if entry("brake_width", history) > 0.0 else None

    columns: tuple[Column[tuple[int, ...]], ...] = (
        Column("gaps before", lambda history: "-".join(map(gap_text, history)), left=True),
        Column("advance", lambda history: entry("advance", history), "time"),
        Column("width", lambda history: entry("width", history), "time"),
        Column("brake after", lambda history: brake("brake_delay", history), "time"),
        Column("brake", lambda history: brake("brake_width", history), "time"),
        Column("worst,\nof the limits", lambda history: 100.0 * entry("deviation", history), "", "%", ".1f"),
    )
    low, high, count = made.rates[0], made.rates[-1], made.rates.size
    span = f"{low:g} Hz to {high:g} Hz, {count} rates, at " if count > 1 else ""
    every = histories(made.gaps, made.reach)
    return table(columns, every, units, title=f"Table for {span}{high:g} Hz", most=_ROWS)


def judged(report: TableReport) -> Table:
    """Return what the table gains and loses, a row a hammer."""
    rates = report.rates
    span = f"{rates[0]:g} Hz" if rates.size == 1 else f"{rates.min():g} Hz to {rates.max():g} Hz"
    share = 100.0 * report.good.mean(axis=(2, 3))
    lost = report.lost.sum(axis=(2, 3))
    columns: tuple[Column[int], ...] = (
        Column("hammer driven", lambda row: report.hammers[row], left=True),
        Column("open loop:\ngood dots", lambda row: f"{share[0, row]:.2f} %"),
        Column("lost", lambda row: lost[0, row], format=".0f"),
        Column("table:\ngood dots", lambda row: f"[bold]{share[1, row]:.2f} %[/bold]"),
        Column("lost", lambda row: lost[1, row], format=".0f"),
        Column("worst force", lambda row: f"{100.0 * report.force[1, row].max():.1f} %"),
        Column("worst arrival", lambda row: float(report.arrival[1, row].max()), "time"),
    )
    return table(columns, range(len(report.hammers)), title=f"On patterns it was not tuned on, {span}")
