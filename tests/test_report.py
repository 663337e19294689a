import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from printhammer.claims import claims
from printhammer.errors import InputError
from printhammer.report import build, write_report
from printhammer.report.citations import cited_figures
from printhammer.report.quantities import band_text, split_name, typeset, value_text

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
    """Checks that tags are balanced, and collects links, identifiers and text."""

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


@pytest.fixture(scope="module")
def folder(hammer: "ph.Hammer", tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("paper") / "new" / "folder"
    report = write_report(hammer, out, claims=CLAIMS, figures=[2, 3])
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
        assert {"name", "kind", "value", "band", "verdict"} <= set(entry)


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
    write_report(hammer, tmp_path, claims=CLAIMS, figures=[2])
    for name in ("claims.json", "figures/figure02.svg"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


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
    with pytest.raises(InputError, match="expected a folder that can be written to"):
        write_report(hammer, tmp_path / "file", claims=["geometry"], figures=[])
    assert (tmp_path / "file").read_text() == "kept"


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
