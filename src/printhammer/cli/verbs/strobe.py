"""The verbs `strobe`, `orbits` and `lyapunov`: states at the firings, periodic orbits, exponents."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, verb
from printhammer.cli.screen import render, train_line
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray


@verb(
    "strobe",
    "printhammer strobe hendriks-1983 --period '1.10 ms' --points 200 --out points.csv",
    {
        **opt.FIRED_TRAIN,
        "points": opt.whole("Number of points.", default=200),
        "transient": opt.whole("Firings left out before the first.", default=0),
        "phase": opt.number("Part of the period between a firing and its point, from 0 to 1.", metavar="P"),
        "tolerance": opt.TOLERANCE,
        "verdict": opt.switch("Judge firings 1001 to 2000.", default=True),
    },
    out=opt.results("Points"),
)
def strobe(job: Job, hammer: Hammer = opt.HAMMER, units: Units = opt.UNITS, **passed: Any) -> Answer:
    """Fire a hammer without end and tell what its state is at each firing: periodic, or strange.

    Ends with status 1 where the run stopped before its end.
    """
    from printhammer.chaos import strobe as points_of

    firing = firing_of(job, hammer, passed, "--period '1.10 ms'")
    result = points_of(hammer, **firing, **passed)
    drive = result.drive
    return Answer(
        render(result.summary(), units),
        note=train_line(drive.waveform.shape, drive.quantity, drive.overlap, result.period),
        files={"out": Content.of(result)},
        complaints=[] if result.ok else [f"the run ended early: {result.status}"],
    )


_search = partial(opt.whole, panel="Search")


@verb(
    "orbits",
    "printhammer orbits hendriks-1983 --period '1.05 ms' --longest 4 --out orbits.csv",
    {
        **opt.FIRED_TRAIN,
        "longest": _search("Most firings after which a motion repeats.", default=8),
        "starts": _search("States from which motions are followed.", default=1024),
        "guesses": _search("Guesses that are tried for each number of firings.", default=48),
        "follow": _search("Most firings of orbits through which branches are followed.", default=2),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("Orbits"),
)
def orbits(job: Job, hammer: Hammer = opt.HAMMER, units: Units = opt.UNITS, **passed: Any) -> Answer:
    """Search for the motions that repeat after some firings, stable or not, and tell what they do.

    Ends with status 1 where none was found.
    """
    from printhammer.chaos.orbits.search import orbits as search

    firing = firing_of(job, hammer, passed, "--period '1.05 ms'")
    with job.counting("orbits", remaining=False) as tell:
        result = search(hammer, progress=tell, **firing, **passed)
    regime = result.regime
    missing = "no periodic orbit was found; more --starts or --guesses may find one"
    return Answer(
        render(result.summary(), units),
        note=train_line(regime.fired.shape, regime.fired.quantity, regime.overlap, regime.period),
        files={"out": Content.of(result)},
        complaints=[] if len(result) else [missing],
    )


_STEPS: Final = 100
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
        shown = render(single.summary())
    else:
        with job.counting("trains") as tell:
            chart = lyapunovs(
                hammer, periods, overlap=firing.get("overlap"), threads=threads, progress=tell, **passed
            )
        plot = chart.plot
        shown = render(chart.summary())
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
