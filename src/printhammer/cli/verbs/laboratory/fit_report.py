"""What the verb `fit` shows: constants with their uncertainty, and what the data say of the law."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from rich.console import RenderableType
from rich.markup import escape

from printhammer.cli.screen import Column, facts, repeated, table

if TYPE_CHECKING:
    from printhammer.identify.result import Fit, FittedConstant

_SHOWN_IN: Final = {"m": "um", "kg": "g", "s": "us"}
"""Units that make handy numbers of what a hammer has."""

_COLUMNS: Final[tuple[Column[FittedConstant], ...]] = (
    Column("constant", lambda constant: escape(constant.key), left=True),
    Column("value", lambda constant: _numbers(constant)[0]),
    Column("± error", lambda constant: _numbers(constant)[1]),
    Column("95 % interval", lambda constant: _numbers(constant)[2], left=True),
    Column("unit", lambda constant: _numbers(constant)[3], left=True),
)


def described(fit: Fit) -> list[RenderableType]:
    """Return what a fit tells."""
    files = f"  [dim]{escape(' and '.join(fit.source))}[/dim]" if fit.source else ""
    scale = f"residual scale {fit.residual_scale:.3g} {fit.axes[1][1]}"
    several = len(fit.keys) > 1
    verdict = "[bold yellow]rejected[/bold yellow]" if fit.rejected else "[green]not rejected[/green]"
    rows: list[tuple[str, str | None]] = [
        ("data", f"{int((~fit.outliers).sum())} used, {scale}" if len(fit.data) else None),
        ("robust", escape(fit.outlier_lines()) if fit.outliers.any() else None),
        ("correlation", escape(_largest_correlation(fit)) if several else None),
        ("condition", f"{fit.condition_number:.3g}" if several else None),
        ("law", f"{verdict}, p = {fit.p_value:.2g}" if math.isfinite(fit.p_value) else None),
        ("because", escape(fit.rejected) if fit.rejected else None),
        *repeated("taken as known", (escape(f"{name} = {value}") for name, value in fit.given.items())),
        *repeated("not told apart", map(escape, fit.indistinct)),
        *repeated("notes", map(escape, fit.remarks)),
    ]
    return [f"[bold]{fit.kind}[/bold]{files}", table(_COLUMNS, fit.constants.values()), "", facts(rows)]


def _numbers(constant: FittedConstant) -> tuple[str, str, str, str]:
    """Return value, standard error, interval and unit; as many digits as the error has meaning."""
    from printhammer.units import from_si

    unit = _SHOWN_IN.get(constant.unit, constant.unit)
    value, error, low, high = (
        from_si(number, constant.unit, unit) if math.isfinite(number) else number
        for number in (constant.value, constant.standard_error, *constant.interval)
    )
    digits = 6
    if error > 1e-12 * abs(value):
        size = max(abs(value), error)
        digits = math.floor(math.log10(size)) - math.floor(math.log10(error)) + 2
    texts = [f"{part:.{digits}g}" for part in (value, low, high)]
    return texts[0], f"{error:.2g}", f"{texts[1]} to {texts[2]}", "" if unit == "1" else unit


def _largest_correlation(fit: Fit) -> str:
    import numpy as np

    size = np.abs(fit.correlation - np.eye(len(fit.keys)))
    row, column = (int(k) for k in np.unravel_index(int(np.argmax(size)), size.shape))
    first, second = sorted((row, column))
    return f"{fit.correlation[row, column]:.2f} at most, of {fit.keys[first]} and {fit.keys[second]}"
