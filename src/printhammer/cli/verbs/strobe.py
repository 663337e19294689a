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
    "printhammer strobe hendriks-1983 --period '1.15 ms' --points 200 --out points.csv",
    {
        **opt.FIRED_TRAIN,
        "points": opt.whole("Number of strobe points, one per recorded firing.", default=200),
        "transient": opt.whole("Number of firings to discard before the first strobe point.", default=0),
        "phase": opt.number("Sampling phase after each firing, as a fraction of the period.", metavar="P"),
        "tolerance": opt.TOLERANCE,
        "verdict": opt.switch("Classify the motion from firings 1001 to 2000.", default=True),
    },
    out=opt.results("the strobe points"),
)
def strobe(job: Job, hammer: Hammer = opt.HAMMER, units: Units = opt.UNITS, **passed: Any) -> Answer:
    """Sample the state at each firing of a periodic drive; classify the motion as periodic or chaotic.

    The exit status is 1 if the run stopped early.
    """
    from printhammer.chaos import strobe as points_of

    firing = firing_of(job, hammer, passed)
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
        "longest": _search("Largest orbit period to search for, in firings.", default=8),
        "starts": _search("Number of initial states from which trajectories are followed.", default=1024),
        "guesses": _search("Number of initial guesses for Newton's method at each orbit period.", default=48),
        "follow": _search(
            "Largest period, in firings, of orbits to continue over a 5 % change of the drive period.",
            default=2,
        ),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("the orbits"),
)
def orbits(job: Job, hammer: Hammer = opt.HAMMER, units: Units = opt.UNITS, **passed: Any) -> Answer:
    """Search for periodic orbits, stable and unstable, and report their multipliers and dots.

    The exit status is 1 if no orbit is found.
    """
    from printhammer.chaos.orbits.search import orbits as search

    firing = firing_of(job, hammer, passed, 1.05e-3)
    with job.progress_bar("orbits", remaining=False) as tell:
        result = search(hammer, progress=tell, **firing, **passed)
    regime = result.regime
    missing = "no periodic orbit was found; more --starts or --guesses may find one"
    return Answer(
        render(result.summary(), units),
        note=train_line(regime.fired.shape, regime.fired.quantity, regime.overlap, regime.period),
        files={"out": Content.of(result)},
        complaints=[] if len(result) else [missing],
    )


_STEPS: Final = 100  # Default number of firing periods in a range; arbitrary
_TRAINS: Final = "Trains (--period, --rate, or --from and --to)"
_trains = partial(opt.text, panel=_TRAINS)


@verb(
    "lyapunov",
    "printhammer lyapunov hendriks-1983 --period '1.15 ms, 1.30 ms' --firings 300",
    {
        "overlap": opt.overlapping(_TRAINS),
        "drive": opt.source(
            "Drive file with a continuous periodic force or a pulse train, instead of --period or --rate.",
            panel=_TRAINS,
        ),
        "firings": opt.whole("Number of firings over which the exponents are averaged.", default=1000),
        "transient": opt.whole("Number of firings to discard before the average.", default=1000),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("the exponents"),
)
def lyapunov(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    period: str | None = _trains("TIMES", "Firing periods, e.g. '1.15 ms, 1.30 ms'."),
    rate: str | None = _trains("RATES", "Firings per second, e.g. '952 Hz'."),
    lowest: str | None = _trains(
        "TIME", "Lower end of a range of firing periods, e.g. '0.8 ms'.", flag="--from"
    ),
    highest: str | None = _trains("TIME", "Upper end of the range of firing periods.", flag="--to"),
    steps: int | None = opt.whole(
        f"Number of firing periods in the range (default: {_STEPS}).", panel=_TRAINS
    ),
    threads: int | None = opt.THREADS,
    **passed: Any,
) -> Answer:
    """Compute Lyapunov exponents with standard errors, the Lyapunov dimension, and the 0-1 test for chaos.

    The exit status is 1 if a run stopped early.
    """
    from printhammer.chaos import LyapunovChart, lyapunovs
    from printhammer.chaos import lyapunov as exponents_of

    if passed.get("drive") is None:
        firing = firing_of(job, hammer, passed, timed=False)
        periods = _periods(period, rate, lowest, highest, steps)
    else:
        more = {"period": period, "rate": rate, "from": lowest, "to": highest, "steps": steps}
        opt.check_unset(more, "--drive without this option")
        firing, periods = firing_of(job, hammer, passed), None
    if periods is None or len(periods) == 1:
        if periods is not None:
            firing["period"] = float(periods[0])
        single = exponents_of(hammer, **firing, **passed)
        chart, plot = LyapunovChart.of([single]), single.plot
        shown = render(single.summary())
    else:
        with job.progress_bar("trains") as tell:
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
    """Return the firing periods [s] selected by the options --period, --rate, or --from and --to."""
    import numpy as np

    from printhammer.drive.input import read_positive

    ranged = lowest is not None or highest is not None
    if sum((period is not None, rate is not None, ranged)) != 1:
        raise InputError(
            "--period, --rate, --from and --to: expected --period, --rate, or --from and --to", key="--period"
        )
    if not ranged:
        if steps is not None:
            raise InputError(f"--steps {steps}: expected --from and --to as well", key="--steps")
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
            f"--from {low:.9g} s and --to {high:.9g} s: expected --to above --from",
            key="--from",
        )
    if count < 2:
        raise InputError(f"--steps {steps}: expected at least 2", key="--steps")
    return np.linspace(low, high, count)
