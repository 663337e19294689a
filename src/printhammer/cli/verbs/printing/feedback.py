"""The verb `feedback`: a drive that sees the hammer, beside the open loop."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import render

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "feedback",
    "printhammer feedback hendriks-1983 --rate '1.6 kHz' --out feedback.png",
    {
        "current": opt.text("CURRENT", "Largest current of either sign, such as '2 A'.", default="2 A"),
        "edge": opt.text("TIME", "Time constant of the driver (the hammer's own decay)."),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("Deviations"),
    run=opt.files(
        "Picture of one run (.svg, .png, .pdf), or its drive (.toml); may be given repeatedly.",
        ".toml",
        panel="The run that is shown",
    ),
)
def feedback(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    rate: str = opt.text("RATE", "Slots per second.", default="1.6 kHz"),
    noise: float | None = opt.number("Noise of a sample, in parts of the way to the pack (0.01)."),
    delay: float | None = opt.quantity("s", "TIME", "Delay of the sensor ('20 us')."),
    interval: float | None = opt.quantity("s", "TIME", "Between samples ('2 us').", positive=True),
    step: float | None = opt.number("Quantisation, in parts of the way to the pack (1/1024)."),
    seed: int | None = opt.whole("Of the noise (0)."),
    supply: float = opt.number("Current of the hammer driven, in parts of the nominal one.", default=1.0),
    travel: float | None = opt.quantity(
        "m", "LENGTH", "By how much its pack lies farther away, such as '10 um' (0)."
    ),
    beside: Path | None = opt.source(
        "Compensation table to compare with, from `printhammer tune`.", flag="--table"
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Drive a hammer with feedback: all patterns of eight slots, and two dots at all distances.

    Ends with status 1 where a pattern is not printed within limits with feedback.
    """
    from printhammer.control.feedback.comparison import feedback as compared
    from printhammer.control.feedback.estimator.sensor import PositionSensor
    from printhammer.control.table.compensation import TableStrategy, load_table
    from printhammer.drive.file import save_drive
    from printhammer.drive.input import read_positive
    from printhammer.printing.rates.variability import Perturbation, perturbed

    if beside is not None:
        passed["beside"] = [TableStrategy(load_table(beside), hammer)]
    change = Perturbation(current=read_positive(supply, "1", "supply") - 1.0, travel=travel or 0.0)
    sensor = PositionSensor(**opt.given(noise=noise, delay=delay, interval=interval, step=step, seed=seed))
    driven = perturbed(hammer, change)
    with job.counting("tables, closed loops") as tell:
        result = compared(hammer, rate, driven=driven, sensor=sensor, progress=tell, **passed)
    bad, patterns = int((~result.passed[-1]).sum()), result.passed.shape[1]
    complaint = f"{bad} of {patterns} patterns are not printed within limits with feedback"
    return Answer(
        render(result.summary(), units),
        files={
            "out": Content.of(result),
            "run": Content(partial(save_drive, result.run.motion.drive), result.plot_run),
        },
        complaints=[complaint] if bad else [],
    )
