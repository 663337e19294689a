"""The verb `fit coil`, on current records written by `measure current`."""

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.identify.test_coil import driven

import printhammer as ph


def test_from_a_hammer_over_its_current_back_to_a_hammer(
    cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    driven().save("driven.toml")
    driven(resistance="12 ohm", inductance="5 mH").save("guess.toml")
    record = ("--locked", "100 um", "--duration", "3 ms", "--sampling-rate", "100 kHz")
    assert cli("measure", "current", "driven.toml", "--out", "current.csv", *record).status == 0
    wanted = ("--out", "coil.toml", "--into", "fitted.toml", "--strict")
    done = cli("fit", "coil", "current.csv", "--hammer", "guess.toml", *wanted)
    assert done.status == 0, done.err
    assert "coil.inductance" in done.out
    assert "[coil]" in Path("coil.toml").read_text("utf-8")
    fitted = ph.load("fitted.toml")
    assert fitted.constants["coil.resistance"].si == pytest.approx(10.0, rel=2e-3)
    assert fitted.uncertainty is not None
    assert fitted.uncertainty.error("coil.inductance") < 1e-5
    for options, said in (
        ((), "the hammer"),
        (("--hammer", "guess.toml", "--also", "magnet.saturation_flux"), "magnet.saturation_flux"),
        (("--hammer", "guess.toml", "--locked", "2 V"), "--locked"),
    ):
        failed = cli("fit", "coil", "current.csv", *options)
        assert failed.status == 2
        assert said in failed.err
