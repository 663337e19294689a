"""The verb `duty`: how many dots a second a coil stands without getting too hot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, load_hammer, verb
from printhammer.cli.screen import Column, facts, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.duty import ThermalDuty
    from printhammer.control.thermal_limit import ThermalLimit

_COIL: Final = "Coil"
_NEEDED: Final = ("thermal_resistance", "limit")


def _coil(si: str, metavar: str, what: str) -> Any:
    return opt.quantity(si, metavar, what, positive=True, panel=_COIL)


@verb(
    "duty",
    "printhammer duty --heat '4 mJ' --thermal-resistance '12 K/W' --limit '91 degC' --ambient '25 degC'"
    " --ambient '50 degC' --out duty.csv",
    {
        "thermal_resistance": _coil("K/W", "K/W", "From the winding to the ambient air, or the body."),
        "thermal_capacity": _coil("J/K", "J/K", "Heat capacity of the winding, for times."),
        "body_resistance": _coil("K/W", "K/W", "From the body to the ambient air, of two masses."),
        "body_capacity": _coil("J/K", "J/K", "Heat capacity of the body."),
        "limit": opt.quantity("degC", "TEMPERATURE", "Largest temperature of the winding.", panel=_COIL),
        "ambient": opt.text("TEMPERATURE", "Of the ambient air (25 degC); repeatedly.", many=True),
        "burst": opt.text("RATE", "How long and how often this rate is allowed; repeatedly.", many=True),
        "feed": opt.choice("voltage|current|energy", "What a driver keeps in a warm coil (voltage)."),
    },
    out=opt.results("Rates"),
)
def duty(
    hammer: str | None = opt.text(
        "HAMMER", "A hammer whose coil has a resistance, instead of --heat.", argument=True, is_input=True
    ),
    heat: float | None = opt.quantity(
        "J", "ENERGY", "Heat of one dot with the winding at 20 degC.", positive=True
    ),
    rates: Path | None = opt.source("Rates that a maker allows (.csv): tell the limit behind them instead."),
    **passed: Any,
) -> Answer:
    """Find the largest rate that a coil stands at an ambient temperature, and what faster bursts may last."""
    if rates is not None:
        from printhammer.control.thermal_limit import read_rates, thermal_limit
        from printhammer.errors import located

        opt.refuse(
            {"heat": heat, **{name.replace("_", "-"): passed.get(name) for name in passed}},
            "none beside --rates",
        )
        if hammer is not None:
            raise InputError(
                f"{hammer} is given", key="HAMMER", value=hammer, expected="no hammer beside --rates"
            )
        with located(str(rates)):
            behind = thermal_limit(**read_rates(rates))
        return Answer(limit_shown(behind), files={"out": Content.of(behind)})
    from printhammer.control.duty import thermal_duty

    if (hammer is None) == (heat is None):
        raise InputError("HAMMER and --heat: expected one of them, such as --heat '4 mJ'", key="HAMMER")
    for name in _NEEDED:
        if name not in passed:
            raise InputError(
                f"--{name.replace('_', '-')} is missing", key=name, expected="it beside the heat of a dot"
            )
    made = thermal_duty(heat if heat is not None else _fired(hammer, passed), **passed)
    return Answer(duty_shown(made), files={"out": Content.of(made)})


def _fired(name: str | None, passed: dict[str, Any]) -> Any:
    """Return the heat of one dot of a hammer."""
    from printhammer.control.duty import heat_of

    if "feed" in passed:
        raise InputError(
            "--feed is given",
            key="--feed",
            expected="it beside --heat only: a hammer has a driver of its own",
        )
    return heat_of(load_hammer(str(name), fired=True))


def duty_shown(made: ThermalDuty) -> list[Any]:
    """Return the largest rates, a row each ambient temperature, and what bursts are allowed."""
    rows = range(made.ambient.size)
    rates: tuple[Column[int], ...] = (
        Column("ambient", lambda row: made.ambient[row], unit="°C", format="g"),
        Column("dots a second\nfor ever", lambda row: made.rate[row], unit="Hz", format=".4g"),
    )
    pairs = [(row, fast) for fast in range(made.burst.size) for row in rows]
    bursts: tuple[Column[tuple[int, int]], ...] = (
        Column("in bursts of", lambda at: made.burst[at[1]], unit="Hz", format=".6g"),
        Column("ambient", lambda at: made.ambient[at[0]], unit="°C", format="g"),
        Column("would come to", lambda at: _finite(made.temperature[at]), unit="°C", format=".1f"),
        Column("too hot after", lambda at: _finite(made.time[at]), unit="s", format=".3g"),
        Column("part of the time", lambda at: 100.0 * made.share[at], unit="%", format=".1f"),
    )
    said = [
        ("limit of the winding", f"{made.limit:g} °C"),
        ("heat of one dot there", f"{1e3 * made.limit_heat:.4g} mJ"),
        ("keeps the same", f"the {made.heat.feed} of the driver"),
    ]
    return [facts(said), "", table(rates, rows), "", table(bursts, pairs)]


def limit_shown(made: ThermalLimit) -> list[Any]:
    """Return the limit, and the rates beside those that follow from it."""
    error = "" if math.isnan(made.error) else f" ± {made.error:.2g}"
    columns: tuple[Column[int], ...] = (
        Column("rail", lambda row: made.voltage[row] or None, unit="V", format="g"),
        Column("ambient", lambda row: made.ambient[row], unit="°C", format="g"),
        Column("stated", lambda row: made.rate[row], unit="Hz", format="g"),
        Column("from the limit", lambda row: made.fitted[row], unit="Hz", format=".1f"),
        Column("1 Hz warms by", lambda row: made.warming[row], unit="K", format=".4g"),
    )
    return [
        f"limit of the winding [bold]{made.limit:.1f}{error} °C[/bold]",
        "",
        table(columns, range(made.rate.size)),
    ]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
