import dataclasses
import math
from collections import Counter

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Branch, Branches, StabilityChart
from printhammer.figures.chaos.continuation import colour_of

GRAVITY, RESTITUTION, FREQUENCY, GAMMA = 9.80665, 0.5, 50.0, 1.3
WEIGHT = 1e-3 * GRAVITY


@pytest.fixture(scope="module")
def branch() -> Branch:
    """The orbit of the bouncing ball with one impact per period: a fold and a period doubling."""
    ball = ph.Hammer.build(
        1e-3,
        spring={"law": "preload", "preload": -WEIGHT, "stiffness": 0.0},
        backstop={"law": "rigid", "position": 0.0, "restitution": RESTITUTION},
    )
    omega = 2.0 * math.pi * FREQUENCY
    height = GAMMA * GRAVITY / omega**2
    angle = math.acos(math.pi * (1.0 - RESTITUTION) / (1.0 + RESTITUTION) / GAMMA)
    up, dt = 0.5 * GRAVITY / FREQUENCY, 0.5 / FREQUENCY - angle / omega
    state = (height * math.sin(angle) + up * dt - 0.5 * GRAVITY * dt * dt, up - GRAVITY * dt + height * omega)
    return ph.continuation(
        ball,
        "drive.amplitude",
        (1.0 * WEIGHT, 1.55 * WEIGHT),
        drive=ph.SineForce(GAMMA * WEIGHT, FREQUENCY),
        state=state,
        phase=0.5,
    )


def lines(figure: Figure, name: str) -> list:
    return [line for line in figure.axes[0].lines if line.get_gid() == name]


def test_stable_parts_are_solid_and_end_at_the_branch_points(branch: Branch) -> None:
    figure = branch.plot()
    (stable,) = lines(figure, "stable")
    assert stable.get_linestyle() == "-"
    ends = sorted(stable.get_xdata()[[0, -1]])
    (limits,) = branch.stable_ranges
    np.testing.assert_allclose(ends, limits, rtol=1e-12)
    unstable = lines(figure, "unstable")
    assert {line.get_linestyle() for line in unstable} == {"--"}
    drawn = sum(len(line.get_xdata()) for line in [stable, *unstable])
    # Every orbit and branch point once, and those at which the style changes twice.
    assert drawn == len(branch) + len(branch.events) + 2
    for event in branch.events:
        (mark,) = lines(figure, event.kind)
        assert mark.get_xdata()[0] == event.value
        np.testing.assert_allclose(mark.get_ydata()[0], event.state[1], rtol=1e-2)


def test_a_grazing_stands_out_from_the_branch(branch: Branch) -> None:
    """The mark is drawn above the lines, taller than wide, and in another colour; it can be switched off."""
    event = dataclasses.replace(branch.events[0], kind="grazing")
    grazed = dataclasses.replace(branch, events=(event,))
    figure = grazed.plot()
    (mark,) = lines(figure, "grazing")
    assert mark.get_xdata()[0] == event.value
    for line in [*lines(figure, "stable"), *lines(figure, "unstable")]:
        assert mark.get_zorder() > line.get_zorder()
        assert mark.get_markersize() > 5.0 * line.get_linewidth()
        assert to_rgb(mark.get_markeredgecolor()) != to_rgb(line.get_color())
    assert "grazing" in [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert not lines(grazed.plot(grazings=False), "grazing")


def test_the_legend_tells_every_kind(branch: Branch) -> None:
    told = [text.get_text() for text in branch.plot().axes[0].get_legend().get_texts()]
    assert told == ["period 1, stable", "unstable", "fold", "period doubling"]


def test_other_quantities_and_limits(branch: Branch) -> None:
    figure = branch.plot(show="x", limits=(0.0, 1e-3))
    (ax,) = figure.axes
    assert ax.get_ylim() == (0.0, 1e3)
    assert "µm" in ax.get_ylabel()
    for wrong in ("nothing", ""):
        with refused("show"):
            branch.plot(show=wrong)


def test_several_branches_have_colours_by_period(branch: Branch) -> None:
    (event,) = [event for event in branch.events if event.kind == "period doubling"]
    both = Branches((branch, branch.doubled(event)))
    figure = both.plot()
    counts = Counter(line.get_color() for line in lines(figure, "stable"))
    # The doubled orbit has two states.
    assert counts[colour_of(1)] == 1
    assert counts[colour_of(2)] >= 2
    with refused("branches"):
        Branches(()).plot()


def test_ends_before_the_bounds_are_told(branch: Branch) -> None:
    short = ph.continuation(branch.orbit(len(branch) // 2), branch.parameter, branch.bounds, most=3)
    assert "number of steps" in short.message
    figure = short.plot()
    assert "2 at the maximum number of steps" in figure.get_suptitle()
    assert branch.plot().get_suptitle() == ""


def test_a_chart_is_drawn(branch: Branch) -> None:
    chart: StabilityChart = ph.stability_chart(
        branch, "backstop.restitution", (0.48, 0.52), grid=(2, 2), most=8
    )
    figure = chart.plot()
    for kind in ("fold", "period doubling"):
        (curve,) = [curve for curve in chart.curves if curve.kind == kind]
        (line,) = lines(figure, kind)
        np.testing.assert_array_equal(line.get_xdata(), curve.first)
        np.testing.assert_array_equal(line.get_ydata(), np.where(curve.limits, curve.second, np.nan))
    assert len(figure.axes[0].collections) == 1
    told = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert {"from rest: period 1", "fold", "period doubling", "value of the hammer"} <= set(told)


def test_a_curve_is_drawn_with_and_without_attractors(branch: Branch) -> None:
    curve = ph.bifurcation_curve(
        branch, "backstop.restitution", (0.48, 0.52), event="period doubling", grid=(2, 2), most=8
    )
    figure = curve.plot()
    (line,) = lines(figure, "period doubling")
    np.testing.assert_array_equal(line.get_xdata(), curve.first)
    np.testing.assert_array_equal(line.get_ydata(), curve.second)
    assert not lines(figure, "subcritical")
    assert len(figure.axes[0].collections) == 1
    texts = {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    assert {"period 1", "period doubling"} <= texts
    alone = curve.plot(attractors=False)
    assert not alone.axes[0].collections
    with refused("curve"):
        dataclasses.replace(
            curve, **{name: getattr(curve, name)[:1] for name in ("first", "second", "state", "multipliers")}
        ).plot()
