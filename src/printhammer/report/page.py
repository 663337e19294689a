"""The page of a report: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import json
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from printhammer.report.quantities import band_text, split_name, typeset, value_text

if TYPE_CHECKING:
    from printhammer.claims import Result
    from printhammer.hammer import Hammer
    from printhammer.report.build import Report

_KINDS: Final = {
    "stated": "the paper prints the number or the verdict; the band is the printed precision",
    "typical": "the paper calls it typical of such actuators, or an ideal; the band is wide",
    "shape": "a qualitative statement turned into a number; the threshold is ours",
}


def page(report: Report) -> str:
    """Return the HTML page of a report."""
    from jinja2 import Environment, StrictUndefined

    folder = files("printhammer").joinpath("report")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["typeset"] = typeset
    template = environment.from_string(folder.joinpath("page.html.j2").read_text(encoding="utf-8"))
    return template.render(
        style=folder.joinpath("page.css").read_text(encoding="utf-8"),
        hammer=report.hammer,
        statuses=_statuses(report.hammer),
        reconstruction=any(c.status == "reconstructed" for c in report.hammer.constants.values()),
        parts=_parts(report.hammer),
        verdicts={verdict: report.count(verdict) for verdict in ("holds", "fails", "not yet")},
        kinds=_KINDS,
        by_kind=_by_kind(report.results),
        claims=[_claim(result) for result in report.results],
        drawings=[
            {
                "number": drawing.number,
                "title": drawing.title,
                "caption": drawing.caption,
                "says": " ".join(drawing.says.split()),
                "image": base64.b64encode(drawing.svg).decode("ascii"),
                "reason": drawing.reason,
                "claims": drawing.claims,
            }
            for drawing in report.drawings
        ],
        provenance=report.provenance,
        seconds=report.seconds,
        slowest=sorted(report.results, key=lambda result: -result.seconds)[:5],
        figure_seconds=sum(drawing.seconds for drawing in report.drawings),
        claim_seconds=sum(result.seconds for result in report.results),
    )


def _statuses(hammer: Hammer) -> dict[str, int]:
    found: dict[str, int] = {}
    for constant in hammer.constants.values():
        found[constant.status] = found.get(constant.status, 0) + 1
    return found


def _parts(hammer: Hammer) -> list[dict[str, Any]]:
    """Return the constants by part, sources numbered."""
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


def _by_kind(results: list[Result]) -> dict[str, dict[str, int]]:
    counts: dict[str, dict[str, int]] = {}
    for result in results:
        row = counts.setdefault(result.claim.kind, {"holds": 0, "fails": 0, "not yet": 0})
        row[result.verdict] += 1
    return counts


def _claim(result: Result) -> dict[str, Any]:
    """Return a claim with its values as text: those that are banded, and the others."""
    value, band = result.value or {}, result.claim.band
    missed = set(result.missed)
    judged = []
    for name, wanted in band.items():
        words, unit = split_name(name)
        judged.append(
            {
                "words": words,
                "value": value_text(value.get(name), unit) if result.value is not None else "",
                "band": band_text(wanted, unit),
                "met": name not in missed,
            }
        )
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
    return {
        "result": result,
        "judged": judged,
        "plain": plain,
        "long": long,
        "measured": result.value is not None,
    }
