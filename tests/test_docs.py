"""The documentation: its names exist, it builds without warnings, it fetches nothing from elsewhere."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from tests.scripts import run_apart, run_here

import printhammer as ph

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "gallery" not in path.parts)
# A path of the repository in code quotes, possibly with the name of a test behind it.
NAMED = re.compile(r"`((?:src|tests|studies|docs|examples|benchmarks)/[\w./*-]+?)(?:::(\w+))?`")
LINKED = re.compile(r"\]\((?!https?:|#)([^)#]+)(?:#[^)]*)?\)")
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
# Scripts of the gallery that are run here; each is run on its own by another test.
SHOWN = r"(single_pulse|printed_line)\.py$"
EXTERNAL = re.compile(r"(?:https?:)?//")
# Pages whose code computes what another test computes.
ELSEWHERE = {
    "family": "studies/reconstruction/tests/family/test_conclusions.py",
    "energy": "the example in the help of the verb, in tests/cli/test_registry.py; tests/control/least_work",
}
# Code of pages that takes up to a minute as printed runs on fewer values.
FEWER = {
    "basins": {
        '"260 um", 16)': '"260 um", 8)',
        '"1 m/s", 12)': '"1 m/s", 8)',
        '"760 us", 40)': '"760 us", 6)',
        '"500 us", 30)': '"500 us", 5)',
        "longest=1)": "longest=1, starts=20, follow=0)",
        "length=2.0": "length=0.1",
    },
    "bifurcation": {"1.35e-3, 60)": "1.35e-3, 4)", "5e10, 20)": "5e10, 3)"},
    "continuation": {
        '("1.23 ms", "1.36 ms")': '("1.24 ms", "1.26 ms")',
        '("760 Hz", "780 Hz")': '("700 Hz", "720 Hz")',
        "most=60": "most=5",
        "grid=(8, 4), most=10": "grid=(3, 2), most=4",
    },
    "orbits": {"longest=2": "longest=1, follow=0", "longest=1, starts=60": "longest=1, starts=20, follow=0"},
    "quality": {"safe_rate(hammer)": "safe_rate(hammer, first=700.0, step=50.0)"},
    "strobe": {"arange(1400, 1300, -5)": "arange(1400, 1385, -5)"},
    # All hammers are those of a page in tests/studio/test_agreement.py and test_launch.py.
    "studio": {"widget()": 'widget(ph.load("hendriks-1983"))'},
}
# Pages whose code runs in an interpreter of its own, which has imported nothing before.
APART = {"index", "parts"}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(DOCS)))
def test_what_a_page_names_is_there(page: Path) -> None:
    missing = []
    for name, test in NAMED.findall(page.read_text("utf-8")):
        path = ROOT / name
        if not path.exists() or (test and f"def {test}(" not in path.read_text("utf-8")):
            missing.append(f"{name}::{test}" if test else name)
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(DOCS)))
def test_links_lead_to_files(page: Path) -> None:
    missing = []
    for target in LINKED.findall(page.read_text("utf-8")):
        path = (page.parent / target).resolve()
        made = path.is_relative_to(DOCS / "gallery")
        there = (
            (ROOT / "examples" / f"{path.stem}.py").exists() or path.stem == "index"
            if made
            else path.exists()
        )
        if not there:
            missing.append(target)
    assert missing == []


def test_every_equation_of_the_paper_has_file_constants_test_and_figure() -> None:
    text = (DOCS / "model.md").read_text("utf-8")
    labels = re.findall(r"\$\$ \((eq-[a-z]+)\)", text)
    # The numbers on the page are those of the paper.
    assert labels == ["eq-motion", "eq-sum", "eq-magnet", "eq-spring", "eq-pack", "eq-hertz", "eq-damping"]
    after = re.split(r"\$\$ \(eq-(?:sum|magnet|spring|pack|damping)\)", text)[1:]
    assert len(after) == 5
    for part in after:
        section = part.partition("\n## ")[0]
        assert re.search(r"^\| file \| `src/", section, re.MULTILINE)
        assert re.search(r"^\| constants? \| `", section, re.MULTILINE)
        assert re.search(r"^\| tests? \| `tests/", section, re.MULTILINE)
        assert re.search(r"^\| figures? \| .*`src/printhammer/figures/paper/\w+\.py`", section, re.MULTILINE)


def test_every_public_name_is_in_the_reference() -> None:
    text = "".join(path.read_text("utf-8") for path in sorted(DOCS.glob("api*.md")))
    described = set(re.findall(r"^\.\. auto(?:class|function|exception):: (\w+)", text, re.MULTILINE))
    assert set(ph.__all__) - {"__version__"} <= described


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if BLOCK.search(page.read_text("utf-8")) and page.stem not in ELSEWHERE],
    ids=lambda path: path.stem,
)
def test_the_code_on_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my-hammer.toml").write_text(ph.load("hendriks-1983").to_toml(), "utf-8")
    script = "\n".join(BLOCK.findall(page.read_text("utf-8")))
    for many, few in FEWER.get(page.stem, {}).items():
        assert script.count(many) == 1
        script = script.replace(many, few)
    path = tmp_path / f"code_of_{page.stem}.py"
    path.write_text(script, "utf-8")
    if page.stem in APART:
        run_apart(path, tmp_path)
    else:
        run_here(path, tmp_path, monkeypatch)


@pytest.mark.slow
def test_the_code_in_the_readme_passes_mypy(tmp_path: Path) -> None:
    path = tmp_path / "snippet.py"
    path.write_text("\n".join(BLOCK.findall((ROOT / "README.md").read_text("utf-8"))), "utf-8")
    assert "import printhammer" in path.read_text("utf-8")
    options = ["--strict", "--follow-imports=silent", "--cache-dir", str(tmp_path / "cache")]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, path],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


class Requests(HTMLParser):
    """Parser that collects the resources of a page: scripts, styles, images, fonts, frames."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        fetched = [values.get("src"), values.get("srcset"), values.get("poster"), values.get("data")]
        if tag == "link":
            fetched.append(values.get("href"))
        if tag in ("image", "use"):
            fetched += [values.get("href"), values.get("xlink:href")]
        self.found += [value for value in fetched if value and EXTERNAL.match(value.strip())]


def test_a_request_is_recognised() -> None:
    requests = Requests()
    requests.feed('<a href="https://a.org">a</a><script src="//b.org/x.js"></script><img src="c.png">')
    assert requests.found == ["//b.org/x.js"]


@pytest.mark.slow
def test_the_documentation_builds_and_fetches_nothing_from_elsewhere(tmp_path: Path) -> None:
    out = tmp_path / "html"
    command = [
        "-W",
        "--keep-going",
        "-q",
        "-b",
        "html",
        "-d",
        str(tmp_path / "doctrees"),
        "-D",
        f"sphinx_gallery_conf.filename_pattern={SHOWN}",
        str(DOCS),
        str(out),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *command], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = sorted(out.rglob("*.html"))
    assert {"index.html", "model.html", "numerics.html", "api.html"} <= {page.name for page in pages}
    for page in pages:
        requests = Requests()
        requests.feed(page.read_text("utf-8"))
        assert requests.found == [], page.name
    for style in out.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", style.read_text("utf-8")), (
            style.name
        )
    formulas = (out / "model.html").read_text("utf-8")
    assert formulas.count('<math alttext="') > 20
    assert not re.search(r"<code>\\|merror", formulas)
    for script in (ROOT / "examples").glob("*.py"):
        if script.stem != "cubic_spring":
            assert (out / "gallery" / f"{script.stem}.html").exists()
            assert f"sphx_glr_{script.stem}_thumb" in (out / "gallery" / "index.html").read_text("utf-8")
