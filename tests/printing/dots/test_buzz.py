"""The search for buzz printing, verified from the contacts of the train that it returns."""

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.printing.dots import buzz as module
from printhammer.printing.dots.buzz import BuzzTrain, delayed_train, find_buzz_train, longest_run


def single_force(hammer: "ph.Hammer") -> float:
    return ph.simulate(hammer, ph.PulseTrain(hammer.waveform), points=2).dots[0].peak_force


def assert_it_prints(hammer: "ph.Hammer", train: BuzzTrain) -> None:
    """Evaluate the claim from the contacts of a finer run, without the functions of the search."""
    drive = ph.PulseTrain(hammer.waveform, at=train.times)
    motion = ph.simulate(hammer, drive, tolerance=1e-10, points=2)
    pack = [c for c in motion.contacts if c.surface == "pack"]
    touches = [c.t_in for c in motion.contacts if c.surface == "backstop" and not c.initial]
    counted = [next(c for c in pack if c.firing == train.first + k) for k in range(train.count)]
    assert len(counted) >= 6
    assert not [t for t in touches if counted[0].t_in < t < counted[-1].t_in]
    relative = np.array([c.peak_force for c in counted]) / single_force(hammer)
    assert relative.min() >= 0.3
    assert relative.max() <= 0.95
    np.testing.assert_allclose(relative, train.forces, rtol=1e-3)
    time = np.linspace(0.0, train.times[-1] + hammer.waveform.support, 100_001)
    assert drive.value(time).max() <= 2.0
    assert drive.waveform == hammer.waveform
    if train.clear:
        assert not [t for t in touches if pack[0].t_in < t < counted[-1].t_in]
    if train.kind == "uniform":
        np.testing.assert_allclose(np.diff(train.times), train.interval, rtol=1e-9)
    else:
        leavings = [next(c.t_out for c in pack if c.firing == k) for k in range(len(train.times) - 1)]
        np.testing.assert_allclose(np.array(train.times[1:]) - leavings, train.interval, atol=1e-9)


def test_a_heavier_hammer_prints_so_under_an_even_train(hammer: "ph.Hammer") -> None:
    heavier = hammer.replace("mass", 1.5 * hammer.mass)
    found = find_buzz_train(heavier)
    assert found.train is not None
    assert found.train.kind == "uniform"
    assert found.train == found.best
    assert found.reason == ""
    assert found.reference_force == pytest.approx(single_force(heavier), rel=1e-9)
    assert_it_prints(heavier, found.train)


@pytest.mark.slow
def test_the_shipped_hammer(hammer: "ph.Hammer") -> None:
    found = find_buzz_train(hammer)
    if found.train is None:
        assert found.reason
        assert found.best is None or found.best.count < 6
    else:
        assert_it_prints(hammer, found.train)
    assert found == find_buzz_train(hammer)


def test_an_armature_that_is_back_at_once_has_delays_to_try(hammer: "ph.Hammer") -> None:
    search = module._Search(hammer, 9, 6, module.FORCES, module.MAX_CURRENT)
    search.back = search.leaving + 1e-6
    assert search.result().tried >= module._PERIODS + 2


def test_delayed_pulses_follow_the_leaving_of_the_pack(hammer: "ph.Hammer") -> None:
    times = delayed_train(hammer, 12e-6, 4)
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=times), points=2)
    leavings = [c.t_out for c in motion.contacts if c.surface == "pack"]
    np.testing.assert_allclose(np.array(times[1:]) - leavings[:3], 12e-6, atol=1e-10)


def test_no_dot_ends_a_delayed_train(hammer: "ph.Hammer") -> None:
    weak = hammer.replace("waveform.amplitude", "0.1 A")
    assert delayed_train(weak, 1e-5) == (0.0,)


def test_a_touch_of_the_backstop_ends_a_run(hammer: "ph.Hammer") -> None:
    # At 500 Hz every dot is a single one, at its full force, with a settle-out before the next.
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate=500.0, pulses=3), points=2)
    force = single_force(hammer)
    assert longest_run(motion, force).forces == ()
    run = longest_run(motion, force, (0.9, 1.1))
    assert (run.first, len(run.forces), run.clear) == (0, 1, True)


def test_without_a_dot_of_a_single_pulse_there_is_a_reason(hammer: "ph.Hammer") -> None:
    found = find_buzz_train(hammer.replace("waveform.amplitude", "0.1 A"))
    assert found.train is None
    assert found.best is None
    assert "single pulse makes no dot" in found.reason


@pytest.mark.parametrize("part", ["pack", "waveform"])
def test_a_missing_part_is_named(hammer: "ph.Hammer", part: str) -> None:
    with refused(part):
        find_buzz_train(hammer.replace(part, None))


def test_a_train_shorter_than_what_must_count_is_refused(hammer: "ph.Hammer") -> None:
    with refused("pulses"):
        find_buzz_train(hammer, pulses=5)
