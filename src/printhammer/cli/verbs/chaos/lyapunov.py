"""The verb `lyapunov`: how fast neighbouring motions part, and the 0-1 test as a second opinion."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, verb
from printhammer.cli.screen import Column, coloured, facts, table, train_line
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.chaos import Lyapunov, LyapunovChart
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_STEPS: Final = 100
_MOST_ROWS: Final = 40
_TRAINS: Final = "Trains (--period, --rate, or --from and --to)"
_trains = partial(opt.text, panel=_TRAINS)


@verb(
    "lyapunov",
    "printhammer lyapunov hendriks-1983 --period '1.10 ms, 1.30 ms' --firings 300",
    {
        "overlap": opt.overlapping(_TRAINS),
        "drive": opt.source("A drive file instead: a force without end, or pulses.", panel=_TRAINS),
        "firings": opt.whole("Firings over which growth is averaged.", default=1000),
        "transient": opt.whole("Firings left out before.", default=1000),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("Exponents"),
)
def lyapunov(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    period: str | None = _trains("TIMES", "Times between firings, such as '1.10 ms, 1.30 ms'."),
    rate: str | None = _trains("RATES", "Firings per second, such as '952 Hz'."),
    lowest: str | None = _trains(
        "TIME", "Shortest of many times between firings, such as '0.8 ms'.", flag="--from"
    ),
    highest: str | None = _trains("TIME", "Longest of them.", flag="--to"),
    steps: int | None = opt.whole(f"Number of them ({_STEPS}).", panel=_TRAINS),
    threads: int | None = opt.THREADS,
    **passed: Any,
) -> Answer:
    """Tell how fast neighbouring motions part: Lyapunov exponents with errors, dimension, and the 0-1 test.

    Ends with status 1 where a run stopped before its end.
    """
    from printhammer.chaos import LyapunovChart, lyapunovs
    from printhammer.chaos import lyapunov as exponents_of

    if passed.get("drive") is None:
        firing = firing_of(job, hammer, passed, timed=False)
        periods = _periods(period, rate, lowest, highest, steps)
    else:
        more = {"period": period, "rate": rate, "from": lowest, "to": highest, "steps": steps}
        opt.refuse(more, "none beside --drive")
        firing, periods = firing_of(job, hammer, passed), None
    if periods is None or len(periods) == 1:
        if periods is not None:
            firing["period"] = float(periods[0])
        single = exponents_of(hammer, **firing, **passed)
        chart, plot = LyapunovChart.of([single]), single.plot
        shown: list[Table | str] = [facts(summary(single))]
    else:
        with job.counting("trains") as tell:
            chart = lyapunovs(
                hammer, periods, overlap=firing.get("overlap"), threads=threads, progress=tell, **passed
            )
        plot = chart.plot
        shown = [table(_columns(chart), range(len(chart.period)), most=_MOST_ROWS)]
        shown += ["", tally(chart)]
    drive = chart.drive
    train = train_line(drive.waveform.shape, drive.quantity, drive.overlap)
    return Answer(
        shown,
        note=f"{train}; growth from firing {chart.first} to {chart.last}",
        files={"out": Content(chart.save, plot)},
        complaints=ended_early(chart.status),
    )


def _periods(
    period: str | None, rate: str | None, lowest: str | None, highest: str | None, steps: int | None
) -> FloatArray:
    """Return the times between firings, s."""
    import numpy as np

    from printhammer.drive.input import read_positive

    ranged = lowest is not None or highest is not None
    if sum((period is not None, rate is not None, ranged)) != 1:
        raise InputError(
            "--period, --rate, --from and --to: expected --period, --rate, or --from and --to", key="--period"
        )
    if not ranged:
        if steps is not None:
            raise InputError(f"--steps {steps}: expected --from and --to beside it", key="--steps")
        name, unit = ("--period", "s") if period is not None else ("--rate", "Hz")
        values = np.array(
            [read_positive(each.strip(), unit, name) for each in (period or rate or "").split(",")]
        )
        return values if unit == "s" else 1.0 / values
    if lowest is None or highest is None:
        missing = "--from" if lowest is None else "--to"
        raise InputError(f"{missing} is missing", key=missing, expected="both --from and --to")
    low, high = read_positive(lowest, "s", "--from"), read_positive(highest, "s", "--to")
    count = _STEPS if steps is None else steps
    if not high > low:
        raise InputError(
            f"--from {low:.9g} s and --to {high:.9g} s: expected the second to be the longer one",
            key="--from",
        )
    if count < 2:
        raise InputError(f"--steps {steps}: expected at least 2", key="--steps")
    return np.linspace(low, high, count)


def summary(result: Lyapunov) -> list[tuple[str, str | None]]:
    """Return what is known of one train."""
    rows: list[tuple[str, str | None]] = [("period", f"{result.period:.9g} s")]
    for k in (0, 1):
        each, second = float(result.exponents[k]), float(result.per_second[k])
        error = float(result.standard_errors[k])
        rows.append((f"exponent {k + 1}", f"{each:+.4g} ± {error:.2g} per firing, {second:+.4g} per second"))
    test = result.zero_one
    agree = {True: "agree", False: "[bold red]differ[/bold red]", None: "do not both decide"}
    kink = "the motion passes a touch without velocity, where it has no derivative"
    return [
        *rows,
        ("sum", f"{result.total:+.6g} ± {result.total_error:.2g} per firing"),
        ("dimension", _dimension(result.dimension, result.dimension_error)),
        ("0-1 test", "–" if test is None else f"{_named(test.verdict)}: {test.phrase}"),
        ("because", (test.reason or None) if test is not None else None),
        ("verdict", _named(result.verdict.name)),
        ("because", result.verdict.reason or None),
        ("both tests", agree[result.agree]),
        ("remark", None if result.smooth else kink),
    ]


def tally(chart: LyapunovChart) -> str:
    """Count in one line how often both tests agree."""
    pairs = list(zip(chart.growth, chart.zero_one, strict=True))
    agree = sum(growth == zero_one != "undecided" for growth, zero_one in pairs)
    open_cases = sum("undecided" in pair for pair in pairs)
    chaotic = sum(pair == ("chaotic", "chaotic") for pair in pairs)
    return (
        f"{len(pairs)} trains: both tests agree on {agree}, {chaotic} of them chaotic;"
        f" they differ on {len(pairs) - agree - open_cases}; on {open_cases} one of them is undecided"
    )


def _dimension(value: float, error: float) -> str:
    if math.isnan(value):
        return "–"
    return f"{value:.4g} ± {error:.1g}" if error else f"{value:.4g}"


def _named(verdict: str) -> str:
    return coloured(verdict != "undecided", verdict.replace("period-", "period "))


def _columns(chart: LyapunovChart) -> tuple[Column[int], ...]:
    def exponent(k: int, row: int) -> str:
        return f"{chart.exponents[row][k]:+.4g} ± {chart.standard_errors[row][k]:.2g}"

    return (
        Column("period", lambda row: 1e3 * chart.period[row], unit="ms", format=".6g"),
        Column("exponent 1", partial(exponent, 0), unit="1/firing"),
        Column("exponent 2", partial(exponent, 1), unit="1/firing"),
        Column(
            "dimension",
            lambda row: _dimension(float(chart.dimension[row]), float(chart.dimension_error[row])),
            left=True,
        ),
        Column("K", lambda row: round(float(chart.k[row]), 2) + 0.0, format=".2f"),
        Column("0-1 test", lambda row: _named(chart.zero_one[row]), left=True),
        Column("verdict", lambda row: _named(chart.verdict[row]), left=True),
    )
