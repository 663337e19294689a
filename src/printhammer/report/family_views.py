"""What the templates of a report show of the family of hammers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from printhammer.claims import claims as every_claim
from printhammer.claims.verdicts import printed_verdicts
from printhammer.reconstruction.family.robustness import STATEMENTS
from printhammer.report.quantities import split_name, value_text
from printhammer.report.views import SAME

if TYPE_CHECKING:
    from collections.abc import Iterable

    from printhammer.report.build import Report

_ROOM: Final = 4.0
"""Free part of a track at each end, in percent."""


def conclusions_view(report: Report) -> list[dict[str, Any]]:
    """Return the conclusions of the family, those that hold for all of its hammers first."""
    family = report.found.family if report.reconstructed else None
    if family is None:
        return []
    rows = []
    for name, conclusion in family.conclusions.items():
        words, unit = split_name(name)
        values = [member.conclusions.get(name) for member in family.hammers]
        # The range of a statement is that of its margins, which tell a reader nothing.
        ends = ("", "") if name in STATEMENTS else (conclusion.low, conclusion.high)
        rows.append(
            {
                "words": words,
                "low": value_text(ends[0], unit, other=False),
                "high": value_text(ends[1], unit, other=False),
                "robust": conclusion.robust,
                "text": conclusion.text,
                "dots": _dots([value for value in values if value is not None]),
            }
        )
    return sorted(rows, key=lambda row: not row["robust"])


def _dots(values: Iterable[float], ends: tuple[float, float] | None = None) -> list[str]:
    """Return places on a track, in percent, linear between the least and the largest value."""
    values = list(values)
    low, high = ends or (min(values, default=0.0), max(values, default=0.0))
    span = high - low
    return [f"{_ROOM + (100.0 - 2.0 * _ROOM) * ((v - low) / span if span else 0.5):.2f}" for v in values]


def members_view(report: Report) -> dict[str, Any] | None:
    """Return the hammers of the family with their verdicts and conclusions."""
    family = report.found.family if report.reconstructed else None
    if family is None:
        return None
    names = list(dict.fromkeys(name for member in family.hammers for name in member.conclusions))
    kinds = {name: claim.kind for name, claim in every_claim().items()}
    rows = []
    for member in family.hammers:
        stated = [verdict for name, verdict in member.verdicts.items() if kinds[name] == "stated"]
        rows.append(
            {
                "name": member.name,
                "stated": f"{stated.count('holds')} of {len(stated)}",
                "all": f"{list(member.verdicts.values()).count('holds')} of {len(member.verdicts)}",
                "panels": member.panels,
                "values": [
                    value_text(member.conclusions.get(name), split_name(name)[1], other=False)
                    for name in names
                ],
            }
        )
    return {"heads": [split_name(name)[0] for name in names], "rows": rows, "panels": len(printed_verdicts())}


def constants_of_family(report: Report) -> dict[str, Any] | None:
    """Return the constants of the family relative to those of the shipped hammer, on a logarithmic axis."""
    family = report.found.family if report.reconstructed else None
    if family is None:
        return None
    ratios: dict[str, list[float]] = {}
    for key, constant in report.hammer.constants.items():
        values = [member.constants[key] for member in family.hammers if key in member.constants]
        if values and all(value * constant.si > 0.0 for value in values):
            ratios[key] = [value / constant.si for value in values]
    moved = {key: found for key, found in ratios.items() if any(abs(ratio - 1.0) > SAME for ratio in found)}
    widest = max((abs(math.log(ratio)) for found in moved.values() for ratio in found), default=1.0)
    return {
        "rows": [
            {
                "constant": report.hammer.constants[key],
                "low": f"{min(found):.3g}",
                "high": f"{max(found):.3g}",
                "dots": _dots([math.log(ratio) for ratio in found], (-widest, widest)),
            }
            for key, found in moved.items()
        ],
        "same": [key for key in ratios if key not in moved],
        "ends": (f"{math.exp(-widest):.2g}", f"{math.exp(widest):.2g}"),
    }


def claims_of_family(report: Report) -> dict[str, Any] | None:
    """Return which claims hold for all hammers of the family, for some, and for none."""
    family = report.found.family if report.reconstructed else None
    if family is None:
        return None
    counts = {}
    for name in every_claim():
        verdicts = [member.verdicts[name] for member in family.hammers if name in member.verdicts]
        if verdicts:
            counts[name] = (verdicts.count("holds"), len(verdicts))
    return {
        "every": [name for name, (holds, count) in counts.items() if holds == count],
        "some": [(name, holds, count) for name, (holds, count) in counts.items() if 0 < holds < count],
        "none": [name for name, (holds, _) in counts.items() if not holds],
    }
