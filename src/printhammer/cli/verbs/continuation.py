"""The verbs `continue` and `curve`: orbits followed in one parameter, bifurcations in two parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, firing_of, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.chaos.continuation.regimes import Branches
    from printhammer.hammer.hammer import Hammer

_START: Final = "Start"
_ALL: Final = "All regimes in the rate"
_CHART: Final = "Chart of two parameters"


def read_state(written: str, name: str) -> tuple[float, float]:
    """Parse a state, such as '46.2 um, 12 mm/s', as displacement [m] and velocity [m/s]."""
    from printhammer.drive.input import read_number

    parts = [part.strip() for part in written.split(",")]
    if len(parts) != 2:
        raise InputError(
            f"{name} {written!r}: expected displacement and velocity, such as '46.2 um, 12 mm/s'",
            key=name,
            value=written,
        )
    return read_number(parts[0], "m", name), read_number(parts[1], "m/s", name)


_FIRINGS: Final = opt.whole("Orbit period, in firings.", panel=_START)
_STATE: Final = opt.text(
    "X,V", "State (x, v) near the orbit, e.g. '46.2 um, 12 mm/s'.", panel=_START, read=read_state
)
_PHASE: Final = opt.number(
    "Phase of the Poincaré section after each firing, as a fraction of the period.",
    panel=_START,
    metavar="P",
    default=0.0,
)


@verb(
    "continue",
    "printhammer continue hendriks-1983 --period '1.3 ms' --parameter period"
    " --from '1.27 ms' --to '1.34 ms' --out branch.png",
    {
        "most": opt.whole("Maximum number of continuation steps in each direction.", default=1000),
        "overlap": opt.overlapping(),
        "drive": opt.DRIVE,
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("the branches"),
)
def continue_(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    parameter: str = opt.text(
        "NAME",
        "Continuation parameter: 'rate', 'period' or a constant, e.g. 'backstop.damping'.",
        default="rate",
    ),
    lowest: str | None = opt.LOWEST,
    highest: str | None = opt.HIGHEST,
    period: str | None = opt.PERIOD,
    rate: str | None = opt.RATE,
    firings: int | None = _FIRINGS,
    state: tuple[float, float] | None = _STATE,
    phase: float = _PHASE,
    doublings: int = opt.whole(
        "Number of generations of new branches to follow from period doublings and branch points.", default=0
    ),
    regimes: bool = opt.switch(
        "Search for orbits at several rates and continue all of them in the rate.", panel=_ALL
    ),
    longest: int = opt.whole("Largest orbit period to search for, in firings.", panel=_ALL, default=3),
    seeds: int = opt.whole("Number of rates at which orbits are searched for.", panel=_ALL, default=6),
    second: str | None = opt.text(
        "NAME", "Name of the second parameter, e.g. 'backstop.damping'.", panel=_CHART
    ),
    second_from: str | None = opt.text(
        "VALUE", "Lower bound of the second parameter, with its unit.", panel=_CHART
    ),
    second_to: str | None = opt.text(
        "VALUE", "Upper bound of the second parameter, with its unit.", panel=_CHART
    ),
    grid: int = opt.whole(
        "Number of grid values per parameter at which a train from rest is classified.",
        panel=_CHART,
        default=32,
    ),
    show: str = opt.choice(
        "v|x|flight_time|peak_force", "Quantity on the vertical axis of plots.", default="v"
    ),
    **passed: Any,
) -> Answer:
    """Continue a periodic orbit, stable or unstable, in a parameter; report why the branch ends.

    Ctrl-C stops the search and keeps the branches found so far. The exit status is 1 if no branch is found.
    """
    from printhammer.chaos.continuation.regimes import InterruptedBranches
    from printhammer.chaos.continuation.regimes import regimes as all_regimes
    from printhammer.chaos.curves.stability_chart import stability_chart
    from printhammer.run.regime import Regime

    bounds = both(lowest, highest, "--from", "--to", parameter)
    if regimes and (period, rate, firings, state, second) != (None,) * 5:
        raise InputError(
            "--regimes: expected no --period, --rate, --firings, --state or --second",
            key="--regimes",
        )
    if regimes and parameter != "rate":
        raise InputError(f"--parameter {parameter}: expected 'rate' with --regimes", key="--parameter")
    passed |= {"period": period, "rate": rate}
    firing = firing_of(job, hammer, passed, 1.3e-3, timed=not regimes)
    ends = None if second is None else both(second_from, second_to, "--second-from", "--second-to", second)
    interrupted = False
    try:
        if regimes:
            with job.progress_bar("regimes", remaining=False) as tell:
                fired = Regime.of(hammer, **firing) if "drive" in firing else hammer
                result = all_regimes(
                    fired,
                    bounds,
                    longest=longest,
                    seeds=seeds,
                    doublings=doublings,
                    waveform=firing.get("waveform"),
                    overlap=firing.get("overlap"),
                    progress=tell,
                    **passed,
                )
        else:
            start = {"firings": firings, "state": state, "phase": phase}
            result = _follow_orbit(job, hammer, parameter, bounds, doublings, **firing, **start, **passed)
    except InterruptedBranches as interrupt:
        interrupted, result = True, interrupt.branches
    job.show(*render(result.summary()))
    if second is not None and ends is not None and not interrupted:
        with job.progress_bar("curves", remaining=False) as tell:
            chart = stability_chart(result[0], second, ends, grid=(grid, grid), progress=tell)
        return Answer(["", *render(chart.summary())], files={"out": Content.of(chart)})
    known = len(result) and second is None
    nothing = "no branch was found; more --seeds or a larger --longest may find one"
    return Answer(
        files={"out": Content.of(result, show=show)} if known else {},
        complaints=[] if len(result) or interrupted else [nothing],
        interrupted=interrupted,
    )


def both(low: str | None, high: str | None, first: str, last: str, parameter: str) -> tuple[str, str]:
    """Check that both ends of a range are set; return both ends. `first` and `last` are their flags."""
    if low is None or high is None:
        raise InputError(
            f"{first if low is None else last} is missing",
            key=first if low is None else last,
            expected=f"the range of {parameter}",
        )
    return low, high


def _follow_orbit(
    job: Job, hammer: Hammer, parameter: str, bounds: tuple[str, str], levels: int, **options: Any
) -> Branches:
    from printhammer.chaos.continuation.continuation import continuation
    from printhammer.chaos.continuation.regimes import follow_doublings

    if levels < 0:
        raise InputError.of("doublings", levels, "a whole number from 0 on", written=str(levels))
    with job.progress_bar("orbits", remaining=False) as tell:
        branch = continuation(hammer, parameter, bounds, progress=tell, **options)
    return follow_doublings(branch, levels, most=options["most"])


def read_event(written: str, name: str) -> int | str:
    """Parse an event of a branch, given as its index, its kind, or "first" or "last"."""
    from printhammer.chaos.curves.starts import FIRST, LAST
    from printhammer.chaos.curves.systems import KINDS

    if written.strip().isdecimal():
        return int(written)
    if written not in (*KINDS, FIRST, LAST):
        raise InputError(
            f"{name} {written!r}: expected a number, {FIRST}, {LAST}, {' or '.join(KINDS)}",
            key=name,
            value=written,
        )
    return written


@verb(
    "curve",
    "printhammer curve hendriks-1983 --rate '730 Hz' --from '728 Hz' --to '737 Hz'"
    " --second backstop.damping --second-from '2.2e10 N*s/m^2.5' --second-to '2.3e10 N*s/m^2.5'"
    " --out curve.png",
    {
        "most": opt.whole("Maximum number of continuation steps in each direction.", default=200),
        "overlap": opt.overlapping(),
        "drive": opt.DRIVE,
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("the bifurcation curve"),
)
def curve(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    parameter: str = opt.text(
        "NAME", "Name of the first parameter: 'rate', 'period' or a constant of the hammer.", default="rate"
    ),
    lowest: str | None = opt.LOWEST,
    highest: str | None = opt.HIGHEST,
    second: str = opt.text("NAME", "Name of the second parameter, e.g. 'backstop.damping'.", default=...),
    second_from: str | None = opt.text("VALUE", "Lower bound of the second parameter, with its unit."),
    second_to: str | None = opt.text("VALUE", "Upper bound of the second parameter, with its unit."),
    period: str | None = opt.PERIOD,
    rate: str | None = opt.RATE,
    firings: int | None = _FIRINGS,
    state: tuple[float, float] | None = _STATE,
    phase: float = _PHASE,
    event: int | str | None = opt.text(
        "EVENT",
        "Event of the branch at which the curve starts: index (from 0), kind, or 'first' or 'last' for a"
        " grazing at an end of the branch.",
        panel=_START,
        read=read_event,
    ),
    start: Path | None = opt.source(
        "File of a branch or curve to start from, saved by 'continue' or 'curve'.", panel=_START
    ),
    grid: int = opt.whole(
        "Number of grid values per parameter at which a train from rest is classified.", default=0
    ),
    **passed: Any,
) -> Answer:
    """Continue a fold, period doubling or grazing of a periodic orbit in two parameters.

    Reports where the curve ends, and the codimension-two points on the curve.
    """
    from printhammer.chaos.continuation.continuation import continuation
    from printhammer.chaos.curves.bifurcation_curve import bifurcation_curve
    from printhammer.chaos.curves.systems import check_two
    from printhammer.run.regime import Regime

    bounds = both(second_from, second_to, "--second-from", "--second-to", second)
    most = passed.pop("most")
    passed |= {"period": period, "rate": rate}
    firing = firing_of(job, hammer, passed, 1.34e-3)
    chosen: dict[str, Any] = {"event": event, "grid": (grid, grid), "most": most}
    if start is not None:
        if (firings, state) != (None, None):
            raise InputError(
                f"--start {start}: expected neither --firings nor --state with --start", key="--start"
            )
        own = (
            None if lowest is None and highest is None else both(lowest, highest, "--from", "--to", parameter)
        )
        result = bifurcation_curve(
            start, second, bounds, regime=Regime.of(hammer, **firing), first=own, **chosen
        )
    else:
        ends = both(lowest, highest, "--from", "--to", parameter)
        check_two(parameter, second)
        orbit: dict[str, Any] = {"firings": firings, "state": state, "phase": phase}
        with job.progress_bar("orbits", remaining=False) as tell:
            branch = continuation(hammer, parameter, ends, progress=tell, **firing, **orbit, **passed)
        result = bifurcation_curve(branch, second, bounds, **chosen)
    return Answer(render(result.summary()), files={"out": Content.of(result)})
