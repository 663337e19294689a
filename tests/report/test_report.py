import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from matplotlib.figure import Figure
from tests.errors import refused
from tests.report import reconstruction_files

from printhammer.claims import claims
from printhammer.errors import InputError
from printhammer.figures import PaperFigure
from printhammer.report import build, pdf, write_report
from printhammer.report.contents import (
    Report,
    band_text,
    cited_figures,
    distance,
    misses,
    percent,
    split_name,
    typeset,
    value_text,
)
from printhammer.report.reconstruction.results import Results

if TYPE_CHECKING:
    import printhammer as ph

CLAIMS = (
    "geometry",
    "release_margin",
    "single_pulse_stroke",
    "settle_out",
    "print_force",
    "two_pulses_660us",
)
VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """Parser that checks that tags are balanced, and collects links, identifiers and text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.ids: list[str] = []
        self.tags: set[str] = set()
        self.words: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.add(tag)
        self.links += [given["href"]] if given.get("href") else []
        self.sources += [given["src"]] if given.get("src") else []
        self.ids += [given["id"]] if given.get("id") else []
        if tag == "img":
            assert given.get("alt")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"[ \n]+", " ", " ".join(self.words))


def results_of(hammer: "ph.Hammer", folder: Path, **changes: object) -> Results:
    """Return invented results of a reconstruction of a hammer."""
    place = folder / "results"
    place.mkdir(parents=True)
    search = {**reconstruction_files.SAMPLE["search"], "shipped": hammer.fingerprint}
    schemes = {**reconstruction_files.SAMPLE["schemes"], "shipped": hammer.fingerprint}
    return Results(reconstruction_files.write(place, **{"search": search, "schemes": schemes, **changes}))


@pytest.fixture
def blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make every figure empty, for tests of the written files."""
    monkeypatch.setattr(PaperFigure, "draw", lambda *_arguments, **_options: Figure())


@pytest.fixture(scope="module")
def report(hammer: "ph.Hammer", tmp_path_factory: pytest.TempPathFactory) -> Report:
    out = tmp_path_factory.mktemp("paper") / "new" / "folder"
    made = results_of(hammer, out.parent)
    return write_report(hammer, out, claims=CLAIMS, figures=[2, 3], reconstruction=made, pdf=True)


@pytest.fixture(scope="module")
def folder(report: Report) -> Path:
    (out,) = (path.parent for path in report.files if path.name == "index.html")
    assert all(path.is_file() for path in report.files)
    assert {path for path in out.rglob("*") if path.is_file()} == set(report.files)
    return out


@pytest.fixture(scope="module")
def page(folder: Path) -> Page:
    return Page((folder / "index.html").read_text("utf-8"))


def test_the_page_needs_nothing_else(folder: Path, page: Page) -> None:
    text = (folder / "index.html").read_text("utf-8")
    assert not page.tags & {"script", "link", "iframe", "object", "base", "form"}
    assert all(source.startswith("data:image/svg+xml;base64,") for source in page.sources)
    assert all(link.startswith("#") for link in page.links)
    style = text[text.index("<style>") : text.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style
    assert "default-src 'none'" in text


def test_every_section_is_listed(page: Page) -> None:
    for name in ("hammer", "claims", "failing", "rates", "schemes", "reconstruction", "family", "provenance"):
        assert name in page.ids
        # In the bar and in the contents.
        assert page.links.count(f"#{name}") >= 2


def test_claims_and_figures_lead_to_each_other(page: Page) -> None:
    # Figure 3 names settle_out, and the source of settle_out names figure 3.
    assert page.links.count("#settle_out") >= 2
    assert page.links.count("#figure-3") > 2
    # Not drawn, so not linked.
    assert "#figure-6" not in page.links


def test_links_lead_somewhere(page: Page) -> None:
    assert len(page.ids) == len(set(page.ids))
    assert {link.removeprefix("#") for link in page.links} <= set(page.ids)


def test_every_constant_is_there_with_status_and_source(hammer: "ph.Hammer", page: Page) -> None:
    for constant in hammer.constants.values():
        for told in (constant.key, constant.status, " ".join(constant.source.split())):
            assert told in page.text
    assert "This hammer is a reconstruction." in page.text


def test_every_claim_is_there(page: Page) -> None:
    assert set(CLAIMS) <= set(page.ids)
    for name in CLAIMS:
        assert typeset(claims()[name].says) in page.text
        assert typeset(claims()[name].reading) in page.text


def test_the_claims_for_machines(folder: Path) -> None:
    entries = json.loads((folder / "claims.json").read_text("utf-8"))
    assert [entry["name"] for entry in entries] == list(CLAIMS)
    for entry in entries:
        assert {"name", "kind", "value", "band", "verdict", "base_rate"} <= set(entry)
    rates = {entry["name"]: entry["base_rate"] for entry in entries}
    assert rates["geometry"] is None
    assert (rates["settle_out"]["measured"], rates["settle_out"]["holds"]) == (900, 9)
    assert rates["settle_out"]["low"] < rates["settle_out"]["rate"] == 0.01 < rates["settle_out"]["high"]


def test_what_the_integrators_of_1983_do_is_told(page: Page) -> None:
    assert "As computed in 1983" in page.text
    assert "25\xa0% ± 6\xa0%" in page.text
    assert "over the panels of 10 random plausible hammers" in " ".join(page.text.split())
    assert "as computed in 1983: holds" in page.text


def test_what_the_reconstruction_found_is_told(page: Page) -> None:
    for told in (
        "1 %",  # of random hammers settle_out holds for
        ", of 900",  # fewer than there are random hammers
        "15 % 3 of 20",  # and of those found on the stated claims alone
        "4 000 on the stated claims alone (seed 7), 9 000 on all claims (seed 8)",
        "4.5 hours of one core",
        "the print force",
        "The best hammer for it satisfies it",
        "600 Hz",
    ):
        assert told in page.text.replace("\xa0", " ")


def test_a_claim_that_fails_is_told_by_how_much(page: Page, folder: Path) -> None:
    entries = {entry["name"]: entry for entry in json.loads((folder / "claims.json").read_text("utf-8"))}
    value = entries["release_margin"]["value"]["net_over_magnet_force"]
    limit = entries["release_margin"]["band"]["net_over_magnet_force"]["at_most"]
    assert value > limit
    assert f"too large by {100 * (value / limit - 1):.3g} %" in page.text


def test_results_about_another_hammer_are_left_out(hammer: "ph.Hammer", tmp_path: Path) -> None:
    made = results_of(hammer.replace("mass", "0.5 g"), tmp_path)
    report = write_report(hammer, tmp_path / "out", claims=CLAIMS, figures=[], reconstruction=made)
    assert not report.reconstructed
    text = Page((tmp_path / "out" / "index.html").read_text("utf-8")).text
    assert "is about another hammer" in text
    assert "says nothing about this one" in text
    assert "Predictions of" not in text
    assert "satisfies it" not in text
    # Base rates are about the claims, whatever the hammer.
    assert "how hard-won each verdict is" in text


def test_without_results_the_report_says_so(hammer: "ph.Hammer", tmp_path: Path) -> None:
    empty = tmp_path / "results"
    empty.mkdir()
    write_report(hammer, tmp_path / "out", claims=CLAIMS, figures=[], reconstruction=Results(empty), pdf=True)
    shown = Page((tmp_path / "out" / "index.html").read_text("utf-8"))
    assert "No results of a search for the constants ship with this version." in shown.text
    assert "No family of hammers ships with this version." in shown.text
    assert "rates" not in shown.ids
    entries = json.loads((tmp_path / "out" / "claims.json").read_text("utf-8"))
    assert {entry["base_rate"] for entry in entries} == {None}


def test_corrupt_results_are_told_before_anything_is_done(hammer: "ph.Hammer", tmp_path: Path) -> None:
    made = results_of(hammer, tmp_path, **reconstruction_files.changed("family", "hammers", to=[]))
    with refused("hammers", file="family.json"):
        write_report(hammer, tmp_path / "out", reconstruction=made)
    assert not (tmp_path / "out").exists()


def test_figures_are_written_and_shown(folder: Path, page: Page) -> None:
    names = {path.name for path in (folder / "figures").iterdir()}
    assert names == {f"figure{number:02d}.{kind}" for number in (2, 3) for kind in ("svg", "png", "pdf")}
    assert len(page.sources) == 2
    assert {"figure-2", "figure-3"} <= set(page.ids)


def test_claims_are_shown_beside_the_figures_they_cite() -> None:
    assert cited_figures("captions of Figs. 2 and 3") == {2, 3}
    assert cited_figures("Fig. 7 and its text") == {7}
    assert cited_figures("abstract, Figs. 8 and 9") == {8, 9}
    assert cited_figures("Figs. 3, 8 and 9") == {3, 8, 9}
    assert cited_figures("Poincaré plots") == {11}
    assert cited_figures("Introduction") == set()


def test_the_same_again_is_the_same(hammer: "ph.Hammer", folder: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    write_report(hammer, again, claims=CLAIMS, figures=[2], reconstruction=results_of(hammer, tmp_path))
    for name in ("claims.json", "figures/figure02.svg"):
        assert (again / name).read_bytes() == (folder / name).read_bytes()


def test_a_hammer_that_lacks_what_a_figure_shows(hammer: "ph.Hammer", tmp_path: Path) -> None:
    report = write_report(hammer.replace("waveform", None), tmp_path, claims=CLAIMS, figures=[2, 3])
    drawn = {drawing.number: bool(drawing.svg) for drawing in report.drawings}
    assert drawn == {2: True, 3: False}
    shown = Page((tmp_path / "index.html").read_text("utf-8"))
    assert "Not drawn" in shown.text
    assert report.count("fails") >= 3


def test_text_of_a_hammer_cannot_break_the_page(hammer: "ph.Hammer", tmp_path: Path) -> None:
    odd = hammer.replace({"title": "<script>alert('&')</script>", "note": "a < b & c"})
    write_report(odd, tmp_path, claims=["geometry"], figures=[])
    shown = Page((tmp_path / "index.html").read_text("utf-8"))
    assert "script" not in shown.tags
    assert "a < b & c" in shown.text


def test_a_folder_that_cannot_be_written_to(hammer: "ph.Hammer", tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with refused(None):
        write_report(hammer, tmp_path / "file", claims=["geometry"], figures=[])
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.usefixtures("blank")
def test_a_failure_midway_keeps_the_report_before(
    hammer: "ph.Hammer", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_report(hammer, tmp_path, claims=["geometry"], figures=[])
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}

    def fail(*_: object) -> str:
        raise InputError("disk full")

    monkeypatch.setattr(build, "claims_json", fail)
    with pytest.raises(InputError, match="disk full"):
        write_report(hammer, tmp_path, claims=["geometry"], figures=[])
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before


@pytest.mark.usefixtures("blank")
def test_the_steps_of_a_report_are_counted(hammer: "ph.Hammer", tmp_path: Path) -> None:
    steps: list[tuple[int, int, str]] = []
    write_report(
        hammer, tmp_path, claims=["geometry"], figures=[2], progress=lambda *step: steps.append(step)
    )
    assert steps == [(0, 3, "claim geometry"), (1, 3, "figure 2"), (2, 3, "page")]


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("step", ["figure 2", "page", "PDF"])
def test_an_interrupted_report_leaves_the_one_before(hammer: "ph.Hammer", tmp_path: Path, step: str) -> None:
    def stop(_done: int, _steps: int, at: str) -> None:
        if at == step:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_report(hammer, tmp_path / "new", claims=["geometry"], figures=[2], progress=stop, pdf=True)
    assert list((tmp_path / "new").iterdir()) == []
    write_report(hammer, tmp_path / "old", claims=["geometry"], figures=[2, 3])
    before = {path: path.read_bytes() for path in (tmp_path / "old").rglob("*") if path.is_file()}
    with pytest.raises(KeyboardInterrupt):
        write_report(hammer, tmp_path / "old", claims=["geometry"], figures=[2], progress=stop, pdf=True)
    assert {path: path.read_bytes() for path in (tmp_path / "old").rglob("*") if path.is_file()} == before


@pytest.mark.usefixtures("blank")
def test_files_of_an_earlier_report_do_not_pass_for_those_of_this_one(
    hammer: "ph.Hammer", tmp_path: Path
) -> None:
    write_report(hammer, tmp_path, claims=["geometry"], figures=[2, 3], pdf=True)
    mine = tmp_path / "figures" / "mine.svg"
    mine.write_text("kept")
    report = write_report(hammer, tmp_path, claims=["geometry"], figures=[3])
    assert {path for path in tmp_path.rglob("*") if path.is_file()} == {mine, *report.files}


@pytest.mark.usefixtures("blank")
def test_a_page_that_is_there_stands_for_a_complete_report(
    hammer: "ph.Hammer", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_report(hammer, tmp_path, claims=["geometry"], figures=[2])
    move = Path.replace

    def stop(self: Path, target: Path) -> Path:
        if self.parent.name == "figures" and target.parent.parent == tmp_path:
            raise OSError(28, "No space left on device", str(target))
        return move(self, target)

    monkeypatch.setattr(Path, "replace", stop)
    with refused(None, file="figure02.pdf"):
        write_report(hammer, tmp_path, claims=["geometry"], figures=[2])
    assert not (tmp_path / "index.html").exists()


def test_the_pdf_has_a_page_for_each_figure(report: Report, folder: Path) -> None:
    assert folder / "report.pdf" in report.files
    text = (folder / "report.pdf").read_bytes()
    assert text.startswith(b"%PDF-")
    assert b"hendriks-1983" in text
    assert b"CreationDate" not in text
    assert b"/Title(Figure 2 " in text
    # The front, two figures, and at least two pages of claims and results.
    (count,) = re.findall(rb"/Type/Pages/Count (\d+)", text)
    assert int(count) >= 5
    pdf.write_pdf(report, folder / "again.pdf")
    assert (folder / "again.pdf").read_bytes() == text


def test_a_figure_that_cannot_be_drawn_has_its_page(hammer: "ph.Hammer", tmp_path: Path) -> None:
    report = write_report(hammer.replace("waveform", None), tmp_path, claims=[], figures=[3], pdf=True)
    assert [drawing.pdf for drawing in report.drawings] == [None]
    assert (tmp_path / "report.pdf").is_file()


def test_a_pdf_without_its_typesetter_is_refused_before_any_work(
    hammer: "ph.Hammer", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pdf, "find_spec", lambda _name: None)
    with refused("pdf"):
        write_report(hammer, tmp_path / "out", pdf=True)
    assert not (tmp_path / "out").exists()


def test_texts_are_texts_in_the_pdf(hammer: "ph.Hammer", tmp_path: Path) -> None:
    odd = hammer.replace({"title": "#panic() $x *y* _z_ `c` @label </script>", "note": "a < b & c #"})
    write_report(odd, tmp_path, claims=["geometry"], figures=[], pdf=True)
    assert b"hendriks-1983" in (tmp_path / "report.pdf").read_bytes()


@pytest.mark.parametrize(
    ("value", "band", "unit", "told"),
    [
        (0.44, {"at_most": 0.4}, "", "too large by 10 %"),
        (3, {"at_least": 6}, "", "too small by 3"),
        (1.4, {"at_most": 0.4}, "", "too large by 2.5 times the limit"),
        (-0.986, {"above": 0.0}, "m/s", "too small by 0.986 m/s"),
        (0.0, {"above": 0.0}, "m/s", "exactly at the limit"),
        (0.9, [1.0, 2.0], "", "too small by 10 %"),
        (2.2, [1.0, 2.0], "", "too large by 10 %"),
        (2.2, 2.0, "", "too large by 10 %"),
        (False, True, "", ""),
        (None, {"above": 0.0}, "N", ""),
    ],
)
def test_how_far_a_value_is_from_its_band(value: object, band: object, unit: str, told: str) -> None:
    assert distance(value, band, unit) == told


def test_words_that_differ_are_counted() -> None:
    claim = claims()["poincare"]
    (miss,) = misses(claim, {"verdicts": ["strange"] * 12})
    # Eight of the twelve panels are printed as strange.
    assert miss.value == "8 of 12 as printed"


@pytest.mark.parametrize("part", [1e-6, 0.03142, 0.5, 0.99, 0.9996, 1 - 1e-6])
def test_percentages_are_neither_none_nor_all(part: float) -> None:
    shown = float(percent(part).removesuffix("\xa0%"))
    assert 0.0 < shown < 100.0
    assert shown == pytest.approx(100.0 * part, rel=0.05)
    assert "e" not in percent(part)


def test_none_and_all_in_percent() -> None:
    assert (percent(0.0), percent(1.0)) == ("0\xa0%", "100\xa0%")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("peak_force_N", ("peak force", "N")),
        ("velocity_at_half_current_m_per_s", ("velocity at half current", "m/s")),
        ("net_over_magnet_force", ("net / magnet force", "")),
        ("max_displacement_m", ("max displacement", "m")),
        ("hang_up_rate_Hz", ("hang up rate", "Hz")),
    ],
)
def test_names_are_split_into_words_and_unit(name: str, expected: tuple[str, str]) -> None:
    assert split_name(name) == expected


@pytest.mark.parametrize("name", [key for claim in claims().values() for key in claim.band])
def test_every_band_can_be_told(name: str) -> None:
    words, unit = split_name(name)
    assert words
    for claim in claims().values():
        if name in claim.band:
            assert band_text(claim.band[name], unit)


def test_values_are_told_in_both_systems() -> None:
    # 0.0112 in and 5 lbf, to the digits shown.
    assert value_text(0.0112 * 0.0254, "m") == "284.5 µm (0.0112 in)"
    assert value_text(22.2411, "N") == "22.24 N (5 lbf)"
    assert value_text(None, "m") == "none"
    assert value_text(True, "") == "yes"
    assert value_text(-0.5, "") == "−0.5"
    assert band_text({"at_least": 6}, "") == "≥ 6"
    assert band_text([283.2e-6, 285.8e-6], "m") == "283.2 to 285.8 µm"
    assert band_text({"below": 1e-9}, "N") == "< 1e−9 N"
    assert typeset("at least 5 us and <= 25 um") == "at least 5\xa0µs and ≤ 25\xa0µm"
