import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import printhammer as ph
from printhammer.chaos.continuation.regimes import Branches, InterruptedBranches

SLOW = ("--parameter", "period", "--period", "3 ms", "--from", "2.95 ms", "--to", "3.05 ms")


def test_a_branch(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"branch.{kind}" for kind in ("csv", "nc", "json", "png", "svg", "pdf")}
    out = [word for path in paths.values() for word in ("--out", path)]
    done = cli("continue", *SLOW, *out)
    assert done.status == 0
    assert "period-1 branch of" in done.out
    assert "period = 0.00295 s is the bound" in done.out
    assert "stable" in done.out
    assert "1 branch: 1 of period 1" in done.out
    table = pd.read_csv(paths["csv"], comment="#")
    assert table["period [s]"].to_numpy()[[0, -1]] == pytest.approx([2.95e-3, 3.05e-3], rel=1e-12)
    read = xr.load_dataset(paths["nc"], engine="scipy")
    np.testing.assert_array_equal(read["stable"].to_numpy()[0], np.ones(len(table)))
    found = json.loads(paths["json"].read_text("utf-8"))
    assert found["columns"]["closed"]["values"] == [0]
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert paths["pdf"].read_bytes().startswith(b"%PDF")
    assert b"<svg" in paths["svg"].read_bytes()


def test_ctrl_c_writes_the_branches_that_were_followed(
    cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    branch = ph.continuation(ph.load("hendriks-1983"), "period", ("2.99 ms", "3.01 ms"), period="3 ms")

    def interrupted(*_arguments: object, **_options: object) -> None:
        raise InterruptedBranches(Branches((branch,)))

    monkeypatch.setattr(import_module("printhammer.chaos.continuation.regimes"), "regimes", interrupted)
    out = tmp_path / "branches.csv"
    done = cli("continue", "--regimes", "--from", "330 Hz", "--to", "340 Hz", "--out", out)
    assert done.status == 130
    assert len(pd.read_csv(out, comment="#")) == len(branch)


def test_nothing_found_is_status_1(cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        import_module("printhammer.chaos.continuation.regimes"),
        "regimes",
        lambda *_, **_options: Branches(()),
    )
    out = tmp_path / "branches.csv"
    done = cli("continue", "--regimes", "--from", "330 Hz", "--to", "340 Hz", "--out", out)
    assert done.status == 1
    assert "no branch was found" in done.err
    assert not out.exists()


@pytest.mark.slow
def test_a_chart(cli: Callable, tmp_path: Path) -> None:
    own = ph.load("hendriks-1983").constants["backstop.damping"].si
    picture, data = tmp_path / "chart.png", tmp_path / "chart.nc"
    second = ("--second", "backstop.damping", "--second-from", f"{0.95 * own!r}", "--second-to")
    done = cli(
        "continue",
        *SLOW,
        *second,
        f"{1.05 * own!r} N*s/m^2.5",
        "--grid",
        "2",
        "--out",
        picture,
        "--out",
        data,
    )
    assert done.status == 2
    assert "backstop.damping" in done.err
    assert not picture.exists()
    second = ("--second", "backstop.damping", "--second-from", f"{0.95 * own!r} N*s/m^2.5", "--second-to")
    done = cli(
        "continue",
        *SLOW,
        *second,
        f"{1.05 * own!r} N*s/m^2.5",
        "--grid",
        "2",
        "--out",
        picture,
        "--out",
        data,
    )
    assert done.status == 0
    assert "of the grid settles to period 1" in done.out
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert xr.load_dataset(data, engine="scipy")["settled"].shape == (2, 2)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--from"),
        (("--from", "1 ms"), "--to"),
        (("--from", "700 Hz", "--to", "800 Hz"), "--period and --rate"),
        (
            ("--from", "700 Hz", "--to", "800 Hz", "--period", "1 ms", "--rate", "1 kHz"),
            "--period and --rate",
        ),
        (("--from", "700 Hz", "--to", "800 Hz", "--regimes", "--rate", "1 kHz"), "--regimes"),
        (("--from", "1 ms", "--to", "2 ms", "--regimes", "--parameter", "period"), "--parameter"),
        (("--from", "800 Hz", "--to", "700 Hz", "--rate", "750 Hz"), "ascending"),
        (("--from", "700 Hz", "--to", "800 Hz", "--rate", "2 kHz"), "within the bounds"),
        (("--from", "1", "--to", "2", "--rate", "1 kHz", "--parameter", "nothing"), "'nothing'"),
        ((*SLOW, "--state", "1 um"), "--state"),
        ((*SLOW, "--state", "1 um, 1 um"), "--state"),
        ((*SLOW, "--doublings", "-1"), "doublings"),
        ((*SLOW, "--second", "mass"), "--second-from"),
        ((*SLOW, "--second", "mass", "--second-from", "1 g"), "--second-to"),
        ((*SLOW, "--second", "mass", "--out", "chart.txt"), "--out chart.txt"),
        ((*SLOW, "--show", "nothing", "--out", "branch.png"), "--show = 'nothing'"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("continue", *options, said=said)
