"""Waveforms against their formulas, evaluated with 40 digits."""

import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Trapezoid, Waveform

mp = mpmath.mp.clone()
mp.dps = 40

Formula = Callable[[float], mpmath.mpf]
amplitudes = st.floats(0.1, 5.0)
widths = st.floats(1e-5, 2e-3)
spans = st.floats(1e-6, 1e-3)


def half_sine(pulse: HalfSine) -> Formula:
    width = mp.mpf(pulse.width)
    return lambda tau: (
        pulse.amplitude * mp.sin(mp.pi * mp.mpf(tau) / width) if 0 <= tau < width else mp.mpf(0)
    )


def rectangle(pulse: Rectangle) -> Formula:
    rise, width, decay = mp.mpf(pulse.rise), mp.mpf(pulse.width), mp.mpf(pulse.decay)
    reached = pulse.amplitude * (1 - mp.exp(-width / rise))

    def current(tau: float) -> mpmath.mpf:
        if tau < 0 or tau >= pulse.width + 27.6310211159 * pulse.decay:
            return mp.mpf(0)
        if tau < width:
            return pulse.amplitude * (1 - mp.exp(-mp.mpf(tau) / rise))
        return reached * mp.exp(-(mp.mpf(tau) - width) / decay)

    return current


def trapezoid(pulse: Trapezoid) -> Formula:
    rise, width, fall = mp.mpf(pulse.rise), mp.mpf(pulse.width), mp.mpf(pulse.fall)
    return lambda tau: (
        pulse.amplitude
        * max(mp.mpf(0), min(mp.mpf(1), mp.mpf(tau) / rise, (rise + width + fall - mp.mpf(tau)) / fall))
    )


def agrees(pulse: Waveform, formula: Formula, size: float) -> None:
    tau = np.linspace(-0.1 * pulse.support, 1.1 * pulse.support, 101)
    expected = [float(formula(float(moment))) for moment in tau]
    np.testing.assert_allclose(pulse.value(tau), expected, rtol=0.0, atol=4e-15 * size)


@settings(max_examples=50)
@given(st.builds(HalfSine, amplitude=amplitudes, width=widths))
def test_half_sine(pulse: HalfSine) -> None:
    agrees(pulse, half_sine(pulse), pulse.amplitude)
    assert pulse.peak == pytest.approx(pulse.amplitude, rel=1e-15)


@settings(max_examples=50)
@given(st.builds(Rectangle, amplitude=amplitudes, width=widths, rise=spans, decay=spans))
def test_rectangle_with_rise_and_decay(pulse: Rectangle) -> None:
    agrees(pulse, rectangle(pulse), pulse.amplitude)
    reached = -pulse.amplitude * math.expm1(-pulse.width / pulse.rise)
    assert pulse.peak == pytest.approx(reached, rel=1e-14)


@settings(max_examples=50)
@given(st.builds(Trapezoid, amplitude=amplitudes, rise=spans, width=widths, fall=spans))
def test_trapezoid(pulse: Trapezoid) -> None:
    # Where fall is much shorter than the rest, the rounded end of the support moves the foot of the ramp.
    agrees(pulse, trapezoid(pulse), pulse.amplitude * max(1.0, pulse.support / min(pulse.rise, pulse.fall)))
    assert pulse.peak == pytest.approx(pulse.amplitude, rel=1e-15)


def test_the_decay_ends_where_a_millionth_of_a_millionth_is_left() -> None:
    assert math.exp(-27.6310211159) == pytest.approx(1e-12, rel=1e-9)


def test_a_cubic_record_of_a_monotone_parabola_has_the_harmonic_mean_slopes() -> None:
    # Fritsch and Butland's slope at the middle of y = x^2 on 0, 1, 2: harmonic mean of the secants 1 and 3.
    record = Sampled.from_samples([0.0, 1.0, 2.0], [0.0, 1.0, 4.0])
    _, _, _, slope, _, _ = record.segments()[1]
    assert slope == pytest.approx(2.0 / (1.0 / 1.0 + 1.0 / 3.0), rel=1e-15)


@given(st.floats(0.05, 0.95))
def test_two_overlapping_half_sines_peak_as_the_sum_of_sines_does(shift: float) -> None:
    # sin(u) + sin(u - p) = 2 cos(p/2) sin(u - p/2), largest at u = (pi + p)/2, inside both pulses.
    drive = PulseTrain(HalfSine(amplitude=1.0, width=1e-3), at=[0.0, shift * 1e-3])
    expected = max(1.0, 2.0 * math.cos(0.5 * math.pi * shift))
    assert drive.peak == pytest.approx(expected, rel=1e-12)


@settings(max_examples=30)
@given(st.floats(0.2, 3.0), st.integers(2, 12))
def test_a_long_train_of_rectangles_builds_up_the_geometric_sum(spacing: float, count: int) -> None:
    # The rise is sharp, so at the last firing every earlier pulse has left an exponential tail.
    decay, width, amplitude = 1e-3, 0.1e-3, 0.5
    pulse = Rectangle(amplitude=amplitude, width=width, rise=0.0, decay=decay)
    drive = PulseTrain(pulse, period=spacing * 1e-3, pulses=count)
    tails = [math.exp(-(k * spacing * 1e-3 - width) / decay) for k in range(1, count)]
    # The total is largest at the last firing, when the newest pulse starts and the tails have decayed least.
    assert drive.peak == pytest.approx(amplitude * (1.0 + sum(tails)), rel=1e-10)
