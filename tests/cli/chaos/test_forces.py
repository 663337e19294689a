"""The chaos verbs with a continuous force from a drive file: a ball on a vibrating table."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import printhammer as ph
from printhammer.drive.file import save_drive

WEIGHT = 9.80665e-3
FORCE = ph.SineForce(0.8 * WEIGHT, "50 Hz")
NEVER = ph.Burst(ph.load("hendriks-1983").waveform, rate="1 kHz", pulses=2, bursts=2, gap="3 ms")


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "table.toml"
    save_drive(FORCE, path)
    return path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("strobe", "--points", "5"), "period 1"),
        (("lyapunov", "--firings", "20", "--transient", "5"), "0.02 s"),
        (("orbits", "--longest", "1", "--starts", "8", "--guesses", "8", "--follow", "0"), "saddle"),
        (("basins", "--x", "0 mm, 1 mm, 2", "--v", "-0.1 m/s, 0.1 m/s, 2"), "attractor 1"),
        (
            (
                "bifurcation",
                "--parameter",
                "drive.amplitude",
                "--from",
                "1 mN",
                "--to",
                "2 mN",
                "--values",
                "2",
                "--firings",
                "40",
            ),
            "period 1",
        ),
        (
            (
                "bifurcation",
                "--parameter",
                "rate",
                "--from",
                "49 Hz",
                "--to",
                "50 Hz",
                "--values",
                "2",
                "--firings",
                "40",
            ),
            "period 1",
        ),
    ],
)
def test_a_force_without_end_drives_every_verb(
    cli: Callable, table: Path, words: tuple[str, ...], said: str
) -> None:
    verb, *options = words
    done = cli(verb, "bouncing-ball", "--drive", table, *options)
    assert done.status == 0, done.err
    assert said in done.out


def test_a_branch_under_a_force_keeps_all_about_its_events(
    cli: Callable, table: Path, tmp_path: Path
) -> None:
    # Half a period after the phase 0 of the table; see the gallery for the closed form.
    out = tmp_path / "branch.nc"
    options = ("--parameter", "drive.amplitude", "--from", "5 mN", "--to", "11 mN", "--phase", "0.5")
    fold = np.pi * 0.2 / 1.8
    omega, phase = 100.0 * np.pi, np.arccos(fold / 0.8)
    since = (np.pi - phase) / omega
    height = 0.8 * 9.80665 / omega**2
    x = height * np.sin(phase) + 0.09806650 * since - 0.5 * 9.80665 * since**2
    v = 0.0980665 - 9.80665 * since + height * omega
    done = cli(
        "continue",
        "bouncing-ball",
        "--drive",
        table,
        *options,
        "--state",
        f"{float(x)!r} m, {float(v)!r} m/s",
        "--out",
        out,
    )
    assert done.status == 0, done.err
    with xr.open_dataset(out, engine="scipy") as kept:
        located = kept["event_value"].values / WEIGHT
        doubling = np.hypot(fold, 2.0 * 1.64 / 1.8**2)
        place = int(np.argmin(abs(located - doubling)))
        assert located[place] == pytest.approx(doubling, abs=1e-8)
        assert kept["event_multiplier_real"].values[place].min() == pytest.approx(-1.0, abs=1e-6)
        assert kept["event_located"].values[place] == 1
        assert np.isfinite(kept["event_x"].values[place])
        assert np.isfinite(kept["event_v"].values[place])
        assert kept["event_contacts_before"].values[place] == "B"


def test_pulses_of_a_drive_file_are_fired_at_its_rate(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "train.toml"
    save_drive(ph.PulseTrain(ph.load("hendriks-1983").waveform, period=3e-3, pulses=4), path)
    done = cli("strobe", "--drive", path, "--points", "3", "--no-verdict")
    plain = cli("strobe", "--period", "3 ms", "--points", "3", "--no-verdict")
    assert done.status == 0
    assert done.out == plain.out


def test_bad_drives(refused: Callable, table: Path, tmp_path: Path) -> None:
    burst = tmp_path / "burst.toml"
    save_drive(NEVER, burst)
    refused("strobe", "bouncing-ball", said="no [waveform] to fire")
    refused("strobe", "--drive", burst, said="expected a continuous periodic force")
    refused("strobe", "bouncing-ball", "--drive", table, "--period", "1 ms", said="--period")
    refused("lyapunov", "bouncing-ball", "--drive", table, "--rate", "1 Hz", said="--rate")
    refused("basins", "--quench", "--drive", table, said="--drive")
