"""The report as a PDF, for print and for the shelf; needs nothing but matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.figures.elements.style import INK, MUTED, in_style
from printhammer.report.page import KINDS, by_kind, judged_lines, statuses_of
from printhammer.report.pdf_results import (
    BAD,
    COLORS,
    body,
    failing_pages,
    family_pages,
    provenance_pages,
    rates_pages,
    reconstruction_pages,
    verdict_of,
    words_of,
)
from printhammer.report.quantities import percent, typeset
from printhammer.report.sheet import MARGIN, SERIF, Sheet, Words

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.claims import Result
    from printhammer.report.build import Report

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
            failing_pages(sheet, report)
            rates_pages(sheet, report)
            reconstruction_pages(sheet, report)
            family_pages(sheet, report)
            provenance_pages(sheet, report)
            sheet.close()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be written ({error.strerror or error})") from None


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
    held, failed, pending = (report.count(name) for name in ("holds", "fails", "not yet"))
    told = f"{held} of {len(report.results)} claims hold, {failed} fail"
    told += f", {pending} cannot be judged yet." if pending else "."
    sheet.write(Words(told, 11.0, weight="bold"), after=6.0)
    for kind, row in by_kind(report.results).items():
        x = MARGIN + 60.0
        sheet.put(Words(kind), MARGIN, sheet.y)
        for verdict, count in row.items():
            for _ in range(count):
                sheet.box(x, sheet.y + 1.0, 8.0, 8.0, COLORS[verdict])
                if verdict != "holds":
                    sheet.box(x + 1.5, sheet.y + 2.5, 5.0, 5.0, "white")
                x += 10.0
        sheet.put(Words(f"{row['holds']} of {sum(row.values())}", 8.0, MUTED), x + 6.0, sheet.y)
        sheet.y += 13.0
    sheet.heading("The hammer")
    told = ", ".join(f"{count} {status}" for status, count in statuses_of(hammer).items())
    sheet.write(
        body(f"Of its {len(hammer.constants)} constants: {told}. {' '.join(hammer.note.split())}"), after=8.0
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
        sheet.write(body(f"Not drawn: {drawing.reason}."), after=10.0)
    else:
        sheet.picture(drawing.figure, title)
    sheet.write(Words(drawing.caption, 8.0, MUTED), after=14.0)
    sheet.write(Words("What the paper says, in our words", 8.0, MUTED, weight="bold"), after=2.0)
    sheet.write(body(drawing.says), after=12.0)
    if drawing.claims:
        rows = [
            [
                [verdict_of(result.verdict)],
                [Words(words_of(result.claim.name))],
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
            Words(words_of(claim.name), 8.0, weight="bold"),
            Words(f"{claim.kind}; {claim.source}", 7.0, MUTED),
        ]
        if share is not None:
            names.append(Words(f"base rate {percent(share.rate)}", 7.0, MUTED))
        rows.append(
            [
                [verdict_of(result.verdict)],
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
            INK if line["met"] else BAD,
        )
        for line in judged_lines(result)
    ]
