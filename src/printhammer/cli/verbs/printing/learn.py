"""The verb `learn`: a compensation table that calibrates itself on a unit, from one number a dot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import Column, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.learning.learn import Learning
    from printhammer.hammer.hammer import Hammer

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
        [stages(result, units), constants(result, units)],
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


def stages(result: Learning, units: Units) -> Table:
    """Return what is printed at each stage, a row each."""
    import numpy as np

    def worst(values: Any) -> float:
        known = np.abs(values[np.isfinite(values)])
        return float(known.max()) if known.size else float("nan")

    columns: tuple[Column[int], ...] = (
        Column("test dots", lambda row: int(result.dots[row])),
        Column("printed with", lambda row: "table" if result.learned[row] else "open loop", left=True),
        Column("within limits", lambda row: f"{100.0 * result.share[row]:.1f} %"),
        Column("worst force", lambda row: f"{100.0 * worst(result.force_deviation[row]):.1f} %"),
        Column("worst arrival", lambda row: worst(result.arrival_deviation[row]), "time"),
    )
    title = f"Unit {result.table.serial} of {result.hammer.name} at {result.rate:g} Hz"
    return table(columns, range(result.dots.size), units, title=title)


def constants(result: Learning, units: Units) -> Table:
    """Return what is believed of the constants of the unit in the end, a row each."""
    nominal = [result.hammer.constants[name].si for name in result.constants]
    columns: tuple[Column[int], ...] = (
        Column("constant", lambda row: result.constants[row], left=True),
        Column("off by", lambda row: f"{100.0 * (result.believed[row] / nominal[row] - 1.0):+.2f} %"),
        Column("known to", lambda row: f"{100.0 * result.uncertainty[row] / abs(nominal[row]):.2f} %"),
    )
    title = f"Constants of unit {result.table.serial}, from its readings"
    return table(columns, range(len(result.constants)), units, title=title)
