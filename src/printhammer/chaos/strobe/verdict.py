"""Classification of the motion of a train: periodic, strange, superstable or undecided, with evidence.

A train of period T has the period q if its states q firings apart agree, and q is the smallest such number;
if the states agree but still move, Newton's method has to confirm the period, see
`printhammer.chaos.orbits.settled`. The train is strange if there is no such q and neighbouring motions
separate: the largest exponent of the strobe map is positive by three standard errors. The train is
superstable if there is no such q and the armature comes to rest on its backstop repeatedly: each rest erases
the past, and the motion repeats a cycle longer than 64 firings. All other trains are undecided, with the
reason.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from printhammer.chaos.orbits.settled import Settled
from printhammer.derivatives.states import Exponent
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray, IntArray

LARGEST_PERIOD: Final = 64
"""Largest orbit period that is searched for, in firings; arbitrary."""

AGREEMENT: Final = 1e-6
"""Distance, in half-widths of the strobe window, within which two states agree; arbitrary."""

SIGNIFICANT: Final = 3.0
"""Number of standard errors by which the exponent of a strange train has to exceed zero; arbitrary."""

SUPERSTABLE: Final = "superstable"
"""Classification of a motion that repeatedly comes to rest on its backstop, without a period up to 64."""

FORGETS: Final = "no exponent: the motion comes to rest and forgets its past"

FIRST: Final = 1001
"""Default number of the first firing used for the classification; the very first firing is number 1.
Arbitrary."""

LAST: Final = 2000
"""Default number of the last firing used for the classification; arbitrary."""

_STOPPED: Final = "the run ended before firing"


class Verdict(Declared):
    """Classification of the motion of a train, with the evidence."""

    name: str = part(
        'name of the class: "period-1", "period-2", ..., "strange", "superstable" or "undecided"'
    )
    period: int | None = part("number of firings after which the states repeat; None without a period")
    distance: float = part(
        "largest distance of states `nearest` firings apart, in half-widths of the window",
        more="NaN if the run ended early",
    )
    nearest: int | None = part(
        "number of firings, at most 64, after which the states come closest to repeating",
        more="equal to the period of a periodic train",
    )
    exponent: float = part("largest exponent of the strobe map, per firing; NaN if not computed")
    standard_error: float = part("standard error of the exponent")
    first: int = part("first firing used for the classification; the very first firing is number 1")
    last: int = part("last firing used for the classification")
    tolerance: float = part("tolerance of the integration")
    reason: str = part('reason for the verdict "undecided"; else empty', default="")
    multiplier: float = part(
        "largest absolute Floquet multiplier of the orbit by which Newton's method confirmed the period",
        more="NaN if the states alone prove it",
        default=math.nan,
    )
    rests: int = part(
        "number of rests on the backstop, in one cycle of a motion that repeats, else in the classified"
        " firings",
        more="0 if the exponent was not computed and no cycle is longer than 4 firings",
        default=0,
    )
    elsewhere: tuple[tuple[float, str], ...] = part(
        "finer tolerances and the classification at each, for a periodic motion that comes to rest",
        default=(),
    )

    @property
    def stopped(self) -> bool:
        """Whether the run ended before the last firing needed for the classification."""
        return self.reason.startswith(_STOPPED)

    @property
    def strange(self) -> bool:
        """Whether the classification is "strange"."""
        return self.name == "strange"

    @property
    def hangs_on_rounding(self) -> bool:
        """Whether the period differs at finer tolerances, so that rounding decides the cycle length."""
        return any(name != self.name for _tolerance, name in self.elsewhere)

    @property
    def superstable(self) -> bool:
        """Whether the classification is "superstable"."""
        return self.name == SUPERSTABLE

    @property
    def phrases(self) -> list[str]:
        """Evidence for the classification, as a list of phrases."""
        phrases = []
        if self.period is not None:
            phrases.append(f"states {_firings(self.period)} apart agree to {self.distance:.1e} of the window")
            if not math.isnan(self.multiplier):
                approached = "they approach an orbit that Newton's method finds"
                phrases.append(f"{approached}, of largest multiplier {self.multiplier:.6g}")
        elif self.superstable and self.distance == 0.0:
            phrases.append(f"states {_firings(self.nearest or 0)} apart agree to the last bit")
        elif self.nearest is not None:
            phrases.append(
                f"no period up to {LARGEST_PERIOD}: states {_firings(self.nearest)} apart come closest,"
                f" to {self.distance:.1e} of the window"
            )
        elif not self.stopped:
            phrases.append(
                f"no period up to {LARGEST_PERIOD}: states that far apart lie on other branches of the pack"
            )
        if self.exponent == -math.inf:
            phrases.append(FORGETS)
        elif not math.isnan(self.exponent):
            phrases.append(f"largest exponent {self.exponent:+.4g} ± {self.standard_error:.2g} per firing")
        if self.hangs_on_rounding:
            others = ", ".join(f"{name} at {tolerance:g}" for tolerance, name in self.elsewhere)
            phrases.append(f"rounding decides the period: {others}")
        phrases.append(f"firings {self.first} to {self.last}, tolerance {self.tolerance:g}")
        return phrases

    @property
    def evidence(self) -> str:
        """Evidence for the classification, in one line."""
        return "; ".join(self.phrases)

    def as_dict(self) -> dict[str, Any]:
        """Return classification and evidence as a dictionary for JSON; None for unknown values."""
        return {
            "verdict": self.name,
            "nearest_period": self.nearest,
            "distance": _finite(self.distance),
            "exponent_per_firing": _finite(self.exponent),
            "standard_error": _finite(self.standard_error),
            "firings": [self.first, self.last],
            "tolerance": self.tolerance,
            "multiplier": _finite(self.multiplier),
            "reason": self.reason,
            "rests": self.rests,
            "at_other_tolerances": {f"{tolerance:g}": name for tolerance, name in self.elsewhere},
        }

    def __str__(self) -> str:
        return self.name


def _firings(count: int) -> str:
    return f"{count} firing{'s' if count > 1 else ''}"


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def repeats(
    states: FloatArray, branches: IntArray, scales: FloatArray, longest: int = LARGEST_PERIOD
) -> FloatArray:
    """Compute, for each q from 1 to `longest`, the largest distance of states q firings apart.

    The n states at successive firings contain displacement, velocity, memory of the pack and, with a driver,
    current, one row per firing. `branches`, shape (n,), are the branches of the pack's force law on which the
    states lie, 0 outside the pack. The distance of two states is the largest absolute difference of a
    component, in units of its scale. The result is infinite if states q firings apart lie on different
    branches, if a state is unknown, or if q exceeds n / 2, so that not every state could be compared.
    """
    scaled = states / scales
    count = len(scaled)
    distances = np.full(longest, np.inf)
    if not np.isfinite(scaled).all():
        return distances
    for q in range(1, min(longest, count // 2) + 1):
        if np.array_equal(branches[q:], branches[:-q]):
            distances[q - 1] = np.abs(scaled[q:] - scaled[:-q]).max()
    return distances


def period_of(distances: FloatArray) -> int | None:
    """Return the smallest q for which states q firings apart agree; None if no q gives agreement."""
    agree = np.flatnonzero(distances <= AGREEMENT)
    return int(agree[0]) + 1 if agree.size else None


def verdict(
    distances: FloatArray,
    firings: tuple[int, int],
    tolerance: float,
    exponent: Exponent | None,
    stopped: str = "",
    settled: Settled | None = None,
    resting: tuple[int, int] | None = None,
) -> Verdict:
    """Classify a train by the distances from `repeats`, its exponent, and its settled orbit.

    `exponent` is the largest exponent over the firings from the first to the last of `firings`, None if it
    was not computed; `stopped` is the status of a run that ended before the last firing. `settled` is the
    orbit to which the motion has settled; if None, the period is the smallest number of firings after which
    states agree. `resting` contains the period of a motion that comes to rest on the backstop, in firings (0
    if unknown), and its number of rests; None for every other motion.
    """
    period = None if stopped else period_of(distances)
    closest = period
    if period is None and np.isfinite(distances).any():
        closest = int(np.argmin(distances)) + 1
    judged, reason = "undecided", ""
    rests = 0 if exponent is None else int((exponent.factors == -math.inf).sum())
    if resting is not None:
        rests = resting[1]
    if stopped:
        reason = f"{_STOPPED} {firings[1]}: {stopped}"
    elif period is not None and settled is not None:
        period, reason = settled.period, settled.reason
        closest = period or closest
    elif period is None and resting is not None:
        judged, closest = SUPERSTABLE, resting[0] or closest
    elif period is None:
        judged, reason = _without_period(exponent)
    distance = math.nan if closest is None else 0.0
    if closest is not None and closest <= len(distances):
        distance = float(distances[closest - 1])
    known = math.nan, math.nan
    if resting is not None:
        known = -math.inf, math.inf
    elif exponent is not None:
        known = exponent.value, exponent.standard_error
    return Verdict(
        name=judged if period is None else f"period-{period}",
        period=period,
        distance=distance,
        nearest=closest,
        exponent=known[0],
        standard_error=known[1],
        first=firings[0],
        last=firings[1],
        tolerance=tolerance,
        reason=reason,
        multiplier=math.nan if settled is None or stopped else settled.multiplier,
        rests=rests,
    )


def is_positive(exponent: Exponent) -> bool:
    """Whether an exponent exceeds zero by `SIGNIFICANT` standard errors; False if the exponent is unknown."""
    return bool(exponent.ok and exponent.smooth and exponent.value > SIGNIFICANT * exponent.standard_error)


def _without_period(exponent: Exponent | None) -> tuple[str, str]:
    """Classify an aperiodic train by its exponent; return the class, and the reason for "undecided"."""
    name = "undecided"
    if exponent is None:
        return name, "no period, and the exponent was not computed"
    if not exponent.ok:
        return name, f"no period, and the tangent flow ended early: {exponent.status}"
    if exponent.value == -math.inf:
        if int((exponent.factors == -math.inf).sum()) > 1:
            return SUPERSTABLE, ""
        return name, "no period, and the motion comes to rest on the backstop only once; more firings decide"
    if not exponent.smooth:
        return name, "no period, and no exponent, since the motion passes a touch without velocity"
    if is_positive(exponent):
        return "strange", ""
    return name, (
        f"no period up to {LARGEST_PERIOD}, and the largest exponent is not positive by"
        f" {SIGNIFICANT:g} standard errors"
    )
