"""Summaries: the same facts on the terminal, in a notebook and in both unit systems."""

import numpy as np
import pytest

import printhammer as ph
from printhammer.results import Cells, Facts, Grid, Result, Summary, column, scalar
from printhammer.results.summary import interval, judged, quantity, rendered, styled, worded
from printhammer.support.arrays import FloatArray


class Fall(Result, rows="fall"):
    """Falls of a stone."""

    time: FloatArray = column("s", "time of the fall", "fall")
    tolerance: float = scalar("1", "error allowed in one step")


def test_a_result_says_what_it_declares() -> None:
    text = str(Fall(time=np.array([1.0, 2.5, np.nan]), tolerance=1e-9))
    assert text.splitlines() == [
        "Fall",
        "time       1 to 2.5 s, time of the fall",
        "tolerance  1e-09, error allowed in one step",
    ]


SUMMARY = Summary(
    [
        styled("strong", "two dots"),
        Facts(
            [
                ("force", quantity(22.2411, "N")),
                ("lost", None),
                ("flight", interval(np.array([1e-4, 3e-4]), "s")),
            ]
        ),
        Grid(
            [
                Cells("depth", np.array([25.4e-6, np.nan]), "m"),
                Cells("share", [0.5, None], "%", ".1f"),
                Cells("verdict", [judged(True, "good"), "[bad]"], left=True),
            ],
            "Dots",
        ),
    ]
)


def test_the_noun_of_a_device_stands_for_dot() -> None:
    said = SUMMARY.worded("closing").text()
    assert said == SUMMARY.text().replace("two dots", "two closings").replace("Dots", "Closings")
    assert SUMMARY.worded("dot") == SUMMARY
    assert worded("2 of 3 dots printed, no dot matrix, dot-peen", "hit") == (
        "2 of 3 hits made, no dot matrix, dot-peen"
    )


def test_units_are_chosen_when_a_summary_is_rendered() -> None:
    assert SUMMARY.text().splitlines() == [
        "two dots",
        "force   22.24 N",
        "flight  100.0 µs to 300.0 µs",
        "Dots",
        "depth [µm]  share [%]  verdict",
        "     25.40        0.5  good",
        "         –          –  [bad]",
    ]
    assert "force   5.000 lbf" in SUMMARY.text("inch")
    assert "     1.000" in SUMMARY.text("inch")


def test_a_notebook_shows_the_facts_without_marks() -> None:
    html = SUMMARY._repr_html_()
    assert "<td>25.40</td>" in html
    assert "<th>depth [µm]</th>" in html
    assert not set("⟦⟧⟪⟫") & set(html)


def test_of_a_long_table_the_ends_are_shown() -> None:
    rows = Grid([Cells("number", range(10)), Cells("double", range(0, 20, 2))], most=4).rows("si")
    assert rows == [("0", "0"), ("1", "2"), ["…", "6 more"], ("8", "16"), ("9", "18")]


def test_marks_of_style_are_shown_by_the_terminal() -> None:
    marked = f"{judged(False, quantity(1e-3, 's'))}, {quantity(None, 's')}"
    assert rendered(marked) == "1000.0 µs, –"
    assert rendered(marked, style=lambda style, said: f"<{style}>{said}") == "<poor>1000.0 µs, –"


def test_print_shows_the_summary_of_a_motion(capsys: pytest.CaptureFixture[str]) -> None:
    hammer = ph.load("hendriks-1983")
    print(ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate="2 kHz", pulses=2)))
    out = capsys.readouterr().out
    assert out.startswith("motion of hendriks-1983, 0 s to ")
    assert "fired [µs]" in out
    assert "residual" in out
