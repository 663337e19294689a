import numpy as np
import pytest
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.chaos import Orbits


@pytest.fixture(scope="module")
def found() -> Orbits:
    return ph.orbits(ph.load(CRUDE), period=1.3e-3, longest=1, starts=60, guesses=6, follow=0)


def lines(figure: object, gid: str) -> list:
    return [line for ax in figure.axes for line in ax.get_lines() if line.get_gid() == gid]


def test_orbits_lie_over_strobe_points(found: Orbits, hammer: ph.Hammer) -> None:
    figure = found.plot(points=30)
    marks = lines(figure, "orbit")
    assert len(marks) == len(found)
    for mark, one in zip(marks, found, strict=True):
        np.testing.assert_allclose(mark.get_xdata(), 1e6 * one.x)
        np.testing.assert_allclose(mark.get_ydata(), one.v)
        # Stable ones are filled, others open.
        assert (mark.get_markerfacecolor() == mark.get_markeredgecolor()) == one.stable
    (points,) = lines(figure, "points")
    expected = ph.strobe(hammer, period=1.3e-3, points=30, transient=10, verdict=False)
    np.testing.assert_allclose(points.get_xdata(), 1e6 * expected.x)
    names = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert names == ["train from rest", "period 1, stable", "period 1, not stable"]
    for trace, one in zip(lines(figure, "trace"), found, strict=False):
        assert trace.get_xdata()[0] == pytest.approx(0.0, abs=1e-9)
        assert trace.get_ydata()[0] == pytest.approx(1e6 * one.x[0])
        assert trace.get_ydata()[-1] == pytest.approx(1e6 * one.x[0], rel=1e-6)


def test_without_strobe_points(found: Orbits) -> None:
    assert all(len(line.get_xdata()) == 0 for line in lines(found.plot(points=0), "points"))


def test_a_figure_of_no_orbits_says_so(hammer: ph.Hammer) -> None:
    short = hammer.replace("magnet.range_max", "250 um")
    none = ph.orbits(short, period="1.3 ms", longest=1, starts=10)
    figure = none.plot()
    assert "no orbit found" in figure.axes[0].get_title(loc="left")
    figure.draw_without_rendering()


def test_one_orbit_closes_in_the_plane(found: Orbits) -> None:
    one = found[0]
    figure = one.plot()
    (curve,) = lines(figure, "curve")
    for values, size in ((curve.get_xdata(), 300.0), (curve.get_ydata(), 1.0)):
        assert values[0] == pytest.approx(values[-1], abs=1e-6 * size)
    (mark,) = lines(figure, "orbit")
    np.testing.assert_allclose(mark.get_xdata(), 1e6 * one.x)


def test_traces_begin_at_the_firing_whatever_the_section(hammer: ph.Hammer) -> None:
    from printhammer.chaos import orbit
    from printhammer.run.regime import Regime

    late = ph.strobe(hammer, period=1.3e-3, points=1, transient=20, phase=0.75, verdict=False)
    one = orbit(Regime.of(hammer, period=1.3e-3), (late.x[0], late.v[0]), phase=0.75)
    (trace,) = lines(one.plot(), "trace")
    times = trace.get_xdata()
    assert (np.diff(times) > 0.0).all()
    assert times[0] == pytest.approx(0.0, abs=1e-9)
    assert times[-1] == pytest.approx(1.3, abs=2e-3)
    assert trace.get_ydata()[0] == pytest.approx(1e6 * one.x[0], abs=1e-6)
