"""Figures of exponents, the 0-1 test, recurrence, sections and impact trains against their numbers."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

import printhammer as ph
from printhammer.chaos import Lyapunov, LyapunovChart, Section, lyapunovs


def lines(drawn: Figure, gid: str) -> list[tuple[np.ndarray, np.ndarray]]:
    return [line.get_data() for ax in drawn.axes for line in ax.lines if line.get_gid() == gid]


def words(drawn: Figure) -> str:
    found = [text.get_text() for ax in drawn.axes for text in [*ax.texts, ax.title, ax._left_title]]
    extra = [text.get_text() for text in (drawn._suptitle, drawn._supxlabel) if text is not None]
    return "\n".join([*found, *extra])


@pytest.fixture(scope="module")
def found(hammer: "ph.Hammer") -> Lyapunov:
    return ph.lyapunov(hammer, period="1.05 ms", firings=150, transient=100)


@pytest.fixture(scope="module")
def chart(hammer: "ph.Hammer") -> LyapunovChart:
    return lyapunovs(hammer, ["1.3 ms", "0.8 ms"], firings=150, transient=100)


@pytest.fixture(scope="module")
def touches(hammer: "ph.Hammer") -> Section:
    return ph.section(hammer, surface="pack", period="1.05 ms", touches=80, transient=20)


def test_running_estimates(found: Lyapunov) -> None:
    drawn = found.plot()
    counts, means, _errors = found.running()
    curves = lines(drawn, "running")
    assert len(curves) == 2
    for k, (x, y) in enumerate(curves):
        np.testing.assert_array_equal(x, counts)
        np.testing.assert_array_equal(y, means[:, k])
        low, high = drawn.axes[k].get_ylim()
        assert low < found.exponents[k] < high
    assert f"{found.exponents[0]:+.4g} ±" in words(drawn)
    assert "1.05 ms" in words(drawn)


def test_a_motion_that_forgets_its_past_is_drawn_without_its_exponents(found: Lyapunov) -> None:
    gone = dataclasses.replace(
        found,
        factors=np.full((150, 2), -np.inf),
        exponents=np.full(2, -np.inf),
        standard_errors=np.full(2, np.inf),
        smooth=False,
    )
    drawn = gone.plot()
    drawn.draw_without_rendering()
    assert all(x.size == 0 for x, _y in lines(drawn, "running"))
    assert "at zero velocity" in words(drawn)


def test_many_trains(chart: LyapunovChart) -> None:
    drawn = chart.plot()
    drawn.draw_without_rendering()
    upper, _lower, k = drawn.axes[:3]
    shown = np.concatenate([line.get_ydata() for line in upper.lines if line.get_marker() == "o"])
    np.testing.assert_allclose(np.sort(shown), np.sort(chart.exponents[:, 0]))
    shown = np.concatenate([line.get_ydata() for line in k.lines if line.get_marker() == "o"])
    np.testing.assert_allclose(np.sort(shown), np.sort(chart.k))
    sure = dataclasses.replace(chart, zero_one=("regular", "chaotic"), growth=("regular", "chaotic"))
    assert "open marks" not in words(sure.plot())
    odd = dataclasses.replace(chart, zero_one=("undecided", "chaotic"), growth=("regular", "regular"))
    assert "2 of 2 trains (open marks)" in words(odd.plot())


def test_the_zero_one_test(found: Lyapunov) -> None:
    drawn = found.zero_one.plot()
    drawn.draw_without_rendering()
    (path,) = lines(drawn, "path")
    np.testing.assert_array_equal(path, (found.zero_one.p, found.zero_one.q))
    ((_steps, moved),) = lines(drawn, "displacement")
    np.testing.assert_array_equal(moved, found.zero_one.displacement)
    assert found.zero_one.verdict in words(drawn)


def test_recurrence(found: Lyapunov) -> None:
    plot = ph.recurrence(found.points)
    drawn = plot.plot()
    (image,) = drawn.axes[0].images
    np.testing.assert_array_equal(image.get_array(), plot.matrix)
    assert f"{plot.determinism:.3g}" in words(drawn)


def test_a_section(touches: Section) -> None:
    drawn = touches.plot()
    ((since, v),) = lines(drawn, "touches")
    np.testing.assert_allclose(since, 1e3 * touches.since)
    np.testing.assert_array_equal(v, touches.v)
    assert drawn.axes[0].get_xlim() == pytest.approx((0.0, 1.05))
    assert "80 touches of the pack" in words(drawn)


def test_a_section_without_touches(hammer: "ph.Hammer") -> None:
    empty = ph.section(hammer, period="0.45 ms", touches=5, transient=500, firings=5)
    drawn = empty.plot()
    drawn.draw_without_rendering()
    assert "no touches" in words(drawn)
    assert "0 of 5 touches" in words(drawn)


def test_an_impact_train(touches: Section) -> None:
    train = ph.impact_train(touches)
    drawn = train.plot()
    drawn.draw_without_rendering()
    ((before, after),) = lines(drawn, "returns")
    np.testing.assert_allclose(before, 1e3 * train.intervals[:-1])
    np.testing.assert_allclose(after, 1e3 * train.intervals[1:])
    assert "80 impacts" in words(drawn)
    clock = ph.impact_train(1e-3 * np.arange(50)).plot()
    clock.draw_without_rendering()
    assert "all intervals are the same" in words(clock)
