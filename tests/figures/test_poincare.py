import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Strobe, strobes
from printhammer.claims.verdicts import printed_verdicts
from printhammer.figures import FIGURES
from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.paper.poincare import PERIODS

INCH = 0.0254


@pytest.fixture(scope="module")
def trains(hammer: "ph.Hammer") -> list[Strobe]:
    return strobes(hammer, PERIODS, points=200, firings=(161, 200))


@pytest.fixture(scope="module")
def drawn(hammer: "ph.Hammer", trains: list[Strobe]) -> Figure:
    return FIGURES[11].draw(hammer, strobes=trains)


def data(ax: matplotlib.axes.Axes, gid: str) -> tuple[np.ndarray, np.ndarray]:
    x, y = next(found for found in ax.lines if found.get_gid() == gid).get_data()
    return np.asarray(x), np.asarray(y)


def texts(ax: matplotlib.axes.Axes) -> list[str]:
    return [text.get_text() for text in ax.texts]


def test_twelve_panels_with_strobe_time_letter_and_verdict(drawn: Figure, trains: list[Strobe]) -> None:
    assert len(drawn.axes) == 12
    for ax, letter, train in zip(drawn.axes, "abcdefghijkl", trains, strict=True):
        assert f"({letter})" in texts(ax)
        assert f"{1e3 * train.period:.2f} ms" in texts(ax)
        assert train.verdict.name.replace("-", " ") in texts(ax)
    assert pytest.approx(np.arange(1.35e-3, 0.79e-3, -0.05e-3)) == PERIODS


def test_points_are_those_of_the_trains(drawn: Figure, trains: list[Strobe]) -> None:
    for ax, train in zip(drawn.axes, trains, strict=True):
        x, v = data(ax, "points")
        np.testing.assert_allclose(x, 1e6 * train.x, rtol=1e-12)
        np.testing.assert_allclose(v, train.v, rtol=1e-12)
        assert len(x) == 200


def test_a_small_attractor_is_drawn_once_more(drawn: Figure, trains: list[Strobe]) -> None:
    for ax, train in zip(drawn.axes, trains, strict=True):
        insets = [child for child in ax.child_axes if child.get_gid() == "attractor"]
        area = np.ptp(train.x[100:]) * np.ptp(train.v[100:])
        small = train.verdict.period is None and area < 0.04 * 2e-3 * INCH * 50.0 * INCH
        assert len(insets) == small
        if small:
            x, v = data(insets[0], "attractor")
            assert set(x) <= set(1e6 * train.x[100:])
            assert np.ptp(x) > 0.8 * np.diff(insets[0].get_xlim())
            assert np.ptp(v) > 0.8 * np.diff(insets[0].get_ylim())


def test_the_window_is_that_of_the_paper(drawn: Figure) -> None:
    for ax in drawn.axes:
        assert ax.get_xlim() == pytest.approx((0.0015 * INCH * 1e6, 0.0035 * INCH * 1e6))
        assert ax.get_ylim() == pytest.approx((-25 * INCH, 25 * INCH))
        assert data(ax, "backstop")[0] == pytest.approx([0.002 * INCH * 1e6] * 2)


def test_outer_axes_carry_both_unit_systems(drawn: Figure) -> None:
    drawn.draw_without_rendering()
    assert [bool(ax.get_xlabel()) for ax in drawn.axes] == [False] * 9 + [True] * 3
    assert [bool(ax.get_ylabel()) for ax in drawn.axes] == [True, False, False] * 4
    tops = [child for ax in drawn.axes for child in ax.child_axes if child.get_xlabel()]
    assert len(tops) == 3
    assert tops[0].get_xlim() == pytest.approx((1.5, 3.5))
    rights = [child for ax in drawn.axes for child in ax.child_axes if child.get_ylabel()]
    assert len(rights) == 4
    assert rights[0].get_ylim() == pytest.approx((-25.0, 25.0))


def test_a_cycle_is_ringed_and_points_outside_are_counted(drawn: Figure, trains: list[Strobe]) -> None:
    for ax, train in zip(drawn.axes, trains, strict=True):
        ringed = [line for line in ax.lines if line.get_gid() == "cycle"]
        period = train.verdict.period
        assert len(ringed) == (period is not None)
        if ringed:
            assert ringed[0].get_xdata() == pytest.approx(1e6 * train.x[-period:])
        beyond = np.abs(1e6 * train.x - 63.5) > 25.4
        beyond |= np.abs(train.v) > 0.635
        told = [text for text in texts(ax) if text.endswith("outside")]
        assert told == ([f"{beyond.sum()} outside"] if beyond.any() else [])


def test_another_verdict_of_the_paper_is_written_beside(hammer: "ph.Hammer", trains: list[Strobe]) -> None:
    printed = printed_verdicts()
    # The caption of Fig. 11: a double cycle, three trains with the period of forcing, eight strange ones.
    assert list(printed) == pytest.approx(PERIODS)
    assert list(printed.values()).count("strange") == 8
    drawn = FIGURES[11].draw(hammer, strobes=trains, printed=printed)
    for ax, train in zip(drawn.axes, trains, strict=True):
        (name,) = (name for period, name in printed.items() if period == pytest.approx(train.period))
        told = [text for text in texts(ax) if text.startswith("paper")]
        assert told == ([] if name == train.verdict.name else [f"paper: {name.replace('-', ' ')}"])


def test_nothing_is_said_of_other_strobe_times(hammer: "ph.Hammer", trains: list[Strobe]) -> None:
    for printed in (None, {}, {1.35001e-3: "strange"}):
        drawn = FIGURES[11].draw(hammer, strobes=trains[:1], printed=printed)
        assert not any(text.startswith("paper") for text in texts(drawn.axes[0]))
    drawn = FIGURES[11].draw(hammer, strobes=trains[:1], printed={1.35e-3: "period-64"})
    assert "paper: period 64" in texts(drawn.axes[0])


def test_the_circles_have_a_key_where_there_are_any(hammer: "ph.Hammer", trains: list[Strobe]) -> None:
    for train in trains:
        drawn = FIGURES[11].draw(hammer, strobes=[train])
        told = [text.get_text() for key in drawn.legends for text in key.get_texts()]
        ringed = any(line.get_gid() == "cycle" for line in drawn.axes[0].lines)
        assert told == (["last points of a periodic train"] if ringed else [])


def test_one_train(hammer: "ph.Hammer", trains: list[Strobe]) -> None:
    figure = trains[3].plot()
    assert figure.axes[0].get_title(loc="left") == f"1.20 ms: {trains[3].verdict.name.replace('-', ' ')}"
    close = trains[3].plot(fit=True).axes[0]
    x, v = data(close, "points")
    assert close.get_xlim()[0] < x.min() < x.max() < close.get_xlim()[1]
    assert close.get_ylim()[0] < v.min() < v.max() < close.get_ylim()[1]
    assert np.diff(close.get_xlim()) < 1.3 * np.ptp(x)


def test_a_run_that_stopped_says_so(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "250 um")
    found = strobes(short, [1e-3, 1.2e-3], points=5, firings=(3, 5))
    assert "1.00 ms ended early: range left" in FIGURES[11].draw(short, strobes=found).get_suptitle()
    assert "ended early: range left" in found[0].plot(fit=True).get_suptitle()


@pytest.mark.parametrize(
    ("period", "text"),
    [(1.05e-3, "1.05 ms"), (1e-3, "1.00 ms"), (1.0525e-3, "1.0525 ms"), (1 / 3e3, "0.333333 ms")],
)
def test_strobe_times_are_written_as_they_are(period: float, text: str) -> None:
    assert shown_period(period) == text


def test_what_is_missing_is_named(hammer: "ph.Hammer") -> None:
    with refused("waveform"):
        FIGURES[11].draw(hammer.replace("waveform", None))
    with refused("strobes"):
        FIGURES[11].draw(hammer, strobes=[])
