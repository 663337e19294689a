"""Feedback on a hammer: drives of the closed loop, comparison, pictures, rejected input."""

import shlex
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests import hammers
from tests.control.feedback.coarse import HALVED, patched
from tests.errors import refused

import printhammer as ph
from printhammer.cli.main import main, verb_of
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.comparison import Feedback
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import FRONT_ERROR, SCALE_ERROR, driver_of
from printhammer.control.feedback.sensor import PositionSensor
from printhammer.drive.file import read_drive
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.paper import simulate_pieces
from printhammer.printing.dots.strategy import eight_slot_patterns, slot_times, slots_of
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.variability import Perturbation, perturbed

CURRENT = 2.0
RATE = 1600.0
HAMMER = Path(__file__).parents[2] / "data" / "bucked.toml"
"""A hammer of its own, since what a controller can do depends on the hammer."""

PATTERNS = [(0, 1, 2, 3), (0, 2, 3), (0, 1, 4)]
PERFECT = PositionSensor(noise=0.0, step=0.0)


@pytest.fixture(scope="module")
def controller() -> Controller:
    hammer = ph.load(HAMMER)
    with patched(HALVED):
        return Controller(hammer, driver_of(hammer, CURRENT))


@pytest.fixture(scope="module")
def shipped() -> Controller:
    hammer = ph.load("hendriks-1983")
    with patched(HALVED):
        return Controller(hammer, driver_of(hammer))


@pytest.mark.slow
def test_a_perfect_sensor_tells_when_and_how_fast_the_pack_is_touched(controller: Controller) -> None:
    loop = FeedbackStrategy(controller, PERFECT).loops(controller.hammer, PATTERNS[:1], RATE)[0]
    drive = loop.drive(controller.driver.edge)
    motion = ph.simulate(controller.hammer, drive, duration=float(loop.due[-1]) + 2e-3)
    touches = [contact for contact in motion.contacts if contact.surface == "pack"]
    assert len(touches) == len(loop.touches) == len(loop.due)
    for contact, (time, speed) in zip(touches, loop.touches, strict=True):
        assert contact.t_in == pytest.approx(time, abs=1e-6)
        assert contact.v_in == pytest.approx(speed, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("current", "travel"), [(0.0, 8e-6), (0.0, -8e-6), (-0.03, 0.0), (0.03, 0.0), (-0.02, 8e-6), (0.02, 8e-6)]
)
def test_front_and_supply_are_learned_and_not_taken_for_each_other(
    controller: Controller, current: float, travel: float
) -> None:
    other = perturbed(controller.hammer, Perturbation(current=current, travel=travel))
    loop = FeedbackStrategy(controller, PositionSensor()).loops(other, [(0, 1, 2, 3, 6)], 1300.0)[0]
    known = loop.learned
    assert known.front * controller.stroke == pytest.approx(travel, abs=1e-6)
    assert known.scale == pytest.approx(current, abs=0.012)
    # Far better known than before the first dot, and told so.
    assert known.front_error < 0.1 * FRONT_ERROR
    assert known.scale_error < 0.5 * SCALE_ERROR


@pytest.mark.slow
@pytest.mark.parametrize("travel", [-10e-6, 10e-6])
def test_a_pack_that_lies_elsewhere_is_printed_on(controller: Controller, travel: float) -> None:
    other = perturbed(controller.hammer, Perturbation(travel=travel))
    case, patterns = Case(other, controller.single, 1300.0), [*PATTERNS, (0, 1), (0, 5), (2, 3, 7)]
    strategy = FeedbackStrategy(controller, PositionSensor(seed=4))
    trial = attempt([case], patterns, strategy, limits=Limits(), tolerance=5e-7)
    assert trial.passed.all()
    # Only the first dot comes before the front is known.
    late = np.abs(trial.judgement.force_deviation)
    assert np.nanmax(late[:, 1:]) < 0.08
    assert max(drive.peak for drive in trial.drives) <= CURRENT * (1.0 + 1e-12)


@pytest.mark.slow
def test_the_drive_prints_within_limits_and_bounds(controller: Controller) -> None:
    strategy = FeedbackStrategy(controller, PositionSensor())
    other = perturbed(controller.hammer, Perturbation(current=0.03))
    for real, rate in ((controller.hammer, RATE), (other, 1000.0)):
        case = Case(real, controller.single, rate)
        trial = attempt([case], PATTERNS, strategy, limits=Limits(), tolerance=5e-7)
        assert trial.passed.all()
        assert max(drive.peak for drive in trial.drives) <= CURRENT * (1.0 + 1e-12)


@pytest.mark.slow
def test_a_hammer_far_from_the_nominal_one_spoils_dots_but_not_the_loop(controller: Controller) -> None:
    far = perturbed(controller.hammer, Perturbation(current=-0.4, travel=60e-6))
    drives = FeedbackStrategy(controller, PositionSensor(noise=0.2))(far, PATTERNS, 2200.0)
    assert [len(drive.times) for drive in drives] == [len(pattern) for pattern in PATTERNS]
    assert all((np.diff(drive.times) > 0.0).all() for drive in drives)
    assert max(drive.peak for drive in drives) <= CURRENT * (1.0 + 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "by",
    [Perturbation(), Perturbation(current=0.1), Perturbation(travel=-25e-6, current=0.05)],
    ids=lambda by: by.name,
)
def test_what_the_sensor_showed_is_what_the_whole_drive_does(
    controller: Controller, by: Perturbation
) -> None:
    """No decision changes the past of the drive, even if the decision is late."""
    driven = perturbed(controller.hammer, by) if by.name != "nominal" else controller.hammer
    patterns = [slots_of(pattern) for pattern in eight_slot_patterns()[128:255:9]]
    for loop in FeedbackStrategy(controller, PERFECT).loops(driven, patterns, RATE):
        drive = loop.drive(controller.driver.edge)
        motion = ph.simulate(driven, drive, duration=float(loop.due[-1]) + 2e-3)
        for times, shown in loop.seen:
            # The closed loop runs at the tolerance for pictures.
            assert motion.at(times)[0] == pytest.approx(shown, abs=1e-7)


@pytest.mark.slow
def test_drives_do_not_depend_on_company_or_threads(controller: Controller) -> None:
    together = FeedbackStrategy(controller, PositionSensor(), threads=2)(controller.hammer, PATTERNS, RATE)
    for pattern, drive in zip(PATTERNS, together, strict=True):
        alone = FeedbackStrategy(controller, PositionSensor(), threads=1)(controller.hammer, [pattern], RATE)
        assert alone == [drive]
        assert len(drive.times) == len(pattern)
    other = FeedbackStrategy(controller, PositionSensor(seed=1))(controller.hammer, PATTERNS, RATE)
    assert other != together


@pytest.mark.slow
def test_the_comparison(controller: Controller, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(
        "printhammer.control.feedback.comparison.Controller", lambda *_args, **_options: controller
    )
    steps: list[tuple[int, int]] = []
    found = ph.feedback(
        controller.hammer, RATE, gaps=[0.6e-3, 1.1e-3], progress=lambda *step: steps.append(step)
    )
    assert steps == sorted(steps)
    # The controller is there already, whose making is most of the steps.
    assert len(steps) > 3
    assert steps[0][0] == 0
    assert 0.9 < steps[-1][0] / steps[-1][1] < 1.0
    assert isinstance(found, Feedback)
    assert found.strategies == ("open loop", "feedback")
    assert found.passed.shape == (2, 128)
    assert found.passed[1].all()
    assert found.passed[1].sum() > found.passed[0].sum()
    # A single dot from rest is the single pulse itself.
    assert found.force[0, 0, 0] == pytest.approx(0.0, abs=1e-4)
    assert (np.abs(found.gap_arrival[1]) < found.limits.arrival).all()
    data = found.to_dataset()
    assert data["force"].dims == ("strategy", "pattern", "dot")
    assert data.attrs["hammer_fingerprint"] == controller.hammer.fingerprint
    found.save(tmp_path / "found.nc")
    with xr.open_dataset(tmp_path / "found.nc", engine="scipy") as read:
        assert np.array_equal(read["arrival"].values, found.arrival, equal_nan=True)
    with refused(None, file="found.txt"):
        found.save(tmp_path / "found.txt")
    again = read_drive(found.run.motion.drive.to_toml())
    assert again == found.run.motion.drive
    forces = [dot.peak_force for dot in ph.simulate(found.driven, again).dots]
    assert forces == pytest.approx([dot.peak_force for dot in found.run.motion.dots], rel=1e-3)
    figure = found.plot()
    assert [line.get_gid() for line in figure.axes[2].get_lines()][:2] == ["open loop", "feedback"]
    shares = figure.axes[1]
    assert max(shares.get_yticks()) <= 1.0
    figure.draw_without_rendering()
    legend = shares.get_legend().get_window_extent()
    assert not any(legend.overlaps(line.get_window_extent()) for line in shares.get_lines())
    run = found.plot_run()
    samples = next(line for line in run.axes[0].get_lines() if line.get_gid() == "samples")
    assert len(samples.get_xdata()) == len(found.run.times)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--rate", "0 Hz"], "rate"),
        (["--noise", "-1"], "noise = -1.0"),
        (["--interval", "0 us"], "interval"),
        (["--current", "0 A"], "current"),
        (["--supply", "0"], "supply"),
        (["--out", "found.txt"], "--out found.txt"),
        (["--run", "run.nc"], "--run run.nc"),
        (["--table", "nowhere.csv"], "nowhere.csv"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main(["feedback", str(hammers.CRUDE), *arguments])
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert told in error.replace("\n", " ")
    assert "Traceback" not in error


@pytest.mark.parametrize("arguments", [["print", "HAMMER"], ["quality", str(hammers.CRUDE)]])
def test_feedback_and_a_table_at_once_are_refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main([*arguments, "--rate", "1 kHz", "--feedback", "--table", "table.csv"])
    assert end.value.code == 2
    assert "--table table.csv and --feedback: expected one of them" in capsys.readouterr().err.replace(
        "\n", " "
    )


@pytest.mark.slow
def test_the_example_in_the_help_runs(
    shipped: Controller,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """For the shipped hammer, whose controller takes most of the time; `test_the_comparison` uses another."""
    made: list[tuple[object, ...]] = []

    def controller(*arguments: object, **_options: object) -> Controller:
        made.append(arguments[:2])
        return shipped

    monkeypatch.setattr("printhammer.control.feedback.comparison.Controller", controller)
    monkeypatch.chdir(tmp_path)
    example = verb_of("feedback").example
    with pytest.raises(SystemExit) as end:
        main(shlex.split(example)[1:])
    assert end.value.code == 0
    assert made == [(shipped.hammer, shipped.driver)]
    assert "feedback" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["feedback.png"]


@pytest.mark.slow
def test_feedback_drives_a_page_and_a_report(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        "printhammer.control.feedback.controller.Controller", lambda *_args, **_options: controller
    )
    monkeypatch.chdir(tmp_path)
    own = ["--rate", "1.6 kHz", "--feedback"]
    for arguments in (
        ["print", "HH", *own, "--hammer", str(HAMMER), "--out", "page.csv"],
        ["quality", str(HAMMER), *own, "--pattern", "1101", "--out", "found.nc"],
    ):
        with pytest.raises(SystemExit) as end:
            main(arguments)
        assert end.value.code == 0
    assert (tmp_path / "page.csv").exists()
    with xr.open_dataset(tmp_path / "found.nc", engine="scipy") as read:
        assert read.attrs["strategy"] == "feedback"


def test_hammers_that_cannot_be_driven_are_refused() -> None:
    bare = hammers.made_of(spring=hammers.preload(-4.0), pack=hammers.power())
    with refused("waveform"):
        ph.feedback(bare, 1e3)


@pytest.mark.parametrize("gaps", [[], [0.0], [-1e-3, 1e-3], [float("nan")], [[1e-3]]])
def test_bad_gaps_are_refused(gaps: list[float]) -> None:
    with refused("gaps"):
        ph.feedback(hammers.crude(), 1e3, gaps=gaps)


@pytest.mark.slow
def test_dots_that_follow_a_landing_are_within_limits(shipped: Controller) -> None:
    """The backstop of the shipped hammer is soft: an armature pressed against it is thrown when released."""
    hammer, single, way = shipped.hammer, shipped.single, FeedbackStrategy(shipped)
    for gap in (0.88e-3, 1.05e-3, 1.3e-3):
        dots = ph.simulate(hammer, way(hammer, [(0, 1, 2, 3)], 1.0 / gap)[0]).dots
        force = np.array([dot.peak_force for dot in dots], dtype=float) / single.force - 1.0
        touched = np.array([dot.fired_at + (dot.flight_time or np.nan) for dot in dots])
        late = touched - slot_times((0, 1, 2, 3), 1.0 / gap) - single.flight_time
        assert np.abs(force).max() < 0.1
        assert np.abs(late).max() < 50e-6


@pytest.mark.slow
def test_paper_that_varies_is_met_and_seen(controller: Controller) -> None:
    hammer, slots = controller.hammer, (0, 1, 2, 4, 5, 6)
    own = FeedbackStrategy(controller, PositionSensor())
    plain = own(hammer, [slots], RATE)[0]
    same = own.along((hammer,) * 7)(hammer, [slots], RATE)[0]
    # Where hammers take turns steps begin anew.
    assert same.times == pytest.approx(plain.times, abs=1e-7)
    report = ph.quality(
        hammer, RATE, "1110111", strategy=own, nominal=controller.single, paper=ph.Paper(front=1e-5)
    )
    assert report.drive.times[0] == plain.times[0]
    assert (np.asarray(report.drive.times)[2:] != plain.times[2:]).all()
    assert not report.lost.any()
    # The loop runs on the paper that the drive then meets.
    places = ph.Paper(front=6e-6, seed=2).hammers(hammer, 7, 4e-4)
    (loop,) = own.along(places).loops(hammer, [slots], RATE)
    drive = loop.drive(controller.driver.edge)
    motion = simulate_pieces([places[slot] for slot in slots], drive, loop.time, own.tolerance)
    x, v = motion._pieces[-1].at(loop.time)
    assert loop.state[0] == pytest.approx(x[0], abs=1e-4 * controller.plant.stroke)
    assert loop.state[1] == pytest.approx(v[0], rel=1e-3)
