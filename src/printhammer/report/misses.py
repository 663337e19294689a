"""By how much a claim fails."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.claims.definition import SIDES
from printhammer.report.quantities import band_text, split_name, value_text
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.claims import Claim


class Miss(Declared):
    """A measured value outside its band, as text."""

    words: str = part("what was measured")
    value: str = part("what it is")
    band: str = part("what it must be")
    distance: str = part("how far these are apart")


def misses(claim: Claim, value: Mapping[str, Any] | None) -> list[Miss]:
    """Return what of measured values is not within the band of a claim; nothing where there are none."""
    missed: list[Miss] = []
    if value is None:
        return missed
    for name in claim.missed(value):
        words, unit = split_name(name)
        measured, band = value.get(name), claim.band[name]
        if isinstance(band, list) and isinstance(band[0], str):
            # One by one they are told elsewhere.
            missed.append(Miss(words, agreement(measured, band), "", ""))
        else:
            shown = value_text(measured, unit), band_text(band, unit)
            missed.append(Miss(words, *shown, distance(measured, band, unit)))
    return missed


def agreement(value: Any, band: list[str]) -> str:
    """Return how many words of a list are those that are wanted."""
    words = value if isinstance(value, (list, tuple)) else []
    same = sum(one == other for one, other in zip(words, band, strict=False))
    return f"{same} of {len(band)} as printed"


def distance(value: Any, band: Any, unit: str) -> str:
    """Return how far a value is from its band, as text; empty where that is no number.

    Parameters
    ----------
    value
        A measured value outside the band, SI.
    band
        What it must be, as `printhammer.claims.Claim.band` has it.
    unit : str
        SI unit; empty for a pure number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return ""
    limit = _limit(float(value), band)
    if limit is None:
        return ""
    if value == limit:
        return "exactly at the limit"
    way = "too small" if value < limit else "too large"
    if limit == 0.0 or isinstance(value, int):
        return f"{way} by {value_text(abs(value - limit), unit, other=False)}"
    part = abs((value - limit) / limit)
    return f"{way} by {100.0 * part:.3g} %" if part < 1.0 else f"{way} by {part:.2g} times the limit"


def _limit(value: float, band: Any) -> float | None:
    """Return the end of a band that a value outside it misses."""
    if isinstance(band, dict):
        for side, limit in band.items():
            if not (math.isnan(value) or SIDES[side](value, limit)):
                return float(limit)
        return None
    if isinstance(band, list):
        return float(band[0] if value < band[0] else band[1])
    return None if isinstance(band, (bool, str)) else float(band)
