"""Figures as files, and the import time of the package."""

import subprocess
import sys
from pathlib import Path

import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.figures import FIGURES, FORMATS, save


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_figure_gives_the_same_bytes(hammer: "ph.Hammer", tmp_path: Path, kind: str) -> None:
    texts = [
        save(FIGURES[2].draw(hammer), tmp_path / place, "figure2", formats=[kind])[0].read_bytes()
        for place in ("one", "two")
    ]
    assert texts[0] == texts[1]
    assert b"date" not in texts[0].lower()


def test_all_formats_are_written_and_nothing_else(hammer: "ph.Hammer", tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    paths = save(FIGURES[2].draw(hammer), folder, "figure2")
    assert [path.name for path in paths] == ["figure2.svg", "figure2.pdf", "figure2.png"]
    assert sorted(folder.iterdir()) == sorted(paths)
    starts = [path.read_bytes()[:8] for path in paths]
    assert starts[0].startswith(b"<?xml")
    assert starts[1].startswith(b"%PDF")
    assert starts[2] == b"\x89PNG\r\n\x1a\n"


def test_a_folder_that_cannot_be_written_is_an_input_error(hammer: "ph.Hammer", tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with refused(None):
        save(FIGURES[2].draw(hammer), tmp_path / "file", "figure2")
    assert (tmp_path / "file").read_text() == "in the way"


def test_what_was_there_stays_if_writing_fails(hammer: "ph.Hammer", tmp_path: Path) -> None:
    (tmp_path / ".figure2.png.part").mkdir()
    (tmp_path / "figure2.png").write_bytes(b"old")
    with refused(None):
        save(FIGURES[2].draw(hammer), tmp_path, "figure2", formats=["png"])
    assert (tmp_path / "figure2.png").read_bytes() == b"old"


def test_an_interrupted_call_leaves_all_files_as_they_were(
    hammer: "ph.Hammer", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = FIGURES[2].draw(hammer)
    kinds = ("svg", "pdf", "png")
    for kind in kinds:
        (tmp_path / f"figure2.{kind}").write_bytes(b"old")
    whole = figure.savefig

    def stopped(path: Path, **options: object) -> None:
        if options["format"] == "png":
            raise KeyboardInterrupt
        whole(path, **options)

    monkeypatch.setattr(figure, "savefig", stopped)
    with pytest.raises(KeyboardInterrupt):
        save(figure, tmp_path, "figure2")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        f"figure2.{kind}": b"old" for kind in kinds
    }


def test_an_unknown_format_is_refused(hammer: "ph.Hammer", tmp_path: Path) -> None:
    with refused("format"):
        save(FIGURES[2].draw(hammer), tmp_path, "figure2", formats=["gif"])


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        (
            "import printhammer.figures, printhammer.printing.dots.buzz",
            ["matplotlib", "numba", "scipy", "pandas", "xarray"],
        ),
        (
            "import printhammer as ph, printhammer.figures as f; f.FIGURES[2].draw(ph.load('hendriks-1983'))",
            ["matplotlib.pyplot", "numba", "pandas", "xarray"],
        ),
    ],
)
def test_nothing_heavy_is_imported_early(code: str, absent: list[str]) -> None:
    script = f"{code}; import sys; print([name for name in {absent} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
