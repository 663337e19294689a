from collections.abc import Callable
from pathlib import Path

import pytest


def test_errors_by_noise_and_rate(cli: Callable, tmp_path: Path) -> None:
    out = tmp_path / "impact.csv", tmp_path / "impact.svg"
    words = [word for path in out for word in ("--out", path)]
    grid = (
        "--noise",
        "2 mA, 20 mA, 2",
        "--sampling-rate",
        "200 kHz, 1 MHz, 2",
        "--bits",
        "8",
        "--bits",
        "12",
    )
    done = cli("impact-time", "impact-wire", *grid, "--dots", "10", "--hammers", "3", *words)
    assert done.status == 0
    assert "time of impact of impact-wire from the current of its coil" in done.out
    assert len(out[0].read_text("utf-8").splitlines()) >= 8
    assert b"<svg" in out[1].read_bytes()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("hendriks-1983",), "the waveform is a current"),
        (("impact-wire", "--signal", "charge"), "--signal = 'charge'"),
        (("impact-wire", "--noise", "2 V, 3 V, 2"), "--noise"),
        (("impact-wire", "--bits", "many"), "--bits = 'many'"),
    ],
)
def test_what_cannot_be_used(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("impact-time", *words, said=said)
