"""The pages of the PDF that follow the claims: what fails, base rates, reconstruction, family, provenance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from printhammer.figures.elements.style import BLUE, INK, MUTED
from printhammer.report.family_views import claims_of_family, conclusions_view
from printhammer.report.quantities import typeset
from printhammer.report.sheet import LINE, MARGIN, SERIF, Sheet, Words
from printhammer.report.views import failing_view, predictions_view, rates_view, timings_view

if TYPE_CHECKING:
    from printhammer.report.build import Report

GOOD: Final = "#1b6b42"
BAD: Final = "#a3261f"
WAIT: Final = "#765300"
COLORS: Final = {"holds": GOOD, "fails": BAD, "not yet": WAIT}
"""Colours of verdicts."""


def words_of(name: str) -> str:
    """Return the name of a claim as words."""
    return name.replace("_", " ")


def body(text: str) -> Words:
    """Return running text."""
    return Words(typeset(text), 9.0, INK, SERIF)


def verdict_of(verdict: str) -> Words:
    """Return a verdict in its colour."""
    return Words(verdict, 8.0, COLORS[verdict], weight="bold")


def failing_pages(sheet: Sheet, report: Report) -> None:
    """Write what fails and by how much."""
    found = failing_view(report)
    if not found:
        return
    sheet.heading("What fails, and by how much")
    rows = []
    for row in found:
        result, best = row["result"], row["best"]
        gaps = [
            Words(" ".join(filter(None, (miss.words, miss.value, miss.band, miss.distance))), 7.5, BAD)
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
            lost = ", ".join(map(words_of, best["costs"])) or "none"
            told += [Words(f"claims that it loses: {lost}", 7.0, MUTED)]
        rows.append([[Words(words_of(result.claim.name), 8.0, weight="bold")], gaps, told])
    sheet.table(["Claim", "By how much", "Why, and the best hammer for it"], [0.2, 0.38, 0.42], rows)


def rates_pages(sheet: Sheet, report: Report) -> None:
    """Write how often each claim holds among random hammers."""
    found = rates_view(report)
    if found is None:
        return
    rates = found["rates"]
    sheet.heading("Base rates: how hard-won each verdict is")
    sheet.write(
        body(
            f"The share of {rates.hammers} random plausible hammers (seed {rates.seed}) for which each claim"
            " holds, with its 95 % interval, on a logarithmic scale; where fewer were judged, of how many."
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
        sheet.put(Words(words_of(result.claim.name), 7.5), MARGIN, y)
        sheet.box(left, y + 4.7, span, 0.4, LINE)
        sheet.box(
            left + span * float(row["low"]) / 100.0, y + 4.2, span * float(row["width"]) / 100.0, 1.4, BLUE
        )
        place = left + span * float(row["dot"]) / 100.0
        sheet.box(place - 3.0, y + 1.9, 6.0, 6.0, COLORS[result.verdict])
        if result.verdict != "holds":
            sheet.box(place - 1.7, y + 3.2, 3.4, 3.4, "white")
        measured = row["share"].measured
        fewer = f", of {measured}" if measured != rates.hammers else ""
        sheet.put(Words(f"{row['rate']}   ({row['interval']}{fewer})", 7.0), left + span + 12.0, y)
        sheet.y += 12.0


def reconstruction_pages(sheet: Sheet, report: Report) -> None:
    """Write how the constants were found, and what that predicts."""
    search = report.found.search
    if search is None or not report.reconstructed:
        return
    sheet.heading("The reconstruction")
    sheet.write(
        body(
            "The paper prints no constants. Those of this hammer were sought so that the model does what the"
            " paper tells, so a claim that steered the search and holds is agreement, not proof. What it is"
            " worth, the base rates tell; what the search was not told, the predictions below. Claims of kind"
            " typical never steered."
        ),
        after=6.0,
    )
    tried = ", ".join(
        f"{one.candidates} on {'the stated claims alone' if one.aim == 'stated' else 'all claims'}"
        f" (seed {one.seed})"
        for one in search.searches
    )
    for text in (
        f"Hammers tried: {tried}.",
        f"Effort: {search.core_hours:.3g} hours of one core; tolerance {search.tolerance:g}.",
        f"Waveform: {search.waveform}. Gauge: {search.gauge}.",
    ):
        sheet.write(Words(text), after=2.0)
    found = predictions_view(report)
    if found is None or not found["rows"]:
        return
    sheet.y += 8.0
    held = ", ".join(map(words_of, found["found"].stated_held)) or "none of them"
    sheet.write(
        body(
            f"Predictions. A search that knew the stated claims alone kept {found['found'].hammers} hammers,"
            f" all of which satisfy {held}. Shares of those for which the other claims hold:"
        ),
        after=6.0,
    )
    rows = [
        [
            [Words(words_of(row["name"]))],
            [Words(row["kind"], 8.0, MUTED)],
            [Words(f"{row['rate']} ({row['interval']})")],
            [Words(row["base"]["rate"] if row["base"] else "")],
            [verdict_of(row["result"].verdict)] if row["result"] else [],
        ]
        for row in found["rows"]
    ]
    sheet.table(["Claim", "Kind", "Predicted", "Base rate", "Here"], [0.32, 0.12, 0.3, 0.14, 0.12], rows)


def family_pages(sheet: Sheet, report: Report) -> None:
    """Write what holds for all hammers of the family."""
    family, claims = report.found.family, claims_of_family(report)
    if family is None or claims is None:
        return
    sheet.heading("The family: what the constants decide, and what they do not")
    sheet.write(
        body(
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
            [Words("holds for all", 8.0, GOOD) if row["robust"] else Words("depends", 8.0, WAIT)],
        ]
        for row in conclusions_view(report)
    ]
    sheet.table(["Conclusion", "Lowest", "Highest", ""], [0.52, 0.16, 0.16, 0.16], rows)
    sheet.y += 8.0
    some = ", ".join(f"{words_of(name)} ({holds} of {count})" for name, holds, count in claims["some"])
    for lead, text in (
        ("Claims that hold for all", ", ".join(map(words_of, claims["every"]))),
        ("for some", some),
        ("for none", ", ".join(map(words_of, claims["none"]))),
    ):
        if text:
            sheet.write(Words(f"{lead}: {text}."), after=3.0)


def provenance_pages(sheet: Sheet, report: Report) -> None:
    """Write versions, settings and times."""
    sheet.heading("Provenance")
    rows = [
        [[Words(words_of(key), 7.5, MUTED)], [Words(str(value), 7.5)]]
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
