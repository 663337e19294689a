"""HTML page of a report: one self-contained file."""

from __future__ import annotations

import base64
import json
from collections import Counter
from importlib.resources import files
from typing import Any, Final

from printhammer.claims import JudgedClaim
from printhammer.hammer.hammer import Hammer
from printhammer.report.contents import Report, linked_source
from printhammer.report.quantities import band_text, percent, split_name, typeset, value_text, words_of
from printhammer.report.views import (
    failing_view,
    family_view,
    panels_view,
    predictions_view,
    rates_view,
    schemes_view,
    timings_view,
)

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
    """Group the constants of a hammer by part, each group with the part's law."""
    laws = {role: part.law for role, part in hammer.parts.items()}
    if hammer.waveform is not None:
        laws["waveform"] = hammer.waveform.shape
    sections: dict[str, list[Any]] = {}
    for key, constant in hammer.constants.items():
        sections.setdefault(key.rpartition(".")[0], []).append(constant)
    return [
        {"name": name or "armature and platen", "law": laws.get(name, ""), "constants": constants}
        for name, constants in sections.items()
    ]


def _judged_lines(result: JudgedClaim) -> list[dict[str, Any]]:
    """Format the measured values of a claim that have bands: name, value, band, and whether it is met."""
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
