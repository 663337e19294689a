"""The verb `dead-time`: how long from switching on to impact, and which pulse gives the same blow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units, with_unit
from printhammer.cli.runner import Answer, Content, Job, ended_early, verb
from printhammer.cli.screen import Column, facts, table

if TYPE_CHECKING:
    from printhammer.control.dead_time import DeadTime
    from printhammer.hammer.hammer import Hammer

_ROWS = 24


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
    import numpy as np

    from printhammer.control.dead_time import dead_time as timed

    grid: dict[str, Any] = {
        "voltage": opt.between(voltage, "V", "--voltage"),
        "temperature": opt.between(temperature, "degC", "--temperature"),
    }
    with job.counting("fired") as tell:
        made = timed(hammer, progress=tell, **grid, **passed)
    none = np.isnan(made.width)
    shown: list[Any] = [facts(_said(made, units)), "", table(_columns(made), _pairs(made), units, most=_ROWS)]
    if none.any():
        reached = float(np.nanmin(made.strongest)) if np.isfinite(made.strongest).any() else 0.0
        many = f"{int(none.sum())} of {none.size} pairs of rail and temperature"
        shown.append(
            f"\n[yellow]No width gives the blow at {many}; {with_unit(reached, 'speed', units)} is the"
            " strongest that all of them reach: --blow.[/yellow]"
        )
    return Answer(shown, files={"out": Content.of(made)}, complaints=ended_early(made.status.ravel()))


def _pairs(made: DeadTime) -> list[tuple[int, int]]:
    return [(i, j) for i in range(made.voltage.size) for j in range(made.temperature.size)]


def _said(made: DeadTime, units: Units) -> list[tuple[str, str | None]]:
    own = (
        f"{with_unit(made.own_width, 'time', units)}, impact after {with_unit(made.own_time, 'time', units)}"
    )
    return [("own pulse", own), ("blow", with_unit(made.blow, "speed", units))]


def _columns(made: DeadTime) -> tuple[Column[tuple[int, int]], ...]:
    return (
        Column("rail", lambda at: made.voltage[at[0]], unit="V", format=".4g"),
        Column("coil", lambda at: made.temperature[at[1]], unit="°C", format="g"),
        Column("own pulse:\nimpact after", lambda at: float(made.time[at]), "time"),
        Column("speed", lambda at: float(made.speed[at]), "speed"),
        Column("heat", lambda at: float(made.heat[at]), "energy"),
        Column("same blow:\nwidth", lambda at: float(made.width[at]), "time"),
        Column("impact after", lambda at: float(made.width_time[at]), "time"),
        Column("heat", lambda at: float(made.width_heat[at]), "energy"),
    )
