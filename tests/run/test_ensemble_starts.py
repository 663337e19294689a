"""Ensembles whose members start later than time 0."""

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import CRUDE

import printhammer as ph

STARTS = np.array([120e-6, 200e-6, 490e-6, 640e-6])


@pytest.mark.parametrize("engine", ["plain", "lanes"])
def test_a_run_can_be_taken_up_where_another_one_passed(engine: str) -> None:
    """Also during a pulse, in free flight and at the edge of the backstop."""
    hammer = ph.load(CRUDE)
    drive = ph.PulseTrain(hammer.waveform)
    whole = ph.simulate(hammer, drive, duration=1.2e-3)
    times = [np.linspace(start, start + 300e-6, 61) for start in STARTS]
    states = np.stack(whole.at(STARTS), axis=1)
    parts = ph.Ensemble(hammer, drive, STARTS + 300e-6, states=states, starts=STARTS)
    found = parts.run(strobes=times, engine=engine)
    assert found.ok.all()
    stroke = hammer.front - hammer.position
    for row, moments in enumerate(times):
        assert np.abs(found.strobes.x[row] - whole.at(moments)[0]).max() < 1e-9 * stroke


def test_starts_are_checked() -> None:
    """An invalid start raises an error of one sentence."""
    hammer = ph.load(CRUDE)
    drive = ph.PulseTrain(hammer.waveform)
    for starts in (-1e-6, 2e-3, np.nan):
        with refused("starts"):
            ph.Ensemble(hammer, drive, 1e-3, starts=starts)
    with refused("ends"):
        ph.Ensemble(hammer, drive, [1e-3, 2e-3], starts=[0.0, 0.0, 0.0])
    with refused("start"):
        ph.Ensemble(hammer, drive, 1e-3, starts=1e-4).motion(0)
