"""Tests of the scalings of mass and forces, and of current and 1 / Bm, which leave the motion unchanged."""

import pytest
from studies.reconstruction.family.choice import at_gauge, scaled
from studies.reconstruction.family.family import print_forces
from studies.reconstruction.search.space import CURRENT, PRINT_FORCE

import printhammer as ph


def si(hammer: ph.Hammer) -> tuple[dict[str, float], dict[str, str]]:
    constants = hammer.constants
    return {key: c.si for key, c in constants.items()}, {key: c.si_unit for key, c in constants.items()}


@pytest.mark.parametrize(("force", "current"), [(4.0, 1.0), (1.0, 2.0), (0.25, 0.5)])
def test_the_motion_is_the_same(hammer: ph.Hammer, force: float, current: float) -> None:
    # Powers of two and four have exact roots, so that only the kernel rounds.
    other = hammer.replace(scaled(*si(hammer), force, current))
    motions = [
        ph.simulate(h, ph.PulseTrain(h.waveform, period=1.5e-3, pulses=3), duration=6e-3)
        for h in (hammer, other)
    ]
    for mine, theirs in zip(motions[0].dots, motions[1].dots, strict=True):
        assert theirs.flight_time == pytest.approx(mine.flight_time, rel=1e-9)
        assert theirs.peak_force == pytest.approx(mine.peak_force * force, rel=1e-9)
    assert motions[1].energy.coil_work == pytest.approx(force * motions[0].energy.coil_work, rel=1e-9)
    assert motions[1].drive.peak == pytest.approx(current * motions[0].drive.peak, rel=1e-12)


def test_the_gauge_is_the_print_force_and_the_current_of_the_search(hammer: ph.Hammer) -> None:
    constants, units = si(hammer)
    (force,) = print_forces([hammer]).tolist()
    brought = hammer.replace(at_gauge(constants, units, force))
    assert print_forces([brought])[0] == pytest.approx(PRINT_FORCE, rel=1e-9)
    assert brought.constants["waveform.amplitude"].si == pytest.approx(CURRENT, rel=1e-12)
