"""Regularised time of a backstop contact in which the armature nearly leaves and is turned back."""

import numpy as np
import pytest
from tests.hammers import crude

import printhammer as ph
from printhammer.hammer.equilibrium import rest_state
from printhammer.kernel.model.modes import ANY_SCALES
from printhammer.run.problem import Problem


@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.3, 0.6, 0.9])
@pytest.mark.parametrize("depth", [1e-10, 4e-9, 1e-7])
def test_a_time_leads_to_the_length_that_led_to_it(depth: float, share: float) -> None:
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform, start=1.0)
    problem = Problem(hammer, drive, (rest_state(hammer), 0.0), 0.0, 2e-11)
    of, live, constants = problem.kernel.namespace, problem.drive_arrays()[-1], problem.constants
    w = np.sqrt(depth)
    kv_at_rest = of["contact_rate"](w, 0.0, 0.0, constants, live)
    assert kv_at_rest < 0.0
    # A constant acceleration would stop it at a share of the way out.
    v = np.sqrt(share * -kv_at_rest * w)
    kv = of["contact_rate"](w, v, 0.0, constants, live)
    for length in np.array([0.1, 0.5, 1.0, 1.5, 2.0, 2.5]) * np.sqrt(w / -kv):
        t = of["contact_step"](0.0, w, v, kv, float(length), constants, live, ANY_SCALES)[0]
        found = of["s_at"](t, 0.0, w, v, kv, constants, live)
        assert found == pytest.approx(length, rel=1e-9)
