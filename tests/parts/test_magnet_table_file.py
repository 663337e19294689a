"""Tables of forces and of flux linkages from CSV files: valid and invalid files."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.errors import InputError
from printhammer.parts.magnet.linkage_table import LinkageTableMagnet
from printhammer.parts.magnet.table import TableMagnet

GRID = """# measured on 1982-11-03
displacement [mm],current [A],force [N]
0.1,0,1
0.1,1,2
0.2,0,3
0.2,1,4.5
"""


def read(path: Path, text: str | bytes) -> TableMagnet:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return TableMagnet(file=str(path))


def test_units_and_order_do_not_matter(tmp_path: Path) -> None:
    plain = read(tmp_path / "plain.csv", GRID)
    assert plain.table.x == (1e-4, 2e-4)
    assert plain.table.current == (0.0, 1.0)
    assert plain.table.values == ((1.0, 2.0), (3.0, 4.5))
    assert plain.domain == (1e-4, 2e-4)
    assert plain.current_range == (0.0, 1.0)
    other = "\ufeffforce [mN], current [mA] ,displacement [um]\r\n4500,1000,200\r\n\r\n2000,1000,100\r\n"
    other += "3000,0,200\r\n1000,0,100\r\n"
    assert read(tmp_path / "other.csv", other).table == plain.table


def test_two_tables_are_equal_if_their_points_are(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    first = read(path, GRID)
    assert read(path, GRID) == first
    assert read(path, GRID.replace("4.5", "4.6")) != first


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "heading"),
        ("# nothing\n\n", "heading"),
        (GRID.replace(" [A]", ""), "current"),
        (GRID.replace("[A]", "[]"), "current"),
        (GRID.replace("[A]", "[V]"), "current [V]"),
        (GRID.replace("[mm]", "[parsec]"), "displacement [parsec]"),
        (
            GRID.replace("current", "voltage"),
            "voltage [A]",
        ),
        (GRID.replace(",force [N]", ""), "line 3"),
        (GRID.replace("current [A]", "force [N]"), "force"),
        (GRID.replace("0.2,0,3\n", ""), "point"),
        (GRID.replace("0.2,0,3", "0.1,0,3"), "point"),
        (
            GRID.replace("0.2,0,3\n", "").replace("0.2,1,4.5\n", ""),
            "displacements",
        ),
        (
            GRID.replace("0.1,1,2\n", "").replace("0.2,1,4.5\n", ""),
            "currents",
        ),
        (GRID.replace(",0,", ",3,"), "current"),
        (GRID.replace("4.5", "four"), "force"),
        (GRID.replace("4.5", "nan"), "force"),
        (GRID.replace("4.5", ""), "force"),
        (GRID.replace("4.5", "4.5,6"), "line 6"),
        (GRID.replace("4.5", "1e308").replace("[N]", "[kN]"), "force"),
        (GRID.replace("4.5", '"4.5'), "line 6"),
        (b"\xff\xfe\x00\x00", None),
    ],
)
def test_a_bad_table_is_refused_in_one_sentence(tmp_path: Path, text: str | bytes, key: str | None) -> None:
    path = tmp_path / "bad.csv"
    with refused(key, file="bad.csv"):
        read(path, text)


@pytest.mark.parametrize("name", ["absent.csv", "."])
def test_a_table_that_cannot_be_read_is_refused(tmp_path: Path, name: str) -> None:
    with refused(None):
        TableMagnet(file=str(tmp_path / name))


@pytest.mark.parametrize(
    ("force", "key"),
    [
        ([[1.0, 2.0]], "rows"),
        ([[1.0, 2.0], [3.0]], "rows"),
        ([[1.0, 2.0], [3.0, float("inf")]], "point"),
    ],
)
def test_arrays_that_are_no_grid_are_refused(force: list[list[float]], key: str) -> None:
    with refused(key):
        TableMagnet.from_arrays([1e-4, 2e-4], [0.0, 1.0], force)


@given(st.text(max_size=60), st.integers(0, len(GRID)))
def test_any_text_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str, place: int) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    told = ""
    try:
        read(path, (GRID[:place] + text + GRID[place:]).encode("utf-8", "replace"))
    except InputError as error:
        told = str(error)
    assert "\n" not in told


LINKAGES = """displacement [mm],current [A],linkage [mWb]
0.1,0,0
0.1,1,20
0.1,2,30
0.2,0,0
0.2,1,30
0.2,2,50
"""


def test_linkages_are_read(tmp_path: Path) -> None:
    path = tmp_path / "linkages.csv"
    path.write_text(LINKAGES)
    assert LinkageTableMagnet(file=str(path)).table.values == ((0.0, 0.02, 0.03), (0.0, 0.03, 0.05))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            LINKAGES.replace("0.1,2,30", "0.1,2,20"),
            "at 0.0001 m the linkage goes from 0.02 to 0.02 Wb between 1 and 2 A: expected one that rises",
        ),
        (
            LINKAGES.replace("0.2,2,50", "0.2,2,31"),
            "the spline through the linkages falls about 2 A: expected one that rises with the current",
        ),
        (
            LINKAGES.replace("linkage [mWb]", "force [N]"),
            "the column 'force [N]' is not known",
        ),
        (LINKAGES.replace("mWb", "N"), "the unit 'N' is a force: expected"),
        ("", "no heading"),
    ],
)
def test_a_table_of_linkages_without_coenergy_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "linkages.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        LinkageTableMagnet(file=str(path))
    assert str(caught.value).startswith(f"{path}: ")
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)
