"""The driver of the coil."""

import numpy as np
import pytest
from tests import hammers
from tests.errors import refused

import printhammer as ph
from printhammer.control.feedback.plant import BoundedSequence, Driver, driver_of
from printhammer.drive.waveforms.shapes import Switched


def test_the_driver_is_as_fast_as_the_hammers_own_decay() -> None:
    hammer = hammers.crude()
    assert driver_of(hammer) == Driver(2.0, hammer.waveform.decay)
    assert driver_of(hammer, 1.5, 5e-6) == Driver(1.5, 5e-6)
    with refused("current of the driver"):
        Driver(0.0, 1e-6)
    with refused("edge of the driver"):
        Driver(2.0, -1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_stated_bound_is_that_of_its_own_drive_in_any_company(order: tuple[int, int]) -> None:
    """The bound sets the scale of the errors; the same pulses without the bound have another scale."""
    pulse = Switched(at=(0.0, 2e-4), levels=(1.0, 0.0), edge=3e-5)
    drives = [ph.PulseSequence([pulse], at=[0.0]), BoundedSequence([pulse], [0.0], 40.0)]

    def run(*some: ph.PulseSequence) -> np.ndarray:
        ensemble = ph.Ensemble(hammers.crude(), list(some), 1e-3, tolerance=1e-6)
        return ensemble.run(strobes=[np.linspace(1e-4, 1e-3, 10)] * len(some)).strobes.x

    alone = [run(drive)[0] for drive in drives]
    assert not np.array_equal(alone[0], alone[1])
    together = run(*(drives[k] for k in order))
    for row, k in enumerate(order):
        np.testing.assert_array_equal(together[row], alone[k])
