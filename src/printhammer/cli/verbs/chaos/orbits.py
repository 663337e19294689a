"""The verb `orbits`: the periodic motions of a train, stable and unstable."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, firing_of, verb
from printhammer.cli.screen import render, train_line

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

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
