"""Exports of one record through every reader: each cell is correct, or the file is rejected."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.support.tables import exports

from printhammer.drive.file import read_drive
from printhammer.drive.waveforms.shapes import Sampled
from printhammer.errors import InputError
from printhammer.maps.measured import load_measured_map
from printhammer.support.tables.readings import read_table

Curves = dict[str, np.ndarray]
AFTER = exports.TIMES >= 0.0
DRIVE = 'format = 1\n[times]\nat = ["0 us"]\n[waveform]\nshape = "sampled"\nfile = "trace.csv"\n'


def of_drive(path: Path) -> Curves:
    waveform = read_drive(DRIVE, folder=path.parent).waveform
    assert isinstance(waveform, Sampled)
    return {"time": waveform.times, waveform.quantity: waveform.values}


def of_map(path: Path) -> Curves:
    chart = load_measured_map(path)
    np.testing.assert_array_equal(chart["rate"], [500.0])
    return {"time": chart["time"].values, "displacement": chart["displacement"].values[0]}


def of_motion(path: Path) -> Curves:
    return read_table(path, {"time": "s", "displacement": "m"}, optional={"current": "A"}).values


def of_coil(path: Path) -> Curves:
    return read_table(path, {"time": "s", "current": "A"}, optional={"displacement": "m"}).values


READERS: dict[str, Callable[[Path], Curves]] = {
    "drive": of_drive,
    "map": of_map,
    "motion": of_motion,
    "coil": of_coil,
}


def written(folder: Path, export: exports.Export, columns: str) -> Path:
    path = folder / "trace.csv"
    path.write_bytes(export.content)
    if columns:
        entries = [entry.split("=") for entry in columns.split(",")]
        lines = [f'"{name.strip()}" = "{value.strip()}"' for name, value in entries]
        (folder / "trace.csv.toml").write_text("[columns]\n" + "\n".join(lines) + "\n")
    return path


def right(found: Curves, name: str) -> None:
    """Check that a reader returns the record, from the firing onward for a drive."""
    if name == "Saleae, edges":
        # A level holds until the next edge.
        late = np.searchsorted(found["time"], [0.0, 10e-6, 20e-6 - 1e-12, 30e-6], side="right") - 1
        np.testing.assert_allclose(found["current"][late], [1.0, 1.0, 1.0, 0.0])
        if found["time"][0] == 0.0:
            late = np.interp([1e-9, 19e-6, 20e-6], found["time"], found["current"])
            np.testing.assert_allclose(late, [1.0, 1.0, 0.0])
        return
    rows = AFTER if len(found["time"]) == AFTER.sum() else slice(None)
    np.testing.assert_allclose(found["time"], exports.TIMES[rows], rtol=1e-6, atol=1e-15)
    for quantity, values in (("current", exports.CURRENT), ("displacement", exports.PLACES)):
        if quantity in found:
            np.testing.assert_allclose(found[quantity], values[rows], rtol=2e-6, atol=1e-12)
    assert len(found) > 1


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("name", exports.EXPORTS)
def test_what_a_file_alone_says_is_right_or_refused(tmp_path: Path, name: str, reader: str) -> None:
    export = exports.EXPORTS[name]()
    path = written(tmp_path, export, "")
    if export.columns or reader == "map":
        # Neither what a channel shows nor a rate stands in the file.
        with pytest.raises(InputError) as caught:
            READERS[reader](path)
        assert "\n" not in str(caught.value)
    else:
        right(READERS[reader](path), name)


@pytest.mark.parametrize("reader", ["drive", "map", "motion", "coil"])
@pytest.mark.parametrize("name", [name for name, made in exports.EXPORTS.items() if made().columns])
def test_what_is_said_of_the_columns_makes_the_record(tmp_path: Path, name: str, reader: str) -> None:
    export = exports.EXPORTS[name]()
    wanted = {"drive": {"time", "current"}, "map": {"time", "displacement"}}.get(reader)
    entries = [entry.strip() for entry in export.columns.split(",")]
    kept = [entry for entry in entries if wanted is None or entry.split("=")[0] in wanted]
    columns = ",".join(kept)
    if reader == "map":
        columns = columns.replace("displacement=", "500 Hz=")
    path = written(tmp_path, export, columns)
    if reader in ("map", "motion") and "displacement" not in export.columns:
        with pytest.raises(InputError):
            READERS[reader](path)
    else:
        found = READERS[reader](path)
        if reader == "map":
            found = {"time": found["time"], "displacement": found["displacement"].astype(float)}
            np.testing.assert_allclose(found["displacement"], exports.PLACES, rtol=1e-6)
        right(found, name)
