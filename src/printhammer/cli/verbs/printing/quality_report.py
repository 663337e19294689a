"""What `quality` shows on the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from rich.markup import escape
from rich.table import Table

from printhammer.cli.options import Units, shown, unit, with_unit
from printhammer.cli.screen import Column, coloured, facts, table

if TYPE_CHECKING:
    from printhammer.printing.dots.judging import Limits
    from printhammer.printing.rates.damping import DampingStudy
    from printhammer.printing.rates.quality import Quality, Spread
    from printhammer.printing.rates.safe_rate import SafeRate
    from printhammer.printing.rates.tolerance import ToleranceYield

_SHARES: Final = (0.95, 0.5)


def report(result: Quality, units: Units) -> Table:
    """Return the figures of a quality report, one row each."""
    judged, good = len(result.slot), int((result.fault < 0).sum())
    what = "the de Bruijn cycle of order 8" if result.judged_from > 0 else f"{len(result.wanted)} slots"
    lost, extra = int(result.lost.sum()), int(result.extra_contacts.sum())
    wear, single = result.wear, result.nominal
    pressed = "" if wear.largest_force is None else f", up to {with_unit(wear.largest_force, 'force', units)}"
    coil = with_unit(result.work, "energy", units)
    impulse = f"{1e3 * result.backstop_impulse:.3f} mN·s"
    heat = "" if result.mean_heat is None else f", {result.mean_heat:.3f} W heat"
    return facts(
        [
            ("pattern", f"{what}, {judged} dots judged, {result.rate:g} Hz, {escape(result.strategy)}"),
            ("limits", _limits(result.limits, units)),
            ("paper", None if result.paper is None else escape(result.paper.text)),
            (
                "dots",
                (
                    f"{coloured(good == judged, f'{good} of {judged} within limits')}, {lost} lost"
                    f" ({100.0 * result.missing:.3g} %), {extra} extra contacts"
                ),
            ),
            ("flight time", _spread(result.flight_time_spread, "time", units, single.flight_time)),
            ("force", _spread(result.force_spread, "force", units, single.force)),
            ("indentation", _spread(result.indentation_spread, "length", units, single.indentation)),
            ("arrival", _spread(result.arrival_spread, "time", units)),
            ("placement", _spread(result.placement_spread, "length", units)),
            ("dot matrix", _verdict(result.dot_matrix, "arrivals within 200 µs of each other")),
            ("engraved", _verdict(result.engraved, "arrivals within 30 µs of each other")),
            (
                "backstop",
                (
                    f"{wear.touches / result.fired:.2f} touches a dot, {impulse}"
                    f" and {with_unit(result.backstop_loss, 'energy', units)} a dot{pressed}"
                ),
            ),
            ("coil", f"{coil} a dot, {result.mean_power:.3f} W in the mean{heat}"),
        ]
    )


def safe_rate(result: SafeRate, units: Units) -> Table:
    """Return the safe rate and what limits it."""
    first, last = float(result.rates[0]), float(result.rates[-1])
    more = "at least " if result.at_least else ""
    none = math.isnan(result.rate)
    waveform = result.hammer.waveform
    return facts(
        [
            ("limits", _limits(result.limits, units)),
            ("drive", escape(result.strategy)),
            (
                "safe rate",
                f"[red]none[/red]: not even {first:g} Hz"
                if none
                else f"[bold green]{more}{result.rate:g} Hz[/bold green]",
            ),
            ("peak", None if none else f"{result.peak_drive:.3f} {waveform.unit if waveform else ''}"),
            ("because", "the grid ends" if result.failure is None else result.failure.text),
            ("grid", f"{first:g} to {last:g} Hz, every {result.step:g} Hz"),
        ]
    )


def tolerance_yield(result: ToleranceYield, units: Units) -> Table:
    """Return the yield, or how safe rates are spread."""
    spreads = sorted(set(result.spreads.values()))
    within = f"{100.0 * spreads[0]:g} %" + (f" to {100.0 * spreads[-1]:g} %" if len(spreads) > 1 else "")
    odd = result.status[result.status != "ok"]
    rows: list[tuple[str, str | None]] = [
        ("limits", f"{_limits(result.limits, units)}, judged by {result.judged_by} single pulse"),
        (
            "draw",
            (
                f"{len(result.status)} hammers, {len(result.spreads)} constants within {within},"
                f" seed {result.seed}"
            ),
        ),
        *(("", f"[yellow]{int((odd == name).sum())} {name}[/yellow]") for name in sorted(set(odd.tolist()))),
    ]
    if math.isnan(result.rate):
        for share in _SHARES:
            rates = [rate for rate in result.grid.tolist() if result.share_at(rate) >= share]
            reached = f"up to {rates[-1]:g} Hz" if rates else "at no rate tried"
            rows.append((f"{100.0 * share:g} % print well", reached))
        known = result.safe_rates[~np.isnan(result.safe_rates)]
        if known.size:
            rows.append(("safe rates", f"{known.min():g} to {known.max():g} Hz"))
    else:
        share_text = f"{100.0 * result.share:.1f} ± {100.0 * result.share_error:.1f} %"
        rows.append(("pass", f"[bold]{share_text}[/bold] at {result.rate:g} Hz"))
    return facts(rows)


def damping(result: DampingStudy, units: Units) -> Table:
    """Return the materials, a row each."""
    best = result.best

    def rate(row: int) -> str:
        safe = float(result.safe_rate[row])
        return (
            f"[bold green]{safe:g}[/bold green]" if row == best else "–" if math.isnan(safe) else f"{safe:g}"
        )

    columns: tuple[Column[int], ...] = (
        Column("", lambda row: result.materials[row].kind, left=True),
        Column("material", lambda row: escape(result.materials[row].label.replace(" us", " µs")), left=True),
        Column("current", lambda row: float(result.peak_current[row]), unit="A", format=".3f"),
        Column("settle-out", lambda row: float(result.settle_out[row]), "time"),
        Column("rebounds", lambda row: float(result.rebounds[row]), format=".0f"),
        Column("first\nrestitution", lambda row: float(result.restitution[row]), format=".2f"),
        Column("backstop", lambda row: float(result.loss[row]), "energy"),
        Column("safe rate", rate, unit="Hz"),
        Column(
            "",
            lambda row: "" if str(result.status[row]) == "ok" else f"[yellow]{result.status[row]}[/yellow]",
            left=True,
        ),
    )
    return table(columns, range(len(result.materials)), units)


def _limits(limits: Limits, units: Units) -> str:
    return (
        f"force within {100.0 * limits.force:g} %, arrival within {with_unit(limits.arrival, 'time', units)},"
        f" {limits.extra_contacts} extra contacts"
    )


def _spread(spread: Spread, kind: str, units: Units, single: float | None = None) -> str:
    if not spread.count:
        return "–"
    mean, deviation, peak_to_peak = (
        shown(value, kind, units) for value in (spread.mean, spread.deviation, spread.peak_to_peak)
    )
    alone = "" if single is None else f", single pulse {shown(single, kind, units)}"
    return f"{mean} ± {deviation} {unit(kind, units)}, {peak_to_peak} peak to peak{alone}"


def _verdict(good: bool, what: str) -> str:
    return f"{coloured(good, 'yes' if good else 'no')}: " + (
        f"{what}, none lost" if good else f"not all {what}, or lost"
    )
