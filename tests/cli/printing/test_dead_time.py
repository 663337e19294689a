from collections.abc import Callable
from pathlib import Path

import pytest

GRID = ("--voltage", "34 V, 38 V, 2", "--temperature", "20 degC, 90 degC, 2")


def test_a_table_for_the_firmware(cli: Callable, tmp_path: Path) -> None:
    out = {ending: tmp_path / f"dead.{ending}" for ending in ("csv", "h", "svg")}
    words = [word for path in out.values() for word in ("--out", path)]
    done = cli("dead-time", "impact-wire", *GRID, "--blow", "2.9 m/s", *words)
    assert done.status == 0
    assert "same blow" in done.out
    assert "width [s]" in out["csv"].read_text("utf-8")
    assert "#define PRINTHAMMER_IMPACT_WIRE_RAILS 2" in out["h"].read_text("utf-8")
    assert b"<svg" in out["svg"].read_bytes()


def test_a_blow_out_of_reach_is_told(cli: Callable) -> None:
    done = cli("dead-time", "impact-wire", *GRID, "--blow", "4 m/s")
    assert done.status == 0
    assert "No width gives the blow at 4 of 4 pairs" in done.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("hendriks-1983",), "expected a [waveform] that is a driver on a rail"),
        (
            ("impact-wire", "--voltage", "40 V, 38 V, 2"),
            "--voltage '40 V, 38 V, 2'",
        ),
        (("impact-wire", "--voltage", "38 V"), "expected two ends and a number"),
        (("impact-wire", "--temperature", "20 K, 90 K, 2"), "'K' is a difference of temperatures"),
    ],
)
def test_what_cannot_be_used(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("dead-time", *words, said=said)


def test_a_blow_weaker_than_the_shortest_pulse_gives(cli: Callable) -> None:
    """The high-current phase of this driver lasts longer than the flight."""
    options = ["--blow", "4 m/s", "--voltage", "45 V, 50 V, 2", "--temperature", "20 degC, 60 degC, 2"]
    done = cli("dead-time", "pinball-flipper", *options)
    assert "At 4 of 4 pairs of rail and temperature the shortest pulse" in " ".join(done.out.split())
    assert "No width gives the blow" not in done.out
