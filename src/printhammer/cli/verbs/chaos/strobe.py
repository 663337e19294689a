"""The verb `strobe`: the state at the moment of firing, and whether the train is periodic or strange."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, firing_of, verb
from printhammer.cli.screen import render, train_line

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "strobe",
    "printhammer strobe hendriks-1983 --period '1.10 ms' --points 200 --out points.csv",
    {
        **opt.FIRED_TRAIN,
        "points": opt.whole("Number of points.", default=200),
        "transient": opt.whole("Firings left out before the first.", default=0),
        "phase": opt.number("Part of the period between a firing and its point, from 0 to 1.", metavar="P"),
        "tolerance": opt.TOLERANCE,
        "verdict": opt.switch("Judge firings 1001 to 2000.", default=True),
    },
    out=opt.results("Points"),
)
def strobe(job: Job, hammer: Hammer = opt.HAMMER, units: Units = opt.UNITS, **passed: Any) -> Answer:
    """Fire a hammer without end and tell what its state is at each firing: periodic, or strange.

    Ends with status 1 where the run stopped before its end.
    """
    from printhammer.chaos import strobe as points_of

    firing = firing_of(job, hammer, passed, "--period '1.10 ms'")
    result = points_of(hammer, **firing, **passed)
    drive = result.drive
    return Answer(
        render(result.summary(), units),
        note=train_line(drive.waveform.shape, drive.quantity, drive.overlap, result.period),
        files={"out": Content.of(result)},
        complaints=[] if result.ok else [f"the run ended early: {result.status}"],
    )
