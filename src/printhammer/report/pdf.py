"""The report as a PDF, for print and for the shelf; needs nothing but matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.figures.style import BLUE, INK, MUTED, in_style
from printhammer.report.page import KINDS, by_kind, judged_lines, statuses_of
from printhammer.report.quantities import percent, typeset
from printhammer.report.sheet import LINE, MARGIN, SERIF, Sheet, Words
from printhammer.report.views import (
    claims_of_family,
    conclusions_view,
    failing_view,
    predictions_view,
    rates_view,
    timings_view,
)

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.claims import Result
    from printhammer.report.build import Report

_GOOD: Final = "#1b6b42"
_BAD: Final = "#a3261f"
_WAIT: Final = "#765300"
_COLORS: Final = {"holds": _GOOD, "fails": _BAD, "not yet": _WAIT}
_TITLE: Final = "Bounce and Chaotic Motion in Impact Print Hammers"


def write_pdf(report: Report, path: Path) -> None:
    """Write a report as a PDF.

    The figures of the report are laid out anew, each on its page.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    metadata: Any = {"Title": f"{_TITLE}: {report.hammer.name}", "CreationDate": None, "Producer": None}
    try:
        # Fonts are embedded when the file is closed, so the style holds till then.
        with in_style(), PdfPages(path, metadata=metadata) as pdf:
            sheet = Sheet(pdf, f"{_TITLE}: {report.hammer.name} {report.hammer.fingerprint[:8]}")
            _front(sheet, report)
            for drawing in report.drawings:
                _figure(sheet, drawing)
            sheet.page()
            _claims(sheet, report)
            _failing(sheet, report)
            _rates(sheet, report)
            _reconstruction(sheet, report)
            _family(sheet, report)
            _provenance(sheet, report)
            sheet.close()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be written ({error.strerror or error})") from None


def _words(name: str) -> str:
    return name.replace("_", " ")


def _body(text: str, color: str = INK) -> Words:
    return Words(typeset(text), 9.0, color, SERIF)


def _verdict(verdict: str, size: float = 8.0) -> Words:
    return Words(verdict, size, _COLORS[verdict], weight="bold")


def _front(sheet: Sheet, report: Report) -> None:
    """Write title, score and constants."""
    hammer = report.hammer
    sheet.page()
    sheet.write(Words(f"printhammer {report.provenance['printhammer']}", 8.0, MUTED), after=4.0)
    sheet.write(Words(_TITLE, 22.0, family=SERIF, weight="bold"), after=8.0)
    of = f": {hammer.title}" if hammer.title else ""
    sheet.write(
        Words(
            "The figures and claims of F. Hendriks, IBM Journal of Research and Development 27 (1983),"
            f" computed anew for the hammer {hammer.name}{of}.",
            10.5,
            family=SERIF,
        ),
        after=12.0,
    )
    counts = ", ".join(f"{report.count(name)} {name}" for name in _COLORS)
    sheet.write(Words(f"{len(report.results)} claims: {counts}", 11.0, weight="bold"), after=6.0)
    for kind, row in by_kind(report.results).items():
        x = MARGIN + 60.0
        sheet.put(Words(kind), MARGIN, sheet.y)
        for verdict, count in row.items():
            for _ in range(count):
                sheet.box(x, sheet.y + 1.0, 8.0, 8.0, _COLORS[verdict])
                if verdict != "holds":
                    sheet.box(x + 1.5, sheet.y + 2.5, 5.0, 5.0, "white")
                x += 10.0
        sheet.put(Words(f"{row['holds']} of {sum(row.values())}", 8.0, MUTED), x + 6.0, sheet.y)
        sheet.y += 13.0
    sheet.heading("The hammer")
    told = ", ".join(f"{count} {status}" for status, count in statuses_of(hammer).items())
    sheet.write(
        _body(f"Of its {len(hammer.constants)} constants: {told}. {' '.join(hammer.note.split())}"), after=8.0
    )
    rows = [
        [
            [Words(constant.key, 6.5)],
            [Words(constant.meaning, 6.5)],
            [Words(f"{constant.value:.9g} {constant.unit}", 6.5)],
            [Words(constant.status, 6.5, MUTED)],
            [Words(constant.source, 6.0, MUTED)],
        ]
        for constant in hammer.constants.values()
    ]
    sheet.table(["Constant", "Meaning", "Value", "Status", "Source"], [0.16, 0.22, 0.2, 0.12, 0.3], rows)


def _figure(sheet: Sheet, drawing: Any) -> None:
    title = f"Figure {drawing.number}  {drawing.title}"
    if drawing.figure is None:
        sheet.page()
        sheet.heading(title)
        sheet.write(_body(f"Not drawn: {drawing.reason}."), after=10.0)
    else:
        sheet.picture(drawing.figure, title)
    sheet.write(Words(drawing.caption, 8.0, MUTED), after=14.0)
    sheet.write(Words("What the paper says, in our words", 8.0, MUTED, weight="bold"), after=2.0)
    sheet.write(_body(drawing.says), after=12.0)
    if drawing.claims:
        rows = [
            [
                [_verdict(result.verdict)],
                [Words(_words(result.claim.name))],
                [Words(typeset(result.detail), 7.5, MUTED)],
            ]
            for result in drawing.claims
        ]
        sheet.table(["Verdict", "Claim", "What this hammer does"], [0.1, 0.28, 0.62], rows)


def _claims(sheet: Sheet, report: Report) -> None:
    sheet.heading("Claims", before=0.0)
    for kind, text in KINDS.items():
        sheet.write(Words(f"{kind}: {text}", 8.0), after=1.0)
    sheet.y += 8.0
    rates = report.found.base_rates
    rows = []
    for result in report.results:
        claim = result.claim
        share = None if rates is None else rates.share(claim.name)
        names = [
            Words(_words(claim.name), 8.0, weight="bold"),
            Words(f"{claim.kind}; {claim.source}", 7.0, MUTED),
        ]
        if share is not None:
            names.append(Words(f"base rate {percent(share.rate)}", 7.0, MUTED))
        rows.append(
            [
                [_verdict(result.verdict)],
                names,
                [Words(typeset(claim.says), 7.5, family=SERIF), Words(typeset(claim.reading), 7.0, MUTED)],
                [*_measured(result), Words(typeset(result.detail), 7.0, MUTED)],
            ]
        )
    sheet.table(
        ["Verdict", "Claim", "The paper, and how it is read", "Measured, and the band"],
        [0.09, 0.2, 0.36, 0.35],
        rows,
    )


def _measured(result: Result) -> list[Words]:
    if result.value is None:
        return []
    return [
        Words(
            f"{'✓' if line['met'] else '✗'} {line['words']} {line['value']} · {line['band']}",
            7.5,
            INK if line["met"] else _BAD,
        )
        for line in judged_lines(result)
    ]


def _failing(sheet: Sheet, report: Report) -> None:
    found = failing_view(report)
    if not found:
        return
    sheet.heading("What fails, and by how much")
    rows = []
    for row in found:
        result, best = row["result"], row["best"]
        gaps = [
            Words(" ".join(filter(None, (miss.words, miss.value, miss.band, miss.distance))), 7.5, _BAD)
            for miss in row["misses"]
        ] or [Words(typeset(result.detail), 7.5)]
        told = [Words(typeset(row["why"]), 7.5)] if row["why"] else []
        if best is not None:
            told += [
                Words("best hammer for it: " + ("satisfies it" if best["holds"] else "misses it too"), 7.5)
            ]
            told += [
                Words(
                    " ".join(filter(None, (line["miss"].words, line["miss"].value, line["miss"].distance))),
                    7.5,
                )
                for line in best["lines"]
            ]
            lost = ", ".join(map(_words, best["costs"])) or "none"
            told += [Words(f"claims that it loses: {lost}", 7.0, MUTED)]
        rows.append([[Words(_words(result.claim.name), 8.0, weight="bold")], gaps, told])
    sheet.table(["Claim", "By how much", "Why, and the best hammer for it"], [0.2, 0.38, 0.42], rows)


def _rates(sheet: Sheet, report: Report) -> None:
    found = rates_view(report)
    if found is None:
        return
    rates = found["rates"]
    sheet.heading("Base rates: how hard-won each verdict is")
    sheet.write(
        _body(
            f"The share of {rates.hammers} random plausible hammers (seed {rates.seed}) for which each claim"
            " holds, with its 95 % interval, on a logarithmic scale."
        ),
        after=8.0,
    )
    left, span = MARGIN + 150.0, 220.0
    for tick in found["ticks"]:
        place = left + span * float(tick["place"]) / 100.0
        sheet.put(Words(tick["text"], 7.0, MUTED), place, sheet.y, ha="center")
    sheet.y += 13.0
    for row in found["rows"]:
        sheet.room(12.0)
        result, y = row["result"], sheet.y
        sheet.put(Words(_words(result.claim.name), 7.5), MARGIN, y)
        sheet.box(left, y + 4.7, span, 0.4, LINE)
        sheet.box(
            left + span * float(row["low"]) / 100.0, y + 4.2, span * float(row["width"]) / 100.0, 1.4, BLUE
        )
        place = left + span * float(row["dot"]) / 100.0
        sheet.box(place - 3.0, y + 1.9, 6.0, 6.0, _COLORS[result.verdict])
        if result.verdict != "holds":
            sheet.box(place - 1.7, y + 3.2, 3.4, 3.4, "white")
        sheet.put(Words(f"{row['rate']}   ({row['interval']})", 7.0), left + span + 12.0, y)
        sheet.y += 12.0


def _reconstruction(sheet: Sheet, report: Report) -> None:
    search = report.found.search
    if search is None or not report.reconstructed:
        return
    sheet.heading("The reconstruction")
    sheet.write(
        _body(
            "The paper prints no constants. Those of this hammer were sought so that the model does what the"
            " paper tells, so a claim that steered the search and holds is agreement, not proof. What it is"
            " worth, the base rates tell; what the search was not told, the predictions below. Claims of kind"
            " typical never steered."
        ),
        after=6.0,
    )
    tried, effort = search.candidates, f"{search.core_hours:.3g} hours of one core"
    for text in (
        f"Hammers tried: {tried.stated} on the stated claims alone, {tried.all} on all.",
        f"Effort: {effort}; seed {search.seed}; tolerance {search.tolerance:g}.",
        f"Waveform: {search.waveform}. Gauge: {search.gauge}.",
    ):
        sheet.write(Words(text), after=2.0)
    found = predictions_view(report)
    if found is None or not found["rows"]:
        return
    sheet.y += 8.0
    held = ", ".join(map(_words, found["found"].stated_held)) or "none of them"
    sheet.write(
        _body(
            f"Predictions. A search that knew the stated claims alone kept {found['found'].hammers} hammers,"
            f" all of which satisfy {held}. Shares of those for which the other claims hold:"
        ),
        after=6.0,
    )
    rows = [
        [
            [Words(_words(row["name"]))],
            [Words(row["kind"], 8.0, MUTED)],
            [Words(f"{row['rate']} ({row['interval']})")],
            [Words(row["base"]["rate"] if row["base"] else "")],
            [_verdict(row["result"].verdict)] if row["result"] else [],
        ]
        for row in found["rows"]
    ]
    sheet.table(["Claim", "Kind", "Predicted", "Base rate", "Here"], [0.32, 0.12, 0.3, 0.14, 0.12], rows)


def _family(sheet: Sheet, report: Report) -> None:
    family, claims = report.found.family, claims_of_family(report)
    if family is None or claims is None:
        return
    sheet.heading("The family: what the constants decide, and what they do not")
    sheet.write(
        _body(
            f"These {len(family.hammers)} hammers are clearly different, and satisfy the claims about as well"
            " as the one above. What holds for all of them follows from what the paper prints."
        ),
        after=6.0,
    )
    rows = [
        [
            [Words(row["words"], 8.0, weight="bold"), Words(typeset(row["text"]), 7.0, MUTED)],
            [Words(row["low"])],
            [Words(row["high"])],
            [Words("holds for all", 8.0, _GOOD) if row["robust"] else Words("depends", 8.0, _WAIT)],
        ]
        for row in conclusions_view(report)
    ]
    sheet.table(["Conclusion", "Lowest", "Highest", ""], [0.52, 0.16, 0.16, 0.16], rows)
    sheet.y += 8.0
    some = ", ".join(f"{_words(name)} ({holds} of {count})" for name, holds, count in claims["some"])
    for lead, text in (
        ("Claims that hold for all", ", ".join(map(_words, claims["every"]))),
        ("for some", some),
        ("for none", ", ".join(map(_words, claims["none"]))),
    ):
        if text:
            sheet.write(Words(f"{lead}: {text}."), after=3.0)


def _provenance(sheet: Sheet, report: Report) -> None:
    sheet.heading("Provenance")
    rows = [
        [[Words(_words(key), 7.5, MUTED)], [Words(str(value), 7.5)]]
        for key, value in report.provenance.items()
    ]
    sheet.table(["Setting", "Value"], [0.3, 0.7], rows)
    found = timings_view(report)
    sheet.y += 8.0
    slowest = ", ".join(f"{row['name']} {row['seconds']} s" for row in found["rows"][:10])
    sheet.write(
        Words(
            f"Times: all {found['all']} s, claims {found['claims']} s, figures {found['figures']} s;"
            f" {slowest}.",
            7.5,
        )
    )
