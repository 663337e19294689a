"""The verb `learn`: a table for one unit, which other verbs reject for any other unit."""

from collections.abc import Callable
from pathlib import Path

import pytest

import printhammer as ph
from printhammer.control.learning.law import RUNS


def test_a_unit_learns_its_table(cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One stage only; control/learning/test_units.py runs all stages for two units."""
    monkeypatch.setattr("printhammer.control.learning.learn.RUNS", RUNS[:1])
    unit, table, picture = tmp_path / "unit.toml", tmp_path / "learned.csv", tmp_path / "lines.png"
    ph.load("hendriks-1983-1").replace("magnet.Am", 0.282).save(unit)
    words = ("--rate", "1.275kHz", "--force-noise", 0.03, "--members", 100, "--history", 1)
    words += ("--serial", "A17", "--unit", unit)
    done = cli("learn", "hendriks-1983-1", *words, "--table", table, "--out", picture)
    assert done.status in (0, 1)
    assert "Unit A17 of hendriks-1983-1 at 1275 Hz" in done.out
    assert "open loop" in done.out
    assert picture.exists()
    assert ph.load_table(table).serial == "A17"
    report = ("quality", "hendriks-1983-1", "--rate", "1.275kHz", "--pulses", 9, "--table", table)
    assert cli(*report, "--serial", "A17").status == 0
    assert cli(*report, "--serial", "any").status == 0
    refused = cli(*report, "--serial", "B2")
    assert refused.status == 2
    assert "learned on unit 'A17'" in refused.err
    assert cli(*report).status == 2


def test_the_offset_of_a_sensor_is_stated(cli: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sensor with a constant delay, and a production whose sensors have different delays."""
    seen: list[ph.ImpactSensor] = []

    def stopped(_hammer: ph.Hammer, _unit: object, *, sensor: ph.ImpactSensor, **_more: object) -> None:
        seen.append(sensor)
        raise ph.InputError.of("rate", 0.0, "no learning here")

    monkeypatch.setattr("printhammer.control.learning.learn.learn", stopped)
    for words in (("--offset", "20 us"), ("--offset-spread", "0.03 ms"), ()):
        assert cli("learn", "hendriks-1983-1", *words).status == 2
    assert [each.delay for each in seen] == [pytest.approx(20e-6), 0.0, 0.0]
    assert [each.offset for each in seen] == [None, pytest.approx(30e-6), None]


def test_bad_sensors_are_refused(refused: Callable) -> None:
    refused("learn", "hendriks-1983", "--missed", "2", said="sensor: missed = 2.0")
    refused("learn", "hendriks-1983", "--signal", "current", said="--signal-noise")
    refused("learn", "hendriks-1983", "--signal-noise", "5 mA", said="--signal-noise")
    refused("learn", "hendriks-1983", "--signal", "current", "--noise", "5 us", said="--noise")
    coil = ("--signal", "current", "--signal-noise", "5 mA")
    refused("learn", "hendriks-1983", *coil, said="the waveform is a current")
    refused("learn", "hendriks-1983", "--driver", "bellows", said="driver")
    refused("quality", "hendriks-1983", "--rate", "900Hz", "--serial", "A17", said="--serial A17")
