"""The benchmark runs, and its accuracy column is what it says; speeds are never asserted."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import printhammer as ph

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def test_the_frozen_hammer_is_a_hammer() -> None:
    assert ph.load(BENCHMARKS / "frozen-hammer.toml").warnings() == []


@pytest.mark.slow
def test_the_benchmark_runs(tmp_path: Path) -> None:
    subprocess.run(
        [
            sys.executable,
            str(BENCHMARKS / "single_run.py"),
            "--quick",
            *("--json", str(tmp_path / "figures.json"), "--markdown", str(tmp_path / "table.md")),
        ],
        check=True,
        capture_output=True,
    )
    errors = {
        row["solver"]: row["error_m"] for row in json.loads((tmp_path / "figures.json").read_text("utf-8"))
    }
    ours = {name: error for name, error in errors.items() if name.startswith("printhammer")}
    assert next(error for name, error in ours.items() if "default" in name) < 1e-12
    assert list(ours.values()) == sorted(ours.values(), reverse=True)
    assert errors["1983: Runge-Kutta 4, 10/1/20 us"] > 1e-8
    assert errors["SciPy DOP853, rtol 1e-11, split at events"] < 1e-11
    assert (tmp_path / "table.md").read_text("utf-8").count("\n| ") == len(errors) + 1
