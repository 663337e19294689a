import csv
import shlex
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests import measurements as lab
from tests.measurements import Array, write

import printhammer as ph


def noisy(columns: dict[str, Array], name: str, size: float) -> dict[str, Array]:
    noise = size * np.random.default_rng(8).standard_normal(len(columns[name]))
    return {**columns, name: columns[name] + noise}


@pytest.fixture
def tables(tmp_path: Path) -> dict[str, Path]:
    columns, branch = lab.pack()
    return {
        "magnet": write(tmp_path / "magnet.csv", noisy(lab.magnet(), "force", 0.1)),
        "spring": write(tmp_path / "spring.csv", noisy(lab.spring(), "force", 0.1)),
        "pack": write(tmp_path / "pack.csv", noisy(columns, "force", 0.2), branch),
        "backstop": write(tmp_path / "rebounds.csv", noisy(lab.rebounds(), "rebound speed", 0.005)),
    }


def test_from_tables_to_a_hammer(
    cli: Callable, tables: dict[str, Path], tmp_path: Path, hammer: ph.Hammer
) -> None:
    options: dict[str, tuple[object, ...]] = {
        "magnet": (tables["magnet"], "--spring", tables["spring"]),
        "pack": (tables["pack"],),
        "backstop": (tables["backstop"],),
    }
    base: object = "hendriks-1983"
    for kind, words in options.items():
        out, made = tmp_path / f"{kind}-part.toml", tmp_path / f"{kind}-made.toml"
        files = ("--out", out, "--into", made)
        done = cli("fit", kind, *words, "--hammer", base, *files)
        assert done.status == 0, done.err
        assert "not rejected" in done.out
        assert "95 % interval" in done.out
        part = tomllib.loads(out.read_text("utf-8"))
        for section, constants in part.items():
            for name, entry in constants.items():
                if name != "law":
                    assert ph.load(made).constants[f"{section}.{name}"].si == entry["value"]
                    assert entry["status"] == "derived"
        base = made
    found = ph.load(tmp_path / "backstop-made.toml")
    assert found.constants["magnet.Am"].si == pytest.approx(lab.AM, rel=0.02)
    assert found.constants["pack.stiffness"].si == pytest.approx(lab.STIFFNESS, rel=0.02)
    k = hammer.constants["backstop.stiffness"].si
    assert found.constants["backstop.damping"].si == pytest.approx(lab.RATIO * k, rel=0.05)
    assert cli("hammer", "check", base).status == 0


def test_covariance_is_a_table(cli: Callable, tables: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    done = cli("fit", "spring", tables["spring"], "--backstop", "0.002 in", "--covariance", path)
    assert done.status == 0
    lines = [line for line in path.read_text("utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.reader(lines))
    assert rows[0] == ["constant", "spring.Bs", "spring.As"]
    matrix = np.array([[float(cell) for cell in row[1:]] for row in rows[1:]])
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.all(np.linalg.eigvalsh(matrix) > 0)


def test_without_the_spring_it_is_said_what_is_missing(cli: Callable, tables: dict[str, Path]) -> None:
    done = cli("fit", "magnet", tables["magnet"])
    assert done.status == 0
    assert "not separated" in done.out
    assert "table of the spring alone" in " ".join(done.out.split())


def test_geometry_alone(cli: Callable, tmp_path: Path) -> None:
    out = tmp_path / "k.toml"
    bodies = shlex.split(
        "--radius '2 mm +- 0.05 mm' --modulus '200 GPa' --modulus '3 GPa ± 0.2 GPa' --poisson 0.3"
        " --poisson 0.35"
    )
    done = cli("fit", "backstop", *bodies, "--out", out)
    assert done.status == 0
    assert "the damping needs rebounds" in " ".join(done.out.split())
    entry = tomllib.loads(out.read_text("utf-8"))["backstop"]["stiffness"]
    assert entry["unit"] == "N/m^1.5"
    assert "computed from radii" in entry["source"]


def test_a_law_that_is_rejected(cli: Callable, tmp_path: Path) -> None:
    columns = lab.rebounds()
    columns["rebound speed"] = 0.7 * columns["impact speed"]
    table = write(tmp_path / "r.csv", noisy(columns, "rebound speed", 0.005))
    done = cli("fit", "backstop", table, "--out", tmp_path / "r.svg")
    assert done.status == 0
    assert "rejected, p" in done.out
    assert "not rejected" not in done.out
    assert "a constant restitution of 0." in " ".join(done.out.split())
    assert b"<svg" in (tmp_path / "r.svg").read_bytes()
    assert cli("fit", "backstop", table, "--strict").status == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("spring {spring}", ("position of the backstop",)),
        ("spring {spring} --backstop 2", ("--backstop", "'2' has no unit")),
        ("spring {spring} --backstop '2 s'", ("--backstop", "a length")),
        ("spring none.csv --backstop '2 mil'", ("none.csv", "no such file")),
        ("spring {pack} --backstop '2 mil'", ("pack.csv", "not known")),
        ("pack {pack}", ("thickness of the pack",)),
        ("pack {pack} --thickness '-1 mm'", ("thickness", "-0.001 m")),
        ("pack {pack} --thickness '7 mil' --into new.toml", ("--into new.toml", "--hammer")),
        ("pack {pack} --thickness '6 mil' --hammer hendriks-1983 --into {out}", ("pack.thickness",)),
        ("magnet {magnet} --spring {spring}", ("position of the backstop",)),
        ("magnet {spring}", ("spring.csv", "'current'")),
        ("magnet {magnet} --zero here", ("--zero", "'here'")),
        ("magnet {magnet} --hammer nobody", ("nobody", "no such file")),
        ("magnet {magnet} --out picture.txt", ("picture.txt", ".svg")),
        ("magnet {magnet} --covariance {magnet}", ("magnet.csv", "that is not an input file")),
        ("backstop", ("expected a table of rebounds, or the geometry",)),
        ("backstop --radius '2 mm'", ("expected 2, of armature and backstop",)),
        ("backstop {backstop} --poisson x", ("--poisson", "'x'")),
        ("motion {spring} --hammer hendriks-1983", ("spring.csv",)),
        ("motion shot.csv", ("the hammer", "--hammer")),
    ],
)
def test_bad_input_is_one_sentence(
    refused: Callable, tables: dict[str, Path], tmp_path: Path, words: str, said: tuple[str, ...]
) -> None:
    refused("fit", *shlex.split(words.format(**tables, out=tmp_path / "out.toml")), said=said)


WORDS = {
    "magnet": "--hammer hendriks-1983",
    "spring": "--backstop '2 mil'",
    "pack": "--thickness '7 mil'",
    "backstop": "--hammer hendriks-1983",
}


@pytest.mark.parametrize("written", ["1e308", "-1e308", "9.9e37", "5e-324"])
@pytest.mark.parametrize("kind", WORDS)
def test_a_value_that_no_sensor_reads_is_refused(
    refused: Callable, tables: dict[str, Path], kind: str, written: str
) -> None:
    lines = tables[kind].read_text().splitlines()
    for column in range(lines[0].count(" [")):
        changed = [line.split(",") for line in lines]
        changed[5][column] = written
        tables[kind].write_text("\n".join(map(",".join, changed)) + "\n")
        words = shlex.split(WORDS[kind])
        refused("fit", kind, tables[kind], *words, said=("line 6", written, "expected a measured value"))


def test_a_row_far_off_is_left_out(cli: Callable, tables: dict[str, Path]) -> None:
    lines = tables["spring"].read_text().splitlines()
    lines[8] = lines[8].partition(",")[0] + ",1e5"
    tables["spring"].write_text("\n".join(lines) + "\n")
    done = cli("fit", "spring", tables["spring"], *shlex.split(WORDS["spring"]))
    assert done.status == 0, done.err
    assert "14 used" in done.out


@pytest.mark.parametrize(("first", "second"), [(9, 31), (31, 55), (75, 105)])
def test_rows_that_change_places_are_a_sentence_or_an_answer(
    cli: Callable, tables: dict[str, Path], first: int, second: int
) -> None:
    lines = tables["pack"].read_text().splitlines()
    lines[first], lines[second] = lines[second], lines[first]
    tables["pack"].write_text("\n".join(lines) + "\n")
    done = cli("fit", "pack", tables["pack"], *shlex.split(WORDS["pack"]))
    if done.status:
        assert done.status == 2
        assert done.err.startswith("printhammer: ")
        assert len(done.err.splitlines()) == 1
    else:
        assert "inf" not in done.out
