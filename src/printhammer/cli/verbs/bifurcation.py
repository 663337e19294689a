"""The verbs `bifurcation` and `basins`: attractors against a parameter, and their basins of attraction."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, period_text, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing

_RANGE: Final = (0.8e-3, 1.35e-3)  # Default range of periods for the paper's hammer, s; arbitrary
_PARAMETER: Final = "Parameter (default: period from 0.8 ms to 1.35 ms; longer for a slow device)"
_of = partial(opt.text, panel=_PARAMETER)


@verb(
    "bifurcation",
    "printhammer bifurcation hendriks-1983 --from '1.2 ms' --to '1.35 ms' --values 60"
    " --direction both --out bifurcation.png",
    {
        "transient": opt.whole(
            "Number of firings to discard at each value (default: all but the last 200, but at least a third"
            " of all firings)."
        ),
        "refine": opt.whole(
            "Number of times to halve the step where the classification of neighbouring motions differs.",
            default=2,
        ),
        "overlap": opt.overlapping(_PARAMETER),
        "drive": opt.source(
            "Drive file with a continuous periodic force or a pulse train.", panel=_PARAMETER
        ),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("the states at the firings and the classification"),
)
def bifurcation(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    parameter: str = _of(
        "NAME", "Name of the parameter: period, rate, or a constant, e.g. backstop.damping.", default="period"
    ),
    lowest: str | None = opt.LOWEST,
    highest: str | None = opt.HIGHEST,
    values: int = opt.whole("Number of parameter values.", panel=_PARAMETER, default=500),
    period: str | None = _of("TIME", "Time between firings, if the parameter is neither period nor rate."),
    rate: str | None = _of("RATE", "Firings per second, if the parameter is neither period nor rate."),
    direction: str = opt.choice(
        "from-rest|up|down|both",
        "Initial state of a train: rest, or the final state of the preceding train in order of rising (up) or"
        " falling (down) parameter.",
        default="from-rest",
    ),
    firings: int = opt.whole("Number of firings at each parameter value.", default=1000),
    exponents: bool = opt.switch(
        "Compute Lyapunov exponents, to separate strange (chaotic) from undecided motions.", default=True
    ),
    show: str = opt.choice("x|v", "Quantity on the vertical axis of the plot.", default="x"),
    **passed: Any,
) -> Answer:
    """Compute a bifurcation diagram: periodic and chaotic (strange) motions against a parameter.

    The exit status is 1 if a run stopped early. Ctrl-C stops the computation and saves the finished values.
    """
    from printhammer.chaos.bifurcation.bifurcation import InterruptedDiagram
    from printhammer.chaos.bifurcation.bifurcation import bifurcation as computed

    start: Any = direction.replace("-", " ")
    timed = parameter in ("period", "rate")
    if timed and (period is not None or rate is not None):
        raise InputError(
            f"--period and --rate: expected neither option where the {parameter} is varied",
            key="--period",
        )
    passed |= {"period": period, "rate": rate}
    firing = firing_of(job, hammer, passed, 1.05e-3, timed=not timed)
    if timed and "drive" not in firing:
        firing["period"] = None
    axis = _axis(hammer, parameter, (lowest, highest), values, firing)
    passed |= {"firings": firings, "exponents": exponents}
    interrupted = False
    try:
        with job.progress_bar("trains") as tell:
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
    hammer: Hammer, parameter: str, ends: tuple[str | None, str | None], count: int, firing: Firing
) -> dict[str, Any]:
    """Return the parameter's name and values as keyword arguments of `printhammer.bifurcation`."""
    import numpy as np

    from printhammer.drive.input import read_number
    from printhammer.run.regime import Regime

    timed = parameter in ("period", "rate")
    forced = firing.get("drive") is not None
    at_first: Firing = (
        {**firing, "period": period_text(hammer, _RANGE[0])} if timed and not forced else firing
    )
    regime = Regime.of(hammer, **at_first)
    regime.value(parameter)
    unit = regime.quantity(parameter).si
    first, last = ends
    if parameter == "period" and not forced:
        first, last = (end or period_text(hammer, of) for end, of in zip(ends, _RANGE, strict=True))
    if first is None or last is None:
        raise InputError(f"--from and --to: expected both of them for {parameter}, in {unit}", key="--from")
    low, high = (read_number(end, unit, name) for end, name in ((first, "--from"), (last, "--to")))
    if count < 2 or not low < high:
        raise InputError(
            f"--from {first}, --to {last} and --values {count}: expected --to above --from,"
            " and at least 2 values",
            key="--from",
        )
    grid = np.linspace(low, high, count)
    if timed:
        return {f"{parameter}s": grid, **firing}
    return {"parameter": parameter, "values": grid, **firing}


_BASINS: Final = "Basins"
_QUENCH: Final = "Quench map"
_count = partial(opt.whole, panel=_BASINS)


@verb(
    "basins",
    "printhammer basins hendriks-1983 --period '1.05 ms' --x '30 um, 260 um, 24'"
    " --v '-1 m/s, 1 m/s, 20' --out basins.png",
    {
        **opt.FIRED_TRAIN,
        "x": opt.span(
            "Displacement range and number of points, e.g. '30 um, 260 um, 128' (default: strobe window).",
            panel=_BASINS,
        ),
        "v": opt.span(
            "Velocity range and number of points, e.g. '-1 m/s, 1 m/s, 128' (default: strobe window).",
            panel=_BASINS,
        ),
        "firings": _count("Number of firings simulated between tests for an attractor (default: 200)."),
        "rounds": _count("Maximum number of tests for an attractor per grid cell (default: 20)."),
        "gaps": opt.span(
            "Range of gaps between the firings (default: '0.5 ms, 0.9 ms, 128'; longer for a slow device).",
            panel=_QUENCH,
        ),
        "widths": opt.span(
            "Range of the width of the second pulse (default: 128 values, 0.5 to 1.5 times the first width).",
            panel=_QUENCH,
        ),
        "tail": opt.text(
            "TIME",
            "Time after the second firing within which the armature must strike the pack"
            " (default: 1 ms; longer for a slow device).",
            panel=_QUENCH,
        ),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("the basins or the quench map"),
)
def basins(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    box: int | None = _count("Box size for the basin entropy, in cells per side (default: 4)."),
    saddles: int | None = _count(
        "Largest period, in firings, of the saddle orbits whose manifolds are drawn."
    ),
    quench: bool = opt.switch(
        "Map where the second of two pulses prints a dot, against gap and width, instead of basins.",
        panel=_QUENCH,
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Map the basins of attraction, or with --quench the second pulses that print no dot.

    The exit status is 1 if a run stopped early.
    """
    from printhammer.chaos.basins.basins import NO_STATE_STATUS
    from printhammer.chaos.basins.basins import basins as computed
    from printhammer.chaos.basins.quench import quench_map
    from printhammer.drive.input import read_count

    of_quench = {name: passed.get(name) for name in ("gaps", "widths", "tail")}
    if quench:
        of_basins = {name: passed.get(name) for name in ("period", "rate", "overlap", "drive", "x", "v")}
        more = {name: passed.get(name) for name in ("firings", "rounds")}
        opt.check_unset({**of_basins, **more, "box": box, "saddles": saddles}, "--quench without this option")
    else:
        opt.check_unset(of_quench, "this option only with --quench")
        firing = firing_of(job, hammer, passed, 1.05e-3, ", or --quench")
    if saddles is not None:
        read_count(saddles, "saddles")
    with job.progress_bar("cells") as tell:
        if quench:
            mapped = quench_map(hammer, progress=tell, **passed)
            status, content, summary = mapped.status, Content.of(mapped), mapped.summary()
        else:
            planes = computed(hammer, progress=tell, **firing, **passed)
            status, summary = planes.status, planes.summary(box)
            content = Content.of(planes)
    shown = render(summary, units)
    if saddles is not None:
        from printhammer.chaos.basins.saddles import saddle_manifolds

        with job.progress_bar("saddles") as tell:
            curves, hidden = saddle_manifolds(planes, saddles, progress=tell)
        shown.append(
            f"manifolds of {len(curves)} saddles drawn"
            + ("" if not hidden else f", {hidden} more are in the pack at the firing")
        )
        content = Content.of(planes, manifolds=curves)
    return Answer(
        shown,
        note=f"{status.size} cells, computed in {job.seconds:.2g} s",
        files={"out": content},
        complaints=ended_early(status[status != NO_STATE_STATUS], status.size),
    )
