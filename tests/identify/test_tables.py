from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.errors import InputError
from printhammer.support.tables.readings import Readings, read_table
from printhammer.units import from_si

COLUMNS = {"displacement": "m", "force": "N"}
WORDS = {"branch": ("loading", "unloading")}


def read(folder: Path, text: str) -> Readings:
    path = folder / "table.csv"
    path.write_text(text, "utf-8")
    return read_table(path, COLUMNS, optional={"current": "A"}, text=WORDS)


def test_any_order_any_unit_and_comments(tmp_path: Path) -> None:
    text = (
        "# hammer: hendriks-1983\n# nothing in particular\n\n"
        "Force [lbf], branch ,displacement [mil]\n"
        "1,loading,2\n# noise: 0.1 N\n\n-0.5, Unloading ,2.5\n,,\n"
    )
    table = read(tmp_path, text)
    np.testing.assert_array_equal(table.values["displacement"], [5.08e-5, 6.35e-5])
    np.testing.assert_allclose(table.values["force"], [4.4482216152605, -2.22411080763025], rtol=1e-15)
    assert table.words == {"branch": ["loading", "unloading"]}
    assert table.lines.tolist() == [5, 8]
    assert table.comments == {"hammer": "hendriks-1983", "noise": "0.1 N"}
    assert len(table) == 2
    assert "current" not in table.values


def test_a_byte_order_mark_and_line_ends_of_other_systems(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes("\ufeffdisplacement [m],force [N]\r\n1,2\r\n3,4\r\n".encode())
    table = read_table(path, COLUMNS)
    assert table.values["force"].tolist() == [2.0, 4.0]
    assert table.lines.tolist() == [2, 3]


@given(
    rows=st.lists(
        st.tuples(*2 * (st.floats(-1e6, 1e6, allow_nan=False, allow_subnormal=False),)),
        min_size=1,
        max_size=20,
    ),
    unit=st.sampled_from(["m", "um", "mil", "in"]),
    turned=st.booleans(),
)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    rows: list[tuple[float, float]],
    unit: str,
    turned: bool,
) -> None:
    heading = [f"displacement [{unit}]", "force [N]"]
    cells = [[repr(from_si(x, "m", unit)), repr(force)] for x, force in rows]
    lines = [line[::-1] if turned else line for line in [heading, *cells]]
    table = read(tmp_path_factory.mktemp("tables"), "\n".join(map(",".join, lines)))
    np.testing.assert_allclose(table.values["displacement"], [x for x, _ in rows], rtol=4e-16, atol=0)
    assert table.values["force"].tolist() == [force for _, force in rows]


@given(text=st.text(max_size=200))
def test_any_text_is_told_in_one_sentence(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("tables") / "table.csv"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(InputError) as caught:
        read_table(path, COLUMNS)
    assert "table.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


HEADING = "displacement [um],force [N]\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ("no heading", "above the numbers")),
        ("# only: comments\n", ("no heading",)),
        (HEADING, ("no rows",)),
        ("displacement,force [N]\n1,2\n", ("line 1", "'displacement'", "unit", "displacement [m]")),
        ("displacement [],force [N]\n1,2\n", ("line 1", "unit")),
        ("displacement [um] x,force [N]\n1,2\n", ("line 1", "not known")),
        ("displacement [s],force [N]\n1,2\n", ("'s' is a time", "a length")),
        ("displacement [gee],force [N]\n1,2\n", ("gee", "not known")),
        ("displacement [um]\n1\n", ("'force' is missing",)),
        ("displacement [um],force [N],forse [N]\n1,2,3\n", ("'forse [N]' is not known",)),
        ("displacement [um],force [N],Force [N]\n1,2,3\n", ("'force' occurs twice",)),
        ("displacement [um],force [N],branch [1]\n1,2,loading\n", ("words have no unit",)),
        ("displacement [um],force [N],branch\n1,2,up\n", ("line 2", "'up'", "loading or unloading")),
        (HEADING + "1,2\n1,x\n", ("line 3", "'force'", "'x'", "number")),
        (HEADING + "1,\n", ("line 2", "'force'", "''")),
        (HEADING + "nan,1\n", ("line 2", "'displacement'", "finite")),
        (HEADING + "1,inf\n", ("line 2", "finite")),
        (HEADING + "1e16,1\n", ("line 2", "1e16 um", "measured value")),
        (HEADING + "1,2\n3,-9.9e37\n", ("line 3", "-9.9e37 N", "measured value")),
        (HEADING + "5e-324,1\n", ("line 2", "5e-324 um", "measured value")),
        (HEADING + "1,2,3\n", ("line 2", "3 cells", "expected 2")),
        (HEADING + "1\n", ("line 2", "1 cell: ")),
        (HEADING + '1,"2\n', ("line 2", "comma-separated")),
    ],
)
def test_bad_tables_in_one_sentence(tmp_path: Path, text: str, said: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert all(word in str(caught.value) for word in ("table.csv", *said)), caught.value


def test_files_that_are_none(tmp_path: Path) -> None:
    with refused(None, file="none.csv"):
        read_table(tmp_path / "none.csv", COLUMNS)
    with refused(None):
        read_table(tmp_path, COLUMNS)
    (tmp_path / "latin.csv").write_bytes(b"displacement [\xb5m],force [N]\n1,2\n")
    assert read_table(tmp_path / "latin.csv", COLUMNS).values["displacement"].tolist() == [1e-6]
