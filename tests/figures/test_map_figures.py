"""Figures 8 and 9 and the comparison of maps: lines and colours, compared with the map."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from tests.errors import refused

import printhammer as ph
from printhammer.figures import FIGURES, save
from printhammer.figures.elements.map_marks import edges
from printhammer.figures.paper.maps import compare_maps, thinned

RATES = np.linspace(500.0, 2300.0, 37)


@pytest.fixture(scope="module")
def chart(hammer: "ph.Hammer") -> xr.Dataset:
    return ph.frequency_map(hammer, RATES, times=400)


@pytest.fixture(scope="module")
def surface(hammer: "ph.Hammer", chart: xr.Dataset) -> Figure:
    return FIGURES[8].draw(hammer, chart=chart)


@pytest.fixture(scope="module")
def colours(hammer: "ph.Hammer", chart: xr.Dataset) -> Figure:
    return FIGURES[9].draw(hammer, chart=chart)


def lines(drawn: Figure, panel: int = 0) -> dict[str, Line2D]:
    return {line.get_gid(): line for line in drawn.axes[panel].lines if line.get_gid()}


def strokes(line: Line2D) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of strokes, shape (n, 2), along time and rate."""
    at, rate = (np.asarray(data).reshape(-1, 3)[:, :2] for data in line.get_data())
    return at, rate


def lost_dots(chart: xr.Dataset) -> list[tuple[int, int]]:
    """Return the rows and firings of lost dots, firing by firing."""
    struck = chart["struck"].values
    return [(row, firing) for firing in range(9) for row in np.flatnonzero(~struck[:, firing])]


def test_the_picture_is_the_map(chart: xr.Dataset, colours: Figure) -> None:
    (mesh,) = colours.axes[0].collections
    assert mesh.get_rasterized()
    np.testing.assert_allclose(mesh.get_array(), 1e6 * chart["displacement"].values, rtol=1e-6)
    panel = colours.axes[0]
    assert panel.get_xlabel() == "Time from the first firing  [ms]"
    assert panel.get_ylabel() == "Rate  [kHz]"
    corners = mesh.get_coordinates()
    middle = 0.5 * (corners[:-1, :-1] + corners[1:, 1:])
    np.testing.assert_allclose(middle[0, :, 0], 1e3 * chart["time"].values, atol=1e-12)
    np.testing.assert_allclose(middle[:, 0, 1], 1e-3 * RATES, rtol=1e-12)


def test_firings_and_lost_dots_are_lines_where_there_are_many_rates(hammer: "ph.Hammer") -> None:
    rates = np.linspace(500.0, 2300.0, 50)
    chart = ph.frequency_map(hammer, rates, times=20)
    found = lines(FIGURES[9].draw(hammer, chart=chart))
    for firing in range(9):
        at, rate = found[f"firing {firing + 1}"].get_data()
        np.testing.assert_allclose(at, 1e3 * firing / rates, rtol=1e-12)
        np.testing.assert_allclose(rate, 1e-3 * rates, rtol=1e-12)
    lost_at, lost_rate = strokes(found["lost dots"])
    expected = lost_dots(chart)
    assert len(expected) == len(lost_at) > 0
    for (row, firing), at, rate in zip(expected, lost_at, lost_rate, strict=True):
        assert np.mean(rate) == pytest.approx(1e-3 * rates[row], rel=1e-9)
        assert np.mean(at) == pytest.approx(1e3 * firing / rates[row], rel=1e-9)
        # Along the line: later at lower rates.
        assert at[0] > at[1]


def test_firings_and_lost_dots_are_upright_marks_where_there_are_few(
    chart: xr.Dataset, colours: Figure
) -> None:
    found = lines(colours)
    borders = 1e-3 * edges(RATES)
    for firing in range(9):
        at, rate = strokes(found[f"firing {firing + 1}"])
        np.testing.assert_allclose(at, np.column_stack([1e3 * firing / RATES] * 2), rtol=1e-12)
        np.testing.assert_allclose(rate, np.column_stack([borders[:-1], borders[1:]]), rtol=1e-12)
    expected = lost_dots(chart)
    at, rate = strokes(found["lost dots"])
    assert len(expected) == len(at) > 0
    for (row, firing), times, ends in zip(expected, at, rate, strict=True):
        assert times == pytest.approx([1e3 * firing / RATES[row]] * 2, rel=1e-12)
        assert ends == pytest.approx(borders[row : row + 2], rel=1e-12)


def test_a_map_of_one_rate_is_marked(hammer: "ph.Hammer") -> None:
    drawn = FIGURES[9].draw(hammer, rates=[1300.0])
    at, rate = strokes(lines(drawn)["firing 4"])
    assert at == pytest.approx(np.full((1, 2), 3e3 / 1300.0), rel=1e-12)
    assert rate[0, 0] < 1.3 < rate[0, 1]


def test_the_places_are_on_the_colour_bar(colours: Figure) -> None:
    bar = lines(colours, 1)
    heights = [bar[name].get_ydata()[0] for name in ("backstop", "pack", "platen")]
    assert heights == pytest.approx([50.8, 203.2, 381.0])
    low, high = colours.axes[1].get_ylim()
    assert low < heights[0] < heights[-1] < high
    assert colours.axes[1].get_ylabel() == "Displacement  [µm]"


def test_every_curve_of_the_surface_is_a_record(chart: xr.Dataset, surface: Figure) -> None:
    found = lines(surface)
    first = np.array(found[f"rate {RATES[0]:.6g}"].get_data())
    last = np.array(found[f"rate {RATES[-1]:.6g}"].get_data())
    lean = last[:, 0] - first[:, 0]
    assert (lean > 0.1).all()
    for row, rate in enumerate(RATES):
        depth = (rate - RATES[0]) / (RATES[-1] - RATES[0])
        across, up = np.array(found[f"rate {rate:.6g}"].get_data()) - depth * lean[:, np.newaxis]
        time, x = chart["time"].values, chart["displacement"].values[row].astype(float)
        places = 0.80 * time / time[-1]
        drawn = np.interp(places, across, up)
        low = min(float(chart["displacement"].min()), 50.8e-6)
        np.testing.assert_allclose(drawn, 0.22 * (x - low) / (381.0e-6 - low), atol=5e-4)


def test_the_surface_is_blue_inside_the_pack(chart: xr.Dataset, surface: Figure) -> None:
    found = lines(surface)
    for row, rate in enumerate(RATES):
        inside = float((chart["displacement"].values[row] > 203.2e-6).mean())
        across, up = found[f"in the pack at {rate:.6g}"].get_data()
        known = np.isfinite(up[1:]) & np.isfinite(up[:-1])
        assert np.diff(across)[known].sum() / 0.80 == pytest.approx(inside, abs=0.05)


def test_nearer_curves_hide_those_behind(surface: Figure) -> None:
    panel = surface.axes[0]
    sheets = panel.patches
    assert len(sheets) == len(RATES)
    feet = [sheet.get_xy()[0][1] for sheet in sheets]
    # Drawn from the back to the front, every sheet white, every line over its own sheet.
    assert feet == sorted(feet, reverse=True)
    assert all(sheet.get_facecolor() == (1.0, 1.0, 1.0, 1.0) for sheet in sheets)
    drawn = sorted(panel.get_children(), key=lambda artist: artist.get_zorder())
    kinds = []
    for artist in drawn:
        name = (artist.get_gid() or "").partition(" ")[0]
        if artist in sheets or name == "rate":
            kinds.append(name or "sheet")
    assert kinds == ["sheet", "rate"] * len(RATES)


@given(st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=200), st.floats(1e-4, 0.5))
def test_a_thinned_curve_stays_close(y: list[float], room: float) -> None:
    x, heights = np.arange(len(y), dtype=float), np.array(y)
    kept_x, kept_y = thinned(x, heights, room)
    assert (kept_x[0], kept_x[-1]) == (x[0], x[-1])
    assert np.isin(kept_x, x).all()
    assert np.abs(np.interp(x, kept_x, kept_y) - heights).max() <= room * (1.0 + 1e-9)


def test_cells_surround_their_centres() -> None:
    np.testing.assert_allclose(edges(np.array([1.0, 2.0, 4.0])), [0.5, 1.5, 3.0, 5.0])
    low, high = edges(np.array([500.0]))
    assert low < 500.0 < high


def test_a_run_that_stopped_is_named_and_grey(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "287 um")
    for number in (8, 9):
        drawn = FIGURES[number].draw(short, rates=np.linspace(500.0, 1500.0, 11))
        assert "of 11 runs did not reach their end: range left (" in drawn.get_suptitle()
        drawn.draw_without_rendering()
    (mesh,) = drawn.axes[0].collections
    assert np.ma.getmaskarray(mesh.get_array()).any()


def test_maps_side_by_side(chart: xr.Dataset) -> None:
    measured = chart[["displacement"]].isel(rate=slice(0, 37, 4)) + np.float32(2e-6)
    measured["displacement"].values[1, 50:60] = np.nan
    measured.attrs = {"source": "measured.csv"}
    drawn = compare_maps(chart, measured)
    left, right, beside, _bar = drawn.axes
    assert (left.get_xlim(), left.get_ylim()) == (right.get_xlim(), right.get_ylim())
    assert left.collections[0].norm.vmax == right.collections[0].norm.vmax
    rms, rates = lines(drawn, 2)["difference"].get_data()
    np.testing.assert_allclose(rms, 2.0, rtol=1e-3)
    np.testing.assert_allclose(rates, 1e-3 * RATES[::4])
    assert beside.get_xlabel() == "RMS  [µm]"
    assert drawn.get_suptitle() == ""


def test_maps_without_a_common_rate_are_still_drawn(chart: xr.Dataset) -> None:
    drawn = compare_maps(chart, chart.isel(rate=[0, 1]).assign_coords(rate=[501.0, 602.0]))
    assert "The maps have no rate in common" in drawn.get_suptitle()


def test_a_map_of_which_nothing_is_known_is_grey(hammer: "ph.Hammer", chart: xr.Dataset) -> None:
    unknown = chart.assign(displacement=chart["displacement"] * np.nan)
    for number in (8, 9):
        FIGURES[number].draw(hammer, chart=unknown).draw_without_rendering()
    compare_maps(chart, unknown).draw_without_rendering()


def test_a_map_of_one_time_is_not_drawn(hammer: "ph.Hammer", chart: xr.Dataset) -> None:
    short = chart.isel(time=[3])
    for draw in (
        lambda: FIGURES[8].draw(hammer, chart=short),
        lambda: FIGURES[9].draw(hammer, chart=short),
        lambda: compare_maps(chart, short),
    ):
        with refused("times"):
            draw()


@pytest.mark.parametrize("number", [8, 9])
def test_files_stay_small_and_the_same(
    hammer: "ph.Hammer", chart: xr.Dataset, tmp_path: Path, number: int
) -> None:
    for kind in ("svg", "pdf"):
        paths = [
            save(FIGURES[number].draw(hammer, chart=chart), tmp_path / place, "map", formats=[kind])[0]
            for place in ("one", "two")
        ]
        assert paths[0].read_bytes() == paths[1].read_bytes()
        assert paths[0].stat().st_size < 2e6
