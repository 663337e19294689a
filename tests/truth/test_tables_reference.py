"""A compensation table, verified by the independent reference: touch times and impact strength."""

import numpy as np
import pytest
from tests.hammers import crude
from tests.oracle.integrator import reference

import printhammer as ph
from printhammer.printing.dots.strategy import slot_times


@pytest.mark.slow
def test_touches_come_as_those_of_the_single_pulse() -> None:
    hammer = crude().replace({"waveform.amplitude": 1.3, "waveform.width": 200e-6})
    assert hammer.waveform is not None
    rate, slots = 1850.0, (0, 1, 2)
    table = ph.tune(hammer, rate=rate, history=2)

    def dots(drive: ph.PulseSequence | ph.PulseTrain) -> tuple[np.ndarray, np.ndarray]:
        """Return the touch times, and the largest displacement after each touch."""
        grid = np.arange(0.0, float(drive.times[-1]) + 0.4e-3, 0.5e-6)
        run = reference(hammer, drive, float(grid[-1]), times=grid, tolerance=1e-10)
        found = np.array([event.time for event in run.events if event.kind == "pack-touch"])
        late = [(grid > time) & (grid < time + 0.2e-3) for time in found]
        return found, np.array([run.x[some].max() for some in late])

    (flight,), (deep,) = dots(ph.PulseTrain(hammer.waveform))
    drive = table.drive(hammer, slots, rate)
    assert isinstance(drive, ph.PulseSequence)
    times, depths = dots(drive)
    assert len(times) == len(slots)
    assert np.abs(times - slot_times(slots, rate) - flight).max() < 0.5e-6
    # The peak force is a function of the indentation alone, equation (5).
    assert hammer.front is not None
    assert np.abs((depths - hammer.front) / (deep - hammer.front) - 1.0).max() < 1e-3

    without, _ = dots(ph.PulseTrain(hammer.waveform, at=slot_times(slots, rate).tolist()))
    assert np.abs(without - slot_times(slots, rate) - flight).max() > 20e-6
