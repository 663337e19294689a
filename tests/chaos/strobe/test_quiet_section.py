import math
from dataclasses import replace

import numpy as np
import pytest
from tests.hammers import interpreted
from tests.strobe_maps import strobe_map

import printhammer as ph
from printhammer.chaos.strobe.map import quiet_section
from printhammer.run.regime import Regime

GRAVITY, GAMMA, RESTITUTION, FREQUENCY = 9.80665, 0.8, 0.8, 50.0


def test_the_quietest_section_lies_opposite_to_the_only_impact() -> None:
    ball = ph.Hammer.build(
        1e-3,
        spring={"law": "preload", "preload": -1e-3 * GRAVITY, "stiffness": 0.0},
        backstop={"law": "rigid", "position": 0.0, "restitution": RESTITUTION},
    )
    impact = math.acos(math.pi * (1.0 - RESTITUTION) / (1.0 + RESTITUTION) / GAMMA) / (2.0 * math.pi)
    # Behind the impact the ball leaves with this speed over the table.
    up = 0.5 * GRAVITY / FREQUENCY
    lift = GAMMA * GRAVITY / (2.0 * math.pi * FREQUENCY) * math.cos(2.0 * math.pi * impact)
    regime = Regime.of(ball, drive=ph.SineForce(GAMMA * 1e-3 * GRAVITY, FREQUENCY), phase=impact)
    quiet = quiet_section(regime, np.array([0.0, up - lift]), 1, 1e-13)
    assert quiet is not None
    assert quiet[0].phase == pytest.approx((impact + 0.5) % 1.0, abs=1e-9)
    np.testing.assert_allclose(strobe_map(quiet[0], quiet[1]).state, quiet[1], atol=1e-12)
    again = quiet_section(replace(quiet[0]), quiet[1], 1, 1e-13)
    assert again is not None
    assert again[0].phase == pytest.approx(quiet[0].phase, abs=1e-9)


def test_a_motion_without_contact_is_quiet_everywhere() -> None:
    free = ph.Hammer.build(1.0, spring={"law": "preload", "preload": 0.0, "stiffness": 1.0})
    regime = Regime.of(free, drive=ph.SineForce(0.5, 0.25), phase=0.25)
    state = np.array([0.1, 0.0])
    with interpreted():
        assert quiet_section(regime, state, 1, 1e-13) == (regime, pytest.approx(state))
