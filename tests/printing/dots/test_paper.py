"""Paper that varies along the line: statistics as stated, no effect without variation, effect on each dot."""

from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import crude

import printhammer as ph
from printhammer.printing.dots.paper import simulate_pieces
from printhammer.printing.dots.strategy import slots_of

PITCH = 4e-4


def test_it_varies_and_is_correlated_as_stated() -> None:
    off = ph.Paper(length=2e-3, seed=3).deviations(20_000, PITCH)
    assert off.shape == (2, 20_000)
    assert off.std(axis=1) == pytest.approx([1.0, 1.0], abs=0.05)
    assert abs(np.corrcoef(off)[0, 1]) < 0.05
    for row in off:
        for apart in (1, 5):
            kept = np.corrcoef(row[:-apart], row[apart:])[0, 1]
            assert kept == pytest.approx(np.exp(-apart * PITCH / 2e-3), abs=0.05)
    alone = ph.Paper(length=0.0).deviations(20_000, PITCH)[0]
    assert abs(np.corrcoef(alone[:-1], alone[1:])[0, 1]) < 0.03


def test_the_hammer_is_another_at_each_slot() -> None:
    paper, hammer = ph.Paper(stiffness=0.1, front=5e-6, seed=1), crude()
    places = paper.hammers(hammer, 4, PITCH)
    assert hammer.front is not None
    for place, (stiffness, front) in zip(places, paper.deviations(4, PITCH).T.tolist(), strict=True):
        own = hammer.constants["pack.stiffness"].si
        assert place.constants["pack.stiffness"].si == pytest.approx(own * (1.0 + 0.1 * stiffness))
        assert place.front == pytest.approx(hammer.front + 5e-6 * front)
        assert place.platen == hammer.platen
    assert ph.Paper(stiffness=0.0, front=0.0).hammers(hammer, 3, PITCH) == (hammer,) * 3


@pytest.mark.parametrize("rate", [900.0, 1400.0])
def test_even_paper_in_pieces_is_the_run_as_a_whole(rate: float) -> None:
    hammer = crude()
    plain = ph.quality(hammer, rate, "110111011")
    even = ph.quality(hammer, rate, "110111011", paper=ph.Paper(stiffness=0.0, front=0.0))
    assert even.force == pytest.approx(plain.force, rel=1e-6)
    assert even.arrival_deviation == pytest.approx(plain.arrival_deviation, abs=1e-10)
    assert (even.extra_contacts == plain.extra_contacts).all()
    assert even.wear.touches == plain.wear.touches
    assert even.wear.impulse == pytest.approx(plain.wear.impulse, rel=1e-6)
    assert even.energy.coil_work == pytest.approx(plain.energy.coil_work, rel=1e-6)
    assert abs(even.energy.residual) < 1e-7 * even.energy.throughput
    assert even.status == plain.status == "ok"


def test_each_dot_meets_the_pack_of_its_slot() -> None:
    hammer, rate = crude(), 200.0  # Each dot comes from rest
    paper = ph.Paper(stiffness=0.1, front=5e-6, seed=2)
    report = ph.quality(hammer, rate, "11011", paper=paper)
    places = paper.hammers(hammer, 5, report.pitch)
    for force, arrival, slot in zip(
        report.force, report.arrival_deviation, slots_of(report.wanted), strict=True
    ):
        (dot,) = ph.simulate(places[slot], ph.PulseTrain(hammer.waveform)).dots
        assert force == pytest.approx(dot.peak_force, rel=1e-4)
        assert arrival == pytest.approx((dot.flight_time or 0.0) - report.nominal.flight_time, abs=1e-8)
    assert np.ptp(report.force) > 0.01 * report.nominal.force


def test_a_nearer_pack_is_not_laid_around_the_armature() -> None:
    """If the next pack would already be indented, the change waits until the armature is outside both."""
    hammer = crude()
    assert hammer.front is not None
    near = hammer.replace({"pack.front": hammer.front - 30e-6}, source="test")
    plain = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
    contact = next(each for each in plain.contacts if each.surface == "pack")
    drive = ph.PulseTrain(hammer.waveform, at=[0.0, contact.t_peak])
    motion = simulate_pieces([hammer, near], drive, 3e-3, 1e-9)
    assert motion.ok
    first = next(each for each in motion.contacts if each.surface == "pack")
    assert first.t_out is not None
    assert first.t_out > contact.t_peak
    assert first.peak_force == pytest.approx(contact.peak_force, rel=1e-6)
    assert motion.dots[0].extra_contacts == 0


def test_a_run_that_ends_early_says_so() -> None:
    hammer = crude()
    strong = hammer.replace("waveform.amplitude", "60 A")
    drive = ph.PulseTrain(strong.waveform, rate=900.0, pulses=3)
    motion = simulate_pieces([hammer] * 3, drive, 6e-3, 1e-9)
    whole = ph.simulate(hammer, drive, duration=6e-3)
    assert motion.status == whole.status != "ok"
    assert not motion.ok
    assert motion.end == pytest.approx(whole.end, abs=1e-8)


def test_a_paper_file_has_units(tmp_path: Path) -> None:
    path = tmp_path / "paper.toml"
    path.write_text('stiffness = "5 %"\nfront = "0.1 mil"\nlength = "2 mm"\nseed = 4\n')
    paper = ph.Paper.load(path)
    assert (paper.stiffness, paper.length, paper.seed) == (0.05, 2e-3, 4)
    assert paper.front == pytest.approx(2.54e-6)
    assert "stiffness 5 %" in paper.text
    path.write_text("")
    assert ph.Paper.load(path) == ph.Paper()


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('front = "3 s"', "front"),
        ("front = -1e-6", "front"),
        ('stiffness = "50 %"', "stiffness"),
        ("seed = 1.5", "seed"),
        ("moisture = 3", "moisture"),
        ("front = ", None),
    ],
)
def test_a_bad_paper_file_is_refused(tmp_path: Path, text: str, key: str | None) -> None:
    path = tmp_path / "paper.toml"
    path.write_text(text)
    with refused(key):
        ph.Paper.load(path)


def test_hammers_on_which_paper_cannot_vary_are_refused() -> None:
    with refused("pack.stiffness"):
        ph.Paper().hammers(crude().replace("pack", None), 3, PITCH)
    drive = ph.PulseTrain(crude().waveform, rate=900.0, pulses=3)
    with refused("hammers"):
        simulate_pieces([crude()] * 2, drive, 5e-3, 1e-9)
