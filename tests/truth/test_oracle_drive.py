import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.oracle.drive import ReferenceDrive

from printhammer.drive.trains import PulseTrain, SineForce
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Trapezoid

SAMPLES = Sampled.from_samples([0.0, 1e-4, 1.5e-4, 4e-4], [0.0, 1.0, 0.8, 0.0])
SHAPES = {
    "half-sine": HalfSine(amplitude=1.5, width=4e-4),
    "rectangle": Rectangle(amplitude=0.93, width=3.5e-4, rise=1e-5, decay=2.4e-5),
    "sharp rectangle": Rectangle(amplitude=0.93, width=3.5e-4, rise=0.0, decay=0.0),
    "trapezoid": Trapezoid(amplitude=1.0, rise=5e-5, width=2e-4, fall=8e-5),
    "sampled": SAMPLES,
    "straight samples": Sampled.from_samples([0.0, 1e-4, 4e-4], [0.2, 1.0, 0.0], interpolation="linear"),
}


@pytest.mark.parametrize("overlap", ["add", "replace"])
@pytest.mark.parametrize("shape", list(SHAPES))
@given(st.floats(0.0, 3e-3), st.floats(0.0, 1.0))
def test_the_series_is_the_current(shape: str, overlap: str, t: float, part: float) -> None:
    drive = PulseTrain(SHAPES[shape], at=[1e-4, 3.3e-4, 1.4e-3], overlap=overlap)
    own = ReferenceDrive(drive)
    h = min(1e-5, own.next_edge(t) - t)
    value = np.polynomial.Polynomial(own.series(t, h))(part)
    # Just before the edge, which belongs to what follows.
    later = t + h * part * (1.0 - 1e-9)
    assert value == pytest.approx(float(drive.value(later)), abs=1e-8)


def test_a_sinusoidal_force() -> None:
    drive = SineForce(3.0, 120.0, 0.4)
    own = ReferenceDrive(drive)
    assert not own.is_current
    assert own.next_edge(0.0) == math.inf
    for t in (0.0, 1e-3, 0.7):
        assert own.series(t, 1.0)[0] == pytest.approx(3.0 * math.sin(240.0 * math.pi * t + 0.4), abs=1e-13)


def test_edges_are_where_the_pulse_has_them() -> None:
    own = ReferenceDrive(PulseTrain(SHAPES["rectangle"], at=[0.0, 1e-3]))
    end = 3.5e-4 + 27.6310211159 * 2.4e-5
    np.testing.assert_allclose(own.edges, [0.0, 3.5e-4, 1e-3, end, 1.35e-3, 1e-3 + end])
