"""The verbs `energy` and `feedback`: bursts of least work, and closed-loop drive."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, rate_text, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

_OFF: Final = 1e-3  # Relative change of the current at which the dots are always checked; arbitrary
_MOST_RATES: Final = 200  # Largest number of rates; each takes seconds to minutes; arbitrary


@verb(
    "energy",
    "printhammer energy hendriks-1983 --rate '1 kHz' --dots 2 --out burst.png",
    {
        "dots": opt.whole("Number of dots in the burst.", default=8),
        "force": opt.number(
            "Minimum peak force of a dot, relative to a single pulse (default: 0.9).",
            flag="--least-force",
        ),
        "largest": opt.text(
            "CURRENT",
            "Limit on the magnitude of the current (default: the hammer's peak current, but at least 2 A).",
        ),
        "slew": opt.number(
            "Limit on the slope of the current, A/s (default: steepest rise of the hammer's waveform).",
            metavar="A/S",
        ),
        "spacing": opt.text(
            "TIME",
            "Time between nodes of the current, e.g. '50 us' "
            "(default: 0.6 times the duration of the indentation by a single pulse).",
        ),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("the burst or, with .csv, its current as a sampled waveform"),
)
def energy(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    rate: str | None = opt.text(
        "RATE", "Dots per second, e.g. '1.2 kHz' (default: 1 kHz; lower for a slow device)."
    ),
    rates: list[float] | None = opt.rates_between(
        "Rates of several bursts, instead of --rate, e.g. '600 Hz, 1.8 kHz, 7'.", _MOST_RATES
    ),
    heat: bool = opt.switch("Minimise the coil heat instead of the positive work."),
    pulses: bool = opt.switch(
        "Use only pulses of the hammer's waveform, and optimise their firing times and widths."
    ),
    supply: bool = opt.switch(
        "Report the dots of the burst for a supply error, with all currents scaled by 0.97 to 1.03."
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Optimise the current of a burst for least work: the swing drive of the paper's discussion.

    Each dot reaches the required force; the hammer starts and ends at rest. The exit status is 1 if a dot
    fails to reach the force.
    """
    from printhammer.control.least_work.burst import least_work

    passed |= {"least": "heat" if heat else "positive work", "shape": "pulses" if pulses else "free"}
    current = any(path.suffix.lower() == ".csv" for path in job.outputs)
    if pulses and current:
        raise InputError(
            "--pulses is given", key="--pulses", expected="no output of the current (.csv) with --pulses"
        )
    if rates is not None:
        if supply or current:
            raise InputError(
                "--rates is given",
                key="--rates",
                expected="neither --supply nor a current (.csv) with --rates",
            )
        from printhammer.control.least_work.rates import FOUND, least_work_rates

        with job.progress_bar("rates") as tell:
            several = least_work_rates(hammer, rates, progress=tell, **passed)
        missing = int((several.status != FOUND).sum())
        complaint = f"no current was found at {missing} of {several.status.size} rates"
        return Answer(
            render(several.summary()),
            files={"out": Content.of(several)},
            complaints=[complaint] if missing else [],
        )
    with job.progress_bar("dots planned") as tell:
        result = least_work(hammer, rate or rate_text(hammer, 1000.0), progress=tell, **passed)
    shown = render(result.summary(), units)
    if supply:
        shown += ["", *render(job.worded(result.under_supply().summary(result.count)), units)]
    else:
        less, more = result.under_supply((-_OFF, _OFF)).adequate.tolist()
        shown.append(
            f"{less} and {more} of {result.count} dots adequate at {100.0 * _OFF:g} % less and more current"
        )
    short = result.adequate < result.count
    return Answer(
        shown,
        files={"out": Content.of(result)},
        complaints=[f"{result.adequate} of {result.count} dots are adequate"] if short else [],
    )


@verb(
    "feedback",
    "printhammer feedback hendriks-1983 --rate '1.6 kHz' --out feedback.png",
    {
        "current": opt.text(
            "CURRENT",
            "Limit on the magnitude of the current (default: the hammer's peak current, but at least 2 A).",
        ),
        "edge": opt.text(
            "TIME", "Time constant of the driver (default: decay time of the hammer's waveform)."
        ),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("the deviations of force and arrival time"),
    run=opt.files(
        "Output file for one run: a picture (.svg, .png, .pdf) or its drive (.toml); repeatable.",
        ".toml",
        panel="Run to show",
    ),
)
def feedback(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    rate: str | None = opt.text("RATE", "Dot slots per second (default: 1.6 kHz; lower for a slow device)."),
    noise: float | None = opt.number(
        "Standard deviation of a sensor sample, as a fraction of the travel to the pack (default: 0.01)."
    ),
    delay: float | None = opt.quantity("s", "TIME", "Delay of the position sensor (default: 20 us)."),
    interval: float | None = opt.quantity(
        "s", "TIME", "Sampling interval of the sensor (default: 2 us).", positive=True
    ),
    step: float | None = opt.number(
        "Quantisation step of the sensor, as a fraction of the travel to the pack (default: 1/1024)."
    ),
    seed: int | None = opt.whole("Seed of the sensor noise (default: 0)."),
    supply: float = opt.number("Current of the driven hammer, as a fraction of nominal.", default=1.0),
    travel: float | None = opt.quantity(
        "m", "LENGTH", "Additional distance from the driven hammer to its pack, e.g. '10 um' (default: 0)."
    ),
    beside: Path | None = opt.source(
        "Compensation table to compare with, made by `printhammer tune`.", flag="--table"
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Simulate all patterns of eight slots, and pairs of dots at a range of gaps, with position feedback.

    The exit status is 1 if, with feedback, a dot exceeds the limits on force and arrival time.
    """
    from printhammer.control.feedback.comparison import feedback as compared
    from printhammer.control.feedback.sensor import PositionSensor
    from printhammer.control.table.compensation import TableStrategy, load_table
    from printhammer.drive.file import save_drive
    from printhammer.drive.input import read_positive
    from printhammer.printing.rates.variability import Perturbation, perturbed

    if beside is not None:
        passed["beside"] = [TableStrategy(load_table(beside), hammer)]
    change = Perturbation(current=read_positive(supply, "1", "supply") - 1.0, travel=travel or 0.0)
    sensor = PositionSensor(**opt.given(noise=noise, delay=delay, interval=interval, step=step, seed=seed))
    driven = perturbed(hammer, change)
    with job.progress_bar("tables, closed loops") as tell:
        result = compared(
            hammer, rate or rate_text(hammer, 1600.0), driven=driven, sensor=sensor, progress=tell, **passed
        )
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
