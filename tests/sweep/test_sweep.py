"""Sweeps: each member equals a run of `simulate`, for every engine; failed members are rows."""

import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.errors import refused
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.results.store import Store, open_store
from printhammer.run.ensemble_group import Group
from printhammer.sweep.outputs import DOTS, STATUSES
from printhammer.sweep.plan import make_plan
from printhammer.sweep.spec import read_spec
from printhammer.sweep.work import run_chunk

# So that two integrators agree although bounces amplify what they differ by.
TIGHT = 1e-13

ALL = {
    "dots": "all",
    "strobes": "all",
    "final": True,
    "scalars": "all",
    "displacement": {"start": "0.1 ms", "end": "5 ms", "count": 40},
}


def run(tmp_path: Path, **spec: Any) -> xr.Dataset:
    whole = {"format": 1, "hammer": str(CRUDE), "outputs": ALL, "tolerance": TIGHT, **spec}
    return ph.sweep(whole, tmp_path / "out.zarr")


def close(found: Any, wanted: Any, scale: float = 0.0) -> bool:
    """Compare the results of two integrators for a member, on a separate scale if necessary."""
    return np.allclose(found, wanted, rtol=1e-7, atol=1e-7 * scale, equal_nan=True)


def check_member(row: xr.Dataset, motion: ph.Motion) -> None:
    """Compare a member with the motion of the same hammer under the same drive."""
    assert STATUSES[int(row.status)] == motion.status
    assert close(row.reached, motion.end)
    assert bool(row.unsettled) == bool(motion.unsettled)
    for dot in motion.dots:
        found = row.isel(firing=dot.index)
        assert bool(found.fired)
        for output in DOTS[1:]:
            wanted = getattr(dot, output.name)
            assert close(found[output.name], math.nan if wanted is None else wanted), output.name
    times, x, v = motion.strobe
    count = len(times)
    assert not row.fired[count:].any()
    assert row.strobe_t[:count].values.tolist() == times.tolist()
    assert close(row.strobe_x[:count], x, 1e-4)
    assert close(row.strobe_v[:count], v, 1.0)
    assert row.strobe_x[count:].isnull().all()
    grid = row.time.values[row.time.values <= motion.end]
    # Stored as float32.
    assert np.allclose(row.displacement[: len(grid)], motion.at(grid)[0], rtol=2e-7, atol=0.0)
    assert row.displacement[len(grid) :].isnull().all()
    struck = [dot for dot in motion.dots if dot.struck]
    flights = [dot.flight_time for dot in struck]
    assert int(row.struck_dots) == len(struck)
    assert int(row.lost_dots) == len(motion.dots) - len(struck)
    assert close(row.flight_time_mean, np.mean(flights))
    assert close(row.flight_time_spread, max(flights) - min(flights), 1e-4)
    assert close(row.peak_displacement, motion.maxima[1].max())
    assert close(row.coil_work, motion.energy.coil_work)
    assert close(row.pack_loss, motion.energy.pack_loss)
    assert int(row.backstop_touches) == sum(
        contact.surface == "backstop" and not contact.initial for contact in motion.contacts
    )


def test_a_grid_over_hammer_and_drive(tmp_path: Path, hammer: ph.Hammer) -> None:
    axes = [
        {"key": "pack.stiffness", "values": ["55 lbf", "60 lbf"]},
        {"key": "drive.period", "values": ["0.7 ms", "1 ms"]},
        {"key": "drive.pulses", "values": [1, 3]},
    ]
    found = run(tmp_path, drive={"train": {}}, axis=axes)
    assert found.status.dims == ("pack_stiffness", "period", "pulses")
    assert found.flight_time.shape == (2, 2, 2, 3)
    for stiffness in found.pack_stiffness.values:
        for period in found.period.values:
            for pulses in found.pulses.values:
                row = found.sel(pack_stiffness=stiffness, period=period, pulses=pulses)
                member = hammer.replace("pack.stiffness", float(stiffness))
                drive = ph.PulseTrain(member.waveform, period=float(period), pulses=int(pulses))
                motion = ph.simulate(member, drive, tolerance=TIGHT)
                check_member(row, motion)
                x, v = motion.at(motion.end)
                assert close(row.final_x, x, 1e-4)
                assert close(row.final_v, v, 1.0)


def test_a_hypercube_over_hammer_drive_and_state(tmp_path: Path, hammer: ph.Hammer) -> None:
    axes = [
        {"key": "waveform.amplitude", "low": "1.1 A", "high": "1.3 A"},
        {"key": "drive.at.1", "low": "0.6 ms", "high": "0.9 ms"},
        {"key": "state.v", "low": "0 m/s", "high": "0.1 m/s"},
    ]
    found = run(
        tmp_path,
        design="latin-hypercube",
        members=6,
        seed=3,
        duration="2 ms",
        drive={"overlap": "replace", "times": {"at": ["0 s", "700 us"]}},
        axis=axes,
    )
    assert found.status.dims == ("member",)
    assert {"waveform_amplitude", "at_1", "state_v", "member"} <= set(found.coords)
    for member in range(6):
        row = found.isel(member=member)
        other = hammer.replace("waveform.amplitude", float(row.waveform_amplitude))
        drive = ph.PulseTrain(other.waveform, at=[0.0, float(row.at_1)], overlap="replace")
        state = (ph.rest_state(other), float(row.state_v))
        motion = ph.simulate(other, drive, duration=2e-3, state=state, tolerance=TIGHT)
        check_member(row, motion)


def test_the_waveform_of_the_drive_takes_the_place_of_the_hammers(tmp_path: Path, hammer: ph.Hammer) -> None:
    own = {"shape": "rectangle", "amplitude": "1.3 A", "rise": "60 us", "decay": "50 us"}
    widths = {"key": "waveform.width", "values": ["250 us", "300 us"]}
    found = run(tmp_path, drive={"train": {"pulses": 1, "rate": "1 kHz"}, "waveform": own}, axis=[widths])
    for width in found.waveform_width.values:
        wave = Rectangle(amplitude=1.3, width=float(width), rise=60e-6, decay=50e-6)
        motion = ph.simulate(hammer, ph.PulseTrain(wave, rate=1000.0, pulses=1), tolerance=TIGHT)
        assert motion.dots[0].struck
        check_member(found.sel(waveform_width=width), motion)


def test_pulses_of_a_sequence_are_swept_by_their_names(tmp_path: Path, hammer: ph.Hammer) -> None:
    pulse = {"shape": "rectangle", "amplitude": "1.3 A", "width": "300 us", "rise": "60 us", "decay": "50 us"}
    drive = {
        "sequence": {"at": ["0 us", "900 us"], "waveforms": ["print", "the brake"]},
        "waveforms": {"print": pulse, "the brake": {**pulse, "amplitude": "0.4 A"}},
    }
    axes = [
        {"key": "waveforms.the brake.width", "values": ["100 us", "200 us"]},
        {"key": "drive.at.1", "values": ["0.8 ms", "1 ms"]},
    ]
    found = run(tmp_path, drive=drive, axis=axes)
    assert set(found.dims) >= {"waveforms_the_brake_width", "at_1"}
    first = Rectangle(amplitude=1.3, width=300e-6, rise=60e-6, decay=50e-6)
    for width in found["waveforms_the_brake_width"].values:
        for time in found.at_1.values:
            brake = Rectangle(amplitude=0.4, width=float(width), rise=60e-6, decay=50e-6)
            own = ph.PulseSequence([first, brake], [0.0, float(time)])
            row = found.sel({"waveforms_the_brake_width": width, "at_1": time})
            check_member(row, ph.simulate(hammer, own, tolerance=TIGHT))


def test_members_that_fail_are_rows(tmp_path: Path, hammer: ph.Hammer) -> None:
    axes = [
        {"key": "pack.front", "values": ["8 mil", "20 mil"]},
        {"key": "magnet.range_max", "values": ["9 mil", "20 mil"]},
    ]
    found = run(tmp_path, drive={"train": {"rate": "1 kHz", "pulses": 2}}, axis=axes)
    names = [[STATUSES[code] for code in row] for row in found.status.values]
    # A pack behind the platen is none; the armature leaves the short range on its way.
    assert names == [["range left", "ok"], ["no such hammer", "no such hammer"]]
    short = found.isel(pack_front=0, magnet_range_max=0)
    motion = ph.simulate(
        hammer.replace("magnet.range_max", "9 mil"), ph.PulseTrain(hammer.waveform, rate=1e3, pulses=2)
    )
    assert close(short.reached, motion.end)
    assert short.final_x.isnull()
    assert found.flight_time[1].isnull().all()
    assert not found.fired[1].any()


def test_a_failed_member_is_a_row_of_the_table_with_its_status(tmp_path: Path) -> None:
    spec = {
        "format": 1,
        "hammer": "hendriks-1983",
        "drive": {"train": {"rate": "1 kHz", "pulses": 2}},
        "axis": [{"key": "pack.front", "values": ["7 mil", "0 mil"]}],
        "outputs": {"dots": ["struck"], "scalars": ["lost_dots"]},
    }
    ph.sweep(spec, tmp_path / "r.csv")
    rows = (tmp_path / "r.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "pack_front [m],status,reached [s],steps,unsettled,struck_1,struck_2,lost_dots"
    assert rows[1].split(",")[1] == "ok"
    assert rows[1].split(",")[4:] == ["False", "True", "True", "0"]
    assert rows[2].split(",")[1:] == ["no such hammer", "", "", "", "", "", ""]


def test_provenance_and_units(tmp_path: Path, hammer: ph.Hammer) -> None:
    found = run(
        tmp_path,
        title="a try",
        drive={"train": {"rate": "1 kHz", "pulses": 1}},
        axis=[{"key": "mass", "values": ["3 g"]}],
    )
    assert found.attrs["hammer_fingerprint"] == hammer.fingerprint
    assert found.attrs["hammer_file"] == hammer.to_toml()
    assert found.attrs["printhammer"] == ph.__version__
    assert found.attrs["title"] == "a try"
    assert found.attrs["finished"] >= found.attrs["created"] > "2020"
    assert found.flight_time.attrs == {"long_name": "time from firing to touch", "units": "s"}
    assert found.mass.attrs["units"] == "kg"
    assert found.status.attrs["flag_meanings"].split()[1 + 5] == "worker_lost"
    again = xr.open_zarr(tmp_path / "out.zarr", consolidated=False, chunks=None)
    xr.testing.assert_identical(found.load(), again.load()[list(found)])
    found.to_netcdf(tmp_path / "out.nc")
    xr.testing.assert_equal(found, xr.load_dataset(tmp_path / "out.nc"))


def test_the_same_bits_for_any_threads_and_order(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Callable[[Path], dict[str, bytes]]
) -> None:
    path = spec_file()
    for threads in (1, 5):
        ph.sweep(path, tmp_path / f"{threads}.zarr", threads=threads)
    assert bytes_of(tmp_path / "1.zarr") == bytes_of(tmp_path / "5.zarr")


def test_the_same_numbers_for_any_chunks(spec_file: Callable[..., Path], tmp_path: Path) -> None:
    found = [
        ph.sweep(spec_file(f"{chunk}.toml", chunk=chunk, count=3), tmp_path / f"{chunk}.zarr").load()
        for chunk in (1, 4, 6)
    ]
    for other in found[1:]:
        xr.testing.assert_equal(found[0], other)


def test_progress_counts_members(spec_file: Callable[..., Path], tmp_path: Path) -> None:
    told: list[tuple[float, int, int]] = []

    def progress(*numbers: float) -> None:
        told.append(numbers)
        assert threading.current_thread() is threading.main_thread()

    ph.sweep(spec_file(), tmp_path / "out.zarr", progress=progress)
    assert told[0] == (0, 0, 12)
    assert told[-1] == (12, 0, 12)
    assert all(0 <= done <= 12 for done, _, _ in told)
    ph.sweep(spec_file(), tmp_path / "out.zarr", progress=progress)
    assert told[-1] == (12, 12, 12)


def test_an_interrupt_keeps_the_blocks_that_are_done(
    spec_file: Callable[..., Path], tmp_path: Path, bytes_of: Callable[[Path], dict[str, bytes]]
) -> None:
    def interrupt(done: float, before: int, members: int) -> None:
        if done >= 4:
            raise KeyboardInterrupt

    out = tmp_path / "out.zarr"
    with pytest.raises(KeyboardInterrupt):
        ph.sweep(spec_file(), out, threads=1, progress=interrupt)
    codes = open_store(out).status.values
    assert 4 <= (codes == 0).sum() < 12
    assert ((codes == 0) | (codes == -1)).all()
    ph.sweep(spec_file(), out)
    ph.sweep(spec_file(), tmp_path / "whole.zarr")
    assert bytes_of(out) == bytes_of(tmp_path / "whole.zarr")


def test_tables_that_change_meanwhile_are_told(
    tmp_path: Path, hammer: ph.Hammer, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Lanes would be compiled for sampled pulses.
    monkeypatch.setattr(Group, "fits_lanes", lambda _group: False)
    (tmp_path / "pulse.csv").write_text("time [us],current [A]\n0,0\n100,1.2\n400,0\n", "utf-8")
    hammer.replace("waveform", {"shape": "sampled", "file": str(tmp_path / "pulse.csv")}).save(
        tmp_path / "sampled.toml"
    )
    spec = {
        "format": 1,
        "hammer": str(tmp_path / "sampled.toml"),
        "drive": {"train": {"rate": "1 kHz", "pulses": 1}},
        "axis": [{"key": "mass", "values": ["3 g", "3.1 g", "3.2 g"]}],
        "outputs": {"dots": ["struck"]},
    }
    before = make_plan(read_spec(spec))
    run_chunk(before.spec.base, before.spec.outputs, before.rows([0]))
    (tmp_path / "pulse.csv").write_text("time [us],current [A]\n0,0\n100,1.3\n400,0\n", "utf-8")
    with refused("table"):
        run_chunk(before.spec.base, before.spec.outputs, before.rows([0]))
    Store(tmp_path / "out.zarr", before.layout(), "now").close()
    with refused("hammer_fingerprint"):
        ph.sweep(spec, tmp_path / "out.zarr")


def test_a_name_in_csv_gives_a_table_of_the_store_beside_it(
    tmp_path: Path, spec_file: Callable[..., Path]
) -> None:
    stored = ph.sweep(spec_file(count=2), tmp_path / "r.csv")
    table = pd.read_csv(tmp_path / "r.csv")
    assert len(table) == stored["status"].size == 4
    assert table["rate [Hz]"].tolist() == np.repeat(stored["rate"].values, 2).tolist()
    for k in range(3):
        expected = stored["peak_force"].isel(firing=k).values.ravel()
        np.testing.assert_array_equal(table[f"peak_force_{k + 1} [N]"], expected)
    np.testing.assert_array_equal(table["lost_dots"], stored["lost_dots"].values.ravel())
    (tmp_path / "other.csv").write_text("of somebody else", encoding="utf-8")
    with refused("out", str(tmp_path / "other.csv")):
        ph.sweep(spec_file(count=2), tmp_path / "other.csv")
    assert (tmp_path / "other.csv").read_text(encoding="utf-8") == "of somebody else"


@pytest.mark.parametrize(
    ("name", "axis", "expected"),
    [
        # Without a spring, the armature of the pot magnet stays at its pole.
        ("pot-magnet", {"key": "mass", "values": ["20 g", "30 g"]}, [True, True]),
        # Of two stops the elastic one makes the armature bounce for ever.
        ("braille-embosser", {"key": "backstop.restitution", "values": ["0.3", "1"]}, [False, True]),
    ],
)
def test_members_that_are_not_at_rest_are_marked(
    tmp_path: Path, name: str, axis: dict[str, Any], expected: list[bool]
) -> None:
    """Against a run of the same hammer for twice as long, which is still away from rest or is not."""
    train = {"train": {"pulses": 2, "rate": "10 Hz"}}
    spec = {
        "format": 1,
        "hammer": name,
        "drive": train,
        "axis": [axis],
        "outputs": {"scalars": ["lost_dots"]},
    }
    found = ph.sweep(spec, tmp_path / "out.zarr")
    assert found.unsettled.values.tolist() == expected
    assert (found.status == 0).all()
    hammer = ph.load(name)
    assert hammer.front is not None
    for value, end, unsettled in zip(axis["values"], found.reached.values, expected, strict=True):
        other = hammer.replace(axis["key"], value)
        drive = ph.PulseTrain(other.waveform, rate=10.0, pulses=2)
        motion = ph.simulate(other, drive, duration=2.0 * float(end))
        away = np.abs(motion.at(np.linspace(end, 2.0 * end, 2000))[0] - other.rest).max()
        assert bool(away > 0.02 * (hammer.front - hammer.rest)) is unsettled
    timed = ph.sweep({**spec, "duration": "300 ms"}, tmp_path / "timed.zarr")
    assert not timed.unsettled.any()


def test_oscillators_settle_in_a_sweep_as_in_a_run(tmp_path: Path) -> None:
    """Without a pack; the force ends, and the window is bounded."""
    spec = {
        "format": 1,
        "hammer": "duffing-holmes",
        "drive": {"waveform": {"shape": "half-sine", "amplitude": "0.3 N", "width": "1 s"}}
        | {"train": {"pulses": 2, "rate": "0.5 Hz"}},
        "axis": [
            {"key": "damping.coefficient", "values": ["0 N s/m", "1e-4 N s/m", "0.25 N s/m", "3 N s/m"]}
        ],
        "outputs": {"final": True},
    }
    found = ph.sweep(spec, tmp_path / "out.zarr")
    hammer = ph.load("duffing-holmes")
    base = read_spec(spec).base
    for value, row in zip(spec["axis"][0]["values"], found.unsettled.values, strict=True):
        drive = ph.PulseTrain(base.waveform, pulses=2, rate=0.5)
        assert bool(ph.simulate(hammer.replace("damping.coefficient", value), drive).unsettled) == bool(row)
    assert found.unsettled.values[0]
