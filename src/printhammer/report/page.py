"""HTML page of a report: one self-contained file, rendered from texts and positions on scales."""

from __future__ import annotations

import base64
import json
import math
from collections import Counter
from collections.abc import Iterable
from importlib.resources import files
from typing import Any, Final

from printhammer.claims import Claim, JudgedClaim
from printhammer.claims import claims as every_claim
from printhammer.claims.verdicts import panel_name, printed_verdicts
from printhammer.hammer.hammer import Hammer
from printhammer.report.contents import (
    Miss,
    Report,
    band_text,
    linked_source,
    misses,
    percent,
    split_name,
    typeset,
    value_text,
    words_of,
)
from printhammer.report.reconstruction.results import BestFor, Family, FamilyMember, Share

SAME: Final = 1e-9
"""Relative tolerance for equal constants; larger than the rounding errors of unit conversions. Arbitrary."""


def share_view(share: Share, floor: float | None = None) -> dict[str, Any]:
    """Return a fraction and its confidence interval, as texts and as positions in percent of a scale.

    The scale is linear from 0 to 1; or, with a `floor`, logarithmic from `floor` to 1.
    """
    low, high = share.interval

    def place(part: float) -> float:
        if floor is None:
            return 100.0 * part
        return 100.0 * (1.0 - math.log10(max(part, floor)) / math.log10(floor))

    return {
        "share": share,
        "rate": percent(share.rate),
        "interval": f"{percent(low)} to {percent(high)}",
        "dot": f"{place(share.rate):.2f}",
        "low": f"{place(low):.2f}",
        "width": f"{place(high) - place(low):.2f}",
    }


def rates_view(report: Report) -> dict[str, Any] | None:
    """Return the fraction of random hammers for which each claim holds, ascending; None without data."""
    rates = report.reconstruction.base_rates
    if rates is None:
        return None
    shares = [(result, rates.share(result.claim.name)) for result in report.results]
    known = [(result, share) for result, share in shares if share is not None]
    # A rate of zero is drawn at the left end of the logarithmic axis.
    positive = [share.rate or share.interval[1] for _, share in known]
    decades = max(1, math.ceil(-math.log10(min(positive)) - 1e-12)) if positive else 1
    floor = 10.0**-decades
    known.sort(key=lambda entry: entry[1].rate)
    return {
        "rates": rates,
        "rows": [{"result": result, **share_view(share, floor)} for result, share in known],
        "unknown": [result for result, share in shares if share is None],
        "ticks": [
            {"text": percent(10.0**-k), "place": f"{100.0 * (1.0 - k / decades):.2f}"}
            for k in range(decades, -1, -1)
        ],
    }


def panels_view(report: Report) -> list[dict[str, Any]]:
    """Return, for each panel of Fig. 11, the verdict of the paper and the computed verdict.

    An entry also contains the fraction of random hammers whose computed verdict is that of the paper.
    """
    verdicts: list[str] = []
    for result in report.results:
        if result.claim.name == "poincare" and result.value is not None:
            verdicts = result.value["verdicts"]
    rates = report.reconstruction.base_rates
    shares = {} if rates is None else rates.panels
    if not verdicts:
        return []
    rows = []
    for (period, printed), verdict in zip(printed_verdicts().items(), verdicts, strict=True):
        share = shares.get(panel_name(period))
        rows.append(
            {
                "name": panel_name(period),
                "printed": printed.replace("-", " "),
                "found": verdict.replace("-", " "),
                "same": verdict == printed,
                "base": None if share is None else share_view(share),
            }
        )
    return rows


def schemes_view(report: Report) -> dict[str, Any] | None:
    """Return the effect of the 1983 integrators on Fig. 11; None if computed for another hammer."""
    found = report.reconstruction.schemes
    if found is None or found.shipped != report.hammer.fingerprint:
        return None
    printed = list(printed_verdicts().values())
    rows = [
        {
            "way": way,
            "panels": [
                {"text": name.replace("-", " "), "same": name == wanted}
                for name, wanted in zip(names, printed, strict=True)
            ],
            "as_printed": sum(map(str.__eq__, names, printed)),
        }
        for way, names in found.panels.items()
    ]
    changes = [
        {
            **row.model_dump(),
            "rate": percent(row.share),
            "interval": "" if row.share_error is None else f"± {percent(row.share_error)}",
        }
        for row in found.changes
    ]
    return {
        "found": found,
        "names": [panel_name(period) for period in printed_verdicts()],
        "printed": [name.replace("-", " ") for name in printed],
        "rows": rows,
        "changes": changes,
        "family": list(found.family.values()),
    }


def predictions_view(report: Report) -> dict[str, Any] | None:
    """Return, for hammers fitted to the stated claims, the fraction for which each other claim holds."""
    predictions = report.reconstruction.predictions
    if predictions is None or not report.reconstructed:
        return None
    rates = report.reconstruction.base_rates
    verdicts = {result.claim.name: result for result in report.results}
    rows = []
    for name in every_claim():
        share = predictions.share(name)
        if share is None or predictions.claims[name].kind == "stated":
            continue
        base = None if rates is None else rates.share(name)
        rows.append(
            {
                "name": name,
                "kind": predictions.claims[name].kind,
                "result": verdicts.get(name),
                "base": None if base is None else share_view(base),
                **share_view(share),
            }
        )
    return {"found": predictions, "rows": rows}


def failing_view(report: Report) -> list[dict[str, Any]]:
    """Return the failing claims, each with its distance from the band and the reason for the failure.

    An entry also contains the hammer that satisfies the claim most closely, if it is known.
    """
    search = report.search
    rows = []
    for result in report.results:
        if result.verdict == "fails":
            known = None if search is None else search.failing.get(result.claim.name)
            best = None if known is None else known.best
            rows.append(
                {
                    "result": result,
                    "misses": misses(result.claim, result.value),
                    "why": "" if known is None else known.why,
                    "best": None if best is None else _best_view(best, result.claim, report.hammer),
                }
            )
    return rows


def _best_view(best: BestFor, claim: Claim, hammer: Hammer) -> dict[str, Any]:
    missed = {miss.words: miss for miss in misses(claim, best.value)}
    lines = []
    for name, wanted in claim.band.items():
        words, unit = split_name(name)
        if name in best.value:
            miss = missed.get(words)
            kept = Miss(words, value_text(best.value[name], unit), band_text(wanted, unit), "")
            lines.append({"miss": miss or kept, "met": miss is None})
    constants = []
    for key, value in best.constants.items():
        constant = hammer.constants.get(key)
        ratio = value / constant.si if constant is not None and constant.si else None
        if ratio is None or not math.isclose(ratio, 1.0, rel_tol=SAME):
            constants.append(
                {
                    "key": key,
                    "value": f"{value:.4g}",
                    "shipped": "" if constant is None else f"{constant.si:.4g}",
                    "unit": "" if constant is None else constant.si_unit,
                    "ratio": "" if ratio is None else f"{ratio:.3g}",
                }
            )
    return {"holds": best.holds, "lines": lines, "constants": constants, "costs": best.costs}


def timings_view(report: Report) -> dict[str, Any]:
    """Return the computation times [s] of figures and claims, the slowest first."""
    entries: list[tuple[str, str, float]] = [
        (f"Figure {drawing.number}", f"figure-{drawing.number}", drawing.seconds)
        for drawing in report.drawings
    ]
    entries += [(words_of(result.claim.name), result.claim.name, result.seconds) for result in report.results]
    longest = max((seconds for *_, seconds in entries), default=0.0) or 1.0
    return {
        "rows": [
            {"name": name, "to": to, "seconds": f"{seconds:.2f}", "width": f"{100.0 * seconds / longest:.1f}"}
            for name, to, seconds in sorted(entries, key=lambda entry: -entry[2])
        ],
        "all": f"{report.seconds:.1f}",
        "figures": f"{sum(drawing.seconds for drawing in report.drawings):.1f}",
        "claims": f"{sum(result.seconds for result in report.results):.1f}",
    }


_ROOM: Final = 4.0
"""Margin at each end of a scale, in percent of its length; arbitrary."""


def family_view(report: Report) -> dict[str, Any] | None:
    """Return conclusions, claims, members and constants of the family; None without a family."""
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
    """Return the conclusions about the family; conclusions that hold for all hammers come first."""
    rows = []
    for name, conclusion in family.conclusions.items():
        words, unit = split_name(name)
        values = [member.conclusions.get(name) for member in family.hammers]
        # Statements have no value per hammer; their range is that of margins, which the page does not show.
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
    """Return the positions of values on a linear scale, in percent of its length.

    The scale extends between `ends`, by default the smallest and the largest value, plus a margin.
    """
    values = list(values)
    low, high = ends or (min(values, default=0.0), max(values, default=0.0))
    span = high - low
    return [f"{_ROOM + (100.0 - 2.0 * _ROOM) * ((v - low) / span if span else 0.5):.2f}" for v in values]


def _member(member: FamilyMember, names: list[str]) -> dict[str, Any]:
    """Return the table row of a hammer of the family: counts of claims that hold, and conclusions."""
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
    """Return the family's constants as ratios to those of the shipped hammer, on a logarithmic axis."""
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
    """Return the claims that hold for all hammers of the family, for some hammers, and for none."""
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


KINDS: Final = {
    "stated": "the paper prints the number or the verdict; the band is the printed precision",
    "typical": "the paper calls it typical of such actuators, or an ideal; the band is wide",
    "shape": "a qualitative statement turned into a number; the threshold is ours",
}
VERDICTS: Final = ("holds", "fails", "not yet")


def page(report: Report) -> str:
    """Render the HTML page of a report."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("printhammer", "report/templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["typeset"] = typeset
    environment.filters["percent"] = percent
    environment.filters["words"] = words_of
    style = files("printhammer").joinpath("report", "templates", "page.css").read_text(encoding="utf-8")
    images = [base64.b64encode(drawing.svg).decode("ascii") for drawing in report.drawings]
    drawings = [
        {"drawing": drawing, "image": image} for drawing, image in zip(report.drawings, images, strict=True)
    ]
    return environment.get_template("page.html.j2").render(
        style=style, report=report, drawings=drawings, **view(report)
    )


def view(report: Report) -> dict[str, Any]:
    """Return the data of a report for page and PDF, as texts and positions on horizontal scales."""
    drawn = {drawing.number for drawing in report.drawings}
    constants = report.hammer.constants.values()
    by_kind = {kind: dict.fromkeys(VERDICTS, 0) for kind in KINDS}
    for result in report.results:
        by_kind[result.claim.kind][result.verdict] += 1
    return {
        "hammer": report.hammer,
        "statuses": dict(Counter(constant.status for constant in constants)),
        "has_reconstructed": any(constant.status == "reconstructed" for constant in constants),
        "parts": _parts(report.hammer),
        "statements": report.statements,
        "verdicts": {verdict: report.count(verdict) for verdict in VERDICTS},
        "kinds": KINDS,
        "by_kind": by_kind,
        "judged": {result.claim.name for result in report.results},
        "claims": [_claim(result, report, drawn) for result in report.results],
        "failing": failing_view(report),
        "rates": rates_view(report),
        "panels": panels_view(report),
        "schemes": schemes_view(report),
        "search": report.search,
        "predictions": predictions_view(report),
        "family": family_view(report),
        "timings": timings_view(report),
    }


def _parts(hammer: Hammer) -> list[dict[str, Any]]:
    """Group the constants of a hammer by part, with the law of each part."""
    sections: dict[str, list[Any]] = {}
    for key, constant in hammer.constants.items():
        sections.setdefault(key.rpartition(".")[0], []).append(constant)
    return [
        {"name": name or "armature and platen", "law": hammer.laws.get(name, ""), "constants": constants}
        for name, constants in sections.items()
    ]


def _judged_lines(result: JudgedClaim) -> list[dict[str, Any]]:
    """Format the banded values of a claim: name, measured value, band, and whether the band is met."""
    value, missed = result.value or {}, set(result.missed)
    lines = []
    for name, wanted in result.claim.band.items():
        words, unit = split_name(name)
        shown = value_text(value.get(name), unit) if result.value is not None else ""
        lines.append(
            {"words": words, "value": shown, "band": band_text(wanted, unit), "met": name not in missed}
        )
    return lines


def _claim(result: JudgedClaim, report: Report, drawn: set[int]) -> dict[str, Any]:
    """Return a claim with its values as text; values with bands are listed separately."""
    value, band = result.value or {}, result.claim.band
    rest = {name: entry for name, entry in value.items() if name not in band}
    plain = {
        words: value_text(entry, unit)
        for name, entry in rest.items()
        for words, unit in [split_name(name)]
        if not isinstance(entry, (dict, list))
    }
    long = {
        name: json.dumps(entry) for name, entry in rest.items() if isinstance(entry, (dict, list)) and entry
    }
    rates, schemes = report.reconstruction.base_rates, report.reconstruction.schemes
    computed = schemes is not None and schemes.shipped == report.hammer.fingerprint
    return {
        "result": result,
        "source": linked_source(result.claim.source, drawn),
        "judged": _judged_lines(result),
        "plain": plain,
        "long": long,
        "measured": result.value is not None,
        "share": None if rates is None else rates.share(result.claim.name),
        "in_1983": schemes.claims.get(result.claim.name) if schemes is not None and computed else None,
    }
