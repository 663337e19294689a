"""The benchmark: all solvers solve the same problem, errors are as stated, missing solvers are named."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.solvers import ensembles, exact, own, table
from benchmarks.solvers.__main__ import main
from benchmarks.solvers.ensembles import Figures, Frame, Mass
from benchmarks.solvers.entry import Entry, Peers, load_peers
from benchmarks.solvers.problem import ENDS, FIRST, GRID, PERIOD, Task, checked, ensemble_tasks, frozen
from benchmarks.solvers.report import Report
from benchmarks.solvers.table import Line, with_ratios

ROOT = Path(__file__).parents[2]
PEERS = ROOT / "benchmarks" / "peers"


@pytest.fixture(scope="module")
def task() -> Task:
    return frozen()


def line(solver: str, error: float, speed: float, *, ours: bool, members: int = 1) -> Line:
    return Line(solver, ours, members, error, speed, 0.1, 0.01)


def test_the_frozen_hammer_is_a_hammer(task: Task) -> None:
    assert task.hammer.warnings() == []


def test_single_runs_agree_with_the_reference_the_better_the_tighter(task: Task) -> None:
    found = [np.abs(entry.positions() - exact.single(task)).max() for entry in own.singles(task, True)]
    assert found == sorted(found, reverse=True)
    assert found[-1] < 1e-13


def test_ensembles_agree_with_the_reference(task: Task) -> None:
    entry = next(e for e in own.ensembles(task, True, 16) if e.name.endswith("1e-12"))
    positions = entry.positions()
    assert positions.shape == (ENDS.size, len(checked(16)))
    assert np.abs(positions - exact.ensemble(task, 16)).max() < 1e-12


def test_members_of_an_ensemble() -> None:
    tasks = ensemble_tasks(frozen(), 5)
    assert [one.period / PERIOD for one in tasks] == pytest.approx([0.9, 0.95, 1.0, 1.05, 1.1])
    assert checked(3) == [0, 1, 2]
    assert len(set(checked(512))) == 8


def test_the_ratio_is_to_the_fastest_of_ours_at_least_as_exact() -> None:
    lines = [
        line("loose", 1e-6, 100.0, ours=True),
        line("middle", 1e-9, 50.0, ours=True),
        line("tight", 1e-12, 20.0, ours=True),
        line("many", 1e-12, 80.0, ours=True, members=8),
        line("peer", 2e-9, 10.0, ours=False),
        line("peers", 1e-9, 10.0, ours=False, members=8),
        line("exact", 1e-15, 1.0, ours=False),
        line("lost", math.nan, 1.0, ours=False),
    ]
    found = {one.solver: one for one in with_ratios(lines)}
    assert (found["peer"].match, found["peer"].ratio) == ("middle", 5.0)
    assert (found["peers"].match, found["peers"].ratio) == ("many", 8.0)
    assert found["exact"].match == found["lost"].match == ""
    assert math.isnan(found["exact"].ratio)
    assert math.isnan(found["lost"].ratio)


def test_a_peer_that_breaks_is_named_and_the_others_go_on(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> np.ndarray:
        raise RuntimeError("no memory\nat all")

    good = np.zeros_like(GRID)
    monkeypatch.setattr(
        own, "singles", lambda *_: [Entry("ours", lambda: good, lambda: None, FIRST, ours=True)]
    )
    monkeypatch.setattr(own, "schemes", lambda *_: [])
    monkeypatch.setattr(own, "ensembles", lambda *_: [])
    peers = Peers(
        {
            "bad": lambda *_: [Entry("bad 1.0", broken, lambda: None, FIRST)],
            "lost": lambda *_: [Entry("lost 1.0", lambda: good * np.nan, lambda: None, FIRST)],
        }
    )
    said: list[str] = []
    lines, absent = table.measure(task, True, 8, peers, said.append)
    assert absent == {"bad 1.0": "failed: RuntimeError: no memory"}
    assert [one.solver for one in lines] == ["ours", "lost 1.0"]
    # From rest at zero the deviation is the largest displacement itself.
    assert lines[0].error == pytest.approx(np.abs(exact.single(task)).max())
    assert math.isnan(lines[1].error)
    assert said[0] == "ours"


def test_errors_are_counted_up_to_the_horizon(task: Task) -> None:
    times = np.linspace(0.0, 1e-3, 50)
    true = exact.trusted(task.hammer, task.drive(1), 1e-3, times, 1.5e-4)
    assert np.isfinite(true).all()
    # A stroke so short that rounding parts the references at once.
    assert np.isnan(exact.trusted(task.hammer, task.drive(1), 1e-3, times, 1e-12)).any()


@pytest.fixture
def report() -> Report:
    frames = [
        Frame("plain", 1e-7, 1, 0.2, 0.19, 1e-5, 3e-5),
        Frame("plain", 1e-10, 1, 0.3, 0.29, 1e-9, 3e-9),
        Frame("plain", 1e-7, 2, 0.1, 0.09, 1e-5, math.inf),
    ]
    mass = Mass("plain", 1e-10, 2, 100, 9, 10.0, 0.5)
    figures = Figures(512, 9, 512, 4.77, 0.5, 64, frames, [mass], [mass])
    lines = with_ratios([line("ours", 1e-12, 50.0, ours=True), line("lost", math.nan, 1.0, ours=False)])
    return Report({"cores": "2"}, False, lines, {"peer": "not installed"}, figures, {"plain": 30.0})


def test_speed_of_many_members(report: Report) -> None:
    assert report.figures.masses[0].speed == 10.0


def test_the_fastest_frame_is_exact_enough(report: Report) -> None:
    assert report.frame_sentences() == [
        "display, median error below 1e-04 of the stroke, 1 thread: 200 ms (plain engine, tolerance 1e-07)",
        "display, median error below 1e-04 of the stroke, 2 threads: 100 ms (plain engine, tolerance 1e-07)",
        "exact, median error below 1e-08 of the stroke, 1 thread: 300 ms (plain engine, tolerance 1e-10)",
        "exact, median error below 1e-08 of the stroke, 2 threads: no setting",
    ]


def test_the_nearest_peer_is_named(report: Report) -> None:
    assert report.least_lead(ensembles=False) == "There is no other solver to compare with."
    peers = [line("far", 1e-6, 1.0, ours=False), line("near", 1e-6, 40.0, ours=False)]
    ahead = replace(report, lines=with_ratios([*report.lines, *peers]))
    wanted = 'the fastest other solver is the one in the row "near"; printhammer is 1.25 times as fast.'
    assert ahead.least_lead(ensembles=False) == f"At the same error, {wanted}"
    assert ahead.least_lead(ensembles=True) == "There is no other solver to compare with."


def test_json_has_null_where_there_is_no_number(report: Report) -> None:
    def refuse(name: str) -> Any:
        raise AssertionError(name)

    data = json.loads(report.to_json(), parse_constant=refuse)
    assert data["solvers"][1]["error"] is None
    assert data["ensembles"]["frames"][2]["error_95"] is None
    assert data["ensembles"]["growth"][0]["speed"] == 10.0
    assert data["absent"] == {"peer": "not installed"}


def test_markdown_has_all_rows(report: Report) -> None:
    text = report.to_markdown()
    assert "| lost | lost |" in text
    assert "- peer: not installed" in text
    tables = [part for part in text.strip().split("\n\n") if part.startswith("|")]
    assert [part.count("\n") - 1 for part in tables] == [2, 0, 3, 1, 1]
    for part in tables:
        assert len({row.count("|") for row in part.splitlines()}) == 1


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--threads", "0"], "threads = 0"),
        (["--peers", "nowhere"], "peers = nowhere: expected a folder"),
        (["--threads", "many"], "whole number"),
        (["--out", "nowhere/at/all.json"], "folder that exists"),
        (["--out", "x.json", "--out", "x.json"], "occurs twice"),
    ],
)
def test_bad_input_is_refused_before_any_work(
    arguments: list[str], word: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table, "measure", lambda *_: pytest.fail("work was done"))
    with pytest.raises(SystemExit) as end:
        main(arguments)
    err = capsys.readouterr().err
    assert end.value.code == 2
    assert word in err
    assert err.count("\n") == 1


@pytest.mark.slow
def test_the_benchmark_runs(tmp_path: Path) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "benchmarks.solvers", "--quick", "--peers", str(PEERS)),
            *("--out", str(tmp_path / "figures.json"), "--out", str(tmp_path / "page.md")),
        ],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    data = json.loads((tmp_path / "figures.json").read_text("utf-8"))
    single = {row["solver"]: row for row in data["solvers"] if row["members"] == 1}
    ours = [row["error"] for row in single.values() if row["ours"]]
    assert next(row["error"] for name, row in single.items() if "default" in name) < 1e-12
    assert ours == sorted(ours, reverse=True)
    assert single["1983: Runge-Kutta 4, 10/1/20 us"]["error"] > 1e-8
    named = " ".join([*single, *data["absent"], *(row["solver"] for row in data["solvers"])])
    peers = load_peers(PEERS)
    for peer in [*peers.single, *peers.ensembles]:
        assert peer in named
    # Whatever is stopped at switches and started anew is exact, and so are ensembles.
    for row in data["solvers"]:
        if any(word in row["solver"] for word in ("its events", "located")):
            assert row["error"] < 1e-8
    for name in data["absent"]:
        assert name in done.stdout
    frames = data["ensembles"]["frames"]
    assert {frame["engine"] for frame in frames} == set(own.engines())
    assert all(0.0 < frame["error_median"] <= frame["error_95"] < 1e-3 for frame in frames)
    rows = (tmp_path / "page.md").read_text("utf-8").count("\n| ")
    many = len(frames) + len(data["ensembles"]["masses"]) + len(data["ensembles"]["growth"])
    assert rows == len(data["solvers"]) + many + 5


def test_trains_of_figure_9(task: Task) -> None:
    drives, ends = ensembles.trains(task, 4, 9)
    np.testing.assert_allclose([drive.period for drive in drives], [1 / 500, 1 / 1000, 1 / 1500, 1 / 2000])
    np.testing.assert_allclose(ends, [9 / 500 + 1e-3, 9e-3 + 1e-3, 6e-3 + 1e-3, 4.5e-3 + 1e-3])
