from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Bifurcation
from printhammer.figures.chaos import basins as basin_figures
from printhammer.figures.chaos.bifurcation import SHADES, WAYS


def gids(figure: object) -> list[str]:
    return [line.get_gid() for ax in figure.axes for line in ax.lines]


@pytest.fixture(scope="module")
def both(hammer: "ph.Hammer") -> Bifurcation:
    """A diagram with two directions that lead to different orbits in its middle."""
    periods = 1e-6 * np.array([860, 861, 865, 866, 867, 873])
    return ph.bifurcation(hammer, periods=periods, direction="both", refine=0, firings=400)


def test_points_of_both_directions_and_bands(both: Bifurcation) -> None:
    figure = both.plot()
    points, strip = figure.axes[0], figure.axes[1]
    drawn = {line.get_gid(): line.get_xydata() for line in points.lines}
    apart = both.values[2:5] * 1e3
    for way in ("up", "down"):
        assert set(np.unique(drawn[f"points {way}"][:, 0]).round(9)) == set(apart.round(9))
    assert len(drawn["points"]) == 3 * 200
    np.testing.assert_allclose(np.sort(drawn["points"][:200, 1]), np.sort(both.x[0, 0] * 1e6))
    assert [tick.get_text() for tick in strip.get_yticklabels()] == ["down", "up"]
    shades = {to_rgb(bar.get_facecolor()) for bar in strip.patches}
    assert shades == {to_rgb(SHADES["period-1"]), to_rgb(SHADES["period-2"])}
    widths = [bar.get_width() for bar in strip.patches]
    assert sum(widths) == pytest.approx(2.0 * 1e3 * (both.values[-1] - both.values[0]))


def test_the_legend_is_clear_of_the_foot_and_no_colour_means_two_things(both: Bifurcation) -> None:
    assert not set(WAYS.values()) & set(SHADES.values())
    figure = both.plot()
    figure.draw_without_rendering()
    legend = figure.axes[1].get_legend()
    assert "up only" in {text.get_text() for text in legend.get_texts()}
    assert not legend.get_window_extent().overlaps(figure._supxlabel.get_window_extent())
    assert not legend.get_window_extent().overlaps(figure.axes[1].xaxis.label.get_window_extent())


def test_velocities_and_limits(both: Bifurcation) -> None:
    figure = both.plot(show="v", limits=(-0.1, 0.1))
    assert figure.axes[0].get_ylim() == pytest.approx((-0.1, 0.1))
    assert any("outside" in text.get_text() for text in figure.axes[0].texts)
    with refused("show"):
        both.plot(show="t")


def test_orbits_and_branches_are_drawn_over(both: Bifurcation) -> None:
    regime = both.regime.with_("period", 866e-6)
    orbit = SimpleNamespace(
        regime=regime, x=np.array([42e-6]), v=np.array([0.1]), kind="saddle", multipliers=np.array([2.0, 0.1])
    )
    stable = SimpleNamespace(**{**vars(orbit), "kind": "stable"})
    branch = SimpleNamespace(
        parameter="period",
        phase=0.0,
        values=np.array([8.6e-4, 8.65e-4, 8.7e-4]),
        x=np.array([[42e-6], [43e-6], [44e-6]]),
        v=np.zeros((3, 1)),
        multipliers=np.array([[0.5, 0.1], [1.5, 0.1], [0.5, 0.1]]),
    )
    figure = both.plot(orbits=[orbit, [stable, branch]])
    lines = {line.get_gid(): line for line in figure.axes[0].lines}
    assert lines["unstable orbit"].get_xydata().tolist() == [[pytest.approx(0.866), pytest.approx(42.0)]]
    assert lines["unstable orbit"].get_markerfacecolor() == "white"
    assert lines["stable orbit"].get_markerfacecolor() != "white"
    # Half-way between the orbits the multiplier is 1.
    assert np.isfinite(lines["unstable branch"].get_ydata()).tolist() == [False, True, True, True, False]
    assert lines["stable branch"].get_xdata()[1] == pytest.approx(0.8625)
    assert lines["stable branch"].get_ydata()[1] == pytest.approx(42.5)
    branch.parameter = "mass"
    with refused("orbits"):
        both.plot(orbits=[branch])


def test_basins_have_a_colour_each_and_marks_for_the_attractors(hammer: "ph.Hammer") -> None:
    found = ph.basins(hammer, period=1.3e-3, x=(20e-6, 260e-6, 7), v=(-1.0, 1.0, 6))
    figure = found.plot()
    mesh = next(mesh for mesh in figure.axes[0].collections if mesh.get_gid() == "basins")
    np.testing.assert_array_equal(mesh.get_array(), found.labels)
    drawn = mesh.cmap(mesh.norm(found.labels))
    for number in (1, 2):
        colours = {tuple(colour) for colour in drawn[found.labels == number]}
        assert [colour[:3] for colour in colours] == [to_rgb(basin_figures.shade(number))]
    assert {"attractor 1", "attractor 2"} <= set(gids(figure))
    assert "attractor 1" not in gids(found.plot(attractors=False))


def test_colours_of_many_attractors_differ() -> None:
    assert len({basin_figures.shade(k) for k in range(1, 25)}) == 24


def test_the_quench_map_shows_lost_and_printed_dots(hammer: "ph.Hammer") -> None:
    found = ph.quench_map(hammer, gaps=(640e-6, 720e-6, 9), widths=(200e-6, 500e-6, 6))
    figure = found.plot()
    ax = figure.axes[0]
    printed, lost = (mesh.get_array() for mesh in ax.collections)
    np.testing.assert_array_equal(~np.ma.getmaskarray(printed), found.struck.T)
    np.testing.assert_array_equal(~np.ma.getmaskarray(lost), found.lost.T)
    marks = next(line for line in ax.lines if line.get_gid() == "Fig. 6")
    np.testing.assert_allclose(marks.get_xdata(), [0.66, 0.70])
    legend = ax.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == [
        "width of the first pulse",
        "two cases of the paper's Fig. 6",
    ]
    # White signs, on the map and in the legend.
    assert {marks.get_color(), *(line.get_color() for line in legend.get_lines())} == {"white"}
    assert to_rgb(legend.get_frame().get_facecolor()) != to_rgb("white")


def test_a_quench_map_without_the_cases_of_fig_6_does_not_explain_them(hammer: "ph.Hammer") -> None:
    found = ph.quench_map(hammer, gaps=(720e-6, 760e-6, 3), widths=(200e-6, 500e-6, 3))
    (ax, *_bars) = found.plot().axes
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["width of the first pulse"]
