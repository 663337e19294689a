"""The runner: how files are written, and the layout of tables."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import typer
from matplotlib.figure import Figure
from tests.errors import refused

from printhammer.cli.main import run_program
from printhammer.cli.options import Units, files
from printhammer.cli.runner import PICTURES, Answer, Content, Job, check_endings
from printhammer.cli.screen import Column, table
from printhammer.results.summary import styled


def drawn() -> Figure:
    figure, ax = plt.subplots()
    ax.plot(np.arange(3.0))
    plt.close(figure)
    return figure


@pytest.mark.parametrize("ending", [*PICTURES, ".PNG"])
def test_the_same_figure_makes_the_same_file(tmp_path: Path, ending: str) -> None:
    paths = [tmp_path / f"{name}{ending}" for name in ("one", "two")]
    for path in paths:
        Content(lambda _path: None, drawn).write(path)
    one, two = (path.read_bytes() for path in paths)
    assert one == two
    assert b"date" not in one.lower()


def test_other_files_are_left_to_those_who_write_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "found.csv"
    job = Job({"out": files("Files.")}, {"out": [path]})
    assert job.end(Answer(files={"out": Content(lambda at: at.write_text("x"), drawn)})) == 0
    assert path.read_text() == "x"
    assert f"wrote {path}" in capsys.readouterr().out


def test_another_ending_is_refused() -> None:
    with refused("--plot"):
        check_endings([Path("a.gif")], PICTURES, "--plot")


def test_a_complaint_is_status_1_and_ctrl_c_is_130(capsys: pytest.CaptureFixture[str]) -> None:
    assert Job({}, {}).end(Answer(["[bold]shown[/bold]"], complaints=["it ended early"])) == 1
    assert capsys.readouterr() == ("shown\n", "printhammer: it ended early\n")
    assert Job({}, {}).end(Answer(failed=True)) == 1
    assert Job({}, {}).end(Answer(interrupted=True)) == 130


def lock_that_is_interrupted() -> None:
    try:
        raise KeyboardInterrupt
    finally:
        raise RuntimeError("cannot release un-acquired lock")


def test_ctrl_c_inside_a_lock_is_130_too(capsys: pytest.CaptureFixture[str]) -> None:
    program = typer.Typer()
    program.command()(lock_that_is_interrupted)
    with pytest.raises(SystemExit) as ended:
        run_program(program, "printhammer", [])
    assert ended.value.code == 130
    assert capsys.readouterr().err == "printhammer: interrupted\n"


def test_other_runtime_errors_are_not_taken_for_ctrl_c() -> None:
    def failing() -> None:
        raise RuntimeError("a fault of the program")

    program = typer.Typer()
    program.command()(failing)
    with pytest.raises(RuntimeError, match="a fault"):
        run_program(program, "printhammer", [])


COLUMNS = (
    Column[float]("length", lambda x: x, "m"),
    Column[float]("number", lambda x: 2.0 * x, unit="m", format=".1f"),
    Column[float]("name", lambda x: styled("good", f"{x:g}"), left=True),
)


def test_a_table_is_declared_by_its_columns() -> None:
    made = table(COLUMNS, [25.4e-6, float("nan")], Units.INCH)
    assert [column.header for column in made.columns] == ["length\n\\[mil]", "number\n\\[m]", "name"]
    assert [list(column.cells) for column in made.columns] == [
        ["1.000", "–"],
        ["0.0", "–"],
        ["[green]2.54e-05[/]", "[green]nan[/]"],
    ]


def test_of_a_long_table_the_ends_are_shown() -> None:
    made = table(COLUMNS, [float(k) for k in range(10)], most=4)
    assert list(made.columns[1].cells) == ["0.0", "2.0", "…", "16.0", "18.0"]
    assert list(made.columns[2].cells)[2] == "6 more"
