"""The verbs `tune` and `learn`: compensation tables from the model, or from the dots of a real unit."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, check_endings, rate_text, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError, PrinthammerError

if TYPE_CHECKING:
    from printhammer.control.table.compensation import CompensationTable
    from printhammer.hammer.hammer import Hammer


def tuned_along(
    job: Job,
    hammer: Hammer,
    along: str,
    header: dict[str, Any],
    budget: int | None,
    options: dict[str, Any],
    units: Units,
) -> Answer:
    """Tune a table for each value of an axis, such as 'rail 90 V, 110 V, 3'; show and save the result.

    `header` holds the arguments for writing a C header, `budget` is the limit on the size of its arrays in
    bytes, and `options` are the options of the tuning.
    """
    from printhammer.control.axes import tune_along

    axis, values = _read(along)
    if "rate" not in options or "rates" in options:
        raise InputError(
            "--along without --rate",
            key="--along",
            expected=f"one rate, such as --rate {rate_text(hammer, 1300.0)!r}",
        )
    check_endings(job.wanted["out"], (*opt.DATA, ".h"), "--out")
    with job.progress_bar("tuning") as tell:
        made = tune_along(hammer, axis, values, progress=tell, **options)
    if header:
        made = made.quantised(header["tick"]).with_multipliers(hammer)
    _show_table(job, made, header, budget, units)
    return Answer(files={"out": Content(lambda path: made.save(path, **header))})


def _show_table(job: Job, made: Any, header: dict[str, Any], budget: int | None, units: Units) -> None:
    """Show the summary of a table; raise InputError if its arrays in a C header exceed `budget` bytes."""
    made.to_header(budget=budget, **header)
    size = f", {made.size(**header)} bytes in a C header"
    job.show(*render(job.worded(made.summary()), units), note=f"tuned in {job.seconds:.2g} s{size}")


def _read(written: str) -> tuple[str, list[float]]:
    """Parse an axis and its values, such as 'rail 90 V, 110 V, 3'."""
    from printhammer.control.axes import AXES

    axis, _, rest = written.strip().partition(" ")
    if axis not in AXES:
        raise InputError(f"--along {written!r}: expected one of {', '.join(AXES)} first", key="--along")
    return axis, opt.between(opt.read_span(rest, f"--along {axis}"), AXES[axis].unit, f"--along {axis}")


_MOST_RATES: Final = 2000  # Largest number of rates of a table; arbitrary


@verb(
    "tune",
    "printhammer tune hendriks-1983 --rate 1.3kHz --history 2 --out table.csv --out table.h",
    {
        "rate": opt.text(
            "RATE",
            "Dot slots per second, e.g. 1.3kHz (default: a grid up to the highest usable rate).",
        ),
        "rates": opt.rates_between(
            "Rates of the table, instead of --rate, e.g. '1.2 kHz, 1.4 kHz, 41'.", _MOST_RATES
        ),
        "history": opt.whole("Number of preceding gaps that select a table entry, 1 to 4.", default=2),
        "reach": opt.whole(
            "Longest gap that is distinguished, in slots; longer gaps count as rest.", default=2
        ),
        "brake": opt.switch("Allow brake pulses.", default=True),
        "robust": opt.switch(
            "Minimise the mean square deviation of the dots over the nominal and perturbed hammers."
        ),
        "driver": opt.choice(
            "own|switch",
            "Driver of the coil: as in the hammer file (own), or a fast unipolar driver (switch).",
            default="own",
        ),
        "largest_current": opt.text(
            "CURRENT", "Limit on the current (default: the hammer's peak current, but at least 2 A)."
        ),
    },
    out=opt.results("the compensation table", ".h"),
    report=opt.files(
        "Output file for the validation report: a picture (.svg, .png, .pdf) or data (.nc, .csv, ...).",
        *opt.DATA,
        many=False,
    ),
)
def tune(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    judge: bool = opt.switch(
        "Validate the table against open loop on patterns that the tuning did not use.", default=True
    ),
    tick: float | None = opt.quantity(
        "s", "TIME", "Tick of the firmware timer, e.g. '1 us' (default: 1 ns).", positive=True
    ),
    budget: int | None = opt.whole("Maximum size of the arrays in the C header, in bytes."),
    along: str | None = opt.text(
        "AXIS LOW, HIGH, N",
        "Additional axis of the table: name, lower bound, upper bound and number of values, e.g. 'rail 90 V,"
        " 110 V, 3'. Names: rail (voltage), temperature (of the coil), gap (increase of the distance to the"
        " pack), forms (relative change of the pack thickness).",
    ),
    variability: bool = opt.switch(
        "Minimise the RMS deviation of the dots over the production spread of the constants."
    ),
    tolerance: float | None = opt.TOLERANCE,
    threads: int | None = opt.THREADS,
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Tune pulse width and advance for each history of gaps, so that every dot matches a dot from rest.

    The exit status is 1 if the table exceeds the limits on the hammer for which it was tuned.
    """
    from printhammer.control.table.multipliers import with_multipliers
    from printhammer.control.table.report import judge_table
    from printhammer.control.table.tuning import tune as tuned

    if job.wanted["report"] and not judge:
        raise InputError(
            f"--report {job.wanted['report'][0]} is given",
            key="--report",
            expected="no report with --no-judge",
        )
    if "rate" in passed and "rates" in passed:
        raise InputError("--rate and --rates", key="--rate", expected="one of them")
    if variability:
        from printhammer.printing.rates.variability import Variability

        passed["variability"] = Variability.of(hammer)
    options = opt.given(tolerance=tolerance, threads=threads)
    if along is not None:
        if job.wanted["report"]:
            raise InputError(
                f"--report {job.wanted['report'][0]} is given",
                key="--report",
                expected="no report with --along",
            )
        return tuned_along(job, hammer, along, opt.given(tick=tick), budget, {**passed, **options}, units)
    with job.progress_bar("tuning") as tell:
        made = tuned(hammer, progress=tell, **passed, **options)
    header = opt.given(tick=tick)
    if tick is not None:
        made = with_multipliers(made.quantised(tick), hammer, **options)
    _show_table(job, made, header, budget, units)
    files = {"out": Content(partial(save_table, made, header), made.plot)}
    if not judge:
        return Answer(files=files)
    try:
        with job.progress_bar("judging") as tell:
            report = judge_table(hammer, made, progress=tell, **options)
    except PrinthammerError as error:
        # Tuning may take hours: the table is written even if its evaluation fails.
        return Answer(files=files, complaints=[f"the table is not validated: {error}"])
    files["report"] = Content.of(report)
    good = report.passed[1, 0]
    off = ", ".join(f"{each:g} Hz" for each in report.rates[~good].tolist())
    complaint = f"with the table some dots are beyond the limits, or rows are unstable, at {off}"
    return Answer(
        ["", *render(report.summary(), units)], files=files, complaints=[] if good.all() else [complaint]
    )


def save_table(made: CompensationTable, header: dict[str, Any], path: Path) -> None:
    """Write the table to a file; a C header states times in ticks of the timer.

    `header` holds the arguments for writing a C header, such as the tick.
    """
    from printhammer.support.files import write_file

    if path.suffix.lower() == ".h":
        write_file(path, made.to_header(**header))
    else:
        made.save(path)


_PANEL: Final = "The sensor"


@verb(
    "learn",
    "printhammer learn hendriks-1983 --rate 1.275kHz --force-noise 0.03 --serial A17 --table learned.json",
    {
        "rate": opt.text(
            "RATE",
            "Dot slots per second (default: 1.275 kHz; lower for a slow device, but high enough that its"
            " pulses interact).",
        ),
        "driver": opt.choice(
            "own|switch",
            "Driver of the coil: as in the hammer file (own), or a fast unipolar driver (switch);"
            " default: own if the hammer has a voltage driver, else switch.",
        ),
        "history": opt.whole("Number of preceding gaps that select a table entry, 1 to 4.", default=2),
        "reach": opt.whole(
            "Longest gap that is distinguished, in slots; longer gaps count as rest.", default=2
        ),
        "members": opt.whole(
            "Number of simulated hammers used to select the sequence of test lines.", default=400
        ),
        "forgetting": opt.number("Fraction of the earlier corrections that each stage undoes.", default=0.02),
        "doubt": opt.number(
            "Maximum fraction of posterior samples that may print fewer dots with the table than in open"
            " loop.",
            default=0.0,
        ),
        "serial": opt.text("TEXT", "Serial number of the calibrated unit.", default="unit"),
        "seed": opt.whole(
            "Seed for the simulated hammers, and for the test unit if --unit is not given.", default=1983
        ),
        "largest_current": opt.text(
            "CURRENT", "Limit on the current (default: the hammer's peak current, but at least 2 A)."
        ),
        "threads": opt.THREADS,
    },
    out=opt.results("the dots printed at each stage"),
    table=opt.files(
        "Output file for the learned compensation table (.csv, .json, .h, ...).",
        *opt.DATA,
        ".h",
        pictures=False,
    ),
    believed=opt.file("Output hammer file with the estimated constants of the unit (.toml).", ".toml"),
)
def learn(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    unit: Path | None = opt.source("Hammer file of the driven unit (default: drawn at random)."),
    noise: float | None = opt.quantity(
        "s", "TIME", "Standard deviation of the impact-time sensor (default: 5 us).", panel=_PANEL
    ),
    signal: str | None = opt.choice(
        "current|voltage",
        "Signal from which to estimate the impact time: samples of coil current or voltage (default: an"
        " impact-time sensor).",
        panel=_PANEL,
    ),
    signal_noise: str | None = opt.text(
        "VALUE",
        "Standard deviation of the noise of coil current or voltage samples, e.g. '5 mA' or '50 mV'.",
        panel=_PANEL,
    ),
    force_noise: float | None = opt.number(
        "Relative standard deviation of measured forces (default: forces are not measured).", panel=_PANEL
    ),
    colour: float | None = opt.number(
        "Correlation of the noise of successive dots (default: 0).", panel=_PANEL
    ),
    gain: float | None = opt.number("Relative scale error of the sensor (default: 0).", panel=_PANEL),
    offset: float | None = opt.quantity(
        "s",
        "TIME",
        "Time offset of the sensor, unknown to the learner (default: 0).",
        panel=_PANEL,
    ),
    offset_spread: float | None = opt.quantity(
        "s",
        "TIME",
        "Unit-to-unit standard deviation of the sensor's time offset (default: none simulated; the learner"
        " assumes 25 us).",
        panel=_PANEL,
    ),
    missed: float | None = opt.number(
        "Fraction of impacts that the sensor misses (default: 0).", panel=_PANEL
    ),
    false: float | None = opt.number(
        "Fraction of impacts preceded by a false detection (default: 0).", panel=_PANEL
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Learn the compensation table of a unit from the impact times of its test lines.

    The exit status is 1 if the readings suggest that the unit still prints dots beyond the limits after
    learning.
    """
    import numpy as np

    from printhammer.control.learning.learn import learn as learned
    from printhammer.control.learning.sensor import ImpactSensor
    from printhammer.hammer.hammer import load

    readings = opt.given(
        noise=noise,
        force=force_noise,
        colour=colour,
        gain=gain,
        missed=missed,
        false=false,
        delay=offset,
        offset=offset_spread,
    )
    if signal is not None:
        own = {"noise": noise, "offset-spread": offset_spread}
        opt.check_unset(own, "--signal-noise instead, since --signal is set")
        readings |= _from_coil(job, hammer, signal, signal_noise)
    else:
        opt.check_unset({"signal-noise": signal_noise}, "this option only with --signal")
    driven = None if unit is None else load(unit)
    with job.progress_bar("learning") as tell:
        result = learned(hammer, driven, sensor=ImpactSensor(**readings), progress=tell, **passed)
    likely = 100.0 * result.certainty[-1]
    if np.isnan(likely):
        complaint = f"no simulated hammer explains the readings: misfit {result.misfit[-1]:.2f}"
    else:
        complaint = (
            f"{likely:.0f} % of the posterior samples print every dot within the limits after learning"
        )

    def believed(path: Path) -> None:
        result.believed_hammer.save(path)

    return Answer(
        render(result.summary(), units),
        files={
            "out": Content.of(result),
            "table": Content.of(result.table),
            "believed": Content(believed),
        },
        complaints=[] if result.passed else [complaint],
    )


def _from_coil(job: Job, hammer: Hammer, signal: Any, noise: str | None) -> dict[str, float]:
    """Compute the errors of impact times estimated from coil samples: noise, offset, fraction missed.

    The result contains the nonzero errors, as keywords of `ImpactSensor`; `noise` is that of a coil sample.
    """
    from dataclasses import asdict

    from printhammer.control.impact_time import impact_time

    if noise is None:
        raise InputError(
            "--signal-noise is missing",
            key="--signal-noise",
            expected="the noise of a sample, such as '5 mA' or '50 mV'",
        )
    with job.progress_bar("sampling") as tell:
        study = impact_time(hammer, signal=signal, noise=[noise], dots=200, units=50, progress=tell)
    sensor = asdict(study.sensor())
    return {name: sensor[name] for name in ("noise", "offset", "missed") if sensor[name]}
