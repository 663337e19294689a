"""List contacts in the figure of a motion: lines at their positions, bars while they are closed."""

import numpy as np
from tests.derivatives.test_lists import relay

import printhammer as ph


def test_bars_span_the_closings_of_a_contact() -> None:
    hammer = relay("linear", 3e3)
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, period=3e-3, pulses=2))
    panel = motion.plot().axes[0]
    bars = [line for line in panel.lines if line.get_gid() == "closed"]
    assert len(bars) == len(motion.closings) > 2
    # The panel shows milliseconds.
    for bar, closing in zip(bars, motion.closings, strict=True):
        end = motion.end if closing.t_out is None else closing.t_out
        np.testing.assert_allclose(bar.get_xdata(), [1e3 * closing.t_in, 1e3 * end])
    named = {line.get_gid() for line in panel.lines}
    assert {"front", "back", "pack", "backstop"} <= named
