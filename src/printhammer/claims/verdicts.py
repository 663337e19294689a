"""Claims about the type of motion of a train: Fig. 11 and its caption, and the route to chaos."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from printhammer.chaos import Strobe, Verdict, strobes
from printhammer.chaos.strobe.scan import scan
from printhammer.chaos.strobe.verdict import LAST
from printhammer.claims.context import Context
from printhammer.claims.judging import WHOLE, Claim, Measured, claims, measures
from printhammer.hammer.hammer import Hammer

_CHANGE: Final = 1e-5  # Relative change of every constant, far below production tolerances; arbitrary
_TIGHTER: Final = 0.1  # Factor on the integration tolerance in the robustness test; arbitrary
_PLAIN: Final = "as it is"
_FINE: Final = "ten times tighter tolerance"
_CHANGED: Final[dict[str, Callable[[int], int]]] = {
    "constants up": lambda _: 1,
    "constants down": lambda _: -1,
    "constants up and down by turns": lambda number: 1 - 2 * (number % 2),
    "constants down and up by turns": lambda number: 2 * (number % 2) - 1,
}
"""Perturbations of all constants of a hammer, by name; each maps the index of a constant to a sign."""

_APERIODIC: Final = "no period"
_PANELS: Final = "panels of Fig. 11"


def printed_verdicts() -> dict[float, str]:
    """Return the classification of each panel as printed in Fig. 11, by strobe time [s]."""
    claim = claims()["poincare"]
    return dict(zip(claim.settings["strobe_times_s"], claim.band["verdicts"], strict=True))


def changed(hammer: Hammer, sign: Callable[[int], int], fraction: float = _CHANGE) -> Hammer:
    """Return a copy of a hammer with constant i scaled by 1 + `fraction` * `sign(i)`, for all constants."""
    # Keep the unit of the file, which distinguishes a current from a force.
    return hammer.replace(
        {
            key: replace(constant, value=constant.value * (1.0 + fraction * sign(number)))
            for number, (key, constant) in enumerate(hammer.constants.items())
        }
    )


def panel_name(period: float) -> str:
    """Format the name of a panel: its strobe time in ms."""
    return f"{period * 1e3:.2f} ms"


def panel_strobes(context: Context) -> list[Strobe]:
    """Compute the classified strobe points of the panels of Fig. 11; the context caches the result."""
    points = claims()["poincare_window"].settings["points"]
    return context.once(
        _PANELS,
        lambda: strobes(context.hammer, [*printed_verdicts()], points=points, tolerance=context.tolerance),
    )


def variants(context: Context, periods: list[float]) -> dict[str, list[Verdict]]:
    """Classify trains of given periods [s], for the unchanged hammer and for each variant, by name.

    A variant is the hammer with all constants slightly changed, or with a tighter integration tolerance.
    """
    hammers = [context.hammer, *(changed(context.hammer, sign) for sign in _CHANGED.values())]
    every = strobes(
        [hammer for hammer in hammers for _ in periods],
        periods * len(hammers),
        points=claims()["poincare_window"].settings["points"],
        tolerance=context.tolerance,
    )
    fine = strobes(context.hammer, periods, tolerance=_TIGHTER * context.tolerance)
    # The figure shows the same trains.
    context.once(_PANELS, lambda: every[: len(periods)])
    by_variant = {}
    for number, name in enumerate((_PLAIN, *_CHANGED)):
        by_variant[name] = _verdicts(every[number * len(periods) : (number + 1) * len(periods)])
    by_variant[_FINE] = _verdicts(fine)
    return by_variant


def _verdicts(judged: list[Strobe]) -> list[Verdict]:
    return [strobe.verdict for strobe in judged if strobe.verdict is not None]


@measures("poincare", *WHOLE)
def poincare(context: Context, claim: Claim) -> Measured:
    """Compare the classifications of the panels with Fig. 11, and test their robustness to perturbations."""
    periods = list(claim.settings["strobe_times_s"])
    printed = list(claim.band["verdicts"])
    by_variant = variants(context, periods)
    count = claims()["poincare_window"].settings["points"]
    first = _verdicts(
        strobes(context.hammer, periods, points=1, firings=(1, count), tolerance=context.tolerance)
    )
    names = [panel_name(period) for period in periods]
    shown = []
    for verdicts in zip(*by_variant.values(), strict=True):
        kinds = list(dict.fromkeys(verdict.name for verdict in verdicts))
        # A panel whose variants disagree gets several classes, joined by "or", and never matches Fig. 11.
        shown.append(" or ".join(kinds))
    right = [name for name, kind, band in zip(names, shown, printed, strict=True) if kind == band]
    wrong = [
        f"{name} {kind} instead of {band}"
        for name, kind, band in zip(names, shown, printed, strict=True)
        if kind != band
    ]
    value = {
        "verdicts": shown,
        "panels_as_printed": len(right),
        "panels_that_change": [name for name, kind in zip(names, shown, strict=True) if " or " in kind],
        "panels": {
            name: {variant: verdicts[number].as_dict() for variant, verdicts in by_variant.items()}
            for number, name in enumerate(names)
        },
        f"first_{count}_firings": {
            name: verdict.as_dict() for name, verdict in zip(names, first, strict=True)
        },
    }
    early = sum(verdict.name == band for verdict, band in zip(first, printed, strict=True))
    remark = f"; {', '.join(wrong)}" if wrong else ""
    return Measured(
        value,
        f"{len(right)} of {len(names)} panels are as printed{remark}. Judged on the first {count} firings,"
        f" with the transient, {early} are.",
    )


@dataclass(frozen=True)
class Stretch:
    """Interval of successive strobe times [s] of a scan whose trains have the same classification."""

    name: str
    longest: float
    shortest: float
    count: int


def stretches(periods: Sequence[float], names: Sequence[str]) -> list[Stretch]:
    """Group a scan of strobe times [s], in descending order, into intervals with the same classification."""
    every = []
    for name, group in itertools.groupby(zip(periods, names, strict=True), key=lambda item: item[1]):
        times = [period for period, _ in group]
        every.append(Stretch(name, times[0], times[-1], len(times)))
    return every


def cascades(scanned: Sequence[Stretch]) -> list[Stretch]:
    """Find period-doubling cascades: three successive intervals with periods of 2, 4 and 8 firings.

    Return the first interval of each cascade.
    """
    return [
        three[0]
        for three in zip(scanned, scanned[1:], scanned[2:], strict=False)
        if [stretch.name for stretch in three] == ["period-2", "period-4", "period-8"]
    ]


@measures("no_period_doubling_cascade", *WHOLE)
def no_period_doubling_cascade(context: Context, claim: Claim) -> Measured:
    """Search for a period-doubling cascade before the onset of chaos; count the periodic windows in chaos."""
    settings = claim.settings
    first, last, step = (
        settings[name] for name in ("first_strobe_time_s", "last_strobe_time_s", "strobe_time_step_s")
    )
    # Rounding to decimals removes the errors of the multiplication.
    periods = [round(first - step * k, 12) for k in range(round((first - last) / step) + 1)]
    judged = scan(context.hammer, periods, tolerance=context.tolerance, exponents=False)
    names = [_APERIODIC if verdict.period is None else verdict.name for verdict in judged]
    ends = [_first_strange(context, periods, names, way) for way in (1, -1)]
    early = sum(verdict.last < LAST for verdict in judged)
    short = f"{early} of {len(names)} trains had settled long before firing {LAST}"
    start, stop = (len(names), 0) if None in ends else (ends[0] or 0, (ends[1] or 0) + 1)
    before = stretches(periods[:start], names[:start])
    inside = stretches(periods[start:stop], names[start:stop])
    windows = {q: [stretch for stretch in inside if stretch.name == f"period-{q}"] for q in (2, 3)}
    every = stretches(periods, names)
    falling, rising = cascades(every), cascades(every[::-1])
    value: dict[str, Any] = {
        "cascade_before_strange": bool(cascades(before)),
        "first_strange_s": None if ends[0] is None else periods[ends[0]],
        "last_strange_s": None if ends[1] is None else periods[ends[1]],
        "windows_before_strange": [_window(stretch, step) for stretch in before],
        **{f"period_{q}_windows": len(group) for q, group in windows.items()},
        **{f"period_{q}": [_window(stretch, step) for stretch in group] for q, group in windows.items()},
        "doublings_with_falling_time_s": [stretch.longest for stretch in falling],
        "doublings_with_rising_time_s": [stretch.shortest for stretch in rising],
        "strobe_times": {name: names.count(name) for name in sorted(set(names))},
        "trains_settled_early": early,
    }
    if None in ends:
        return Measured(value, f"No strobe time is strange; {short}.")
    way = ", ".join(stretch.name for stretch in before) or "nothing"
    wide = " and ".join(
        f"{len(group)} windows of period {q}, {step * sum(s.count for s in group) * 1e6:.0f} us in all"
        for q, group in windows.items()
    )
    return Measured(
        value,
        f"Before the first strange train, at {periods[start] * 1e3:.3f} ms: {way}; between it and the last,"
        f" at {periods[stop - 1] * 1e3:.3f} ms, {wide}; periods 2, 4, 8 in succession at {len(falling)}"
        f" places with falling and {len(rising)} with rising strobe time; {short}.",
    )


def _first_strange(context: Context, periods: Sequence[float], names: Sequence[str], way: int) -> int | None:
    """Find the first strange train from the start (`way` 1) or the end (-1) of a scan; return its index.

    The scan has trains of `periods` [s] with the classifications `names`; None without a strange train.
    Since Lyapunov exponents are expensive, they are computed only until the first strange train.
    """
    for place in range(len(names))[::way]:
        if names[place] == _APERIODIC:
            (strobe,) = strobes(context.hammer, [periods[place]], points=1, tolerance=context.tolerance)
            if strobe.verdict is not None and strobe.verdict.strange:
                return place
    return None


def _window(stretch: Stretch, step: float) -> dict[str, Any]:
    """Return the classification, ends [s] and width [s] of an interval of strobe times, by name.

    `step` is the spacing of the scanned strobe times, s.
    """
    return {
        "verdict": stretch.name,
        "from_s": stretch.longest,
        "to_s": stretch.shortest,
        "width_s": step * stretch.count,
    }
