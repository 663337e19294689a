"""The driver of the coil."""

import pytest
from tests import hammers

import printhammer as ph
from printhammer.control.driver import Driver, driver_of


def test_the_driver_is_as_fast_as_the_hammers_own_decay() -> None:
    hammer = hammers.crude()
    assert driver_of(hammer) == Driver(2.0, hammer.waveform.decay)
    assert driver_of(hammer, 1.5, 5e-6) == Driver(1.5, 5e-6)
    with pytest.raises(ph.InputError, match="current of the driver"):
        Driver(0.0, 1e-6)
    with pytest.raises(ph.InputError, match="edge of the driver"):
        Driver(2.0, -1e-6)
