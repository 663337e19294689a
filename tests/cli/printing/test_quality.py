import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.printing.rates.damping import Material

GRID = ("--first", "400 Hz", "--last", "1.2 kHz", "--step", "400 Hz")


def test_the_report_and_its_files(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"dots.{kind}" for kind in ("nc", "csv", "json", "png")}
    out = [word for path in paths.values() for word in ("--out", path)]
    done = cli("quality", CRUDE, "--rate", "900Hz", "--pattern", "1101", "--units", "inch", *out)
    assert done.status == 0
    found = ph.quality(ph.load(CRUDE), 900.0, "1101")
    assert f"{int((found.fault < 0).sum())} of 3 within limits" in done.out
    assert "lbf" in done.out
    assert "dot matrix" in done.out
    assert json.loads(paths["json"].read_text())["force_mean_N"] == found.force_spread.mean
    assert json.loads(paths["json"].read_text())["dot_matrix_tolerance"] == int(found.dot_matrix)
    assert len(pd.read_csv(paths["csv"], comment="#")) == 3
    assert paths["png"].read_bytes().startswith(b"\x89PNG")


def test_limits_by_name_and_by_number(cli: Callable, tmp_path: Path) -> None:
    words = ("--rate", "900Hz", "--pulses", "2", "--limits", "engraved", "--force-limit", "20%")
    done = cli("quality", CRUDE, *words, "--arrival-limit", "15 us")
    assert done.status == 0
    assert "force within 20 %, arrival within 15.0 µs" in done.out


def test_paper_that_varies(cli: Callable, tmp_path: Path) -> None:
    paper, out = tmp_path / "paper.toml", tmp_path / "dots.json"
    paper.write_text('stiffness = "10 %"\nfront = "5 um"\nseed = 2\n')
    words = ("quality", CRUDE, "--rate", "900Hz", "--pattern", "1101")
    done = cli(*words, "--paper", paper, "--out", out)
    assert done.status == 0
    assert "stiffness 10 %, front 5 µm, correlated over 2 mm" in done.out
    found = ph.quality(ph.load(CRUDE), 900.0, "1101", paper=ph.Paper.load(paper))
    kept = json.loads(out.read_text())
    assert (
        kept["force_mean_N"]
        == found.force_spread.mean
        != ph.quality(ph.load(CRUDE), 900.0, "1101").force.mean()
    )
    assert (kept["paper"], kept["paper_seed"]) == (found.paper and found.paper.text, 2)
    refused = cli("quality", CRUDE, "--safe-rate", *GRID, "--paper", paper)
    assert refused.status == 2
    assert "--paper" in refused.err
    paper.write_text("front = 3 um")
    assert cli(*words, "--paper", paper).status == 2


def test_the_safe_rate(cli: Callable, tmp_path: Path) -> None:
    out = tmp_path / "rates.json"
    done = cli("quality", CRUDE, "--safe-rate", *GRID, "--out", out, "--out", tmp_path / "rates.svg")
    assert done.status == 0
    found = ph.safe_rate(ph.load(CRUDE), first=400.0, last=1200.0, step=400.0)
    assert found.failure is not None
    assert found.failure.text[:30] in done.out
    assert json.loads(out.read_text())["columns"]["rate"]["values"] == found.rates.tolist()
    assert b"<svg" in (tmp_path / "rates.svg").read_bytes()


def test_the_yield(cli: Callable, tmp_path: Path) -> None:
    out = tmp_path / "hammers.nc"
    words = (
        "--yield",
        "4",
        "--spread",
        "1%",
        "--spread",
        "mass=0.03",
        "--seed",
        "2",
        "--limits",
        "dot-matrix",
    )
    done = cli("quality", CRUDE, "--rate", "400Hz", *words, "--out", out, "--out", tmp_path / "hammers.png")
    assert done.status == 0
    assert "4 hammers" in done.out
    assert "at 400 Hz" in done.out
    with xr.open_dataset(out, engine="scipy") as chart:
        assert json.loads(chart.attrs["spreads"])["mass"] == 0.03
        assert json.loads(chart.attrs["spreads"])["magnet.Am"] == 0.01
        assert chart.attrs["seed"] == 2
    rates = cli(
        "quality", CRUDE, "--yield", "2", "--limits", "dot-matrix", *GRID, "--out", tmp_path / "r.png"
    )
    assert rates.status == 0
    assert "keep to the limits" in rates.out


def test_the_damping_study(cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # No other laws, which would have to be compiled.
    few = [
        Material("as it is", "as it is", {}),
        Material("hard", "five times", {"backstop.damping": 5.0 * ph.load(CRUDE).backstop.l}),
        Material("hard", "no material", {"backstop.damping": -1.0}),
    ]
    monkeypatch.setattr(import_module("printhammer.printing.rates.damping"), "materials", lambda *_: few)
    out = tmp_path / "study.png"
    done = cli("quality", CRUDE, "--damping", "--current", "1.5 A", *GRID, "--out", out)
    assert done.status == 0
    assert "five times" in done.out
    assert "no hammer" in done.out
    assert out.stat().st_size > 10_000


def test_a_compensation_table_drives_instead(cli: Callable, tmp_path: Path) -> None:
    # As in the tests of `tune`: a hammer whose pulse is over before the touch.
    quick, table = tmp_path / "quick.toml", tmp_path / "table.csv"
    hammer = ph.load(CRUDE).replace({"waveform.amplitude": 1.3, "waveform.width": 200e-6})
    hammer.save(quick)
    ph.tune(hammer, rate=1850.0, history=1, reach=1, brake=False).save(table)
    done = cli("quality", quick, "--rate", "1850 Hz", "--pattern", "1111", "--table", table)
    assert done.status == 0
    assert "1850 Hz, table" in done.out
    safe = cli("quality", quick, "--safe-rate", "--table", table)
    assert safe.status == 0
    assert "1850 to 1850 Hz" in safe.out
    beyond = cli("quality", quick, "--rate", "900 Hz", "--table", table)
    assert beyond.status == 2
    assert "made for 1850 Hz" in beyond.err
    other = cli("quality", CRUDE, "--rate", "1850 Hz", "--table", table)
    assert other.status == 2
    assert "made for another hammer" in other.err
    over = cli("quality", quick, "--rate", "1850 Hz", "--table", table, "--out", table)
    assert over.status == 2


def test_a_run_that_stops_is_told(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    hammer = ph.load(CRUDE)
    # Within the indentation of a dot from a running start, beyond that of the single pulse.
    deepest = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=4e-3).dots[0].indentation
    hammer.replace("magnet.range_max", hammer.front + deepest + 1e-9).save(path)
    for rate in range(700, 1500, 100):
        if not ph.quality(ph.load(path), rate, 3).ok:
            done = cli("quality", path, "--rate", f"{rate} Hz", "--pulses", "3")
            assert done.status == 1
            assert "range left" in done.err
            return
    pytest.fail("no rate at which a dot is deeper than that of the single pulse")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--rate"),
        (("--rate", "0 Hz"), "rate"),
        (("--rate", "1 ms"), "rate"),
        (("--rate", "1 kHz", "--pattern", "102"), "pattern"),
        (("--rate", "1 kHz", "--pattern", "11", "--pulses", "2"), "--pattern and --pulses"),
        (("--rate", "1 kHz", "--pitch", "-1 mm"), "pitch"),
        (("--rate", "1 kHz", "--limits", "none"), "limits"),
        (("--rate", "1 kHz", "--force-limit", "-10%"), "force"),
        (("--rate", "1 kHz", "--arrival-limit", "1 kg"), "--arrival-limit"),
        (("--rate", "1 kHz", "--safe-rate"), "--rate"),
        (("--rate", "1 kHz", "--seed", "1"), "--seed"),
        (("--safe-rate", "--damping"), "--safe-rate and --damping"),
        (("--safe-rate", "--last", "50 Hz"), "last"),
        (("--yield", "0"), "--yield 0"),
        (("--yield", "2", "--spread", "magnet.Xm=1%"), "magnet.Xm"),
        (("--yield", "2", "--spread", "1%", "--spread", "2%"), "--spread 2%"),
        (("--yield", "2", "--judged-by", "me"), "judged_by"),
        (("--damping", "--current", "-2 A"), "current"),
        (("--rate", "1 kHz", "--tolerance", "0"), "tolerance"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("quality", CRUDE, *options, said=said)
