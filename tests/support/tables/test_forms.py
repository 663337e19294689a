"""Formats of one small record: every cell is correct, or rejected with its line number."""

import gc
from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused

from printhammer.errors import InputError
from printhammer.support.tables.readings import Readings, read_table
from printhammer.support.tables.text import decoded, read_cells, split_cells

RECORD = {"time": "s"}
CHANNELS = {"current": "A", "voltage": "V"}


def read(folder: Path, text: str | bytes, columns: str | None = None, **options: object) -> Readings:
    path = folder / "trace.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, RECORD, optional=CHANNELS, columns=columns, **options)  # type: ignore[arg-type]


def shows(found: Readings, times: list[float], **columns: list[float]) -> None:
    np.testing.assert_allclose(found.values["time"], times, rtol=1e-15, atol=0.0)
    assert set(found.values) == {"time", *columns}
    for name, values in columns.items():
        np.testing.assert_allclose(found.values[name], values, rtol=1e-15, atol=0.0)


GAPS = "t,1,2\ns,V,V\n-3E-06,,0\n-2E-06,,0\n-1E-06,5,0.1\n0,5,0.2\n1E-06,5,0.3\n"
MICRO = [-3e-6, -2e-6, -1e-6, 0.0, 1e-6]


def test_empty_cells_at_the_beginning(tmp_path: Path) -> None:
    shows(read(tmp_path, GAPS, "current=3*1 A/V"), MICRO, current=[0.0, 0.0, 0.1, 0.2, 0.3])
    with refused("voltage", "", file="trace.csv: line 3"):
        read(tmp_path, GAPS, "voltage=2")
    found = read(tmp_path, GAPS, "voltage=2", gaps=["voltage"])
    shows(found, MICRO, voltage=[np.nan, np.nan, 5.0, 5.0, 5.0])
    heading = "time [us],voltage [V],current [A]\n"
    with refused("voltage", "", file="trace.csv: line 2"):
        read(tmp_path, heading + "-3,,0\n-2,,0\n-1,5,0.1\n")


def test_decimal_commas_and_group_marks(tmp_path: Path) -> None:
    heading = "time [us];current [mA]\n"
    found = read(tmp_path, heading + "0;998,5\n1;999,5\n2;1.000\n3;1.001\n")
    shows(found, [0.0, 1e-6, 2e-6, 3e-6], current=[0.9985, 0.9995, 1.0, 1.001])
    found = read(tmp_path, heading + "0;1.000,5\n1;-1.234.567,25\n")
    shows(found, [0.0, 1e-6], current=[1.0005, -1234.56725])
    found = read(tmp_path, 'time [us],current [mA]\n0,"1,000.5"\n1,"1,002"\n')
    shows(found, [0.0, 1e-6], current=[1.0005, 1.002])
    for unclear in ("0;1,000\n1;1,001\n", "0;999\n1;1.000\n", "0;0,5\n1;0.5\n", "0;1.5\n1;0,5\n"):
        with refused(f"line {2 if unclear.startswith('0;1,') else 3}"):
            read(tmp_path, heading + unclear)


def test_times_before_the_trigger_are_kept(tmp_path: Path) -> None:
    found = read(tmp_path, "time [ms],current [A]\n-0.5,0\n0,0\n0.5,1\n1,1.2\n")
    shows(found, [-0.5e-3, 0.0, 0.5e-3, 1e-3], current=[0.0, 0.0, 1.0, 1.2])


@pytest.mark.parametrize(
    "text",
    [
        "Time,Probe\n(us),(A)\n0,0\n1,0.5\n",
        "Time,Probe\nSecond,Ampere\n0,0\n1E-6,0.5\n",
        '"Time [us]", "Coil [A]"\n0, 0\n1, 0.5\n',
        "time [us],current [A]\n\r0,0\n\r1,0.5\n\r",
        "time [us],current [A]\r0,0\r1,0.5\r",
        "time [us],current [A]\r\r\n0,0\r\r\n1,0.5",
        "time (us);current (A)\n0;0\n1;0,5\n",
        "Time (us)\tCurrent (A)\n0\t0\n1\t0.5\n",
        "t/us;i/A\n0;0\n1;0,5\n",
        "in us,Current in A\n0,0\n1,0.5\n",
        "# time [us]  current [A]\n0.0  0.0\n 1.0  0.5\n",
        ",time [us],current [A]\n0,0.0,0.0\n1,1.0,0.5\n",
        "\ufefftime [us],current [A],\n0,0,\n1,0.5,\n",
        "time\tIx(u1:out)\n0.0\t0.0\n1.0e-6\t0.5\n",
        "time [us]|current [A]\n0|0\n1|5e-1\n".encode("utf-16"),
        "Zeit [µs];Strom [mA]\n0;0\n1;500\n".encode("latin-1"),
        "Zeit [µs];Strom [mA]\n0;0\n1;500\n".encode("utf-16-le"),
    ],
)
def test_two_samples_in_many_forms(tmp_path: Path, text: str | bytes) -> None:
    shows(read(tmp_path, text), [0.0, 1e-6], current=[0.0, 0.5])


def test_facts_beside_the_numbers(tmp_path: Path) -> None:
    text = "Points,3,,0,0.0\nUnit,A,,1e-6,0.5\n,,,2e-6,1.0\n"
    shows(read(tmp_path, text, "time=1*1 s,current=2*1 A"), [0.0, 1e-6, 2e-6], current=[0.0, 0.5, 1.0])
    with refused(""):
        read(tmp_path, text)


def test_sample_numbers_with_start_and_step(tmp_path: Path) -> None:
    text = "No,CH1,Begin,Step\nNumber,Volt,-1e-6,2e-6\n0,0\n1,0.5\n2,1\n"
    shows(read(tmp_path, text, "current=2*1 A/V"), [-1e-6, 1e-6, 3e-6], current=[0.0, 0.5, 1.0])
    with refused("CH1 [V]"):
        read(tmp_path, text)
    with refused("time"):
        read(tmp_path, text.replace("\n1,0.5", ""), "current=2*1 A/V")


@pytest.mark.parametrize(
    ("rows", "line"), [("0.0,0\n0.1,0\n0.2,0\n0.0,0\n0.1,0\n", 5), ("0.0,0\n0.0,0\n0.1,0\n", 3)]
)
def test_times_that_do_not_ascend_are_named_by_their_line(tmp_path: Path, rows: str, line: int) -> None:
    found = read(tmp_path, "time [ms],current [A]\n" + rows)
    with refused("time") as caught:
        found.check_times()
    assert f"line {line}:" in str(caught.value)


def test_lines_are_those_of_the_file(tmp_path: Path) -> None:
    text = '# by hand\n\ntime [us],"current [A]"\n# more\n0,0\n\n1,x\n'
    with refused("current", "x", file="line 7"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("row", "key"), [("#N/A,2", "time"), ("#NUM!,2", "time"), ("####,2", "time"), ("2,#VALUE!", "current")]
)
def test_an_error_value_of_a_spreadsheet_is_no_comment(tmp_path: Path, row: str, key: str) -> None:
    with refused(key, file="trace.csv: line 3"):
        read(tmp_path, f"time [us],current [A]\n0,1\n{row}\n4,3\n")
    shows(read(tmp_path, "time [us],current [A]\n#### noon\n0,1\n# N/A: 2,2\n"), [0.0], current=[1.0])


def test_the_time_of_day_is_no_heading(tmp_path: Path) -> None:
    text = "Date,10.05.2022\nTime,10:20:30\n0,0\n1,0.5\n"
    shows(read(tmp_path, text, "time=1*1 us, current=2*1 A"), [0.0, 1e-6], current=[0.0, 0.5])
    with refused("") as caught:
        read(tmp_path, text)
    assert str(caught.value).endswith("--columns 'time=1*1 s, current=2*1 A'")


@pytest.mark.parametrize("step", ["2,5E-6", "2.5e-6", "2,5 us", "2.5 us"])
def test_start_and_step_with_a_decimal_comma(tmp_path: Path, step: str) -> None:
    text = f"t0;-1,5E-6\ndt;{step}\nI [A];U [V]\n0;0,5\n1;0,25\n"
    shows(read(tmp_path, text), [-1.5e-6, 1e-6], current=[0.0, 1.0], voltage=[0.5, 0.25])


@pytest.mark.parametrize(
    ("fact", "key"),
    [
        ("t0;1.000.000", "start"),
        ("dt;1,000.5", "step"),
        ("dt;1'000", "step"),
        ("Sample rate;1.000.000", "sampling rate"),
        ("Zero index;1,000.5", "index of time zero"),
        ("Sample rate;0", "time"),
    ],
)
def test_sampling_that_is_unclear_is_refused(tmp_path: Path, fact: str, key: str) -> None:
    with refused(key, file="trace.csv"):
        read(tmp_path, f"t0;0\n{fact}\nI [A];U [V]\n0;0\n1;1\n")


def test_a_heading_that_begins_with_the_sampling_is_refused(tmp_path: Path) -> None:
    with refused("line 1", "Start"):
        read(tmp_path, "Start\tCH1 (V)\tA\n0\t1\t2\n")


def test_a_long_table_keeps_every_row_and_names_the_line_of_a_fault(tmp_path: Path) -> None:
    count = 30_000
    rows = [f"{k};{k % 7},5" for k in range(count)]
    found = read(tmp_path, "\n".join(["time [us];current [mA]", *rows]))
    np.testing.assert_allclose(found.values["time"], 1e-6 * np.arange(count), rtol=1e-14)
    np.testing.assert_allclose(found.values["current"], 1e-3 * (np.arange(count) % 7 + 0.5), rtol=1e-14)
    rows[-1] = f"{count};"
    with refused("current", file=f"trace.csv: line {count + 1}"):
        read(tmp_path, "\n".join(["time [us];current [mA]", *rows]))


def test_a_name_with_brackets_is_no_unit(tmp_path: Path) -> None:
    with refused("i(t)"):
        read(tmp_path, "time [us],i(t)\n0,0\n1,1\n")
    shows(read(tmp_path, "time [us],i(t)\n0,0\n1,1\n", "current=2*1 mA"), [0.0, 1e-6], current=[0.0, 1e-3])


def test_units_in_capital_letters_are_read_only_if_unambiguous(tmp_path: Path) -> None:
    text = "TIME [MS],CURRENT [MA]\n0,0\n1,800\n"
    with refused("CURRENT [MA]"):
        read(tmp_path, text)
    with refused("CURRENT [MA]"):
        read(tmp_path, text, "current=2")
    shows(read(tmp_path, text, "current=2*1 mA/MA"), [0.0, 1e-3], current=[0.0, 0.8])
    assert gc.isenabled()


def test_a_channel_with_a_number_has_no_unit(tmp_path: Path) -> None:
    """A1 is a channel name, not an ampere."""
    for text in ("time [us],A1\n0,0\n1,1\n", "time [us],probe_A1\n0,0\n1,1\n", "A1\n0\n1\n"):
        with refused(text.splitlines()[0].split(",")[-1]):
            read(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        # Start and step stand in the file: no column of sample numbers is the time.
        ("X,CH1,Start,Increment\nSequence,Volt,0,1e-6\n0,0\n1,1\n2,2\n", "'current=2*1 A/V'"),
        ("CH1\nV\n0\n1\n2\n", "'time=0 s + STEP, current=1*1 A/V'"),
        ("Time,CH1\ns,V\n0,0\n1e-6,1\n2e-6,2\n", "'time=1, current=2*1 A/V'"),
        # The column in amperes is the current, wherever it stands.
        ("Time,CH1,CH2\ns,V,A\n0,0,1\n1e-6,1,2\n", "'time=1, current=3, voltage=2'"),
    ],
)
def test_a_refusal_names_columns_that_may_be_stated(tmp_path: Path, text: str, columns: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert caught.value.expected is not None
    assert caught.value.expected.endswith(f"--columns {columns}")


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("time [us],current [A]\n1,x\n2,3\n", "line 2"),
        ("time [us],current [A]\nx,1\n2,3\n", "line 2"),
        ("time [us],current [A]\n0,1\n1,2\n2\n", "line 4"),
        ("time [us],current [A]\n0,1\ntime [us],current [A]\n0,1\n", "time"),
        ("0,1\n1,2\n", ""),
        ("time [us],current [A]\n0,∞\n1,2\n", "current"),
        ("time [us],current [A]\n0,1_000\n1,2\n", "line 2"),
    ],
)
def test_no_row_is_lost(tmp_path: Path, text: str, key: str) -> None:
    with refused(key):
        read(tmp_path, text)


TEXT = '# by hand\n#rate: 1 MHz: sharp\n\ntime [us],x [um]\n # more\n0,"1"\n,\n1,2\n'


def test_cells_lines_and_comments(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\ufeff" + TEXT, encoding="utf-8")
    cells = read_cells(path, "the table")
    assert cells.rows == [(4, ["time [us]", "x [um]"]), (6, ["0", "1"]), (8, ["1", "2"])]
    assert cells.comments == {"rate": "1 MHz: sharp"}
    assert [line for line, _cells in split_cells(TEXT, "a", gaps=True).rows] == [4, 6, 7, 8]


def test_what_is_no_text(tmp_path: Path) -> None:
    with refused(None, file="none.csv"):
        read_cells(tmp_path / "none.csv", "the table")
    with refused(None, file="x" * 280):
        read_cells(tmp_path / f"{'x' * 280}.csv", "the table")
    with refused(None):
        decoded(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256)), "a.csv")
    with refused("line 2"):
        split_cells('t\n"1\n', "a")
