"""What `quality` shows on the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from rich.markup import escape

from printhammer.cli.terminal import plain_table
from printhammer.cli.units import shown, unit, with_unit

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.cli.units import Units
    from printhammer.printing.dots.limits import Limits
    from printhammer.printing.rates.damping import DampingStudy
    from printhammer.printing.rates.quality import Quality, Spread
    from printhammer.printing.rates.safe_rate import SafeRate
    from printhammer.printing.rates.tolerance import ToleranceYield

_SHARES: Final = (0.95, 0.5)


def report(found: Quality, units: Units) -> Table:
    """Return the figures of a quality report, one row each."""
    table = _facts()
    judged = len(found.slot)
    cycle = found.judged_from > 0
    what = "the de Bruijn cycle of order 8" if cycle else f"{len(found.wanted)} slots"
    table.add_row("pattern", f"{what}, {judged} dots judged, {found.rate:g} Hz, {escape(found.strategy)}")
    table.add_row("limits", _limits(found.limits, units))
    good = int((found.fault < 0).sum())
    style = "green" if good == judged else "yellow"
    lost, extra = int(found.lost.sum()), int(found.extra_contacts.sum())
    table.add_row(
        "dots",
        f"[{style}]{good} of {judged} within limits[/{style}], {lost} lost ({100.0 * found.missing:.3g} %),"
        f" {extra} extra contacts",
    )
    for name, spread, kind, single in (
        ("flight time", found.flight_time_spread, "time", found.nominal.flight_time),
        ("force", found.force_spread, "force", found.nominal.force),
        ("indentation", found.indentation_spread, "length", found.nominal.indentation),
        ("arrival", found.arrival_spread, "time", None),
        ("placement", found.placement_spread, "length", None),
    ):
        table.add_row(name, _spread(spread, kind, single, units))
    table.add_row("dot matrix", _verdict(found.dot_matrix, "arrivals within 200 µs of each other"))
    table.add_row("engraved", _verdict(found.engraved, "arrivals within 30 µs of each other"))
    wear = found.wear
    pressed = "" if wear.largest_force is None else f", up to {with_unit(wear.largest_force, 'force', units)}"
    table.add_row(
        "backstop",
        f"{wear.touches / found.fired:.2f} touches a dot, {1e3 * found.backstop_impulse:.3f} mN·s and"
        f" {with_unit(found.backstop_loss, 'energy', units)} a dot{pressed}",
    )
    table.add_row(
        "coil",
        f"{with_unit(found.work, 'energy', units)} a dot, {found.mean_power:.3f} W in the mean"
        + ("" if found.mean_heat is None else f", {found.mean_heat:.3f} W heat"),
    )
    return table


def safe_rate(found: SafeRate, units: Units) -> Table:
    """Return the safe rate and what limits it."""
    table = _facts()
    table.add_row("limits", _limits(found.limits, units))
    table.add_row("drive", escape(found.strategy))
    first, last = float(found.rates[0]), float(found.rates[-1])
    if math.isnan(found.rate):
        table.add_row("safe rate", f"[red]none[/red]: not even {first:g} Hz")
    else:
        more = "at least " if found.at_least else ""
        table.add_row("safe rate", f"[bold green]{more}{found.rate:g} Hz[/bold green]")
        table.add_row(
            "peak", f"{found.peak_drive:.3f} {found.hammer.waveform.unit if found.hammer.waveform else ''}"
        )
    table.add_row("because", "the grid ends" if found.failure is None else found.failure.text)
    table.add_row("grid", f"{first:g} to {last:g} Hz, every {found.step:g} Hz")
    return table


def tolerance_yield(found: ToleranceYield, units: Units) -> Table:
    """Return the yield, or how safe rates are spread."""
    table = _facts()
    table.add_row("limits", f"{_limits(found.limits, units)}, judged by {found.judged_by} single pulse")
    spreads = sorted(set(found.spreads.values()))
    told = f"{100.0 * spreads[0]:g} %" + (f" to {100.0 * spreads[-1]:g} %" if len(spreads) > 1 else "")
    table.add_row(
        "draw",
        f"{len(found.status)} hammers, {len(found.spreads)} constants within {told}, seed {found.seed}",
    )
    odd = found.status[found.status != "ok"]
    for name in sorted(set(odd.tolist())):
        table.add_row("", f"[yellow]{int((odd == name).sum())} {name}[/yellow]")
    error = 100.0 * found.share_error
    if math.isnan(found.rate):
        for share in _SHARES:
            rates = [rate for rate in found.grid.tolist() if found.share_at(rate) >= share]
            table.add_row(
                f"{100.0 * share:g} % print well", f"up to {rates[-1]:g} Hz" if rates else "at no rate tried"
            )
        known = found.safe_rates[~np.isnan(found.safe_rates)]
        if known.size:
            table.add_row("safe rates", f"{known.min():g} to {known.max():g} Hz")
    else:
        table.add_row("pass", f"[bold]{100.0 * found.share:.1f} ± {error:.1f} %[/bold] at {found.rate:g} Hz")
    return table


def damping(found: DampingStudy, units: Units) -> Table:
    """Return the materials, a row each."""
    heads = (
        ("current\nA", "right"),
        (f"settle-out\n{unit('time', units)}", "right"),
        ("rebounds", "right"),
        ("first\nrestitution", "right"),
        (f"backstop\n{unit('energy', units)}", "right"),
        ("safe rate\nHz", "right"),
        ("", "left"),
    )
    table = plain_table(("", "left"), ("material", "left"), *heads)
    best = found.best
    for number, one in enumerate(found.materials):
        rate = found.safe_rate[number]
        cells = [
            _number(found.peak_current[number], ".3f"),
            shown(None if math.isnan(found.settle_out[number]) else found.settle_out[number], "time", units),
            _number(found.rebounds[number], ".0f"),
            _number(found.restitution[number], ".2f"),
            shown(None if math.isnan(found.loss[number]) else found.loss[number], "energy", units),
            f"[bold green]{rate:g}[/bold green]" if number == best else _number(rate, "g"),
        ]
        status = str(found.status[number])
        remark = "" if status == "ok" else f"[yellow]{status}[/yellow]"
        table.add_row(one.kind, escape(one.label.replace(" us", " µs")), *cells, remark)
    return table


def _facts() -> Table:
    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    return table


def _limits(limits: Limits, units: Units) -> str:
    return (
        f"force within {100.0 * limits.force:g} %, arrival within {with_unit(limits.arrival, 'time', units)},"
        f" {limits.extra_contacts} extra contacts"
    )


def _spread(spread: Spread, kind: str, single: float | None, units: Units) -> str:
    if not spread.count:
        return "–"
    mean, deviation, peak_to_peak = (
        shown(value, kind, units) for value in (spread.mean, spread.deviation, spread.peak_to_peak)
    )
    alone = "" if single is None else f", single pulse {shown(single, kind, units)}"
    return f"{mean} ± {deviation} {unit(kind, units)}, {peak_to_peak} peak to peak{alone}"


def _verdict(good: bool, what: str) -> str:
    return (
        f"[green]yes[/green]: {what}, none lost" if good else f"[yellow]no[/yellow]: not all {what}, or lost"
    )


def _number(value: float, digits: str) -> str:
    return "–" if math.isnan(value) else format(float(value), digits)
