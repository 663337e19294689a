import itertools

import numpy as np
import pytest

from printhammer.claims import Context, claims, judge
from printhammer.claims.bursts import hung_up, later_impacts, spreads
from printhammer.claims.integrators import REFERENCE_TOLERANCE
from printhammer.claims.pulses import second_coil_work
from printhammer.drive.trains import PulseTrain
from printhammer.printing.dots.settling import touches


def test_the_peak_after_the_second_pulse_is_no_position_at_the_firing(context: Context) -> None:
    value = judge(context, claims()["two_pulses_660us"]).value
    x, v = (column[0] for column in context.single.at(660e-6))
    # The second pulse changes nothing before it is fired.
    assert value["position_at_firing_m"] == pytest.approx(x, abs=1e-13)
    assert value["velocity_at_firing_m_per_s"] == pytest.approx(v, abs=1e-9)
    motion = context.pulses([0.0, 660e-6], 2e-3)
    times, heights = motion.maxima
    assert value["peak_after_firing_m"] == pytest.approx(heights[times > 660e-6].max(), abs=1e-12)


def test_the_second_dot_is_compared_with_the_first(context: Context) -> None:
    value = judge(context, claims()["two_pulses_700us"]).value
    first, second = context.pulses([0.0, 700e-6], 4e-3).dots
    assert value["second_over_first_peak_force"] == pytest.approx(second.peak_force / first.peak_force)
    assert value["flight_time_gain_s"] == pytest.approx(first.flight_time - second.flight_time, abs=1e-12)
    assert value["second_excursion_complete"]


@pytest.mark.parametrize("interval", [660e-6, 700e-6])
def test_the_coil_work_of_the_second_pulse_is_that_of_its_force(context: Context, interval: float) -> None:
    motion = context.pulses([0.0, interval], interval + 4e-3)
    times = np.linspace(interval, motion.end, 200_001)
    x, v = motion.at(times)
    magnet = context.hammer.constants
    field, bias = magnet["magnet.Am"].si, magnet["magnet.F0"].si
    # Equation (3), with the current and without.
    power = (motion.forces_at(times)["magnet"] - (bias - field**2 / np.sqrt(x))) * v
    assert second_coil_work(context, interval) == pytest.approx(np.trapezoid(power, times), rel=1e-4)


@pytest.mark.parametrize("rate", [500.0, 1000.0, 1800.0])
def test_an_impact_is_distinct_if_no_other_firing_went_into_it(context: Context, rate: float) -> None:
    motion = context.train(rate, 9)
    struck = [contact.t_in for contact in motion.contacts if contact.surface == "pack"]
    firings = motion.drive.times
    between = [
        int(((firings > before) & (firings <= after)).sum()) for before, after in itertools.pairwise(struck)
    ]
    assert [distinct for _, distinct in later_impacts(motion)] == [count <= 1 for count in between]
    if rate == 500.0:
        assert all(count <= 1 for count in between)
    if rate == 1000.0:
        assert max(between) > 1


def test_the_first_dot_of_a_burst_is_that_of_a_single_pulse(context: Context) -> None:
    motion = context.train(500.0, 9)
    assert motion.dots[0].peak_force == pytest.approx(context.print_force, rel=1e-8)
    struck, force, flight = spreads(motion)
    forces = [dot.peak_force for dot in motion.dots]
    flights = [dot.flight_time for dot in motion.dots]
    assert struck == 9
    assert force == pytest.approx((max(forces) - min(forces)) * 9 / sum(forces))
    assert flight == pytest.approx(max(flights) - min(flights))


@pytest.mark.parametrize("rate", [500.0, 1500.0, 2000.0, 2500.0, 4000.0])
def test_hang_up_is_told_alike_by_steps_and_contacts(context: Context, rate: float) -> None:
    motion = context.train(rate, 9, tail=1e-3)
    left = next(c.t_out for c in motion.contacts if c.surface == "pack")
    last = motion.drive.times[-1]
    assert hung_up(motion) == (not any(left < c.t_in < last for c in touches(motion)))


def test_without_a_dot_nothing_hangs_up(context: Context) -> None:
    weak = Context(context.hammer.replace("waveform.amplitude", "0.1 A"))
    assert not hung_up(weak.train(500.0, 9))


def test_second_dot_lost_agrees_with_single_runs(context: Context) -> None:
    value = judge(context, claims()["second_dot_lost"]).value
    begins, ends = value["begins_at_rate_Hz"], value["ends_at_rate_Hz"]
    lost = {}
    for rate in (begins - 1.0, begins, ends, ends + 1.0):
        motion = context.run(PulseTrain(context.waveform, rate=rate, pulses=3), 3.0 / rate)
        peak = motion.peak_after(1)
        lost[rate] = peak is None or peak[1] < context.front
    assert list(lost.values()) == [False, True, True, False]


def test_errors_of_the_schemes_against_a_tight_run(context: Context) -> None:
    result = judge(context, claims()["integrator_comparison"])
    value = result.value
    # A hundred-fold looser reference changes nothing that is seen.
    loose = context.run(PulseTrain(context.waveform), 10e-3, tolerance=100.0 * REFERENCE_TOLERANCE)
    for scheme, name in (("trapezoid", "trapezoid_error_m"), ("runge-kutta-4", "runge_kutta_error_m")):
        motion = context.attempt(PulseTrain(context.waveform), 10e-3, scheme=scheme, step_scale=1.0)
        times = motion.step_times
        error = abs(motion.at(times)[0] - loose.at(times)[0]).max()
        assert value[name] == pytest.approx(error, rel=1e-4)
    assert value["runge_kutta_fails_at_scale"] >= 1.0
    assert "um" in result.detail
