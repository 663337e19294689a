"""Sweeps on dask workers of this machine, whose processes are killed."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from tests.errors import refused

import printhammer as ph
from printhammer.results.store import open_store
from printhammer.sweep import cluster
from printhammer.sweep.outputs import WORKER_LOST

HERE = Path(__file__).parent
Content = Callable[[Path], dict[str, bytes]]

# Run by each worker when it starts: one member of the grid kills whoever works on it.
DEADLY = """
import os, signal, time
from printhammer.sweep import cluster, work

def deadly(base, outputs, rows, **options):
    if any(round(row[0]) == {rate} and round(row[1]) == {stiffness} for row in rows):
        # A nanny whose worker dies while it is still being started gives up.
        time.sleep(1.0)
        os.kill(os.getpid(), signal.SIGKILL)
    return work.run_chunk(base, outputs, rows, **options)

cluster.run_chunk = deadly
"""


@contextlib.contextmanager
def local_cluster(workers: int, *preload: Path) -> Iterator[dict[str, Any]]:
    arguments = [sys.executable, str(HERE / "local_cluster.py"), str(workers), *map(str, preload)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(arguments, text=True, **pipes) as process:
        yield json.loads(process.stdout.readline())
        process.stdin.close()


def command(spec: Path, out: Path, address: str) -> list[str]:
    return [sys.executable, "-m", "printhammer", "sweep", str(spec), "--out", str(out), "--dask", address]


def wait_for_blocks(out: Path, count: int, process: "subprocess.Popen[str]") -> None:
    while sum(path.is_file() for path in (out / "status" / "c").rglob("*")) < count:
        assert process.poll() is None
        time.sleep(0.005)


@pytest.mark.slow
def test_a_worker_killed_midway_costs_only_its_blocks(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content
) -> None:
    spec = spec_file(chunk=1, pulses=20, count=30)
    out, whole = tmp_path / "dask.zarr", tmp_path / "whole.zarr"
    with local_cluster(2) as told:
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        with subprocess.Popen(command(spec, out, told["address"]), text=True, **pipes) as process:
            wait_for_blocks(out, 3, process)
            os.kill(told["workers"][0], signal.SIGKILL)
            printed, errors = process.communicate()
    assert process.returncode == 0, errors
    assert "60 ok" in printed
    assert "Traceback" not in errors
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)


@pytest.mark.slow
def test_a_member_that_always_kills_its_worker_is_recorded_and_the_others_are_done(
    spec_file: Callable[..., Path], tmp_path: Path
) -> None:
    spec = spec_file(chunk=6, count=15)
    out, whole = tmp_path / "dask.zarr", ph.sweep(spec, tmp_path / "whole.zarr").load()
    deadly = tmp_path / "deadly.py"
    rate, stiffness = whole.rate.values[7], whole.pack_stiffness.values[1]
    deadly.write_text(DEADLY.format(rate=round(rate), stiffness=round(stiffness)), "utf-8")
    with local_cluster(2, deadly) as told:
        done = subprocess.run(
            command(spec, out, told["address"]), capture_output=True, text=True, check=False
        )
    assert done.returncode == 0, done.stderr
    assert "29 ok, 1 worker lost" in done.stdout
    found = open_store(out).load()
    lost = found.status.values == WORKER_LOST
    assert np.argwhere(lost).tolist() == [[7, 1]]
    assert found.flight_time.values[7, 1].tolist() == pytest.approx([np.nan] * 3, nan_ok=True)
    keep = xr.DataArray(~lost, dims=found.status.dims, coords=found.status.coords)
    xr.testing.assert_equal(found.where(keep), whole.where(keep))


@pytest.mark.slow
def test_a_client_killed_midway_goes_on_without_the_cluster(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content
) -> None:
    spec = spec_file(chunk=1, pulses=20, count=30)
    out, whole = tmp_path / "dask.zarr", tmp_path / "whole.zarr"
    with local_cluster(2) as told:
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen(command(spec, out, told["address"]), text=True, **pipes) as process:
            wait_for_blocks(out, 3, process)
            process.kill()
    assert (open_store(out).status.values == -1).any()
    ph.sweep(spec, out)
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)


@pytest.mark.slow
def test_a_scheduler_that_goes_is_told_and_what_is_done_stays(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Content
) -> None:
    spec = spec_file(chunk=1, pulses=20, count=60)
    out, whole = tmp_path / "dask.zarr", tmp_path / "whole.zarr"
    with local_cluster(1) as told:
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        with subprocess.Popen(command(spec, out, told["address"]), text=True, **pipes) as process:
            wait_for_blocks(out, 3, process)
            os.kill(told["scheduler"], signal.SIGKILL)
            _, errors = process.communicate()
    assert process.returncode == 2, errors
    assert errors.strip().splitlines()[-1] == (
        "printhammer: the scheduler has stopped; completed blocks are kept"
    )
    assert "Traceback" not in errors
    ph.sweep(spec, out)
    ph.sweep(spec, whole)
    assert bytes_of(out) == bytes_of(whole)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nobody", "somebody else"])
def test_an_address_where_no_scheduler_answers(
    kind: str, spec_file: Callable[..., Path], tmp_path: Path
) -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        if kind == "somebody else":
            listener.listen()
        address = f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        done = subprocess.run(
            command(spec_file(), tmp_path / "out.zarr", address), capture_output=True, text=True, check=False
        )
    assert done.returncode == 2
    (told,) = done.stderr.strip().splitlines()
    assert told.startswith(f"printhammer: {address}: no dask scheduler answers there")
    assert not (tmp_path / "out.zarr").exists()


@pytest.mark.parametrize("address", ["nonsense://here", "tcp://127.0.0.1:port"])
def test_an_address_that_is_none(address: str, spec_file: Callable[..., Path], tmp_path: Path) -> None:
    with refused("dask"):
        ph.sweep(spec_file(), tmp_path / "out.zarr", dask=address)
    assert not (tmp_path / "out.zarr").exists()


def test_a_worker_of_another_version_is_told(spec_file: Callable[..., Path]) -> None:
    from printhammer.results.provenance import versions
    from printhammer.sweep.plan import make_plan
    from printhammer.sweep.spec import read_spec

    plan = make_plan(read_spec(spec_file()))
    told = cluster._task(plan.spec.base, plan.spec.outputs, plan.rows([0]), {**versions(), "llvmlite": "0.1"})
    assert isinstance(told, str)
    assert told.startswith("a worker of the cluster has llvmlite")
