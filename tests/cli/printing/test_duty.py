from collections.abc import Callable
from pathlib import Path

import pytest

import printhammer as ph

COIL = ("--thermal-resistance", "12 K/W", "--limit", "91 degC")
FAMILY = """\
voltage [V],ambient [degC],rate [Hz]
21.6,25,1127
21.6,50,700
24,25,1173
24,50,728
26.4,25,1218
26.4,50,756
"""


def test_rates_and_bursts(cli: Callable, tmp_path: Path) -> None:
    out = tmp_path / "duty.csv"
    ambient = ("--ambient", "25 degC", "--ambient", "50 degC")
    fired = ("--burst", "3 kHz", "--thermal-capacity", "2 J/K")
    done = cli("duty", "--heat", "4 mJ", *COIL, *ambient, *fired, "--out", out)
    assert done.status == 0
    assert "1759" in done.out
    assert "18.8" in done.out
    assert "58.6" in done.out
    assert "burst [Hz]" in out.read_text("utf-8")


def test_the_limit_behind_rates(cli: Callable, tmp_path: Path) -> None:
    rates, picture = tmp_path / "family.csv", tmp_path / "limit.svg"
    rates.write_text(FAMILY)
    done = cli("duty", "--rates", rates, "--out", picture)
    assert done.status == 0
    assert "limit of the winding 90.9" in done.out
    assert b"<svg" in picture.read_bytes()


def test_a_hammer_by_its_resistance_and_current(cli: Callable, tmp_path: Path) -> None:
    wound = tmp_path / "wound.toml"
    ph.load("hendriks-1983").replace("coil.resistance", "4 ohm").save(wound)
    done = cli("duty", wound, *COIL, "--out", tmp_path / "duty.png")
    assert done.status == 0
    assert "held constant" in done.out
    assert "the current of the driver" in done.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--heat", "4 mJ"), "--thermal-resistance"),
        (COIL, "HAMMER and --heat"),
        (("hendriks-1983", "--heat", "4 mJ", *COIL), "HAMMER and --heat"),
        (("hendriks-1983", *COIL), "hendriks-1983.toml: coil.resistance"),
        (("hendriks-1983", "--feed", "current", *COIL), "--feed"),
        (("--rates", "no.csv", *COIL), "--thermal-resistance"),
        (("--rates", "no.csv"), "no.csv: there is no such file"),
        (("--heat", "4 mJ", "--ambient", "300 K", *COIL), "'K' is a difference of temperatures"),
    ],
)
def test_what_cannot_be_used(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("duty", *words, said=said)
