"""Small sweeps, and stores as bytes."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

SPEC = """
format = 1
hammer = "hendriks-1983"
chunk = {chunk}

[drive.train]
pulses = {pulses}

[[axis]]
key = "drive.rate"
low = "500 Hz"
high = "1.9 kHz"
count = {count}

[[axis]]
key = "pack.stiffness"
values = ["50 lbf", "60 lbf"]

[outputs]
dots = "all"
strobes = ["x", "v"]
final = true
scalars = ["lost_dots", "flight_time_mean", "flight_time_spread"]
"""


@pytest.fixture
def spec_file(tmp_path: Path) -> Callable[..., Path]:
    """Write a spec of a grid of rates and stiffnesses."""

    def write(name: str = "spec.toml", chunk: int = 4, pulses: int = 3, count: int = 6) -> Path:
        path = tmp_path / name
        path.write_text(SPEC.format(chunk=chunk, pulses=pulses, count=count), "utf-8")
        return path

    return write


def content(store: Path) -> dict[str, bytes]:
    """Return all files of a store except its time stamps."""
    files = {str(path.relative_to(store)): path.read_bytes() for path in store.rglob("*") if path.is_file()}
    root = json.loads(files["zarr.json"])
    assert root["attributes"].pop("created")
    root["attributes"].pop("finished")
    return {**files, "zarr.json": json.dumps(root).encode()}


@pytest.fixture
def bytes_of() -> Callable[[Path], dict[str, bytes]]:
    return content
