"""The verb `energy`: a burst of dots with least work, rest to rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units, with_unit
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import Column, facts, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.least_work.burst import LeastWork, SupplyCheck
    from printhammer.hammer.hammer import Hammer

_MOST_RATES: Final = 200


@verb(
    "energy",
    "printhammer energy hendriks-1983 --rate '1 kHz' --dots 2 --out burst.png",
    {
        "dots": opt.whole("Number of dots.", default=8),
        "force": opt.number("Least force in parts of that of the single pulse (0.9).", flag="--least-force"),
        "largest": opt.text("CURRENT", "Largest current of either sign, such as '2 A'.", default="2 A"),
        "slew": opt.number("Largest slope of the current, A/s (the hammer's own waveform's).", metavar="A/S"),
        "spacing": opt.text("TIME", "Time between nodes of the current, such as '50 us'."),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("Burst, as .csv its current as a sampled waveform"),
)
def energy(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    rate: str = opt.text("RATE", "Dots per second, such as '1.2 kHz'.", default="1 kHz"),
    rates: list[float] | None = opt.rates_between(
        "Bursts at several rates instead, such as '600 Hz, 1.8 kHz, 7'.", _MOST_RATES
    ),
    heat: bool = opt.switch("Make the squared current least instead of the positive work."),
    pulses: bool = opt.switch("Only pulses of the hammer, of times and widths that are sought."),
    supply: bool = opt.switch("Show as well how the burst fares with other currents, up to 3 %."),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Find the current that prints a burst with least work: the swing drive of the paper's discussion.

    Every dot has the force asked for, the hammer starts from rest and comes to rest again. Ends with status 1
    where a dot of the burst found is not adequate.
    """
    from printhammer.control.least_work.burst import least_work

    passed |= {"least": "heat" if heat else "positive work", "shape": "pulses" if pulses else "free"}
    current = any(path.suffix.lower() == ".csv" for path in job.outputs)
    if pulses and current:
        raise InputError("--pulses is given", key="--pulses", expected="no current (.csv) beside it")
    if rates is not None:
        if supply or current:
            raise InputError(
                "--rates is given", key="--rates", expected="neither --supply nor a current (.csv) beside it"
            )
        return _at_rates(job, hammer, rates, passed)
    with job.counting("dots planned") as tell:
        result = least_work(hammer, rate, progress=tell, **passed)
    shown: list[Table | str] = [facts(burst(result, units))]
    if supply:
        shown += ["", supplied(result.under_supply(), result.count, units)]
    short = result.adequate < result.count
    return Answer(
        shown,
        files={"out": Content.of(result)},
        complaints=[f"{result.adequate} of {result.count} dots are adequate"] if short else [],
    )


def burst(result: LeastWork, units: Units) -> list[tuple[str, str | None]]:
    """Return what the burst prints, and what it costs."""
    work, ledger = result.work, result.ledger
    weakest = (
        f", the weakest with {result.forces.min():.4f} of the single pulse's force" if result.contacts else ""
    )
    allowed = f"{result.slew:.4g} A/s allowed" if result.shape == "free" else "pulses of the hammer"
    return [
        ("dots", f"{result.adequate} of {result.count} adequate at {result.rate:.6g} Hz{weakest}"),
        ("current", f"at most {with_unit(result.drive.peak, 'current', units)}, {allowed}"),
        ("at rest", f"after {with_unit(result.rest_time, 'time', units)}"),
        ("absorbed by the pack", with_unit(ledger.pack_loss, "energy", units)),
        ("lost at the backstop", with_unit(ledger.backstop_loss, "energy", units)),
        (
            "net work W",
            (
                f"{with_unit(work.net, 'energy', units)}, [bold]{result.net_ratio:.4f}[/bold] of what the"
                f" pack absorbs; {result.single_ratio:.2f} with single pulses"
            ),
        ),
        (
            "positive work W+",
            (
                f"{with_unit(work.positive, 'energy', units)}, [bold]{result.positive_ratio:.4f}[/bold] of"
                f" it; no current does with less than {result.bound_ratio:.4f} for this force"
            ),
        ),
        ("heat of the coil", None if work.heat is None else with_unit(work.heat, "energy", units)),
        ("ledger", f"residual {ledger.residual / ledger.throughput:.1e} of the throughput"),
    ]


def supplied(result: SupplyCheck, count: int, units: Units) -> Table:
    """Return how the burst fares with other currents."""
    columns: tuple[Column[int], ...] = (
        Column("current", lambda row: f"{100.0 * result.changes[row]:+.1f} %"),
        Column("adequate dots", lambda row: f"{result.adequate[row]} of {count}"),
        Column("weakest force", lambda row: float(result.weakest[row]), format=".3f"),
        Column("late by", lambda row: float(result.spread[row]), "time"),
    )
    return table(columns, range(len(result.changes)), units)


def _at_rates(job: Job, hammer: Hammer, rates: list[float], options: dict[str, Any]) -> Answer:
    from printhammer.control.least_work.rates import FOUND, least_work_rates

    with job.counting("rates") as tell:
        result = least_work_rates(hammer, rates, progress=tell, **options)

    def ratio(values: Any, row: int) -> float | None:
        return float(values[row]) if result.status[row] == FOUND else None

    columns: tuple[Column[int], ...] = (
        Column("rate", lambda row: result.rates[row], unit="Hz", format=".6g"),
        Column("adequate dots", lambda row: f"{result.adequate[row]} of {result.count}"),
        Column("W", lambda row: ratio(result.net_ratio, row), format=".4f"),
        Column("W+", lambda row: ratio(result.positive_ratio, row), format=".4f"),
        Column("least W+", lambda row: ratio(result.bound_ratio, row), format=".4f"),
        Column("", lambda row: "" if result.status[row] == FOUND else str(result.status[row])),
    )
    missing = int((result.status != FOUND).sum())
    complaint = f"no current was found at {missing} of {result.status.size} rates"
    return Answer(
        [table(columns, range(len(rates)))],
        files={"out": Content.of(result)},
        complaints=[complaint] if missing else [],
    )
