"""What the verb `fit` shows: constants with their uncertainty, and what the data say of the law."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.console import Console

    from printhammer.identify.result import Fit, FittedConstant

_SHOWN_IN: Final = {"m": "um", "kg": "g", "s": "us"}
"""Units that make handy numbers of what a hammer has."""


def show(fit: Fit, screen: Console) -> None:
    """Print a fit."""
    from rich.markup import escape

    from printhammer.cli.terminal import plain_table
    from printhammer.identify.fragment import outliers

    files = f"  [dim]{escape(' and '.join(fit.source))}[/dim]" if fit.source else ""
    screen.print(f"[bold]{fit.kind}[/bold]{files}", soft_wrap=True)
    table = plain_table(
        ("constant", "left"),
        ("value", "right"),
        ("± error", "right"),
        ("95 % interval", "left"),
        ("unit", "left"),
    )
    for constant in fit.constants.values():
        table.add_row(escape(constant.key), *_numbers(constant))
    screen.print(table)
    told = plain_table(("", "left"), ("", "left"))
    told.show_header = False
    told.columns[0].style = "dim"
    told.columns[0].vertical = "top"
    if len(fit.data):
        used = int((~fit.outliers).sum())
        told.add_row("data", f"{used} used, residual scale {fit.residual_scale:.3g} {fit.axes[1][1]}")
    if fit.outliers.any():
        told.add_row("robust", escape(outliers(fit)))
    if len(fit.keys) > 1:
        told.add_row("correlation", escape(_largest_correlation(fit)))
        told.add_row("condition", f"{fit.condition_number:.3g}")
    if math.isfinite(fit.p_value):
        verdict = "[bold yellow]rejected[/bold yellow]" if fit.rejected else "[green]not rejected[/green]"
        told.add_row("law", f"{verdict}, p = {fit.p_value:.2g}")
    if fit.rejected:
        told.add_row("because", escape(fit.rejected))
    for heading, sentences in (
        ("taken as known", [f"{name} = {value}" for name, value in fit.given.items()]),
        ("not told apart", fit.indistinct),
        ("notes", fit.remarks),
    ):
        for row, sentence in enumerate(sentences):
            told.add_row("" if row else heading, escape(sentence))
    screen.print()
    screen.print(told)


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
