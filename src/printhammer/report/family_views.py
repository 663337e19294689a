"""What a report shows of the family of hammers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

from printhammer.claims import claims as every_claim
from printhammer.claims.verdicts import printed_verdicts
from printhammer.hammer.hammer import Hammer
from printhammer.report.contents import Report
from printhammer.report.quantities import split_name, value_text
from printhammer.report.reconstruction.results import Family, FamilyMember
from printhammer.report.views import SAME

_ROOM: Final = 4.0
"""Free part of a track at each end, in percent."""


def family_view(report: Report) -> dict[str, Any] | None:
    """Return conclusions, claims, members and constants of the family; None where there is none."""
    family = report.family
    if family is None:
        return None
    names = list(dict.fromkeys(name for member in family.hammers for name in member.conclusions))
    return {
        "conclusions": _conclusions(family),
        "claims": _claims(family),
        "heads": [split_name(name)[0] for name in names],
        "members": [_member(member, names) for member in family.hammers],
        "panels": len(printed_verdicts()),
        "spread": _spread(family, report.hammer),
    }


def _conclusions(family: Family) -> list[dict[str, Any]]:
    """Return the conclusions, those that hold for all hammers first."""
    rows = []
    for name, conclusion in family.conclusions.items():
        words, unit = split_name(name)
        values = [member.conclusions.get(name) for member in family.hammers]
        # Members have no value of a statement; its range is that of margins, which mean nothing to a reader.
        is_statement = not any(name in member.conclusions for member in family.hammers)
        ends = ("", "") if is_statement else (conclusion.low, conclusion.high)
        low, high = (value_text(end, unit, other=False) for end in ends)
        dots = _dots([value for value in values if value is not None])
        rows.append(
            {"words": words, "low": low, "high": high, "dots": dots}
            | {"robust": conclusion.robust, "text": conclusion.text}
        )
    return sorted(rows, key=lambda row: not row["robust"])


def _dots(values: Iterable[float], ends: tuple[float, float] | None = None) -> list[str]:
    """Return places on a track, in percent, linear between the least and the largest value."""
    values = list(values)
    low, high = ends or (min(values, default=0.0), max(values, default=0.0))
    span = high - low
    return [f"{_ROOM + (100.0 - 2.0 * _ROOM) * ((v - low) / span if span else 0.5):.2f}" for v in values]


def _member(member: FamilyMember, names: list[str]) -> dict[str, Any]:
    """Return one hammer with its verdicts and what follows for it."""
    kinds = {name: claim.kind for name, claim in every_claim().items()}
    verdicts = list(member.verdicts.values())
    stated = [verdict for name, verdict in member.verdicts.items() if kinds[name] == "stated"]
    return {
        "name": member.name,
        "stated": f"{stated.count('holds')} of {len(stated)}",
        "all": f"{verdicts.count('holds')} of {len(verdicts)}",
        "panels": member.panels,
        "values": [
            value_text(member.conclusions.get(name), split_name(name)[1], other=False) for name in names
        ],
    }


def _spread(family: Family, hammer: Hammer) -> dict[str, Any]:
    """Return the constants relative to those of the shipped hammer, on a logarithmic axis."""
    ratios: dict[str, list[float]] = {}
    for key, constant in hammer.constants.items():
        values = [member.constants[key] for member in family.hammers if key in member.constants]
        if values and all(value * constant.si > 0.0 for value in values):
            ratios[key] = [value / constant.si for value in values]
    moved = {key: many for key, many in ratios.items() if any(abs(ratio - 1.0) > SAME for ratio in many)}
    widest = max((abs(math.log(ratio)) for many in moved.values() for ratio in many), default=1.0)
    return {
        "rows": [
            {
                "key": key,
                "low": f"{min(many):.3g}",
                "high": f"{max(many):.3g}",
                "dots": _dots([math.log(ratio) for ratio in many], (-widest, widest)),
            }
            for key, many in moved.items()
        ],
        "same": [key for key in ratios if key not in moved],
        "ends": (f"{math.exp(-widest):.2g}", f"{math.exp(widest):.2g}"),
    }


def _claims(family: Family) -> dict[str, Any]:
    """Return which claims hold for all hammers, for some, and for none."""
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
