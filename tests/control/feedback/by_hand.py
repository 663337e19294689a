"""Comparisons with invented numbers. Helpers only."""

import numpy as np

import printhammer as ph
from printhammer.control.feedback.comparison import BURST, Feedback, ObservedRun
from printhammer.control.feedback.plant import driver_of
from printhammer.control.feedback.sensor import PositionSensor
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal


def by_hand(hammer: ph.Hammer) -> Feedback:
    """A comparison with invented numbers, and a run without feedback."""
    assert hammer.waveform is not None
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
    times = np.linspace(0.0, 1e-4, 5)
    force = np.linspace(-0.1, 0.1, 32).reshape(2, 2, 8)
    force[0, 0, 3] = np.nan
    return Feedback(
        hammer=hammer,
        driven=hammer,
        driver=driver_of(hammer),
        sensor=PositionSensor(),
        limits=Limits(),
        single=nominal(hammer),
        rate=1e3,
        strategies=("open loop", "feedback"),
        passed=np.array([[True, False], [True, True]]),
        force=force,
        arrival=1e-5 * force,
        lost=np.array([1, 0]),
        extra_contacts=np.array([2, 0]),
        peak_current=np.array([1.5, 2.0]),
        gaps=np.array([6e-4, 1e-3, 2e-3]),
        gap_force=force[:, 0, :3],
        gap_arrival=1e-5 * force[:, 1, :3],
        run=ObservedRun(BURST, motion, times, motion.at(times)[0], np.array([5e-4])),
        tolerance=1e-6,
    )
