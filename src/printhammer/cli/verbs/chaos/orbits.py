"""The verb `orbits`: the periodic motions of a train, stable and unstable."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, firing_of, verb
from printhammer.cli.screen import Column, multiplier, table, train_line

if TYPE_CHECKING:
    from printhammer.chaos.orbits.orbit import Orbit
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Regime

_STYLES: Final = {"stable": "green", "saddle": "cyan", "unstable": "magenta", "undecided": "yellow"}
_search = partial(opt.whole, panel="Search")


def _energy(name: str, orbit: Orbit) -> float | None:
    return None if orbit.energy is None else getattr(orbit.energy, name)


_COLUMNS: Final[tuple[Column[Orbit], ...]] = (
    Column("firings", lambda orbit: orbit.firings),
    Column("kind", lambda orbit: f"[{_STYLES[orbit.kind]}]{orbit.kind}[/{_STYLES[orbit.kind]}]", left=True),
    Column("multipliers", lambda orbit: "  ".join(map(multiplier, orbit.multipliers))),
    Column("backstop\ncontacts", lambda orbit: orbit.backstop_contacts),
    Column("dots", lambda orbit: orbit.printed),
    Column("lost", lambda orbit: orbit.lost),
    Column("coil work", partial(_energy, "coil_work"), "energy"),
    Column("pack loss", partial(_energy, "pack_loss"), "energy"),
    Column("backstop loss", partial(_energy, "backstop_loss"), "energy"),
)
_DRIVE_WORK: Final[Column[Orbit]] = Column("drive work", partial(_energy, "drive_work"), "energy")
_DAMPING_LOSS: Final[Column[Orbit]] = Column("damping loss", partial(_energy, "damping_loss"), "energy")


def columns_for(regime: Regime) -> tuple[Column[Orbit], ...]:
    """Return the columns of the table: the work of what drives the hammer, and the losses that it has."""
    force = regime.fired.quantity == "force"
    columns = tuple(_DRIVE_WORK if force and each.heading == "coil work" else each for each in _COLUMNS)
    return (*columns, _DAMPING_LOSS) if regime.hammer.damping is not None else columns


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
    shown: list[Table | str] = [table(columns_for(regime), result, units), ""] if len(result) else []
    missing = "no periodic orbit was found; more --starts or --guesses may find one"
    return Answer(
        [*shown, result.message],
        note=train_line(regime.fired.shape, regime.fired.quantity, regime.overlap, regime.period),
        files={"out": Content.of(result)},
        complaints=[] if len(result) else [missing],
    )
