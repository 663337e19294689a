"""Figures: lines and axes, compared with the motion and the equations."""

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from tests.errors import refused

import printhammer as ph
from printhammer.figures import FIGURES
from printhammer.figures.paper.motion import plot
from printhammer.printing.dots.buzz import BuzzSearch, BuzzTrain, delayed_train, longest_run

OPPOSITE = {"µm": ("10⁻³ in", 25.4), "N": ("lbf", 4.4482216152605), "m/s": ("in/s", 0.0254)}


def line(drawn: Figure, gid: str, panel: int = 0) -> Line2D:
    return next(found for found in drawn.axes[panel].lines if found.get_gid() == gid)


def data(drawn: Figure, gid: str, panel: int = 0) -> tuple[np.ndarray, np.ndarray]:
    x, y = line(drawn, gid, panel).get_data()
    return np.asarray(x), np.asarray(y)


def unit(label: str) -> str:
    return label.partition("[")[2].rstrip("]")


@pytest.fixture(scope="module")
def single(hammer: "ph.Hammer") -> "ph.Motion":
    return ph.simulate(hammer, ph.PulseTrain(hammer.waveform))


@pytest.fixture(scope="module")
def drawn(hammer: "ph.Hammer") -> dict[int, Figure]:
    return {number: entry.draw(hammer) for number, entry in FIGURES.items() if number not in (7, 11)}


def test_the_registry_has_the_figures_of_the_paper() -> None:
    assert list(FIGURES) == [2, 3, 4, 5, 6, 7, 8, 9, 10, 11]
    assert all(entry.number == number and entry.title and entry.caption for number, entry in FIGURES.items())


@pytest.mark.parametrize(
    ("number", "units"),
    [
        (2, ["µm", "N"]),
        (3, ["µm"]),
        (4, ["N"]),
        (5, ["µm", "N"]),
        (6, ["µm"]),
        (10, ["µm", "m/s"]),
    ],
)
def test_axes_carry_both_unit_systems(drawn: dict[int, Figure], number: int, units: list[str]) -> None:
    panel = drawn[number].axes[0]
    drawn[number].draw_without_rendering()
    opposite = [child for child in panel.child_axes if not child.lines]
    found = {}
    for axis in opposite:
        vertical = bool(axis.get_ylabel())
        own = unit(panel.get_ylabel() if vertical else panel.get_xlabel())
        ends = axis.get_ylim() if vertical else axis.get_xlim()
        here = panel.get_ylim() if vertical else panel.get_xlim()
        found[own] = (unit(axis.get_ylabel() or axis.get_xlabel()), np.array(here) / np.array(ends))
    assert sorted(found) == sorted(units)
    for own, (name, ratios) in found.items():
        assert name == OPPOSITE[own][0]
        np.testing.assert_allclose(ratios, OPPOSITE[own][1], rtol=1e-9)


@pytest.mark.parametrize("number", [3, 4, 6])
def test_time_is_in_milliseconds_and_current_in_amperes(drawn: dict[int, Figure], number: int) -> None:
    strip = drawn[number].axes[1]
    assert unit(strip.get_xlabel()) == "ms"
    assert strip.get_ylabel() == "Current\n[A]"


@pytest.mark.parametrize("current", [0.0, 0.5, 1.0, 1.5, 2.0])
def test_figure_2_is_equation_3(hammer: "ph.Hammer", drawn: dict[int, Figure], current: float) -> None:
    x, force = data(drawn[2], f"magnet {current:g} A")
    key = hammer.constants
    pull = key["magnet.Am"].si - key["magnet.Bm"].si * current
    np.testing.assert_allclose(force, key["magnet.F0"].si - pull**2 / np.sqrt(1e-6 * x), rtol=1e-12)


def test_figure_2_is_equation_4_and_its_reflection(hammer: "ph.Hammer", drawn: dict[int, Figure]) -> None:
    x, force = data(drawn[2], "spring")
    bs, reach = hammer.constants["spring.Bs"].si, hammer.constants["spring.As"].si
    np.testing.assert_allclose(force, bs * (1.0 - (1e-6 * x - 50.8e-6) / reach), rtol=1e-12)
    np.testing.assert_array_equal(data(drawn[2], "spring reflected")[1], -force)
    assert line(drawn[2], "spring reflected").is_dashed()


def test_figure_2_marks_each_place_by_one_line(drawn: dict[int, Figure]) -> None:
    for name, place in (("backstop", 50.8), ("pack", 203.2), ("platen", 381.0)):
        assert line(drawn[2], name).get_xdata()[0] == pytest.approx(place)
        marks = [found for found in drawn[2].axes[0].lines if str(found.get_gid()).startswith(name)]
        assert len(marks) == 1


def test_figure_3_is_the_motion(single: "ph.Motion", drawn: dict[int, Figure]) -> None:
    time, x = data(drawn[3], "displacement")
    peak_time, peak = single.peak_after(0)
    assert x.max() == pytest.approx(1e6 * peak, rel=1e-9)
    assert time[np.argmax(x)] == pytest.approx(1e3 * peak_time, abs=1e-4)
    np.testing.assert_allclose(x, 1e6 * single.at(1e-3 * time)[0], atol=1e-6)
    np.testing.assert_allclose(data(drawn[3], "current", 1)[1], single.drive.value(1e-3 * time), atol=1e-6)
    assert [line(drawn[3], name).get_ydata()[0] for name in ("backstop", "pack", "platen")] == pytest.approx(
        [50.8, 203.2, 381.0]
    )


def test_figure_4_is_mass_times_acceleration(
    hammer: "ph.Hammer", single: "ph.Motion", drawn: dict[int, Figure]
) -> None:
    time, force = data(drawn[4], "total force")
    time, step = 1e-3 * time, 1e-8
    inside = (time > step) & (time < single.end - step)
    at = time[inside]
    slope = (single.at(at + step)[1] - single.at(at - step)[1]) / (2.0 * step)
    np.testing.assert_allclose(force[inside], hammer.mass * slope, atol=0.05)


def test_the_loops_of_figure_5_add_up(single: "ph.Motion", drawn: dict[int, Figure]) -> None:
    x, force = data(drawn[5], "force")
    work = np.trapezoid(force, 1e-6 * x)
    assert abs(work) < 1e-3 * single.energy.throughput
    # From touch to leaving, the backstop takes energy: a counter-clockwise loop.
    for contact in single.contacts[1:4]:
        t = np.linspace(contact.t_in, contact.t_out, 2001)
        inside = np.trapezoid(single.forces_at(t)["total"], single.at(t)[0])
        assert inside < 0.0


def test_the_insert_of_figure_5_is_the_settle_out(single: "ph.Motion", drawn: dict[int, Figure]) -> None:
    insert = next(child for child in drawn[5].axes[0].child_axes if child.lines)
    x, force = next(found for found in insert.lines if found.get_gid() == "settle-out").get_data()
    second = [c for c in single.contacts if c.surface == "backstop"][2]
    assert np.min(x) == pytest.approx(50.8 - 1e6 * second.depth, abs=1e-3)
    assert np.max(force) < np.max(data(drawn[5], "force")[1])


def test_figure_6_has_both_motions(hammer: "ph.Hammer", drawn: dict[int, Figure]) -> None:
    for number, delay in enumerate((660e-6, 700e-6), 1):
        motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=[0.0, delay]), points=2)
        time, x = data(drawn[6], f"displacement {number}")
        maxima = 1 + np.flatnonzero((x[1:-1] >= x[:-2]) & (x[1:-1] > x[2:]))
        late = maxima[time[maxima] > 1e3 * delay]
        assert x[late].max() == pytest.approx(1e6 * motion.peak_after(1)[1], rel=1e-9)
        np.testing.assert_allclose(x, 1e6 * motion.at(1e-3 * time)[0], atol=1e-6)


def test_figure_10_is_the_orbit(single: "ph.Motion", drawn: dict[int, Figure]) -> None:
    x, v = data(drawn[10], "orbit")
    assert (x[0], v[0]) == pytest.approx((1e6 * single.at(0.0)[0][0], 0.0), abs=1e-9)
    assert x.max() == pytest.approx(1e6 * single.peak_after(0)[1], rel=1e-9)
    fastest = min(c.v_in for c in single.contacts if c.surface == "backstop")
    assert fastest >= v.min() > 1.1 * fastest
    heads = [text for text in drawn[10].axes[0].texts if getattr(text, "arrow_patch", None) is not None]
    assert len(heads) >= 8


@pytest.fixture(scope="module")
def buzz(hammer: "ph.Hammer") -> BuzzSearch:
    times = delayed_train(hammer, 12e-6, 4)
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=times), points=2)
    force = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), points=2).dots[0].peak_force
    run, peak = longest_run(motion, force), motion.drive.peak
    train = BuzzTrain(**vars(run), kind="delayed", interval=12e-6, times=times, peak_current=peak)
    return BuzzSearch(train, "", train, force, 1)


def test_figure_7_shows_the_train(hammer: "ph.Hammer", buzz: BuzzSearch) -> None:
    drawn = FIGURES[7].draw(hammer, search=buzz)
    at, _foot = data(drawn, "firings")
    np.testing.assert_allclose(at, 1e3 * np.array(buzz.train.times), rtol=1e-12)
    numbers = [text.get_text() for text in drawn.axes[0].texts]
    assert [f"{force:.2f}" for force in buzz.train.forces] == numbers[-len(buzz.train.forces) :]
    assert "12 µs after leaving the pack" in drawn.axes[0].get_title(loc="left")
    assert drawn.get_suptitle().replace("\n", " ") == f"{buzz.train.touches_text}."


def test_figure_7_says_that_there_is_none(hammer: "ph.Hammer", buzz: BuzzSearch) -> None:
    none = BuzzSearch(None, "no train does", buzz.best, buzz.reference_force, 1)
    remark = FIGURES[7].draw(hammer, search=none).get_suptitle().replace("\n", " ")
    assert remark == f"No buzz printing: no train does. {buzz.best.touches_text}."


def test_a_motion_that_stopped_says_so(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "250 um")
    motion = ph.simulate(short, ph.PulseTrain(hammer.waveform), points=2)
    assert not motion.ok
    drawn = plot(motion)
    assert drawn.get_suptitle().replace("\n", " ") == motion.message
    time, x = data(drawn, "displacement")
    assert time[-1] == pytest.approx(1e3 * motion.end)
    assert x[-1] == pytest.approx(1e6 * motion.at(motion.end)[0][0])


def test_a_motion_is_shown_up_to_a_time(single: "ph.Motion") -> None:
    assert plot(single, until="0.5 ms").axes[0].get_xlim() == pytest.approx((0.0, 0.5))
    with refused("until"):
        plot(single, until=0.0)


@pytest.mark.slow
def test_an_impact_on_a_rigid_backstop_is_a_jump(hammer: "ph.Hammer") -> None:
    part = {"law": "rigid", "position": "0.002 in", "restitution": 0.5}
    rigid = hammer.replace({"backstop": part, "waveform.amplitude": "1.1 A"})
    x, v = data(FIGURES[10].draw(rigid), "orbit")
    jumps = np.flatnonzero((np.diff(x) == 0.0) & (v[:-1] < 0.0) & (v[1:] > 0.0))
    assert len(jumps) >= 3
    np.testing.assert_allclose(x[jumps], 50.8, rtol=1e-9)
    np.testing.assert_allclose(v[jumps + 1], -0.5 * v[jumps], rtol=1e-9)
    time, force = data(FIGURES[4].draw(rigid), "total force")
    # The stop carries the armature before it is released: nothing accelerates it.
    assert force[time == 0.0] == 0.0


def test_settings_of_the_user_stay(hammer: "ph.Hammer") -> None:
    with matplotlib.rc_context({"lines.linewidth": 7.0, "font.family": ["serif"]}):
        before = dict(matplotlib.rcParams)
        label = FIGURES[2].draw(hammer).axes[0].xaxis.label
        assert dict(matplotlib.rcParams) == before
    assert label.get_fontfamily() == ["DejaVu Sans"]


@pytest.mark.parametrize(
    ("number", "missing", "key"),
    [(2, "magnet", "magnet"), (3, "waveform", "waveform"), (10, "waveform", "waveform"), (7, "pack", "pack")],
)
def test_a_missing_part_is_named(hammer: "ph.Hammer", number: int, missing: str, key: str) -> None:
    with refused(key):
        FIGURES[number].draw(hammer.replace(missing, None))


def test_figure_2_needs_no_more_than_a_magnet_and_a_scale(hammer: "ph.Hammer") -> None:
    bare = hammer.replace({"spring": None, "pack": None})
    gids = {found.get_gid() for found in FIGURES[2].draw(bare).axes[0].lines}
    assert {"magnet 0 A", "backstop", "platen"} <= gids
    assert not {"spring", "pack"} & gids
    with refused("pack"):
        FIGURES[2].draw(hammer.replace({"pack": None, "platen": None}))


@pytest.mark.parametrize("delays", [(), (0.0,), (1e-4, 2e-4, 3e-4, 4e-4)])
def test_delays_that_make_no_sense_are_refused(hammer: "ph.Hammer", delays: tuple[float, ...]) -> None:
    with refused("delays"):
        FIGURES[6].draw(hammer, delays=delays)
