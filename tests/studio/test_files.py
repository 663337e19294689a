"""Files dropped on a page: drive files and measured tables, read in Node as in Python, or rejected."""

import math
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from tests.studio.reading import STATE, drive_of, node
from tests.support.tables import exports

import printhammer as ph
from printhammer.drive.file import read_drive
from printhammer.drive.waveforms.shapes import SHAPES
from printhammer.studio import Shelf, live
from printhammer.studio.controls import fields_of
from printhammer.studio.launch import FORMAT, KIND
from printhammer.support.tables.layout import layout_of
from printhammer.support.tables.readings import read_table
from printhammer.support.tables.text import decoded
from printhammer.units import parse

NAME = "hendriks-1983-1"
CURVES = {"displacement": "m", "current": "A", "force": "N", "voltage": "V"}
ASKED = """
  quantity: (text, si) => quantityOf(text, [si], "it")[0],
  write: (state) => driveText(state, shelf),
  drive: (text) => driveOf(tomlOf(text, "a.toml", shelf.limits), shelf, "a.toml"),
  state: (content, more) => {
    const text = JSON.stringify(content) + " ".repeat(more);
    return dropped({ name: "a.json", text }, shelf).what;
  },
  long: (lines, bad) => {
    const rows = Array.from({ length: lines }, (_each, k) => (k < bad ? `${k}.5,1e-6` : `x${k},y`));
    const text = thinned(["time [us],displacement [m]", ...rows].join("\\n"), 400000);
    return [...dropped({ name: "a.csv", text, columns: null }, shelf).data.t];
  },
  wide: (cell, n, between) => recordOf(Array(n).fill(cell).join(between), "a.csv", null, shelf.limits),
  layout: (text) => layoutOf(text, "a.csv"),
  table: (text, told) => {
    const { data, ...rest } = recordOf(text, "a.csv", told, shelf.limits);
    return { ...rest, data: Object.fromEntries(Object.entries(data).map(([key, list]) => [key, [...list]])) };
  },
"""
RECORD = {"shape": "sampled", "times": [0.0, 1e-4, 3e-4], "values": [0.0, 1.5, 0.0], "quantity": "current"}
WAVES: list[Any] = [
    None,
    RECORD,
    {"shape": "half-sine", "amplitude": 0.7, "width": 3e-4, "quantity": "force"},
    fields_of(ph.load("relay-5v").waveform),
    fields_of(
        SHAPES["chopper"](voltage=40.0, width=4e-4, upper=1.5, lower=1.1, decay="zener", decay_voltage=50.0)
    ),
]
TIMES = np.array([0.0, 1e-5, 2e-5])
CURRENTS = np.array([0.0, 0.5, 1.25])


@pytest.fixture(scope="module")
def ask() -> Iterator[Any]:
    own = ph.load(NAME), ph.load("relay-5v")
    with node("engine/files.js", ASKED, Shelf(*own, only=True)) as asked:
        yield asked


def state_of(**changed: Any) -> dict[str, Any]:
    return {**STATE, "hammer": NAME, **changed}


@pytest.mark.parametrize("wave", WAVES)
@pytest.mark.parametrize("train", [{}, {"pattern": "1011", "rate": 812.5}, {"overlap": "replace"}])
def test_a_drive_is_written_as_python_writes_it_and_read_again(
    ask: Any, wave: Any, train: dict[str, Any]
) -> None:
    state = state_of(waveform=wave, **train)
    drive = drive_of(state, ph.load(NAME).waveform)
    text = ask("write", state)["found"]
    assert read_drive(text).fingerprint == drive.fingerprint
    patch = ask("drive", drive.to_toml())["found"]
    assert (patch["pattern"], patch.get("pulses", 9)) == (state["pattern"], 9)
    assert patch["rate"] == pytest.approx(state["rate"], rel=1e-12)
    assert read_drive(ask("write", {**state, **patch})["found"]).waveform == drive.waveform


def test_a_driver_without_a_decay_has_the_first_of_pythons(monkeypatch: pytest.MonkeyPatch) -> None:
    rail = "format = 1\n[train]\nrate = '1 kHz'\n[waveform]\nshape = 'rail'\n"
    rail += "voltage = '40 V'\nwidth = '300 us'\n"
    for decays in (live.DECAYS, ("zener", "diode", "rail")):
        monkeypatch.setattr(live, "DECAYS", decays)
        with node("engine/files.js", ASKED, Shelf(ph.load(NAME), only=True)) as asked:
            assert asked("drive", rail)["found"]["waveform"]["decay"] == decays[0]
    assert fields_of(read_drive(rail).waveform)["decay"] == "diode"


def test_a_sinusoidal_force_is_written_and_read_again(ask: Any) -> None:
    wave = {"shape": "sine", "amplitude": 0.3, "phase": 1.5, "quantity": "force"}
    text = ask("write", state_of(waveform=wave, rate=0.16))["found"]
    assert read_drive(text).fingerprint == ph.SineForce(0.3, 0.16, phase=1.5).fingerprint
    assert ask("drive", text)["found"] == {"pattern": "", "rate": 0.16, "waveform": wave}
    assert ask("drive", text.replace("rad", "deg"))["found"]["waveform"]["phase"] == pytest.approx(
        math.radians(1.5)
    )
    assert "an angle" in ask("drive", text.replace("rad", "m"))["refused"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "format = 1\n[burst]\nrate = '1 kHz'\npulses = 2\nbursts = 2",
            "[times] or [sine]",
        ),
        ("format = 2\n[train]\nrate = '1 kHz'", "expected 1"),
        ("format = 1\n[train]\nrate = 1000", "has no unit"),
        ("format = 1\n[train]\nrate = '1 mm'", "expected a quantity in Hz"),
        ("format = 1\n[train]\nrate = '1,500 Hz'", "a decimal point"),
        ("format = 1\n[train]\nrate = '2*3 Hz'", "expected one number"),
        (f"format = 1\n[train]\nrate = '1*{'(' * 20_000}'", "expected one number"),
        # These would take minutes to read.
        (f"format = 1\n[train]\nrate = '{'1' * 300_000}'", "expected one number"),
        (f"format = 1\n[sine]\namplitude = '1 N'\nfrequency = '1 Hz'\nphase = '{'1' * 300_000}'", "an angle"),
        ("format = 1\n[train]\nrate = '1 kHz'\npulses = 1000", "pulses is expected"),
        ("format = 1\n[train]\nrate = '1 kHz'\ncolour = 1", "train.colour is not known"),
        ("format = 1\n[times]\nat = ['0 s', '1 ms', '2.5 ms']", "expected multiples"),
        ("format = 1\n[train]\nrate = '1 kHz'\n[waveform]\nshape = '__proto__'", "waveform.shape"),
        ("format = 1\n[train\nrate", "expected a TOML file"),
        (f"format = 1\n[train]\n{'a.' * 300}b = 1", "dots"),
    ],
)
def test_a_drive_that_a_page_cannot_set_is_refused(ask: Any, text: str, reason: str) -> None:
    assert reason in ask("drive", text)["refused"]


parts = st.sampled_from(
    [*"0123,.-+*/^()e_ mNs·", "1 ", "25", "1e3", " N", "mN", " m", "/m", "us", "^2", "^0.5"]
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=300)
@given(
    parts=st.lists(parts, min_size=1, max_size=7), si=st.sampled_from(["N", "m", "N/m", "1", "s", "N s/m"])
)
@example(parts=["1,500 N"], si="N")
@example(parts=["2*3 N"], si="N")
@example(parts=["2^3 N"], si="N")
@example(parts=["11/s s m"], si="m")
@example(parts=["3 N/mm s"], si="N s/m")
@example(parts=["3 N·ms/m"], si="N s/m")
@example(parts=["2 1/m N"], si="N/m")
def test_a_quantity_that_is_read_is_read_as_python_reads_it(ask: Any, parts: list[str], si: str) -> None:
    text = "".join(parts)
    answer = ask("quantity", text, si)
    if "found" in answer:
        assert answer["found"] == pytest.approx(parse(text, si), rel=1e-12)


@pytest.mark.parametrize(
    "text", ["3 N/mm s", "3.0N*s/mm", " +3e0 N ·s/mm ", "3 1/mm N s", "3 N^(1/2) s N^0.5/mm"]
)
def test_units_are_written_as_in_python(ask: Any, text: str) -> None:
    assert ask("quantity", text, "N s/m")["found"] == pytest.approx(parse(text, "N s/m"))


def test_columns_are_asked_for_where_the_heading_does_not_say_what_they_hold(ask: Any) -> None:
    text = "time,displacement,current\n0,50,0\n10,51.5,0.5\n20,52,1.25\n"
    found = ask("table", text, None)["found"]
    assert found["what"] == "columns"
    assert [column["quantity"] for column in found["columns"]] == ["time", "displacement", "current"]
    assert found["columns"][1]["first"] == ["50", "51.5", "52"]
    told = [["time", "us"], ["displacement", "um"], ["current", "10 A"]]
    data = ask("table", text, told)["found"]["data"]
    np.testing.assert_allclose(data["current"], 10.0 * CURRENTS)
    np.testing.assert_allclose(data["t"], TIMES, atol=1e-20)


def test_a_unit_in_capital_letters_is_asked_for(ask: Any) -> None:
    text = "TIME [MS],CURRENT [MA]\n0,0\n1,800\n"
    assert ask("table", text, None)["found"]["what"] == "columns"
    assert "may be mA" in ask("table", text, [["time", "ms"], ["current", "MA"]])["refused"]
    found = ask("table", text, [["time", "ms"], ["current", "mA"]])["found"]
    assert found["data"]["current"] == pytest.approx([0.0, 0.8])


def test_an_empty_cell_between_tabs_shifts_no_cell(ask: Any) -> None:
    rows = "time [us]\tcurrent [A]\tdisplacement [um]\n0\t0\t50\n10\t1\t51\n"
    assert ask("table", rows, None)["found"]["data"]["current"] == [0.0, 1.0]
    assert "line 4" in ask("table", f"{rows}20\t\t52\t\n", None)["refused"]


def test_times_come_from_a_column_or_from_the_file(ask: Any) -> None:
    text = "CH1 [V]\n0\n1\n2\n"
    told = [["displacement", "20 um/V"]]
    assert "a line such as 't0 = -1 ms, dt = 2 us'" in ask("table", text, told)["refused"]
    data = ask("table", "t0 = -1 ms, dt = 2 us\n" + text, told)["found"]["data"]
    assert data["t"] == pytest.approx([-1e-3, -0.998e-3, -0.996e-3])
    assert data["displacement"] == pytest.approx([0.0, 20e-6, 40e-6])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("nothing here", "expected columns of numbers"),
        ("time [us],current [A]\n0,0\n10,x\n20,1\n", "line 3"),
        ("time [us],current [A]\n0,0\n10,nan\n20,1\n", "is no finite number"),
        ("time [us],current [A]\n0,0\n10,1\n5,1\n", "ascending times"),
        ("time [us],current [A]\n0,0\n10,1,7\n", "line 3"),
        ("time [us],current [A]\n-10,1\n0,1\n10,0\n", "before time 0"),
        ("time [s],current [A]\n0,0\n1,1\n", "at most 0.5 s"),
        ("time [us],current [A]\n0,0\n10,101\n", "at most 100 A"),
        ("time [us];current [A]\n0;0\n10;1,234\n", "may be a decimal mark"),
    ],
)
def test_a_table_that_is_none_is_refused_in_a_sentence(ask: Any, text: str, reason: str) -> None:
    assert reason in ask("table", text, None)["refused"]


def test_a_long_table_is_thinned_and_keeps_the_numbers_of_its_lines(ask: Any) -> None:
    times = ask("long", 250_000, 250_000)["found"]
    assert len(times) == 2000
    assert times[0] == pytest.approx(0.5e-6)
    assert times[-1] == pytest.approx(0.25, rel=1e-3)
    found = re.search(r"line (\d+): 'x(\d+),y'", ask("long", 250_000, 150_000)["refused"])
    assert found is not None
    # Below the heading, and counted from 1.
    assert int(found[1]) == int(found[2]) + 2 > 150_000


def test_tables_of_very_many_columns_or_rows_are_answered(ask: Any) -> None:
    assert "columns: expected at most 16" in ask("wide", "1", 150_000, ",")["refused"]
    assert ask("wide", "1", 190_000, "\n")["found"]["what"] == "columns"
    assert "expected columns" in ask("table", f"{'1' * 300_000}x", None)["refused"]


def test_a_state_file_may_be_longer_than_other_files(ask: Any) -> None:
    """As long as a file whose hammer has the largest permitted size."""
    state = {"kind": KIND, "format": FORMAT, "state": {}}
    assert ask("state", state, 500_000)["found"] == "state"
    assert "expected at most 1000000" in ask("state", state, 1_000_000)["refused"]


cells = st.sampled_from(
    ["0", "1", "2.5", "-3e-1", "4,5", "1,234", "1.234", "nan", "", "x", "12 3", '"7"', "1e9"]
)
heads = st.sampled_from(
    ["time [us]", "t/ms", "x [mm]", "current (A)", "I", "CH1 [V]", "Force in N", "s", "A", "", "sec", "Volt"]
)


facts = st.sampled_from(
    [
        "Model,XYZ",
        "Sample Interval,1e-6",
        "XInc:,2 us",
        "t0 = -1 ms",
        "dt = 10 us,t0 = 1",
        "XOrg:,-4e-06",
        "Start,0",
        "Zero Index,2",
        "Horizontal Units,ms",
        "Vertical Units,V,mA",
        "LECROY,1",
        "# Sample rate: 1 MHz",
        "; sigrok",
        "Points,3",
        "",
    ]
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    above=st.lists(facts, max_size=3),
    names=st.lists(heads, min_size=2, max_size=3),
    rows=st.lists(st.lists(cells, min_size=2, max_size=3), min_size=2, max_size=4),
    separator=st.sampled_from([",", ";", "\t"]),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_a_table_that_is_read_is_read_as_python_reads_it(
    ask: Any,
    tmp_path: Path,
    above: list[str],
    names: list[str],
    rows: list[list[str]],
    separator: str,
    end: str,
) -> None:
    written = [line.replace(",", separator) for line in above]
    text = end.join([*written, *(separator.join(row) for row in [names, *rows])])
    found = ask("table", text, None)
    if found.get("found", {}).get("what") != "curves":
        return
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode())
    expected = read_table(path, {"time": "s"}, optional=CURVES).values
    data = found["found"]["data"]
    assert {name.replace("time", "t") for name in expected} == set(data)
    for name, values in expected.items():
        np.testing.assert_allclose(data[name.replace("time", "t")], values, rtol=1e-12, atol=1e-300)


def columns_said(export: exports.Export, headings: list[dict[str, Any]]) -> list[list[str]] | None:
    """Return the column settings of an export, as answers of the page; None if there are none."""
    if not export.columns:
        return None
    answers = [["", ""] for _ in headings]
    for entry in export.columns.split(", "):
        name, _, source = entry.partition("=")
        place, _, factor = source.partition("*")
        if place.isdigit():
            # An offset is set in the page.
            amount = factor.partition(" +")[0]
            answers[int(place) - 1] = [name, amount or headings[int(place) - 1]["unit"]]
    return answers


HEADED = "time [ms],probe [mV],u\n0.0,10,1\n0.5,20,2\n1.0,15,3\n"


@pytest.mark.parametrize(
    ("text", "answers", "declared"),
    [
        (HEADED, [["time", "ms"], ["current", "10 A/V"], ["", ""]], {"time": "1", "current": "2*10 A/V"}),
        (HEADED, [["time", "us"], ["current", "-2e-3 A"], ["displacement", "um"]], None),
        (HEADED, [["time", "ms"], ["current", "A"], ["voltage", "V"]], None),
        (HEADED, [["time", "ms"], ["voltage", "mV"], ["current", "0,25 A"]], None),
        (HEADED, [["time", "ms"], ["", ""], ["force", "2*3 N/V"]], None),
        (HEADED, [["time", "2 ms"], ["displacement", "50 um/V"], ["current", ".5mA"]], None),
        ("0,1,2\n1,3,4\n2,5,6\n", [["time", "10 us"], ["displacement", "um"], ["current", "-3"]], None),
        ("TIME,CURRENT [MA]\n0,1\n1,3\n2,5\n", [["time", "ms"], ["current", "mA"]], None),
    ],
)
def test_answered_columns_are_declared_in_the_file_beside_the_table(
    ask: Any, tmp_path: Path, text: str, answers: list[list[str]], declared: dict[str, str] | None
) -> None:
    found = ask("table", text, answers)["found"]
    path, beside = tmp_path / "a.csv", tmp_path / "a.csv.toml"
    path.write_text(text, encoding="utf-8")
    beside.write_text(found["beside"], encoding="utf-8")
    assert declared is None or tomllib.loads(found["beside"]) == {"columns": declared}
    read = read_table(path, {"time": "s"}, optional=CURVES).values
    assert {name.replace("time", "t") for name in read} == set(found["data"])
    for name, values in read.items():
        np.testing.assert_allclose(found["data"][name.replace("time", "t")], values, rtol=1e-12)


def test_a_table_with_a_heading_needs_no_file_beside(ask: Any) -> None:
    assert "beside" not in ask("table", "time [us],current [A]\n0,1\n1,2\n", None)["found"]


@pytest.mark.parametrize("name", exports.EXPORTS)
def test_the_layout_of_an_export_is_that_of_python(ask: Any, name: str, tmp_path: Path) -> None:
    """Separator, headings, units, numbers, and the times that metadata state."""
    export = exports.EXPORTS[name]()
    text = decoded(export.content, "a.csv")
    expected, found = layout_of(text, "a.csv"), ask("layout", text)["found"]
    assert [(each["name"], each["unit"]) for each in found["headings"]] == expected.columns
    assert [each["cells"] for each in found["rows"]] == [
        [cell.strip() for cell in row][: len(each["cells"])]
        for row, each in zip(expected.rows, found["rows"], strict=True)
    ]
    assert [each["line"] for each in found["rows"]] == expected.lines
    clock = found["clock"]
    assert (clock and (clock["start"], clock["step"], clock["numbers"])) == expected.clock
    # What the heading leaves open is answered.
    answers = columns_said(export, found["headings"])
    if name not in ("sigrok", "start and step"):
        record = ask("table", text, answers)["found"]
        data = record["data"]
        if name == "Saleae, edges":
            return
        if answers:
            path = tmp_path / "a.csv"
            path.write_bytes(export.content)
            path.with_name("a.csv.toml").write_text(record["beside"], encoding="utf-8")
            for quantity, values in read_table(path, {"time": "s"}, optional=CURVES).values.items():
                np.testing.assert_allclose(data[quantity.replace("time", "t")], values, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(data["t"], exports.TIMES, rtol=1e-6, atol=1e-15)
        if "current" in data:
            np.testing.assert_allclose(data["current"], exports.CURRENT, atol=1e-5)
        if "displacement" in data:
            offset = data["displacement"][0] - exports.PLACES[0]
            np.testing.assert_allclose(np.subtract(data["displacement"], offset), exports.PLACES, atol=1e-10)
