"""The verb `strobe`: the state at the moment of firing, and whether the train is periodic or strange."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units, range_with_unit
from printhammer.cli.runner import Answer, Content, Job, firing_of, verb
from printhammer.cli.screen import facts, repeated, train_line

if TYPE_CHECKING:
    from printhammer.chaos import Strobe
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
        [facts(summary(result, units))],
        note=train_line(drive.waveform.shape, drive.quantity, drive.overlap, result.period),
        files={"out": Content.of(result)},
        complaints=[] if result.ok else [f"the run ended early: {result.status}"],
    )


def summary(result: Strobe, units: Units) -> list[tuple[str, str | None]]:
    """Return points and verdict."""
    import numpy as np

    known = np.isfinite(result.x)
    first, last = int(result.firing[0]), int(result.firing[-1])
    at = f", {result.phase:g} of a period later" if result.phase else ""
    rows: list[tuple[str, str | None]] = [
        ("points", f"{int(known.sum())}, at the firings {first} to {last}{at}"),
        ("displacement", range_with_unit(result.x[known], "length", units)),
        ("velocity", range_with_unit(result.v[known], "speed", units)),
    ]
    if result.current is not None:
        rows.append(("current", range_with_unit(result.current[known], "current", units)))
    judged = result.verdict
    if judged is None:
        return rows
    style = "yellow" if judged.name == "undecided" else "green"
    return [
        *rows,
        ("verdict", f"[bold {style}]{judged.name.replace('-', ' ')}[/bold {style}]"),
        ("because", judged.reason or None),
        *repeated("evidence", judged.phrases),
    ]
