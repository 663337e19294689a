"""Killed processes: the same command continues, and the store equals that of an uninterrupted sweep."""

import random
import resource
import signal
import subprocess
import sysconfig
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import printhammer as ph

SCRIPT = Path(sysconfig.get_path("scripts")) / "printhammer"
Content = Callable[[Path], dict[str, bytes]]


def command(spec: Path, out: Path) -> list[str]:
    return [str(SCRIPT), "sweep", str(spec), "--out", str(out)]


def blocks_done(out: Path) -> int:
    return sum(path.is_file() for path in (out / "status" / "c").rglob("*"))


def killed(spec: Path, out: Path, blocks: int, later: float, kind: int = signal.SIGKILL) -> int | None:
    """Start the sweep, and kill it after a number of further blocks and a delay."""
    before = blocks_done(out)
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    with subprocess.Popen(command(spec, out), **pipes) as process:
        while blocks_done(out) < before + blocks and process.poll() is None:
            time.sleep(0.001)
        time.sleep(later)
        process.send_signal(kind)
        told = process.communicate()[1].decode()
        assert "Traceback" not in told
        return process.returncode


def finished(spec: Path, out: Path) -> str:
    done = subprocess.run(command(spec, out), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_killed_sweep_goes_on_to_the_same_store(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content
) -> None:
    spec = spec_file(chunk=1, pulses=9, count=8)
    out, whole = tmp_path / "killed.zarr", tmp_path / "whole.zarr"
    assert killed(spec, out, 2, 0.0) == -signal.SIGKILL
    done = blocks_done(out)
    assert 2 <= done < 16
    told: list[tuple[float, int, int]] = []
    ph.sweep(spec, out, progress=lambda *numbers: told.append(numbers))
    assert told[0] == (done, done, 16)
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)


@pytest.mark.slow
def test_kills_at_any_moment(spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content) -> None:
    chance = random.Random(1)
    # So many blocks that a fast machine is not done before it is killed.
    spec = spec_file(chunk=2, pulses=9, count=80)
    out, whole = tmp_path / "killed.zarr", tmp_path / "whole.zarr"
    kills = 0
    for attempt in range(4):
        # Now and then before anything is done: while the store is laid out.
        blocks = 0 if attempt % 3 == 0 else chance.randrange(1, 6)
        later = chance.uniform(0.0, 1.0) if blocks == 0 else chance.uniform(0.0, 0.05)
        kills += killed(spec, out, blocks, later) == -signal.SIGKILL
    assert kills >= 3
    finished(spec, out)
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)
    assert {path.name for path in tmp_path.iterdir()} == {"spec.toml", "killed.zarr", "whole.zarr"}


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done(spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content) -> None:
    spec = spec_file(chunk=1, pulses=9, count=15)
    out, whole = tmp_path / "interrupted.zarr", tmp_path / "whole.zarr"
    assert killed(spec, out, 3, 0.0, signal.SIGINT) == 130
    assert 3 <= blocks_done(out) < 30
    finished(spec, out)
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)


@pytest.mark.slow
def test_a_file_that_cannot_grow_is_told_and_what_is_done_stays(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content
) -> None:
    spec = spec_file(chunk=1, pulses=9, count=8)
    long = '[outputs]\ndisplacement = { end = "12 ms", count = 20000 }\n'
    spec.write_text(spec.read_text("utf-8").replace("[outputs]\n", long), "utf-8")
    out, whole = tmp_path / "full.zarr", tmp_path / "whole.zarr"
    assert killed(spec, out, 2, 0.0) == -signal.SIGKILL
    done = blocks_done(out)

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))

    failed = subprocess.run(command(spec, out), capture_output=True, text=True, check=False, preexec_fn=limit)
    assert failed.returncode == 2
    assert failed.stderr.strip().splitlines()[-1].endswith("(File too large); its blocks are kept")
    assert "Traceback" not in failed.stderr
    assert blocks_done(out) == done
    finished(spec, out)
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)
