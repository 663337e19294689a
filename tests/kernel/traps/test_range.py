"""A run ends exactly where a force law ends, with a status, however short the excursion beyond."""

import math
from pathlib import Path

import numpy as np
import pytest
from tests import hammers
from tests.hammers import MASS, STROKE

import printhammer as ph
from printhammer.drive.waveforms.shapes import Trapezoid


def test_the_end_of_the_range_of_a_fit_is_met() -> None:
    """A law valid up to 250 um: the run ends there, inside the pack, and no output lies beyond."""
    hammer = hammers.crude().replace({"magnet.range_min": 30e-6, "magnet.range_max": 250e-6})
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), times=np.linspace(0.0, 4e-3, 4001))
    assert motion.status == "range left"
    assert not motion.ok
    assert motion.x.max() <= 250e-6
    assert motion.at(motion.end)[0][0] == pytest.approx(250e-6, rel=1e-9)
    full = ph.simulate(hammers.crude(), ph.PulseTrain(hammer.waveform), times=motion.t)
    np.testing.assert_allclose(motion.x, full.x, rtol=0.0, atol=1e-9 * STROKE)
    assert full.at(motion.end + 1e-7)[0][0] > 250e-6


@pytest.mark.slow
@pytest.mark.parametrize("over", [1e-7, 1e-9, 1e-11])
def test_a_short_visit_beyond_the_range_is_not_overlooked(over: float) -> None:
    """The flight leaves the range and returns within one step."""
    pull, speed = 1e4, 1.0
    hammer = hammers.made_of(
        magnet=hammers.MAGNETS["inverse-root"].model_copy(
            update={"range_max": 150e-6, "Bm": 0.0, "Am": 1e-9}
        ),
        spring=hammers.preload(-pull * MASS - 2.47),
    )
    start = 150e-6 - speed**2 / (2.0 * pull)
    inside = ph.simulate(hammer, hammers.idle("current"), duration=1.6e-4, state=(start - over, speed))
    outside = ph.simulate(hammer, hammers.idle("current"), duration=1.6e-4, state=(start + over, speed))
    assert inside.status == "ok"
    assert outside.status == "range left"
    assert outside.end == pytest.approx((speed - math.sqrt(2.0 * pull * over)) / pull, rel=1e-6)


def test_a_current_outside_a_table_is_a_status(tmp_path: Path) -> None:
    """Outside its currents a table is NaN: the run ends at once with a status."""
    hammer = hammers.made_of(
        magnet=hammers.magnet_table(tmp_path),
        spring=hammers.SPRINGS["linear"],
        pack=hammers.PACKS["dashpot"],
        backstop=hammers.rigid(0.6),
    )
    rise = Trapezoid(amplitude=8.0, rise=1e-3, width=1e-3, fall=1e-4)
    with hammers.interpreted():
        motion = ph.simulate(hammer, ph.PulseTrain(rise), duration=4e-3)
        assert np.isfinite(motion.x).all()
    assert motion.status in {"range left", "step underflow"}
    assert motion.end <= 3.5 / 8.0 * 1e-3 * (1.0 + 1e-3)
    assert motion.end >= 3.5 / 8.0 * 1e-3 * (1.0 - 2e-2)
