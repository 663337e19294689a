"""Declarations of columns in a file beside a table: factors, offsets, delays, evenly spaced samples."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.drive.waveforms.sampled import read_csv
from printhammer.errors import InputError
from printhammer.support.tables.columns import read_columns
from printhammer.support.tables.readings import Readings, read_table

TABLE = "Time,A,B\n(ms),(mV),\n-1,0,0\n0,10,1\n1,20,2\n2,30,4\n"
SI = {"current": "A", "displacement": "m", "voltage": "V"}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "trace.csv"
    path.write_text(TABLE)
    return path


def read(path: Path, columns: str | None) -> Readings:
    return read_table(path, {"time": "s"}, optional=SI, columns=columns)


@pytest.mark.parametrize(
    ("columns", "name", "values"),
    [
        ("voltage=2", "voltage", [0.0, 0.01, 0.02, 0.03]),
        ("voltage=2*-1", "voltage", [0.0, -0.01, -0.02, -0.03]),
        ("current = 2 * -10 A/V", "current", [0.0, -0.1, -0.2, -0.3]),
        ("current=2*10 mA/mV - 0.1 A", "current", [-0.1, 0.0, 0.1, 0.2]),
        ("current=3*2 A", "current", [0.0, 2.0, 4.0, 8.0]),
        ("current=3*2e-3 kA/V+500 mA", "current", [0.5, 2.5, 4.5, 8.5]),
        ("displacement=3*50 um/V+120 um, time=1", "displacement", [120e-6, 170e-6, 220e-6, 320e-6]),
    ],
)
def test_factor_and_offset(path: Path, columns: str, name: str, values: list[float]) -> None:
    found = read(path, columns).values
    np.testing.assert_allclose(found[name], values, rtol=1e-14, atol=1e-18)
    np.testing.assert_allclose(found["time"], [-1e-3, 0.0, 1e-3, 2e-3])


def test_times_are_moved_or_even(path: Path) -> None:
    moved = read(path, "time=1+1 ms, voltage=2").values["time"]
    np.testing.assert_allclose(moved, [0.0, 1e-3, 2e-3, 3e-3], atol=1e-18)
    even = read(path, "time=-1 ms + 20 us, voltage=2").values["time"]
    np.testing.assert_allclose(even, [-1e-3, -0.98e-3, -0.96e-3, -0.94e-3])


def test_a_delay_of_all_columns_moves_time_alone(path: Path) -> None:
    found = read(path, "current=2*1 A/V, delay(current)=300 us")
    np.testing.assert_allclose(found.values["time"], [-1.3e-3, -0.3e-3, 0.7e-3, 1.7e-3])
    np.testing.assert_allclose(found.values["current"], [0.0, 0.01, 0.02, 0.03])


@given(
    delay=st.integers(-9, 9).map(lambda tenths: tenths / 10),
    slope=st.integers(-50, 50).map(lambda tenths: tenths / 10),
)
def test_straight_lines_are_brought_to_one_time_exactly(
    tmp_path_factory: pytest.TempPathFactory, delay: float, slope: float
) -> None:
    path = tmp_path_factory.mktemp("delays") / "trace.csv"
    times = np.arange(-3.0, 8.0)
    rows = "".join(f"{t!r},{2.0 * t!r},{slope * (t - delay)!r}\n" for t in times.tolist())
    path.write_text("time [s],current [A],voltage [V]\n" + rows)
    columns = f"time=1, current=2, voltage=3, delay(voltage)={delay!r} s"
    found = read_table(path, {"time": "s"}, optional=SI, columns=columns).values
    np.testing.assert_allclose(found["current"], 2.0 * found["time"])
    np.testing.assert_allclose(found["voltage"], slope * found["time"], atol=1e-9)
    assert len(found["time"]) == len(times) - (delay != 0.0)


@pytest.mark.parametrize(
    ("columns", "key"),
    [
        ("current", "--columns"),
        ("", "--columns"),
        ("current=0", "current"),
        ("current=2*A", "current"),
        ("current=-1 ms + 2 us", "current"),
        ("current=9*1 A", "current"),
        ("speed=2*1 A", "speed"),
        ("voltage=2, voltage=3", "voltage"),
        ("voltage=2, delay(current)=1 us", "delay(current)"),
        ("voltage=2, delay(voltage)=1 m", "delay(voltage)"),
        ("voltage=2, delay(voltage)=1", "delay(voltage)"),
        ("current=3", "B"),
        ("current=2*10 A", "A"),
        ("current=2*10 A/N", "A"),
        ("current=2*10 N/V", "A"),
        ("voltage=2+1 A", "A"),
    ],
)
def test_what_says_nothing_is_refused(path: Path, columns: str, key: str) -> None:
    with refused(key):
        read(path, columns)


def test_the_file_beside_a_table(path: Path) -> None:
    beside = path.with_name("trace.csv.toml")
    beside.write_text('[columns]\ncurrent = "2*-10 A/V"\n[delay]\ncurrent = "1 ms"\n')
    found = read(path, None).values
    np.testing.assert_allclose(found["current"], [0.0, -0.1, -0.2, -0.3])
    np.testing.assert_allclose(found["time"], [-2e-3, -1e-3, 0.0, 1e-3])
    assert set(read(path, "voltage=2").values) == {"time", "voltage"}
    for text, key in [
        ("x = 1\n", "columns"),
        ("[columns]\na = 1\n", "columns"),
        ("[", None),
        ("", "columns"),
    ]:
        beside.write_text(text)
        with refused(key, file="trace.csv.toml"):
            read(path, None)


@pytest.mark.parametrize(
    ("columns", "advised", "first"),
    [
        ("current=2*-10", "2*-10 A/mV", -100.0),
        ("current=2", "2*1 A/mV", 10.0),
        ("current=2*-10 A", "2*-10 A/mV", -100.0),
        ("voltage=2*3 mV", "2*3 mV/mV", 30e-3),
    ],
)
def test_a_factor_without_its_unit_is_advised_with_it(
    path: Path, columns: str, advised: str, first: float
) -> None:
    with refused("A") as caught:
        read(path, columns)
    assert str(caught.value.expected).endswith(advised)
    name = columns.partition("=")[0]
    values = read(path, f"{name}={advised}").values[name]
    assert values[1] == pytest.approx(first)


def test_advice_for_a_table_that_another_file_names(tmp_path: Path) -> None:
    """A sampled waveform has no option --columns: its columns are declared in the file beside the table."""
    path = tmp_path / "s.csv"
    path.write_text("Time,Channel A\n(ms),(V)\n0,0\n1,-0.1\n")
    with pytest.raises(InputError) as caught:
        read_csv(path)
    advice = str(caught.value.expected)
    assert "--columns" not in advice
    file, lines = advice.partition("or a file ")[2].split(" with the lines ")
    (tmp_path / file).write_text("\n".join(re.findall("'([^']*)'", lines)))
    assert read_csv(path).values == (0.0, -0.1)


def test_the_text_may_be_of_a_file() -> None:
    assert read_columns("1.2 kHz=2*1 um/V").sources["1.2 kHz"].unit == "um/V"


def test_a_fit_takes_columns(tmp_path: Path) -> None:
    path = tmp_path / "spring.csv"
    x = np.linspace(0.0, 0.4e-3, 9)
    volts = np.stack([x / 50e-6, (2.0 - 3000.0 * x) / -4.0], axis=1)
    path.write_text("CH1,CH2\nVolt,Volt\n" + "".join(f"{a!r},{b!r}\n" for a, b in volts.tolist()))
    with refused("CH1 [V]"):
        ph.fit("spring", path, position=0.0)
    found = ph.fit("spring", path, position=0.0, columns="displacement=1*50 um/V, force=2*-4 N/V")
    assert found["spring.Bs"].value == pytest.approx(2.0)
    assert found["spring.As"].value == pytest.approx(2.0 / 3000.0)


def test_degrees_fahrenheit_are_converted_or_refused(tmp_path: Path) -> None:
    """A factor cannot represent the offset of degrees Fahrenheit; the error says so."""
    path = tmp_path / "warm.csv"
    path.write_text("ambient [degF],sensor [V]\n32,1\n212,2\n")
    wanted = {"ambient": "degC"}
    known = read_table(path, wanted, optional={"sensor": "V"}).values["ambient"]
    np.testing.assert_allclose(known, [0.0, 100.0], atol=1e-12)
    for columns in ("ambient=1*2", "ambient=2*100 degF/V"):
        with refused("ambient.unit", "degF") if columns.endswith("2") else refused("sensor.unit", "degF"):
            read_table(path, wanted, columns=columns)
