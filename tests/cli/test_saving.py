"""Files that the verbs write."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from printhammer.cli.saving import PICTURES, check_endings, write_found
from printhammer.cli.terminal import console
from printhammer.errors import InputError


def drawn() -> Figure:
    figure, ax = plt.subplots()
    ax.plot(np.arange(3.0))
    plt.close(figure)
    return figure


@pytest.mark.parametrize("ending", [*PICTURES, ".PNG"])
def test_the_same_figure_makes_the_same_file(tmp_path: Path, ending: str) -> None:
    paths = [tmp_path / f"{name}{ending}" for name in ("one", "two")]
    for path in paths:
        write_found(console(), [path], drawn, lambda _path: None)
    one, two = (path.read_bytes() for path in paths)
    assert one == two
    assert b"date" not in one.lower()


def test_other_files_are_left_to_those_who_write_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "found.csv"
    write_found(console(), [path], drawn, lambda at: at.write_text("x"))
    assert path.read_text() == "x"
    assert f"wrote {path}" in capsys.readouterr().out


def test_another_ending_is_refused() -> None:
    with pytest.raises(InputError, match=r"^--plot a\.gif: expected a name that ends in one of \.svg, "):
        check_endings([Path("a.gif")], PICTURES, "--plot")
