"""The verb `bifurcation`: the states at the firings against a parameter, windows, and the way into chaos."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape
from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, verb
from printhammer.cli.screen import Column, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.chaos.bifurcation.diagram import Bifurcation
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing

_RANGE: Final = ("0.8 ms", "1.35 ms")
_PARAMETER: Final = "Parameter (default: period from 0.8 ms to 1.35 ms)"
_ROWS: Final = 12
_JUDGED: Final = 200
"""Firings that are judged, where there are enough."""
_UNITS: Final = {"s": "ms", "m": "um"}
"""Units of values of the parameter that are not shown in SI."""
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
        raise InputError(
            f"--period and --rate: expected none of them where the {parameter} is changed", key="--period"
        )
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
    windows = [summary(result, name) for name in result.directions]
    return Answer(
        [*windows, *map(escape, sentences(result))] if done else [],
        note=f"{escape(result.parameter)}: {counted(result)}, {done} trains of"
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
        raise InputError(f"--from and --to: expected both of them for {parameter}, in {unit}", key="--from")
    low, high = (read_number(end, unit, name) for end, name in ((first, "--from"), (last, "--to")))
    if count < 2 or not low < high:
        raise InputError(
            f"--from {first}, --to {last} and --values {count}: expected the second to be the higher"
            " one, and at least 2 values",
            key="--from",
        )
    grid = np.linspace(low, high, count)
    if timed:
        return {f"{parameter}s": grid, **firing}
    return {"parameter": parameter, "values": grid, **firing}


def counted(result: Bifurcation) -> str:
    """Return how many values there are, and how many of them were put between those asked for."""
    between = int((result.levels > 0).sum())
    more = f" and {between} between those that differ" if between else ""
    return f"{len(result.values) - between} values{more}"


def shown_with(result: Bifurcation) -> tuple[Callable[[float], str], str]:
    """Return what writes values of the parameter, with digits that tell neighbours apart, and the unit."""
    import numpy as np

    from printhammer.units import from_si

    si = result.regime.quantity(result.parameter).si
    unit = _UNITS.get(si, si)
    steps = np.diff(result.values)
    ratio = float(np.abs(result.values).max() / steps.min()) if steps.size else 1e6
    digits = 1 + math.ceil(math.log10(max(ratio, 10.0)))
    return lambda value: f"{from_si(value, si, unit):.{digits}g}", unit


def summary(result: Bifurcation, direction: str) -> Table:
    """Return the verdicts of one direction: how many windows, how wide together, the widest one."""
    windows = result.windows(direction)
    total = sum(window.width for window in windows) or 1.0
    some = {
        verdict: [window for window in windows if window.verdict == verdict]
        for _period, verdict in sorted({(window.period or 1000, window.verdict) for window in windows})
    }
    shown, unit = shown_with(result)
    widest = {verdict: max(same, key=lambda window: window.width) for verdict, same in some.items()}
    columns: tuple[Column[str], ...] = (
        Column("verdict", lambda verdict: verdict.replace("-", " "), left=True),
        Column("windows", lambda verdict: len(some[verdict])),
        Column(
            "share", lambda verdict: 100.0 * sum(each.width for each in some[verdict]) / total, "", "%", ".2f"
        ),
        Column("widest from", lambda verdict: shown(widest[verdict].low), unit=unit),
        Column("to", lambda verdict: shown(widest[verdict].high), unit=unit),
    )
    return table(columns, some, title=direction, most=_ROWS)


def sentences(result: Bifurcation) -> list[str]:
    """Return what the diagram tells: routes to strange trains, hysteresis, why trains are undecided."""
    from printhammer.chaos.bifurcation.diagram import cells, hysteresis

    lines = [""]
    shown, unit = shown_with(result)
    several = len(result.directions) > 1
    for direction in result.directions:
        lines += [
            (f"{direction}: " if several else "") + route.worded(lambda value: f"{shown(value)} {unit}")
            for route in result.routes(direction)
        ]
    if several:
        widths = cells(result.values)
        share = float(widths[hysteresis(result)].sum() / (widths.sum() or 1.0))
        lines.append(f"Up and down lead to different attractors at {100.0 * share:.2f} % of the range.")
    return [*lines, *why_undecided(result)]


def why_undecided(result: Bifurcation) -> list[str]:
    """Return why trains that came to their end are undecided, a sentence for each reason."""
    import numpy as np

    from printhammer.chaos.strobe.verdict import SIGNIFICANT

    exponents, errors = result.exponents, result.standard_errors
    undecided = (result.verdicts == "undecided") & (result.status == "ok")
    known = undecided & np.isfinite(exponents)
    settling = known & (exponents < -SIGNIFICANT * errors)
    reasons = (
        (
            settling,
            "neighbouring motions approach each other: they still settle, more --firings show the period",
        ),
        (known & ~settling, "the exponent lies within three standard errors of zero"),
        (
            undecided & ~known,
            "no exponent was computed: --exponents does so, except where a touch grazes",
        ),
    )
    every = int(undecided.sum())
    return [f"{int(some.sum())} of {every} undecided trains: {why}." for some, why in reasons if some.any()]
