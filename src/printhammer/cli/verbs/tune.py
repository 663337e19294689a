"""The verbs `tune` and `learn`: compensation tables from the model, and from the dots of one unit."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, check_endings, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

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
    """Tune tables along an axis, such as 'rail 90 V, 110 V, 3'; `header` holds the tick, if any."""
    from printhammer.control.axes import tune_along

    axis, values = _read(along)
    if "rate" not in options or "rates" in options:
        raise InputError(
            "--along is given without --rate", key="--along", expected="one rate, such as --rate 1.3kHz"
        )
    check_endings(job.wanted["out"], (*opt.DATA, ".h"), "--out")
    with job.counting("tuning") as tell:
        made = tune_along(hammer, axis, values, progress=tell, **options)
    made = _told(job, made, header, budget, units)
    return Answer(files={"out": Content(lambda path: made.save(path, **header))})


def _told(job: Job, made: Any, header: dict[str, Any], budget: int | None, units: Units) -> Any:
    """Show a table, rounded to the tick if there is one, and return it; check that it keeps to the budget."""
    made = made.quantised(header["tick"]) if header else made
    made.to_header(budget=budget, **header)
    size = f", {made.size(**header)} bytes in a C header"
    job.show(*render(made.summary(), units), note=f"tuned in {job.seconds:.2g} s{size}")
    return made


def _read(written: str) -> tuple[str, list[float]]:
    """Read an axis and its values; InputError if it is none."""
    from printhammer.control.axes import AXES

    axis, _, rest = written.strip().partition(" ")
    if axis not in AXES:
        raise InputError(f"--along {written!r}: expected one of {', '.join(AXES)} first", key="--along")
    return axis, opt.between(opt.read_span(rest, f"--along {axis}"), AXES[axis].unit, f"--along {axis}")


_MOST_RATES: Final = 2000


@verb(
    "tune",
    "printhammer tune hendriks-1983 --rate 1.3kHz --history 2 --out table.csv --out table.h",
    {
        "rate": opt.text("RATE", "Slots per second, such as 1.3kHz (all rates)."),
        "rates": opt.rates_between("Several rates, such as '1.2 kHz, 1.4 kHz, 41'.", _MOST_RATES),
        "history": opt.whole("Gaps that a history holds, 1 to 4.", default=2),
        "reach": opt.whole("Longest gap that counts, slots.", default=2),
        "brake": opt.switch("Allow brake pulses.", default=True),
        "robust": opt.switch("Tune on hammers that differ a little as well."),
        "driver": opt.choice(
            "own|switch", "The hammer's own pulse, or that of a fast switch.", default="own"
        ),
        "largest_current": opt.text("CURRENT", "Bound on the current.", default="2 A"),
    },
    out=opt.results("Table", ".h"),
    report=opt.files(
        "Picture of gain and loss (.svg, .png, .pdf) or numbers (.nc, .csv, ...).", *opt.DATA, many=False
    ),
)
def tune(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    judge: bool = opt.switch("Judge the table beside open loop on what it was not tuned on.", default=True),
    tick: float | None = opt.quantity(
        "s", "TIME", "Tick of the timer, such as '1 us' (1 ns).", positive=True
    ),
    budget: int | None = opt.whole("Most bytes that the arrays of the C header may take."),
    along: str | None = opt.text(
        "AXIS LOW, HIGH, N",
        "Tables along rail, temperature (of the coil), gap or forms, such as 'rail 90 V, 110 V, 3'.",
    ),
    variability: bool = opt.switch("Choose for the spread of a production."),
    tolerance: float | None = opt.TOLERANCE,
    threads: int | None = opt.THREADS,
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Tune pulse width and advance as a function of the last gaps, so that every dot is like one from rest.

    Ends with status 1 where the table does not keep to the limits on the hammer it is made for.
    """
    from printhammer.control.table.report import judge_table
    from printhammer.control.table.tuning import tune as tuned

    if job.wanted["report"] and not judge:
        raise InputError(
            f"--report {job.wanted['report'][0]} is given", key="--report", expected="none beside --no-judge"
        )
    if "rate" in passed and "rates" in passed:
        raise InputError("--rate and --rates are given", key="--rate", expected="one of them")
    if variability:
        from printhammer.printing.rates.variability import Variability

        passed["variability"] = Variability.of(hammer)
    options = opt.given(tolerance=tolerance, threads=threads)
    if along is not None:
        if job.wanted["report"]:
            raise InputError(
                f"--report {job.wanted['report'][0]} is given", key="--report", expected="none beside --along"
            )
        return tuned_along(job, hammer, along, opt.given(tick=tick), budget, {**passed, **options}, units)
    with job.counting("tuning") as tell:
        made = tuned(hammer, progress=tell, **passed, **options)
    header = opt.given(tick=tick)
    made = _told(job, made, header, budget, units)
    files = {"out": Content(partial(save_table, made, header), made.plot)}
    if not judge:
        return Answer(files=files)
    with job.counting("judging") as tell:
        report = judge_table(hammer, made, progress=tell, **options)
    files["report"] = Content.of(report)
    good = report.passed[1, 0]
    off = ", ".join(f"{each:g} Hz" for each in report.rates[~good].tolist())
    complaint = f"with the table not all dots are within the limits at {off}"
    return Answer(
        ["", *render(report.summary(), units)], files=files, complaints=[] if good.all() else [complaint]
    )


def save_table(made: CompensationTable, header: dict[str, Any], path: Path) -> None:
    """Write a table, a C header in ticks of the timer."""
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
        "rate": opt.text("RATE", "Slots per second, such as 1.275kHz.", default="1.275 kHz"),
        "driver": opt.choice(
            "own|switch", "The hammer's own pulse, or that of a fast switch.", default="switch"
        ),
        "history": opt.whole("Gaps that a history holds, 1 to 4.", default=2),
        "reach": opt.whole("Longest gap that counts, slots.", default=2),
        "members": opt.whole("Simulated hammers on which the ladder is chosen.", default=400),
        "forgetting": opt.number("Part of the corrections that each stage takes back.", default=0.02),
        "doubt": opt.number("Share of hammers like the unit to which the table may do harm.", default=0.0),
        "serial": opt.text("TEXT", "Serial number of the unit.", default="unit"),
        "seed": opt.whole("Of the simulated hammers, and of the unit where none is given.", default=1983),
        "largest_current": opt.text("CURRENT", "Bound on the current.", default="2 A"),
        "threads": opt.THREADS,
    },
    out=opt.results("What is printed at each stage"),
    table=opt.files("The table that is learned (.csv, .json, .h, ...).", *opt.DATA, ".h", pictures=False),
)
def learn(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    unit: Path | None = opt.source("Hammer file of the unit that is driven (a random one)."),
    noise: float | None = opt.quantity("s", "TIME", "Of a time of impact ('5 us').", panel=_PANEL),
    signal: str | None = opt.choice(
        "current|voltage", "Take the time of impact from samples of the coil instead.", panel=_PANEL
    ),
    signal_noise: str | None = opt.text("VALUE", "Noise of such a sample ('5 mA', '50 mV').", panel=_PANEL),
    force_noise: float | None = opt.number(
        "Noise of a force, relative (forces are not measured).", panel=_PANEL
    ),
    colour: float | None = opt.number("Correlation of the noise from dot to dot (0).", panel=_PANEL),
    gain: float | None = opt.number("Error of the scale (0).", panel=_PANEL),
    missed: float | None = opt.number("Share of the impacts that are missed (0).", panel=_PANEL),
    false: float | None = opt.number("Share of false impacts (0).", panel=_PANEL),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Let a hammer that nobody has measured calibrate its compensation table while it prints test lines.

    Ends with status 1 where not all dots are within limits in the end.
    """
    from printhammer.control.learning.learn import learn as learned
    from printhammer.control.learning.sensor import ImpactSensor
    from printhammer.hammer.hammer import load

    readings = opt.given(noise=noise, force=force_noise, colour=colour, gain=gain, missed=missed, false=false)
    if signal is not None:
        opt.refuse({"noise": noise}, "none beside --signal, which has --signal-noise")
        readings |= _from_coil(job, hammer, signal, signal_noise)
    else:
        opt.refuse({"signal-noise": signal_noise}, "none without --signal")
    driven = None if unit is None else load(unit)
    with job.counting("learning") as tell:
        result = learned(hammer, driven, sensor=ImpactSensor(**readings), progress=tell, **passed)
    share = 100.0 * result.share[-1]
    complaint = f"{share:.1f} % of the dots are within limits in the end"
    return Answer(
        render(result.summary(), units),
        files={"out": Content.of(result), "table": Content.of(result.table)},
        complaints=[] if result.passed else [complaint],
    )


def _from_coil(job: Job, hammer: Hammer, signal: Any, noise: str | None) -> dict[str, float]:
    """Return what the time of impact from samples of the coil is like: noise, offset and share missed."""
    from dataclasses import asdict

    from printhammer.control.impact_time import impact_time

    if noise is None:
        raise InputError(
            "--signal-noise is missing",
            key="--signal-noise",
            expected="the noise of a sample, such as '5 mA' or '50 mV'",
        )
    with job.counting("sampling") as tell:
        study = impact_time(hammer, signal=signal, noise=[noise], dots=200, units=50, progress=tell)
    sensor = asdict(study.sensor())
    return {name: sensor[name] for name in ("noise", "offset", "missed") if sensor[name]}
