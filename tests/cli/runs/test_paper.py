import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from printhammer import report
from printhammer.claims import claims
from printhammer.claims.verdicts import printed_verdicts
from printhammer.figures import PaperFigure
from printhammer.report import build
from printhammer.report.reconstruction.results import Results


@pytest.fixture
def quick_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the verb write a report with few claims and one empty figure; the full report is slow."""
    whole = report.write_report

    def few(hammer, out, **options):
        return whole(hammer, out, claims=["geometry", "settle_out", "print_force"], figures=[2], **options)

    monkeypatch.setattr(report, "write_report", few)
    monkeypatch.setattr(PaperFigure, "draw", lambda *_arguments, **_options: Figure())


@pytest.mark.usefixtures("quick_report")
def test_paper(cli, tmp_path: Path) -> None:
    outcome = cli("paper", "--out", tmp_path / "paper")
    assert (outcome.status, outcome.err) == (0, "")
    assert {path.name for path in (tmp_path / "paper").iterdir()} == {"index.html", "claims.json", "figures"}
    entries = {entry["name"]: entry for entry in json.loads((tmp_path / "paper" / "claims.json").read_text())}
    for name, entry in entries.items():
        (line,) = [line for line in outcome.out.splitlines() if line.startswith(f"{name} ")]
        assert entry["verdict"] in line
        assert claims()[name].kind in line


@pytest.mark.usefixtures("quick_report")
def test_strict_ends_with_status_1_where_a_claim_fails(cli, hammer, tmp_path: Path) -> None:
    moved = tmp_path / "moved.toml"
    hammer.replace("platen", "0.016 in").save(moved)
    assert cli("paper", moved, "--out", tmp_path / "paper").status == 0
    assert cli("paper", moved, "--out", tmp_path / "paper", "--strict").status == 1
    assert (tmp_path / "paper" / "index.html").is_file()


@pytest.mark.usefixtures("quick_report")
def test_pdf(cli, tmp_path: Path) -> None:
    outcome = cli("paper", "--out", tmp_path, "--pdf")
    assert (outcome.status, outcome.err) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == {
        "index.html",
        "claims.json",
        "report.pdf",
        "figures",
    }
    for name in ("index.html", "claims.json", "report.pdf"):
        assert f"wrote {tmp_path / name}" in outcome.out
    assert f"wrote {tmp_path / 'figures'}, 3 files" in outcome.out


def test_corrupt_results_end_with_status_2(cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "base_rates.json").write_text('{"format": 2}')
    monkeypatch.setattr(build, "shipped_results", lambda: Results(tmp_path / "data"))
    outcome = cli("paper", "--out", tmp_path / "paper")
    assert outcome.status == 2
    assert outcome.err.startswith("printhammer: ")
    assert "base_rates.json: format = 2" in outcome.err
    assert not (tmp_path / "paper").exists()


def test_figure_11_is_told_what_the_paper_says(cli, hammer, tmp_path: Path, monkeypatch) -> None:
    told = []

    def blank(_entry: PaperFigure, _hammer: object, **options: object) -> Figure:
        told.append(options)
        return Figure()

    monkeypatch.setattr(PaperFigure, "draw", blank)
    monkeypatch.setattr(build, "panel_strobes", lambda _context: "those of the claim")
    assert cli("figure", "11", "--out", tmp_path / "alone").status == 0
    report.write_report(hammer, tmp_path / "report", claims=[], figures=[11])
    assert cli("figure", "3", "--out", tmp_path / "other").status == 0
    assert told == [
        {"printed": printed_verdicts()},
        {"printed": printed_verdicts(), "strobes": "those of the claim"},
        {},
    ]


@pytest.mark.slow
def test_the_whole_report(cli, tmp_path: Path) -> None:
    assert cli("paper", "--out", tmp_path).status == 0
    entries = json.loads((tmp_path / "claims.json").read_bytes())
    assert [entry["name"] for entry in entries] == list(claims())
    for entry in entries:
        assert entry["verdict"] in ("holds", "fails")
        assert entry["detail"].endswith(".")
        if entry["value"] is not None:
            assert set(entry["band"]) <= set(entry["value"])
