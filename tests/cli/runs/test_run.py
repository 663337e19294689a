import contextlib
import csv
import json
import re
import signal
import subprocess
import sysconfig
import time
from pathlib import Path

import pytest

import printhammer as ph

SCRIPT = Path(sysconfig.get_path("scripts")) / "printhammer"


def numbers_of(line: str) -> list[float]:
    return [float(text) for text in re.findall(r"-?\d+\.?\d*", line)]


def dot_rows(text: str) -> list[list[float]]:
    table = text[text.index("\ndot ") : text.index("\nstatus")]
    return [numbers_of(line) for line in table.splitlines() if re.match(r"\s+\d+ ", line)]


@pytest.mark.parametrize(("name", "text"), [("rate", "1.2 kHz"), ("period", "0.7 ms")])
def test_a_rate_alone_is_one_drive_wherever_it_is_said(
    cli, hammer: "ph.Hammer", tmp_path: Path, name: str, text: str
) -> None:
    """The default is nine firings in Python, in a drive file and on the command line."""
    assert hammer.waveform is not None
    drive = ph.PulseTrain(hammer.waveform, **{name: text})
    assert drive == ph.PulseTrain(hammer.waveform, **{name: text}, pulses=9)
    (tmp_path / "drive.toml").write_text(f'format = 1\n[train]\n{name} = "{text}"\n')
    for number, options in enumerate([(f"--{name}", text), ("--drive", str(tmp_path / "drive.toml"))]):
        out = tmp_path / f"{number}.json"
        assert cli("run", "hendriks-1983", *options, "--out", str(out)).status == 0
        told = json.loads(out.read_text())
        assert told["provenance"]["drive_fingerprint"] == drive.fingerprint


def test_the_table_tells_what_the_motion_tells(cli, hammer: "ph.Hammer") -> None:
    outcome = cli("run", "hendriks-1983", "--rate", "1.2 kHz")
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate=1200.0, pulses=9))
    rows = dot_rows(outcome.out)
    assert (outcome.status, outcome.err) == (0, "")
    assert len(rows) == 9
    for row, dot in zip(rows, motion.dots, strict=True):
        assert row[:5] == pytest.approx(
            [dot.index + 1, dot.fired_at * 1e6, dot.flight_time * 1e6, dot.impact_speed, dot.peak_force],
            abs=0.06,
        )
    assert "status    ok" in outcome.out
    assert "reconstruction" in outcome.out
    assert "9 struck" in outcome.out


def test_the_same_in_inches_and_pounds(cli) -> None:
    metric, inch = (
        dot_rows(cli("run", "--at", "0 us, 700 us", "--units", units).out) for units in ("si", "inch")
    )
    for si, us in zip(metric, inch, strict=True):
        assert us[1:3] == si[1:3]
        assert us[3] == pytest.approx(si[3] / 0.0254, abs=0.1)
        assert us[4] == pytest.approx(si[4] / 4.4482216152605, abs=0.002)
        assert us[5] == pytest.approx(si[5] / 25.4, abs=0.001)


def test_a_lost_dot_is_told(cli) -> None:
    outcome = cli("run", "--at", "0 us, 660 us")
    assert outcome.status == 0
    assert "1 struck, 1 lost" in outcome.out
    assert any(line.rstrip().endswith("lost") and "–" in line for line in outcome.out.splitlines())


def test_a_run_that_stops_early_ends_with_status_1(cli, hammer: "ph.Hammer", tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    hammer.replace("magnet.range_max", "0.009 in").save(path)
    outcome = cli("run", path, "--out", tmp_path / "out.json")
    assert outcome.status == 1
    assert "range left" in outcome.out
    assert "left the range" in outcome.err
    assert json.loads((tmp_path / "out.json").read_text())["status"] == "range left"


def test_files(cli, hammer: "ph.Hammer", tmp_path: Path) -> None:
    import pandas as pd

    names = {"dots": ["dots.csv"], "contacts": ["contacts.parquet"]}
    names["out"] = ["m.csv", "m.parquet", "m.json", "m.svg"]
    written = [(kind, name) for kind, many in names.items() for name in many]
    options = [text for kind, name in written for text in (f"--{kind}", tmp_path / name)]
    outcome = cli("run", "--at", "0 us, 660 us", "--points", "101", *options)
    assert outcome.status == 0
    assert {path.name for path in tmp_path.iterdir()} == {name for _, name in written}
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=[0.0, 660e-6]), points=101)
    record = pd.read_csv(tmp_path / "m.csv", comment="#")
    assert record["x [m]"].to_numpy() == pytest.approx(motion.x, rel=1e-15)
    stored = pd.read_parquet(tmp_path / "m.parquet")
    pd.testing.assert_frame_equal(record, stored, check_dtype=False, rtol=1e-15, atol=0.0)
    with (tmp_path / "dots.csv").open() as file:
        first, second = csv.DictReader(file)
    assert float(first["flight_time [s]"]) == motion.dots[0].flight_time
    assert second["struck"] == "False"
    assert second["flight_time [s]"] == ""
    contacts = pd.read_parquet(tmp_path / "contacts.parquet")
    assert contacts["surface"].tolist() == [contact.surface for contact in motion.contacts]
    told = json.loads((tmp_path / "m.json").read_text())
    assert told["dots"][0]["peak_force_N"] == motion.dots[0].peak_force
    assert told["dots"][1]["flight_time_s"] is None
    assert told["energy"]["coil_work_J"] == motion.energy.coil_work
    assert told["provenance"]["hammer_fingerprint"] == hammer.fingerprint
    assert told["constants"]["mass"] == {"value": hammer.mass, "unit": "kg", "status": "reconstructed"}
    assert (tmp_path / "m.svg").read_text().startswith("<?xml")


def test_a_drive_file(cli, tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text('format = 1\n[burst]\nrate = "1 kHz"\npulses = 2\nbursts = 2\ngap = "3 ms"\n', "utf-8")
    outcome = cli("run", "--drive", path, "--out", tmp_path / "out.json")
    assert outcome.status == 0
    dots = json.loads((tmp_path / "out.json").read_text())["dots"]
    assert [dot["fired_at_s"] for dot in dots] == pytest.approx([0.0, 1e-3, 4e-3, 5e-3])


def test_a_long_train_shows_its_ends(cli) -> None:
    outcome = cli("run", "--period", "1.5 ms", "--pulses", "60")
    rows = dot_rows(outcome.out)
    assert [int(row[0]) for row in rows] == [*range(1, 21), *range(41, 61)]
    assert "20 more" in outcome.out


@pytest.mark.parametrize("scheme", ["trapezoid", "runge-kutta-4"])
def test_the_schemes_of_1983(cli, scheme: str, tmp_path: Path) -> None:
    outcome = cli("run", "--scheme", scheme, "--out", tmp_path / "out.json")
    assert outcome.status == 0
    told = json.loads((tmp_path / "out.json").read_text())
    assert told["provenance"]["scheme"] == scheme
    # Printed to a third of a per cent in the paper; a scheme that is off by more is none of its.
    assert told["peak"]["x_m"] == pytest.approx(0.0112 * 0.0254, rel=5e-3)


def test_the_second_run_compiles_nothing(tmp_path: Path) -> None:
    command = [SCRIPT, "run", "--rate", "1.2 kHz"]
    first, second = (
        subprocess.run(command, cwd=tmp_path, capture_output=True, check=True, text=True) for _ in range(2)
    )
    assert second.stdout == first.stdout
    assert "compiling" not in second.stderr


def test_interrupting_is_polite(tmp_path: Path) -> None:
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen([SCRIPT, "paper", "--out", "paper"], cwd=tmp_path, **pipes)
    # It is at work once there is a folder for what is not complete yet.
    while not [*(tmp_path / "paper").glob(".report-*")] and process.poll() is None:
        time.sleep(0.02)
    told = ""
    # The compiler may swallow an interrupt; a second one then does what the first was meant to.
    for _ in range(100):
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            told = process.communicate(timeout=3)[1]
            break
    assert process.returncode == 130
    assert told.splitlines()[-1] == "printhammer: interrupted"
    assert "Traceback" not in told


def test_a_reader_who_has_had_enough() -> None:
    command = f"{SCRIPT} hammer schema | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert done.stdout == "{\n"
    assert "Traceback" not in done.stderr
