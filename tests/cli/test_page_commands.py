"""The commands on the pages run as printed, in a folder with the files that a reader has at that point."""

import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tests.test_docs_commands import CELL, PAGES, ROOT, SHELL

import printhammer as ph
from printhammer.control.learning.law import RUNS

TOML = re.compile(r"^```toml\n(.*?)^```", re.MULTILINE | re.DOTALL)
WRITTEN = re.compile(r"(?:--out|--into|--dots|--contacts|>) ([\w./-]+)")
# Commands that other tests run, or that do not end, by how they begin.
ELSEWHERE = {
    "printhammer paper": "test_paper.py writes the whole report",
    "printhammer studio": "opens a browser; test_studio.py",
    "printhammer feedback": "takes minutes; the example of the help runs, in control/feedback",
    "python -m ": "programs of the repository, which have tests of their own",
    "NUMBA_CACHE_DIR=": "compiles anew what test_warm.py compiles",
    "printhammer sweep spec.toml --out results.zarr --dask": "needs a cluster, in tests/sweep",
    "dask ": "the same",
    "printhammer figure 11 --": "the same on the page on strobes",
    "printhammer continue --rate '725 Hz' --from '715 Hz' --to '740 Hz' --second": (
        "takes half a minute; another chart in chaos/test_continue.py, and this page's own in test_docs.py"
    ),
    "pip ": "installs",
    "make ": "installs, and runs this test",
    "mkdir ": "the tests have a folder of their own",
    "printhammer basins hendriks-1983 --period '1.05 ms' --x '30 um, 260 um, 24'": (
        "takes a minute; with another hammer in chaos/test_basins.py"
    ),
    "printhammer learn mine.toml": "on the page on learning, with another hammer",
    "printhammer fit coil": "in test_fit_coil.py, which has hammers with records of their currents",
}
# What takes minutes as printed runs with fewer values.
FEWER = {
    # The exact figure is part of the whole report, in test_paper.py.
    "figure 11\n": "figure 11 --scheme runge-kutta-4 --reading inside\n",
    "--values 2000": "--values 4 --refine 0",
    "--values 30": "--values 8",
    "--longest 2 --starts 100": "--longest 1 --starts 20 --follow 0",
    "'2e10 N s/m^2.5' --to '6e10 N s/m^2.5'": "'2e10 N s/m^2.5' --to '6e10 N s/m^2.5' --values 4",
    "--from '1.39 ms' --to '1.41 ms'": "--from '1.39 ms' --to '1.41 ms' --values 20",
    "--steps 111": "--steps 4 --firings 200",
    "--longest 3 --starts 2000 --guesses 100": "--longest 1 --starts 50 --guesses 10",
    "um, 128'": "um, 8'",
    "m/s, 128'": "m/s, 8'",
    "ms, 256'": "ms, 8'",
    "us, 256'": "us, 8'",
    "orbits mine.toml": "orbits mine.toml --longest 1 --starts 20 --follow 0",
    "tune mine.toml": "tune mine.toml --history 1 --no-judge",
    "--longest 4": "--longest 1 --starts 20 --follow 0",
    "'1300 Hz' --longest 3 --out regimes": "'720 Hz' --longest 1 --seeds 1 --most 10 --out regimes",
    "learn hendriks-1983 ": "learn hendriks-1983 --members 100 ",
    "--doublings 1": "--doublings 1 --most 20",
    "--grid 24": "",
    "'1.23 ms' --to '1.29 ms'": "'1.24 ms' --to '1.26 ms'",
    "--yield 64": "--yield 2",
    "--yield 32": "--yield 2 --first 700Hz --step 100Hz",
    "--damping --step 50Hz": "--damping --first 700Hz --step 200Hz",
    "--safe-rate\n": "--safe-rate --first 700Hz --step 50Hz\n",
}
# Pages all of whose commands together take a few seconds with compiled kernels.
QUICK = {"README.md", "docs/howto/hammer_files.md", "docs/howto/laboratory.md", "docs/howto/command_line.md"}


# Tutorials whose commands run in this process; that of the developer registers a law, in a shell of its own.
TUTORIALS = ["engineer", "oscilloscope", "data_sheet", "chaos"]


def commands_of(page: Path) -> list[str]:
    text = page.read_text("utf-8")
    blocks = "".join(SHELL.findall(text)).replace("\\\n", " ")
    # Other tables name verbs with what stands for their arguments.
    cells = CELL.findall(text) if page.stem == "cheat_sheet" else []
    lines = [line.strip() for line in (*blocks.splitlines(), *cells)]
    return [line for line in lines if line and not line.startswith(tuple(ELSEWHERE))]


def pages() -> Iterator[Any]:
    for page in (ROOT / "README.md", *PAGES):
        name = page.relative_to(ROOT).as_posix()
        # Those of the tutorials begin in an empty folder, and run below.
        if "tutorials" not in page.parts and commands_of(page):
            yield pytest.param(page, id=name, marks=[] if name in QUICK else [pytest.mark.slow])


@pytest.fixture(autouse=True)
def _two_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Learn in two stages; `tests/control/learning/test_units.py` runs all stages for two units."""
    monkeypatch.setattr("printhammer.control.learning.learn.RUNS", RUNS[:2])


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the pages refer to, except those that their own commands write."""
    folder = tmp_path_factory.mktemp("desk")
    hammer = ph.load("hendriks-1983")
    for name in ("my-hammer", "base", "known"):
        hammer.save(folder / f"{name}.toml")
    for kind, names in {
        "magnet": ("magnet",),
        "spring": ("spring",),
        "pack": ("pack",),
        "backstop": ("backstop", "rebounds"),
        "motion": ("motion", "shot1", "shot2"),
    }.items():
        for seed, name in enumerate(names):
            ph.measure(kind, hammer, seed=seed).write(folder / f"{name}.csv")
    motions = [(rate, ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate=rate))) for rate in (500, 900)]
    rows = [f"{rate},{t},{x}" for rate, motion in motions for t, x in zip(motion.t, motion.x, strict=True)]
    (folder / "measured.csv").write_text("\n".join(["rate [Hz],time [s],displacement [m]", *rows[::9]]))
    for page, name in (("drives", "burst"), ("sweeps", "spec"), ("quality", "paper")):
        text = (ROOT / "docs" / "howto" / f"{page}.md").read_text("utf-8")
        (folder / f"{name}.toml").write_text(TOML.findall(text)[0])
    sheet = files("printhammer").joinpath("hammers", "sheets", "dot-peen.toml")
    (folder / "sheet.toml").write_text(sheet.read_text("utf-8"), "utf-8")
    family = re.findall(r"^```text\n(.*?)^```", (ROOT / "docs/howto/duty.md").read_text("utf-8"), re.M | re.S)
    (folder / "family.csv").write_text(family[0])
    Image.fromarray(255 - 255 * (np.arange(9 * 40).reshape(9, 40) % 7 == 0).astype(np.uint8)).save(
        folder / "drawing.png"
    )
    return folder


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tuned table, which takes longer than the commands of most pages."""
    path = tmp_path_factory.mktemp("tuned") / "table.csv"
    ph.tune(ph.load("hendriks-1983"), rates=["1.3 kHz"], history=1).save(path)
    return path


def run_shortened(cli: Callable[..., Any], command: str) -> None:
    """Run a command of a page, with fewer values if it takes minutes."""
    printed = f"{command}\n"
    for long, short in FEWER.items():
        printed = printed.replace(long, short)
    program, *words = shlex.split(printed, comments=True)
    assert program == "printhammer", command
    to = words[words.index(">") + 1] if ">" in words else None
    done = cli(*words[: words.index(">")] if to else words)
    assert done.status == 0, f"{command}\n{done.out}\n{done.err}"
    assert done.err == ""
    if to:
        Path(to).write_text(done.out)


@pytest.mark.parametrize("page", list(pages()))
def test_the_commands_on_a_page_run(
    cli: Callable[..., Any],
    page: Path,
    desk: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    monkeypatch.chdir(tmp_path)
    commands, text = commands_of(page), page.read_text("utf-8")
    written = set(WRITTEN.findall("\n".join(commands)))
    for file in desk.iterdir():
        if file.name in text and file.name not in written:
            shutil.copy(file, tmp_path)
    if "table.csv" in text and "table.csv" not in written:
        shutil.copy(request.getfixturevalue("table"), tmp_path)
    for command in commands:
        run_shortened(cli, command)
    assert [name for name in written if not Path(name).exists()] == []


def steps_of(script: str) -> Iterator[tuple[bool, str]]:
    """Split a shell script into commands of the program and the shell commands between them."""
    command = re.compile(r"^printhammer .*$", re.MULTILINE)
    script = script.replace(" \\\n", " ")
    place = 0
    for found in command.finditer(script):
        if between := script[place : found.start()].strip():
            yield False, between
        yield True, found[0]
        place = found.end()
    if rest := script[place:].strip():
        yield False, rest


@pytest.mark.slow
@pytest.mark.parametrize("name", TUTORIALS)
def test_the_commands_of_a_tutorial_run(
    cli: Callable[..., Any], name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "tutorials" / f"{name}.md").read_text("utf-8")
    steps = list(steps_of("".join(SHELL.findall(text))))
    assert sum(own for own, _ in steps) >= 8
    for own, step in steps:
        if own:
            run_shortened(cli, step)
        else:
            done = subprocess.run(["sh", "-ec", step], capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"{step}\n{done.stderr}"
    if name == "oscilloscope":
        found, truth = (ph.load(path) for path in ("relay.toml", "relay-5v"))
        assert found.uncertainty is not None
        for key in ("mass", "coil.resistance"):
            off = found.constants[key].si - truth.constants[key].si
            assert abs(off) < 3.0 * found.uncertainty.error(key)
