import re
from collections.abc import Callable
from importlib import import_module
from inspect import signature
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import printhammer as ph
from printhammer.chaos.bifurcation.bifurcation import FIRINGS, InterruptedDiagram

SHORT = ("--firings", "60", "--transient", "30", "--refine", "0")


def test_windows_routes_and_files(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"diagram.{kind}" for kind in ("csv", "nc", "png", "svg")}
    out = [word for path in paths.values() for word in ("--out", path)]
    words = ("--from", "1.29 ms", "--to", "1.33 ms", "--values", "5", "--direction", "both", *SHORT)
    done = cli("bifurcation", "hendriks-1983", *words, *out)
    assert done.status == 0
    assert "5 values, 10 trains of 60 firings" in done.out
    assert "up: With rising values" in done.out
    assert "down: With falling values" in done.out
    assert "rising and falling values differ" in done.out
    periods = np.linspace(1.29e-3, 1.33e-3, 5)
    found = ph.bifurcation(
        ph.load("hendriks-1983"),
        periods=periods,
        direction="both",
        refine=0,
        firings=60,
        transient=30,
        exponents=True,
    )
    with xr.open_dataset(paths["nc"], engine="scipy") as chart:
        np.testing.assert_array_equal(chart["x"], found.x)
    assert pd.read_csv(paths["csv"], comment="#")["verdict"].tolist() == found.verdicts.reshape(-1).tolist()
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths["svg"].read_bytes()


@pytest.mark.slow
def test_most_trains_are_decided_and_the_others_say_why(cli: Callable) -> None:
    done = cli("bifurcation", "hendriks-1983", "--values", "100")
    assert done.status == 0
    out = " ".join(done.out.split())
    assert re.search(r"period: 100 values and \d+ between those that differ, \d+ trains of 1000 firings", out)
    shares = {
        row[1]: float(row[3]) for row in re.finditer(r"(undecided|strange) +(\d+) +([\d.]+) ", done.out)
    }
    assert shares["undecided"] < 6.0
    assert shares["strange"] > 25.0
    assert "[ms] [ms]" in out
    assert "With rising values the very first train, at 0.8 ms, is strange." in out
    assert re.search(r"With falling values the first strange train is at 1\.29\d\d? ms, after", out)
    assert "undecided trains: neighbouring motions converge; more firings will show the period" in out


def test_without_exponents_it_is_said_how_to_tell(cli: Callable) -> None:
    done = cli(
        "bifurcation", "--from", "1.27 ms", "--to", "1.29 ms", "--values", "2", *SHORT, "--no-exponents"
    )
    assert done.status == 0
    assert "2 values, 2 trains of 60 firings" in done.out
    assert "undecided trains: the diagram has no exponent; use the option `exponents`" in done.out


def test_a_transient_leaves_points_to_judge(cli: Callable) -> None:
    words = ("--from", "1.3 ms", "--to", "1.31 ms", "--values", "2", "--refine", "0")
    assert cli("bifurcation", *words, "--firings", "90").status == 0


def test_defaults_are_those_of_the_library() -> None:
    """With fewer firings, Python would classify more trains as undecided than the command line does."""
    verb = import_module("printhammer.cli.verbs.bifurcation").bifurcation
    assert int(signature(verb.call).parameters["firings"].default) == FIRINGS
    assert signature(ph.bifurcation).parameters["firings"].default == FIRINGS


def test_another_constant(cli: Callable) -> None:
    words = ("--parameter", "backstop.damping", "--from", "3e8 N s/m^2.5", "--to", "5e8 N s/m^2.5")
    done = cli("bifurcation", *words, "--values", "3", "--period", "1.3 ms", *SHORT)
    assert done.status == 0
    assert "backstop.damping: 3 values" in done.out


def test_a_run_that_stops_is_told(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    ph.load("hendriks-1983").replace("magnet.range_max", "250 um").save(path)
    done = cli("bifurcation", path, "--values", "2", *SHORT)
    assert done.status == 1
    assert "2 of 2 runs ended early: range left" in done.err


def test_ctrl_c_writes_what_is_done(
    cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hammer: "ph.Hammer"
) -> None:
    found = ph.bifurcation(hammer, periods=[1.3e-3, 1.31e-3], refine=0, firings=20, transient=10)
    found.status[0, 1] = "not run"
    found.x[0, 1] = np.nan

    def interrupted(*_arguments: object, **_options: object) -> None:
        raise InterruptedDiagram(found)

    monkeypatch.setattr(
        import_module("printhammer.chaos.bifurcation.bifurcation"), "bifurcation", interrupted
    )
    out = tmp_path / "diagram.csv"
    done = cli("bifurcation", "--values", "2", "--out", out)
    assert done.status == 130
    assert pd.read_csv(out, comment="#")["status"].tolist() == ["ok", "not run"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--parameter", "rate"), "--from and --to"),
        (("--parameter", "rates", "--period", "1 ms", "--from", "1", "--to", "2"), "rates"),
        (
            ("--parameter", "mass", "--from", "0.3 g", "--to", "0.5 g"),
            "--period and --rate",
        ),
        (("--period", "1 ms"), "--period and --rate"),
        (("--from", "1 kg"), "--from"),
        (("--from", "2 ms"), "--to"),
        (("--values", "1"), "--values"),
        (("--firings", "0"), "firings"),
        (("--transient", "1000"), "transient"),
        (("--direction", "sideways"), "sideways"),
        (("--refine", "-1"), "refine"),
        (("--show", "y"), "--show"),
        (("--tolerance", "0"), "tolerance"),
        (("--threads", "0"), "threads"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("bifurcation", "hendriks-1983", *options, said=said)
