"""The verbs `dead-time`, `impact-time` and `duty`: timing of the impact, and heat in the coil."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, ended_early, load_hammer, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "dead-time",
    "printhammer dead-time impact-wire --voltage '36 V, 40 V, 2' --temperature '20 degC, 100 degC, 2'"
    " --out dead.csv --out dead.h",
    {
        "blow": opt.text(
            "SPEED",
            "Impact speed that the tabulated pulse widths produce (default: the speed at nominal voltage).",
        ),
        "tolerance": opt.TOLERANCE,
    },
    out=opt.results("the dead-time table", ".h"),
)
def dead_time(
    job: Job,
    hammer: Hammer = opt.FIRED,
    voltage: tuple[str, str, int] | None = opt.span(
        "Rail voltages of the table (default: nominal, 10 % below and above)."
    ),
    temperature: tuple[str, str, int] | None = opt.span(
        "Coil temperatures of the table (default: 20, 60, 100 degC)."
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Tabulate dead time (switch-on to impact) and pulse width against rail voltage and coil temperature.

    With the tabulated pulse widths, the impact speed is constant.
    """
    from printhammer.control.dead_time import dead_time as timed

    grid: dict[str, Any] = {
        "voltage": opt.between(voltage, "V", "--voltage"),
        "temperature": opt.between(temperature, "degC", "--temperature"),
    }
    with job.progress_bar("fired") as tell:
        made = timed(hammer, progress=tell, **grid, **passed)
    return Answer(
        render(made.summary(), units),
        files={"out": Content.of(made)},
        complaints=ended_early(made.status.ravel()),
    )


@verb(
    "impact-time",
    "printhammer impact-time impact-wire --noise '2 mA, 20 mA, 4' --sampling-rate '200 kHz, 1 MHz, 2'"
    " --bits 12 --out impact.svg",
    {
        "signal": opt.choice("current|voltage", "Signal of the coil to sample.", default="current"),
        "full_scale": opt.text(
            "VALUE", "Full scale of the A/D converter (default: 1.5 times the largest nominal sample)."
        ),
        "delay": opt.text("TIME", "Delay of the probe, e.g. '2 us' (default: none)."),
        "bandwidth": opt.text("FREQUENCY", "Bandwidth of the probe, e.g. '50 kHz' (default: unlimited)."),
        "known": opt.switch("Correct the estimates for the delay and bandwidth of the probe.", default=True),
        "dots": opt.whole(
            "Number of dots for each combination of noise, sampling rate and resolution.", default=50
        ),
        "seed": opt.whole("Seed for drawing the hammers and the noise.", default=0),
    },
    out=opt.results("the errors of the estimated impact times"),
)
def impact_time(
    job: Job,
    hammer: Hammer = opt.FIRED,
    noise: tuple[str, str, int] | None = opt.span(
        "Standard deviations of sample noise (default: 0.1, 0.3 and 1 % of the peak current, or of 10 V)."
    ),
    sampling_rate: tuple[str, str, int] | None = opt.span(
        "Sampling rates of the A/D converter (default: 1 MHz)."
    ),
    bits: list[str] | None = opt.text(
        "N", "Resolution of the A/D converter in bits (default: 12); repeatable.", many=True
    ),
    hammers: int = opt.whole("Number of hammers drawn from the production spread.", default=20),
    record: list[Path] | None = opt.source(
        "Record of one shot to analyse instead of simulated shots: columns time, and current or voltage;"
        " repeatable.",
        many=True,
    ),
    columns: str | None = opt.text(
        "COLUMNS",
        "Column numbers (from 1) of the records, e.g. 'time=1, current=2*-10 A/V' (default: from the file"
        " RECORD.toml beside a record, else from its heading).",
    ),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Estimate impact times from samples of the coil current or voltage, and report the estimation error."""
    from printhammer.control.impact_estimator import UNITS
    from printhammer.control.impact_time import impact_time as studied

    if columns is not None and not record:
        raise InputError.of("--columns", columns, "--columns together with --record only", written=columns)
    if record:
        from printhammer.control.recorded_impacts import recorded_impacts

        opt.check_unset(
            {"noise": noise, "sampling-rate": sampling_rate, "bits": bits}, "--record without this option"
        )
        probe = {name: passed[name] for name in ("signal", "delay", "bandwidth") if name in passed}
        impacts = recorded_impacts(hammer, record, columns=columns, **probe)
        return Answer(render(impacts.summary(), units), files={"out": Content.of(impacts)})
    grids: dict[str, Any] = {
        "noise": opt.between(noise, UNITS[passed.get("signal", "current")], "--noise"),
        "sampling_rate": opt.between(sampling_rate, "Hz", "--sampling-rate"),
        "bits": [opt.read_whole(each, "--bits") for each in bits or ()],
    }
    with job.progress_bar("sampled") as tell:
        study = studied(
            hammer,
            progress=tell,
            units=hammers,
            **{name: grid for name, grid in grids.items() if grid},
            **passed,
        )
    return Answer(render(study.summary(), units), files={"out": Content.of(study)})


_COIL: Final = "Coil"
_NEEDED: Final = ("thermal_resistance", "limit")


def _coil(si: str, metavar: str, what: str) -> Any:
    return opt.quantity(si, metavar, what, positive=True, panel=_COIL)


@verb(
    "duty",
    "printhammer duty --heat '4 mJ' --thermal-resistance '12 K/W' --limit '91 degC' --ambient '25 degC'"
    " --ambient '50 degC' --out duty.csv",
    {
        "thermal_resistance": _coil(
            "K/W",
            "K/W",
            "Thermal resistance from the winding to the air, or to the body in a two-mass model.",
        ),
        "thermal_capacity": _coil("J/K", "J/K", "Heat capacity of the winding; needed for burst times."),
        "body_resistance": _coil(
            "K/W", "K/W", "Thermal resistance from the body to the air, for a two-mass model."
        ),
        "body_capacity": _coil("J/K", "J/K", "Heat capacity of the body, for a two-mass model."),
        "limit": opt.quantity("degC", "TEMPERATURE", "Temperature limit of the winding.", panel=_COIL),
        "ambient": opt.text(
            "TEMPERATURE", "Temperature of the ambient air (default: 25 degC); repeatable.", many=True
        ),
        "burst": opt.text(
            "RATE",
            "Firing rate for which to compute the allowed burst length and duty cycle; repeatable.",
            many=True,
        ),
        "feed": opt.choice(
            "voltage|current|energy",
            "Quantity that the driver holds constant as the coil warms (default: voltage).",
        ),
    },
    out=opt.results("the allowed rates"),
)
def duty(
    hammer: str | None = opt.text(
        "HAMMER",
        "Hammer file, or name of a shipped hammer, that specifies the coil resistance; replaces --heat.",
        argument=True,
        is_input=True,
    ),
    heat: float | None = opt.quantity(
        "J",
        "ENERGY",
        "Heat dissipated in the coil per dot, with the winding at 20 degC, e.g. '4 mJ'.",
        positive=True,
    ),
    rates: Path | None = opt.source(
        "Manufacturer's table of permitted rates (.csv), from which the thermal limit is inferred."
    ),
    **passed: Any,
) -> Answer:
    """Compute the highest continuous dot rate at each ambient temperature, and the longest allowed bursts."""
    if rates is not None:
        from printhammer.control.thermal_limit import read_rates, thermal_limit
        from printhammer.errors import located

        opt.check_unset(
            {"heat": heat, **{name.replace("_", "-"): passed.get(name) for name in passed}},
            "--rates without this option",
        )
        if hammer is not None:
            raise InputError(
                f"{hammer} is given", key="HAMMER", value=hammer, expected="no hammer with --rates"
            )
        with located(str(rates)):
            behind = thermal_limit(**read_rates(rates))
        return Answer(render(behind.summary()), files={"out": Content.of(behind)})
    from printhammer.control.duty import thermal_duty

    if (hammer is None) == (heat is None):
        raise InputError("HAMMER and --heat: expected one of them, such as --heat '4 mJ'", key="HAMMER")
    for name in _NEEDED:
        if name not in passed:
            raise InputError(
                f"--{name.replace('_', '-')} is missing",
                key=name,
                expected="this option together with the heat of a dot",
            )
    fired = None if hammer is None else load_hammer(hammer, fired=True)
    source: Any = heat if fired is None else _heat(fired, passed)
    made = thermal_duty(source, **passed)
    return Answer(render(made.summary()), files={"out": Content.of(made)})


def _heat(hammer: Hammer, passed: dict[str, Any]) -> Any:
    """Return the heat of a hammer's coil, as an argument of `thermal_duty`.

    Raises InputError if `passed` contains the option --feed, since a hammer has its own driver.
    """
    from printhammer.control.duty import heat_of

    if "feed" in passed:
        raise InputError(
            "--feed is given",
            key="--feed",
            expected="--feed with --heat only, since a hammer has its own driver",
        )
    return heat_of(hammer)
