import json
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import xarray as xr

import printhammer as ph
from printhammer.chaos.orbits import search
from printhammer.chaos.orbits.collection import energies_of
from printhammer.cli.verbs.strobe import orbits as verb
from printhammer.run.regime import Regime

SMALL = ("--longest", "1", "--starts", "30", "--guesses", "4", "--follow", "0")


def test_orbits_on_the_screen_and_in_files(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"orbits.{kind}" for kind in ("csv", "nc", "json", "png", "svg")}
    out = [word for path in paths.values() for word in ("--out", path)]
    done = cli("orbits", "hendriks-1983-1", "--period", "1.3 ms", *SMALL, *out)
    assert done.status == 0
    found = ph.orbits(ph.load("hendriks-1983-1"), period=1.3e-3, longest=1, starts=30, guesses=4, follow=0)
    assert len(found) > 0
    assert found.message in " ".join(done.out.split())
    for one in found:
        assert one.kind in done.out
        assert f"{one.multipliers[0].real:+.4g}" in done.out
        assert f"{1e3 * one.energy.coil_work:.4f}" in done.out
    table = pd.read_csv(paths["csv"], dtype=str, comment="#")
    assert table["x [m]"].map(float).tolist() == [one.x[0] for one in found]
    with xr.open_dataset(paths["nc"], engine="scipy") as chart:
        assert chart["x"].values[:, 0].tolist() == [one.x[0] for one in found]
    assert json.loads(paths["json"].read_text("utf-8"))["search"] == found.message
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths["svg"].read_bytes()


def test_in_inches(cli: Callable) -> None:
    done = cli("orbits", "hendriks-1983", "--rate", "500 Hz", "--units", "inch", *SMALL)
    assert done.status == 0
    assert "[in·lbf]" in done.out


def test_a_search_that_finds_nothing_is_told(cli: Callable, tmp_path: Path) -> None:
    path, table = tmp_path / "short.toml", tmp_path / "orbits.csv"
    ph.load("hendriks-1983-1").replace("magnet.range_max", "250 um").save(path)
    done = cli("orbits", path, "--period", "1.3 ms", *SMALL, "--out", table)
    assert done.status == 1
    assert "no orbits of 1 firing" in done.out
    assert "no periodic orbit was found" in done.err
    assert len(pd.read_csv(table, comment="#")) == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--period and --rate"),
        (("--period", "1 ms", "--rate", "1 kHz"), "--period and --rate"),
        (("--period", "1 kg"), "period"),
        (("--period", "-1 ms"), "period"),
        (("--period", "1 ms", "--longest", "0"), "longest"),
        (("--period", "1 ms", "--longest", "99"), "longest"),
        (("--period", "1 ms", "--guesses", "0"), "guesses"),
        (("--period", "1 ms", "--tolerance", "0"), "tolerance"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("orbits", "hendriks-1983", *options, said=said)


def test_defaults_are_those_of_the_library() -> None:
    defaults = {name: each.default for name, each in signature(verb.call).parameters.items()}
    assert int(defaults["longest"]) == search.LONGEST
    assert int(defaults["starts"]) == search.STARTS
    assert int(defaults["guesses"]) == search.GUESSES


def test_energies_in_the_table_are_those_that_there_are() -> None:
    """Work of the drive on the hammer, and loss in its damping."""

    def names(name: str, **firing: Any) -> set[str]:
        return set(energies_of(Regime.of(ph.load(name), **firing)))

    force = ph.SineForce("1 N", "1 Hz")
    assert {"drive_work", "damping_loss"} <= names("shaw-holmes-1983", drive=force)
    assert "coil_work" not in names("shaw-holmes-1983", drive=force)
    assert "damping_loss" not in names("linear-impact-oscillator", drive=force)
    assert {"coil_work", "pack_loss"} <= names("hendriks-1983", period=1e-3)
