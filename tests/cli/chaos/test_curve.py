"""The verb `curve`, on a bouncing ball whose fold and doubling are known in closed form."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
from tests.truth.impact_orbits import BouncingBall

import printhammer as ph
from printhammer.drive.file import save_drive

GRAVITY = 9.80665
WEIGHT = 1e-3 * GRAVITY
CASE = BouncingBall(GRAVITY, 0.8, 50.0)
SECOND = ("--second", "backstop.restitution", "--second-from", "0.7", "--second-to", "0.85")

# Around the doubling only, which lies between 10.2 and 11.5 mN.
NEAR = ("--from", "7 mN", "--to", "12 mN")


@pytest.fixture
def ball(tmp_path: Path) -> tuple[object, ...]:
    path = tmp_path / "table.toml"
    save_drive(ph.SineForce(0.8 * WEIGHT, "50 Hz"), path)
    x, v = CASE.state(0.8, 0.01)
    along = ("--parameter", "drive.amplitude", "--from", "2 mN", "--to", "16 mN", "--phase", "0.5")
    return ("bouncing-ball", "--drive", path, *along, "--state", f"{x!r} m, {v!r} m/s")


@pytest.mark.parametrize("event", [pytest.param("fold", marks=pytest.mark.slow), "period doubling"])
def test_a_curve(cli: Callable, tmp_path: Path, ball: tuple[object, ...], event: str) -> None:
    out, picture = tmp_path / "curve.nc", tmp_path / "curve.png"
    near = () if event == "fold" else NEAR
    words = ("--event", event, "--grid", "3", "--out", out, "--out", picture)
    done = cli("curve", *ball, *near, *SECOND, *words)
    assert done.status == 0, done.err
    assert f"{event} of the period-1 orbit" in done.out
    assert "backstop.restitution = 0.85 is the bound" in done.out.replace("\n", " ")
    assert picture.read_bytes().startswith(b"\x89PNG")
    with xr.open_dataset(out, engine="scipy") as kept:
        assert sorted(kept["second"].values[[0, -1]]) == [0.7, 0.85]
        for force, restitution in zip(kept["first"].values, kept["second"].values, strict=True):
            at = BouncingBall(GRAVITY, float(restitution), 50.0)
            exact = at.fold if event == "fold" else at.doubling
            assert force / WEIGHT == pytest.approx(exact, rel=1e-9)
        assert kept["settled"].shape == (3, 3)
        if event != "fold":
            assert (kept["coefficient"].values > 0.0).all()


def test_a_curve_from_the_file_of_a_branch(cli: Callable, tmp_path: Path, ball: tuple[object, ...]) -> None:
    branch, out = tmp_path / "branch.nc", tmp_path / "curve.csv"
    assert cli("continue", *ball, *NEAR, "--out", branch).status == 0
    words = ("curve", *ball[:3], "--start", branch, *SECOND, "--event", "period doubling", "--out", out)
    done = cli(*words)
    assert done.status == 0, done.err
    rows = pd.read_csv(out, comment="#")
    assert rows["second"].min() == pytest.approx(0.7, rel=1e-12)
    again = cli(
        "curve", *ball[:3], "--start", out, *SECOND, "--event", "last", "--out", tmp_path / "again.csv"
    )
    assert again.status == 0, again.err
    anew = pd.read_csv(tmp_path / "again.csv", comment="#")
    assert sorted(anew["second"].iloc[[0, -1]]) == pytest.approx([0.7, 0.85], rel=1e-12)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ("--event", "Neimark-Sacker"),
            "event = Neimark-Sacker: no such event; the events of the branch are:",
        ),
        (("--event", "sausage"), "expected a number"),
        (("--event", "99"), "expected the number of one of"),
    ],
)
def test_events_that_are_not_there(
    refused: Callable, ball: tuple[object, ...], options: tuple, said: str
) -> None:
    refused("curve", *ball, *SECOND, *options, said=said)


def test_bad_input_is_one_sentence(refused: Callable, tmp_path: Path, ball: tuple[object, ...]) -> None:
    twice = ("--second", "drive.amplitude", "--second-from", "1 mN", "--second-to", "9 mN")
    refused("curve", *ball, *twice, said="expected another constant than that of the branch")
    outside = ("--second", "backstop.restitution", "--second-from", "0.1", "--second-to", "0.2")
    refused("curve", *ball, *outside, said="at the start: expected one within the bounds")
    refused("curve", *ball, "--second", "mass", said="--second-from")
    refused("curve", *ball[:3], *SECOND, "--start", tmp_path / "none.nc", said="none.nc")


def test_a_rate_and_its_period_are_one_constant(refused: Callable) -> None:
    along = ("--rate", "745 Hz", "--from", "740 Hz", "--to", "750 Hz")
    second = ("--second", "period", "--second-from", "1 ms", "--second-to", "2 ms")
    refused("curve", "hendriks-1983", *along, *second, said="'period'")
