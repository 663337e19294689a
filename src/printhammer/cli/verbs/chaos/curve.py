"""The verb `curve`: a fold, a period doubling or a grazing followed through a second constant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.console import RenderableType
from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, firing_of, verb
from printhammer.cli.screen import Column, multiplier, table
from printhammer.cli.verbs.chaos.continuation import both, read_state
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.chaos.curves.bifurcation_curve import BifurcationCurve
    from printhammer.hammer.hammer import Hammer

_START: Final = "Start"


def read_event(written: str, name: str) -> int | str:
    """Read the number or the kind of an event; InputError where it is neither."""
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
    "printhammer curve hendriks-1983 --rate '745 Hz' --from '740 Hz' --to '750 Hz'"
    " --second backstop.damping --second-from '3.6e10 N*s/m^2.5' --second-to '3.7e10 N*s/m^2.5'"
    " --out curve.png",
    {
        "most": opt.whole("Steps in either direction.", default=200),
        "overlap": opt.overlapping(),
        "drive": opt.DRIVE,
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("BifurcationCurve"),
)
def curve(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    parameter: str = opt.text("NAME", "First constant, see 'continue'.", default="rate"),
    lowest: str | None = opt.LOWEST,
    highest: str | None = opt.HIGHEST,
    second: str = opt.text("NAME", "Second constant, such as 'backstop.damping'.", default=...),
    second_from: str | None = opt.text("VALUE", "Its least value."),
    second_to: str | None = opt.text("VALUE", "Its largest value."),
    period: str | None = opt.PERIOD,
    rate: str | None = opt.RATE,
    firings: int | None = opt.whole("Firings after which the orbit repeats.", panel=_START),
    state: tuple[float, float] | None = opt.text(
        "X,V", "State near the orbit, such as '46.2 um, 12 mm/s'.", panel=_START, read=read_state
    ),
    phase: float = opt.number(
        "Part of the period between firing and section, from 0 to 1.", panel=_START, metavar="P", default=0.0
    ),
    event: int | str | None = opt.text(
        "EVENT",
        "Number of an event of the branch from 0 on, its kind, or 'first' or 'last' for an end in a grazing.",
        panel=_START,
        read=read_event,
    ),
    start: Path | None = opt.source(
        "A file with a branch or a curve instead, saved by 'continue' or 'curve'.", panel=_START
    ),
    grid: int = opt.whole("Values of either constant at which trains from rest are judged.", default=0),
    **passed: Any,
) -> Answer:
    """Follow a fold, a period doubling or a grazing of a periodic motion through the plane of two constants.

    Tells where the curve ends, and at which points more happens.
    """
    from printhammer.chaos.continuation.continuation import continuation
    from printhammer.chaos.curves.bifurcation_curve import bifurcation_curve
    from printhammer.chaos.curves.systems import check_two
    from printhammer.run.regime import Regime

    bounds = both(second_from, second_to, "--second-from", "--second-to", second)
    most = passed.pop("most")
    passed |= {"period": period, "rate": rate}
    firing = firing_of(job, hammer, passed, "--rate '745 Hz'")
    chosen: dict[str, Any] = {"event": event, "grid": (grid, grid), "most": most}
    if start is not None:
        if (firings, state) != (None, None):
            raise InputError(
                f"--start {start}: expected no --firings and no --state beside it", key="--start"
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
        with job.counting("orbits", remaining=False) as tell:
            branch = continuation(hammer, parameter, ends, progress=tell, **firing, **orbit, **passed)
        result = bifurcation_curve(branch, second, bounds, **chosen)
    return Answer(described(result), files={"out": Content.of(result)})


def described(result: BifurcationCurve) -> list[RenderableType]:
    """Return what the curve is, and its points of codimension two."""
    parts: list[RenderableType] = []
    if result.points:
        parts += [table(_columns(result), result.points), ""]
    return [*parts, escape(result.message)]


def _columns(result: BifurcationCurve) -> tuple[Column[Any], ...]:
    units = [unit if unit != "1" else "" for unit in result.units]
    return (
        Column(result.names[0], lambda point: point.first, unit=units[0], format=".9g"),
        Column(result.names[1], lambda point: point.second, unit=units[1], format=".9g"),
        Column("what happens", lambda point: point.message, left=True),
        Column("multipliers", lambda point: "  ".join(multiplier(complex(m)) for m in point.multipliers)),
    )
