"""The verb `bifurcation`: the states at the firings against a parameter, windows, and the way into chaos."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing

_RANGE: Final = ("0.8 ms", "1.35 ms")
_PARAMETER: Final = "Parameter (default: period from 0.8 ms to 1.35 ms)"
_JUDGED: Final = 200
"""Firings that are judged, where there are enough."""
_of = partial(opt.text, panel=_PARAMETER)


@verb(
    "bifurcation",
    "printhammer bifurcation hendriks-1983 --from '1.2 ms' --to '1.35 ms' --values 60"
    " --direction both --out bifurcation.png",
    {
        "transient": opt.whole("Firings left out at the beginning (all but 200; a third, if that is more)."),
        "refine": opt.whole("Halve the steps between neighbours that differ so often.", default=2),
        "overlap": opt.overlapping(_PARAMETER),
        "drive": opt.source("A drive file: a force without end, or pulses.", panel=_PARAMETER),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("States and verdicts"),
)
def bifurcation(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    parameter: str = _of("NAME", "period, rate, or any constant such as backstop.damping.", default="period"),
    lowest: str | None = opt.LOWEST,
    highest: str | None = opt.HIGHEST,
    values: int = opt.whole("Number of values.", panel=_PARAMETER, default=500),
    period: str | None = _of("TIME", "Time between firings, where another constant is changed."),
    rate: str | None = _of("RATE", "Firings per second, likewise."),
    direction: str = opt.choice(
        "from-rest|up|down|both",
        "Begin at rest (default), or where the train at the value before, or after, ended.",
        default="from-rest",
    ),
    firings: int = opt.whole("Firings at each value.", default=1000),
    exponents: bool = opt.switch("Tell strange trains from undecided ones by their exponents.", default=True),
    show: str = opt.choice("x|v", "What a picture shows.", default="x"),
    **passed: Any,
) -> Answer:
    """Fire trains at many values of a parameter and tell which are periodic, and what leads to chaos.

    Ends with status 1 where a run stopped before its end. Ctrl-C writes what is done.
    """
    from printhammer.chaos.bifurcation.bifurcation import InterruptedDiagram
    from printhammer.chaos.bifurcation.bifurcation import bifurcation as computed

    start: Any = direction.replace("-", " ")
    timed = parameter in ("period", "rate")
    if timed and (period is not None or rate is not None):
        raise InputError(f"--period and --rate: expected none of them where the {parameter} is changed")
    passed |= {"period": period, "rate": rate}
    firing = firing_of(job, hammer, passed, "--period '1.05 ms'", timed=not timed)
    if timed and "drive" not in firing:
        firing["period"] = None
    axis = _axis(hammer, parameter, (lowest, highest), values, firing)
    passed |= {"firings": firings, "exponents": exponents}
    # With few firings at first, trains that settle slowly pass for undecided.
    passed.setdefault("transient", max(firings - _JUDGED, firings // 3))
    interrupted = False
    try:
        with job.counting("trains") as tell:
            result = computed(hammer, progress=tell, direction=start, **axis, **passed)
    except InterruptedDiagram as interrupt:
        interrupted, result = True, interrupt.diagram
    done = int((result.status != "not run").sum())
    between = int((result.levels > 0).sum())
    more = f" and {between} between those that differ" if between else ""
    return Answer(
        render(result.summary()) if done else [],
        note=f"{escape(result.parameter)}: {len(result.values) - between} values{more}, {done} trains of"
        f" {int(result.firing[-1])} firings, tolerance {result.tolerance:g}; computed in {job.seconds:.2g} s",
        files={"out": Content.of(result, show=show)} if done else {},
        complaints=[] if interrupted else ended_early(result.status.ravel()),
        interrupted=interrupted,
    )


def _axis(
    hammer: Hammer,
    parameter: str,
    ends: tuple[str | None, str | None],
    count: int,
    firing: Firing,
) -> dict[str, Any]:
    """Return the parameter and its values as arguments of `printhammer.bifurcation`."""
    import numpy as np

    from printhammer.drive.input import read_number
    from printhammer.run.regime import Regime

    timed = parameter in ("period", "rate")
    forced = firing.get("drive") is not None
    at_first: Firing = {**firing, "period": _RANGE[0]} if timed and not forced else firing
    regime = Regime.of(hammer, **at_first)
    regime.value(parameter)
    unit = regime.quantity(parameter).si
    first, last = ends
    if parameter == "period" and not forced:
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
        return {f"{parameter}s": grid, **firing}
    return {"parameter": parameter, "values": grid, **firing}
