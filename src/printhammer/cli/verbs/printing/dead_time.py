"""The verb `dead-time`: how long from switching on to impact, and which pulse gives the same blow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, ended_early, verb
from printhammer.cli.screen import render

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "dead-time",
    "printhammer dead-time impact-wire --voltage '36 V, 40 V, 2' --temperature '20 degC, 100 degC, 2'"
    " --out dead.csv --out dead.h",
    {
        "blow": opt.text("SPEED", "Speed of impact whose pulse is sought (that of the own rail)."),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("Table", ".h"),
)
def dead_time(
    job: Job,
    hammer: Hammer = opt.FIRED,
    voltage: tuple[str, str, int] | None = opt.span("Rails (own rail, 10 % less, 10 % more)."),
    temperature: tuple[str, str, int] | None = opt.span("Temperatures of the coil (20, 60, 100 degC)."),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Find the time from switching on to impact against rail and temperature, and pulses of the same blow."""
    from printhammer.control.dead_time import dead_time as timed

    grid: dict[str, Any] = {
        "voltage": opt.between(voltage, "V", "--voltage"),
        "temperature": opt.between(temperature, "degC", "--temperature"),
    }
    with job.counting("fired") as tell:
        made = timed(hammer, progress=tell, **grid, **passed)
    return Answer(
        render(made.summary(), units),
        files={"out": Content.of(made)},
        complaints=ended_early(made.status.ravel()),
    )
