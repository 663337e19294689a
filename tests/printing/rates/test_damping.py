import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.errors import refused
from tests.hammers import made_of, preload

import printhammer as ph
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.settling import settle
from printhammer.printing.rates.damping import DampingStudy, Material, damping_study, materials, tuned
from printhammer.run.effort import Effort

GRID = {"first": 400.0, "last": 1200.0, "step": 400.0, "limits": Limits(force=0.2, arrival=80e-6)}


@pytest.fixture(scope="module")
def found(hammer: "ph.Hammer") -> DampingStudy:
    """Hard backstops only, so that no other laws are compiled."""
    tried = [
        Material("as it is", "as it is", {}),
        Material("hard", "less", {"backstop.damping": 0.5 * hammer.backstop.l}),
        Material("hard", "more", {"backstop.damping": 4.0 * hammer.backstop.l}),
        Material("pack", "a wall of air", {"pack.stiffness": 1e-6}),
        Material("hard", "nothing", {"backstop.stiffness": -1.0}),
    ]
    return damping_study(hammer, tried, **GRID)


def test_the_print_force_is_kept(hammer: "ph.Hammer", found: DampingStudy) -> None:
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=4e-3).dots[0]
    np.testing.assert_allclose(found.force[:3], single.peak_force, rtol=1e-6)
    assert found.amplitude[0] == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(found.peak_current[:3], found.amplitude[:3] * hammer.waveform.peak, rtol=1e-12)


def test_more_damping_settles_sooner(found: DampingStudy) -> None:
    assert found.restitution[2] < found.restitution[0] < found.restitution[1]
    assert found.settle_out[2] < found.settle_out[1]
    assert found.rebounds[2] <= found.rebounds[0] <= found.rebounds[1]
    # From rest to rest the backstop takes what the pack leaves, which keeps as much at the same force.
    rest = found.coil_work[:3] - found.nominal.pack_loss
    np.testing.assert_allclose(found.loss[:3], rest, rtol=1e-4)
    assert found.impulse[2] < found.impulse[1]


def test_what_cannot_print_so_hard_is_told(found: DampingStudy) -> None:
    assert found.status.tolist()[3:] == ["force not reached", "no hammer"]
    for number in (3, 4):
        assert math.isnan(found.safe_rate[number])
        assert math.isnan(found.settle_out[number])


def test_the_best_is_within_the_current_limit(hammer: "ph.Hammer", found: DampingStudy) -> None:
    peak = hammer.waveform.peak
    tight = damping_study(hammer, found.materials[:1], current=0.99 * peak, **GRID)
    assert tight.status.tolist() == ["current limit"]
    assert tight.best is None
    np.testing.assert_array_equal(tight.safe_rate, found.safe_rate[:1])
    loose = damping_study(hammer, found.materials[:1], current=1.01 * peak, **GRID)
    assert loose.status.tolist() == ["ok"]
    assert loose.best == 0


def test_a_dataset_holds_everything(found: DampingStudy, tmp_path: Path) -> None:
    for name in ("study.nc", "study.json", "study.csv"):
        found.save(tmp_path / name)
    with xr.open_dataset(tmp_path / "study.nc", engine="scipy") as chart:
        np.testing.assert_array_equal(chart["settle_out"], found.settle_out)
        assert chart["loss"].attrs["units"] == "J"


def test_amplitudes_are_those_at_which_the_force_is_reached(hammer: "ph.Hammer") -> None:
    target = 1.1 * nominal(hammer).force
    (factor,) = tuned([hammer], target, Effort(1e-9))
    pulse = hammer.waveform.scaled(float(factor))
    dot = ph.simulate(hammer, ph.PulseTrain(pulse), duration=4e-3).dots[0]
    assert dot.peak_force == pytest.approx(target, rel=1e-6)
    assert np.isnan(tuned([hammer], 1e3 * target, Effort(1e-7))).all()
    assert tuned([], target, Effort(1e-7)).size == 0


def test_the_default_materials_change_one_thing_each(hammer: "ph.Hammer") -> None:
    single = nominal(hammer)
    found = materials(hammer, single)
    assert {one.kind for one in found} == {"as it is", "hard", "elastomer", "pack"}
    for one in found:
        other = hammer.replace(one.changes) if one.changes else hammer
        assert other.magnet == hammer.magnet
        assert other.position == hammer.position
        assert other.front == hammer.front
        assert (other.backstop == hammer.backstop) or (other.pack == hammer.pack)
    assert len({one.label for one in found}) == len(found)
    # A spring that takes the work of the dot is pressed as hard as the dot was.
    spring = next(one.changes["pack"] for one in found if "dashpot" in one.label)
    assert math.sqrt(2.0 * spring.stiffness * single.loading_work) == pytest.approx(single.force, rel=1e-12)


def test_settling_ends_within_a_hundredth_of_the_stroke(hammer: "ph.Hammer") -> None:
    found = settle(hammer)
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=20e-3, points=2)
    stroke = motion.peak_after(0)[1] - hammer.position
    away = np.abs(motion.at(found.settle_out + np.linspace(1e-9, 15e-3, 20_001))[0] - ph.rest_state(hammer))
    assert away.max() <= 0.01 * stroke * (1.0 + 1e-9)
    before = abs(motion.at(found.settle_out - 1e-8)[0][0] - ph.rest_state(hammer))
    assert before > 0.01 * stroke


def test_a_hammer_that_cannot_be_studied_is_refused(hammer: "ph.Hammer") -> None:
    with refused("backstop"):
        damping_study(hammer.replace("backstop", None))
    with refused("backstop"):
        settle(made_of(spring=preload(-1.0)))
    with refused("kind"):
        Material("soft", "soft", {})
    with refused("others"):
        damping_study(hammer, [])
    with refused("current"):
        damping_study(hammer, current=0.0)
