"""Display in notebooks: pictures, tables, and names for completion."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from IPython.core.formatters import DisplayFormatter

import printhammer as ph
from printhammer.results.declare import MOST_ROWS
from printhammer.results.result import Rows
from printhammer.run.contacts import Contact, Dot

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def motion() -> ph.Motion:
    hammer = ph.load("hendriks-1983")
    return ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate="2 kHz", pulses=4))


def shown(value: object) -> dict[str, Any]:
    """Return the representations of a value in IPython, by MIME type."""
    return dict(DisplayFormatter().format(value)[0])


def test_the_last_line_of_a_cell_shows_the_picture(motion: ph.Motion) -> None:
    assert shown(motion.plot())["image/png"].startswith(PNG)


def test_every_picture_tells_a_notebook_what_it_shows(motion: ph.Motion) -> None:
    """All figures are created in one place, including the figure with a manual layout."""
    from printhammer.figures import FIGURES
    from printhammer.figures.elements.style import new_figure

    figures: list[Any] = [new_figure(2.0), new_figure(2.0, 3.0, "none"), FIGURES[2].draw(motion.hammer)]
    for figure in figures:
        assert figure._repr_png_().startswith(PNG)


def test_a_picture_is_shown_in_its_own_style(motion: ph.Motion) -> None:
    from matplotlib import rc_context

    # Layout settles with each drawing: two figures, each drawn once.
    figure, other = motion.plot(), motion.plot()
    with rc_context({"savefig.facecolor": "red", "savefig.bbox": "tight", "font.size": 30.0}):
        shown_elsewhere = figure._repr_png_()
    assert shown_elsewhere == other._repr_png_()


def test_no_picture_takes_pyplot() -> None:
    script = (
        "import sys; from printhammer.figures.elements.style import new_figure;"
        "new_figure(1.0)._repr_png_(); print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_dots_and_contacts_are_tuples_and_tables(motion: ph.Motion) -> None:
    for rows, kind in ((motion.dots, Dot), (motion.contacts, Contact)):
        assert isinstance(rows, tuple)
        assert tuple(rows) == rows
        assert isinstance(rows[0], kind)
        assert isinstance(rows[1:], Rows)
        assert rows[1:] == tuple(rows)[1:]
        assert pickle.loads(pickle.dumps(rows)) == rows
        table = rows.to_dataframe()
        assert len(table) == len(rows)
        html = shown(rows)["text/html"]
        assert html.count("<tr>") == 1 + len(rows)
        assert all(f"<th>{head}</th>" in html for head in table)
        assert len(repr(rows).splitlines()) == 1 + len(rows)
    assert "flight_time [s]" in repr(motion.dots)
    times = motion.dots["flight_time"]
    expected = [np.nan if dot.flight_time is None else dot.flight_time for dot in motion.dots]
    np.testing.assert_array_equal(times, expected)
    np.testing.assert_array_equal(motion.dots.to_dataframe()["flight_time [s]"], expected)
    assert motion.contacts["surface"].tolist() == [contact.surface for contact in motion.contacts]
    with pytest.raises(KeyError, match="'speed': expected one of index, fired_at"):
        motion.dots["speed"]


def test_long_and_empty_tables() -> None:
    lost = [Dot(index, 1e-3 * index, struck=False) for index in range(1000)]
    rows = Rows(lost, Dot)
    html = rows._repr_html_()
    assert html.count("<tr>") == 2 + MOST_ROWS
    assert "<td>0</td>" in html
    assert "<td>999</td>" in html
    assert np.isnan(rows["flight_time"]).all()
    none = Rows([], Dot)
    assert none == ()
    assert none["flight_time"].shape == (0,)
    assert list(none.to_dataframe()) == list(rows.to_dataframe())
    assert "fired_at [s]" in none._repr_html_()
    assert len(repr(none).splitlines()) == 1


def test_results_and_their_parts_show_values_with_units(motion: ph.Motion) -> None:
    html = motion._repr_html_()
    assert "<td>x [m]</td>" in html
    assert f"{motion.x.min():.6g} to {motion.x.max():.6g}" in html
    energy = shown(motion.energy)["text/html"]
    assert f"<td>pack_loss [J]</td><td>{motion.energy.pack_loss:.6g}</td>" in energy
    assert "<b>Dot</b>" in shown(motion.dots[0])["text/html"]


def test_completion_shows_public_names_only(motion: ph.Motion) -> None:
    for value in (motion, motion.dots[0], motion.energy):
        names = dir(value)
        assert all(re.fullmatch(r"[a-z][a-z0-9_]*", name) for name in names), names
        assert all(hasattr(value, name) for name in names)
    assert {"x", "dots", "plot", "to_dataframe"} <= set(dir(motion))
    assert dir(ph) == sorted(ph.__all__)


def test_a_notebook_shows_the_constants_of_a_hammer() -> None:
    hammer = ph.load("hendriks-1983")
    html = shown(hammer)["text/html"]
    for constant in hammer.constants.values():
        assert f"<td>{constant.key}</td>" in html
    assert hammer.name in html


def test_pyplot_shows_a_picture_where_it_has_windows(
    motion: ph.Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib import pyplot

    for backend, number in (("agg", 0), ("tkagg", 1)):
        monkeypatch.setattr("matplotlib.get_backend", lambda backend=backend: backend)
        figure = motion.plot()
        assert len(pyplot.get_fignums()) == number
    assert pyplot.gcf() is figure
    pyplot.close("all")
