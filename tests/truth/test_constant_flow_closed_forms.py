"""Derivatives of motions with respect to constants: closed forms, and dimensional analysis."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import hammers
from tests.constant_maps import constant_map
from tests.hammers import FRONT, MASS, STOP, THICKNESS, Draw, crude, idle, interpreted, made_of
from tests.tangents import SHARP
from tests.truth import oracles

import printhammer as ph
from printhammer.derivatives.dots import DOT_QUANTITIES
from printhammer.derivatives.flow import flow, rest_columns
from printhammer.derivatives.parameters import parameters
from printhammer.derivatives.states import tangent_map
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.run.problem import Problem

CLOSE = 1e-9
AREA = 259.0
"""Stiffness of the pack, N."""


def changes(
    hammer: ph.Hammer, drive: object, end: float, state: tuple[float, float], names: list[str]
) -> np.ndarray:
    """Derivatives of displacement and velocity at the end, one column per constant; interpreted Python."""
    with interpreted():
        found = constant_map(hammer, drive, 0.0, end, names, state=state, tolerance=SHARP)
    assert found.ok
    assert found.smooth
    return found.matrix


def test_a_harmonic_oscillator() -> None:
    """x = P/K + (x0 - P/K) cos(r t) + v0/r sin(r t), r^2 = K/m."""
    stiffness, push, t, x0, v0 = 3e4, 1.5, 0.7e-3, 1e-4, 0.1
    hammer = made_of(spring=hammers.preload(push, stiffness), pack=hammers.power())
    rate = math.sqrt(stiffness / MASS)
    c, s = math.cos(rate * t), math.sin(rate * t)
    away = x0 - push / stiffness
    by_rate = np.array(
        [
            -away * t * s + v0 * (t * c / rate - s / rate**2),
            -away * (s + rate * t * c) - v0 * t * s,
        ]
    )
    by_rest = np.array([1.0 - c, rate * s])
    exact = np.array(
        [
            by_rest / stiffness,
            -by_rest * push / stiffness**2 + by_rate * 0.5 * rate / stiffness,
            -by_rate * 0.5 * rate / MASS,
            [0.0, 0.0],
        ]
    ).T
    names = ["spring.preload", "spring.stiffness", "mass", "pack.thickness"]
    found = changes(hammer, idle(), t, (x0, v0), names)
    assert not found[:, 3].any()
    scales = np.array([push, stiffness, MASS, THICKNESS]) / np.array([[x0], [x0 * rate]])
    np.testing.assert_allclose(found * scales, exact * scales, rtol=0.0, atol=CLOSE)


def test_one_sharp_pulse_on_a_free_mass() -> None:
    """After it v = F w / m, x = x0 + F w (t - t0 - w/2) / m: both edges move with the firing time."""
    push, width, fired, t = 3.0, 0.2e-3, 0.05e-3, 0.4e-3
    hammer = made_of(pack=hammers.power(front=1.0))
    drive = ph.PulseTrain(
        Rectangle(amplitude=push, width=width, rise=0.0, decay=0.0, quantity="force"), at=[fired]
    )
    rest = t - fired - width
    exact = {
        "waveform.amplitude": (width * (rest + 0.5 * width) / MASS, width / MASS),
        "waveform.width": (push * rest / MASS, push / MASS),
        "firing.0": (-push * width / MASS, 0.0),
        "mass": (-push * width * (rest + 0.5 * width) / MASS**2, -push * width / MASS**2),
    }
    found = changes(hammer, drive, t, (0.0, 0.0), list(exact))
    for column, (name, wanted) in zip(found.T, exact.items(), strict=True):
        size = max(abs(number) for number in wanted)
        assert column == pytest.approx(wanted, rel=CLOSE, abs=1e-12 * size), name


def test_a_pulse_that_replaces_another() -> None:
    """A pulse cut off at t1 leaves F t1; a cut later by dt1 adds F dt1."""
    push, second, t = 3.0, 0.15e-3, 0.5e-3
    hammer = made_of(pack=hammers.power(front=1.0))
    waveform = Rectangle(amplitude=push, width=0.2e-3, rise=0.0, decay=0.0, quantity="force")
    drive = ph.PulseTrain(waveform, period=second, pulses=2, overlap="replace")
    found = changes(hammer, drive, t, (0.0, 0.0), ["period"])
    # It acts from 0 to t1 + w without a pause.
    assert found[:, 0] == pytest.approx([push / MASS * (t - second - 0.2e-3), push / MASS], rel=CLOSE)


@pytest.mark.parametrize("restitution", [0.3, 0.8])
def test_one_bounce_on_a_rigid_stop(restitution: float) -> None:
    """Under a pull g: x = b + e u s - g/2 s^2, s = t - t1, t1 = (v0 + u)/g, u = sqrt(v0^2 + 2 g (x0 - b))."""
    e, force, height, speed, t = restitution, 4.0, 1e-4, 0.3, 0.22e-3
    pull = force / MASS
    hammer = made_of(spring=hammers.preload(-force), pack=hammers.power(), backstop=hammers.rigid(e))
    u = math.sqrt(speed**2 + 2.0 * pull * height)
    t1 = (speed + u) / pull
    left = t - t1
    assert 0.0 < left < 2.0 * e * u / pull
    out = e * u - pull * left
    du_b = -pull / u
    by_position = [1.0 + e * du_b * left - out * du_b / pull, e * du_b + du_b]
    du_g = height / u
    dt_g = du_g / pull - t1 / pull
    by_pull = [e * du_g * left - out * dt_g - 0.5 * left**2, e * du_g - left + pull * dt_g]
    exact = np.array([[u * left, u], by_position, [-number / MASS for number in by_pull]]).T
    names = ["backstop.restitution", "backstop.position", "spring.preload"]
    found = changes(hammer, idle(), t, (STOP + height, speed), names)
    scales = np.array([1.0, height, force]) / np.array([[height], [u]])
    np.testing.assert_allclose(found * scales, exact * scales, rtol=0.0, atol=CLOSE)


def test_the_undamped_hertz_backstop_alone() -> None:
    """The contact lasts T = C (m/k)^0.4 v^-0.2, after it x = 2 b - x0 + v (t - T)."""
    speed, height, t, stiffness = 0.8, 40e-6, 0.2e-3, 1.156e9
    hammer = made_of(backstop=hammers.hertz(stiffness), pack=hammers.power())
    lasts = oracles.hertz_duration(MASS, stiffness, speed)
    assert height / speed + lasts < t
    exact = np.array([[2.0, 0.4 * speed * lasts / stiffness, -0.4 * speed * lasts / MASS], [0.0, 0.0, 0.0]])
    names = ["backstop.position", "backstop.stiffness", "mass"]
    found = changes(hammer, idle(), t, (STOP + height, -speed), names)
    scales = np.array([height, stiffness, MASS]) / np.array([[height], [speed]])
    np.testing.assert_allclose(found * scales, exact * scales, rtol=0.0, atol=CLOSE)


def test_the_damped_backstop_alone() -> None:
    """With z = l v/k and z - ln(1 + z) = -(y + ln(1 - y)): v_out = k y(z) / l, at any mass."""
    speed, stiffness, damping = 0.8, 1.156e9, 4.175e8
    hammer = made_of(backstop=hammers.hertz(stiffness, damping), pack=hammers.power())
    z = damping / stiffness * speed
    y = oracles.backstop_speed_ratio(z) * z
    slope = z * (1.0 - y) / (y * (1.0 + z))
    by_damping = speed * slope / damping - stiffness * y / damping**2
    exact = [by_damping, -by_damping * damping / stiffness, 0.0, 0.0]
    names = ["backstop.damping", "backstop.stiffness", "mass", "backstop.position"]
    found = changes(hammer, idle(), 0.2e-3, (STOP + 40e-6, -speed), names)[1]
    scales = np.array([damping, stiffness, MASS, 40e-6]) / speed
    np.testing.assert_allclose(found * scales, exact * scales, rtol=0.0, atol=CLOSE)


def test_the_pack_alone() -> None:
    """rmax^3.7 = 3.7 m v^2 / (2 S d): indentation, force, times and loss are powers of the constants."""
    speed, distance = 1.5, 30e-6
    hammer = made_of(pack=hammers.power(AREA), backstop=hammers.rigid(0.5))
    with interpreted():
        found = ph.sensitivities(
            hammer, idle(), state=(FRONT - distance, speed), duration=0.3e-3, tolerance=SHARP
        )
    exact = oracles.pack_rebound(MASS, AREA, THICKNESS, speed)
    part = 1.0 / 3.7
    powers = {
        # mass, stiffness, thickness
        "flight_time": (0.0, 0.0, 0.0),
        "impact_speed": (0.0, 0.0, 0.0),
        "peak_force": (2.7 * part, part, -2.7 * part),
        "indentation": (part, -part, 1.0 - part),
        "contact_time": (part, -part, 1.0 - part),
        "loading_work": (1.0, 0.0, 0.0),
        "net_loss": (1.0, 0.0, 0.0),
    }
    columns = [found.constants.index(name) for name in ("mass", "pack.stiffness", "pack.thickness")]
    for name, wanted in powers.items():
        row = found.logarithmic[0, found.quantities.index(name)]
        assert row[columns] == pytest.approx(wanted, rel=0.0, abs=CLOSE), name
    front = found.constants.index("pack.front")
    by_front = dict(zip(found.quantities, found.derivatives[0, :, front], strict=True))
    assert by_front["flight_time"] == pytest.approx(1.0 / speed, rel=CLOSE)
    for name in ("impact_speed", "peak_force", "indentation", "contact_time", "net_loss"):
        value = found.dots[0, found.quantities.index(name)]
        assert by_front[name] * distance / value == pytest.approx(0.0, abs=CLOSE)
    loss = 0.5 * MASS * (speed**2 - exact.speed_out**2)
    assert found.run[found.run_quantities.index("pack_loss")] == pytest.approx(loss, rel=CLOSE)


def test_the_change_of_the_rest_state() -> None:
    """A run from rest in the backstop begins at b - (F/k)^(2/3); without a drive it stays there."""
    force, stiffness = 4.0, 1.156e9
    hammer = hammers.shelf(-force)
    depth = (force / stiffness) ** (2.0 / 3.0)
    exact = {
        "spring.preload": 2.0 / 3.0 * depth / force,
        "backstop.stiffness": 2.0 / 3.0 * depth / stiffness,
        "backstop.position": 1.0,
        "mass": 0.0,
    }
    with interpreted():
        found = ph.sensitivities(hammer, idle(), constants=list(exact), duration=1e-3)
        assert found.lost == (0,)
        assert np.isnan(found.derivatives).all()
        problem = Problem(hammer, idle(), (ph.rest_state(hammer), 0.0), 0.0, SHARP)
        wanted = parameters(hammer, idle(), list(exact))
        begin = rest_columns(problem, wanted)
        marks = np.array([0.0, 1e-5, 1e-3])
        seen = flow(problem, problem.run(1e-3), wanted, marks, begin).changes
    scales = np.array([parameter.scale for parameter in wanted])
    for row in seen:
        assert row[0] == pytest.approx(np.array(list(exact.values())) * scales, rel=0.0, abs=CLOSE * depth)
        assert np.abs(row[1]).max() < 1e-9


UNITS = {
    "kg": (1, 0, 0, 0),
    "m": (0, 1, 0, 0),
    "s": (0, 0, 1, 0),
    "A": (0, 0, 0, 1),
    "N": (1, 1, -2, 0),
    "J": (1, 2, -2, 0),
    "Hz": (0, 0, -1, 0),
}


def dimension(unit: str) -> np.ndarray:
    """Return the exponents of kg, m, s and A of a unit such as "N^0.5 m^0.25/A"."""
    total, sign = np.zeros(4), 1.0
    for word in unit.replace("/", " / ").split():
        if word == "/":
            sign = -1.0
            continue
        name, _, power = word.partition("^")
        if name != "1":
            total += sign * float(Fraction(power or "1")) * np.array(UNITS[name])
        sign = 1.0
    return total


def check_dimensions(hammer: ph.Hammer, drive: ph.PulseTrain) -> None:
    """The hammer does not depend on the units of measurement (E. Buckingham, Phys. Rev. 4 (1914) 345).

    With every constant multiplied by what its dimension makes of a larger unit, every quantity is multiplied
    by what its own makes of it: the logarithmic derivatives, weighted by the dimensions of the constants, add
    up to the dimension of the quantity, for each of the four base units.
    """
    found = ph.sensitivities(hammer, drive, tolerance=1e-13)
    assert found.ok
    assert not found.left_out
    weights = np.array([dimension(unit) for unit in found.units])
    for dot in range(len(found.dots)):
        if dot in found.lost:
            continue
        for place, (unit, _meaning) in enumerate(DOT_QUANTITIES.values()):
            if not math.isfinite(found.dots[dot, place]):
                continue
            row = found.logarithmic[dot, place]
            size = np.abs(row).sum()
            assert row @ weights == pytest.approx(dimension(unit), rel=0.0, abs=1e-8 * size)


def test_dimensions_of_the_shipped_hammer() -> None:
    hammer = crude()
    check_dimensions(hammer, ph.PulseTrain(hammer.waveform))
    check_dimensions(hammer, ph.PulseTrain(hammer.waveform, period=1.4e-3, pulses=3))


@settings(max_examples=12)
@given(st.integers(0, 10**6), st.floats(1.2e-3, 2e-3))
def test_dimensions_of_random_hammers(seed: int, period: float) -> None:
    hammer = Draw(np.random.default_rng(seed), spread=0.08)()
    check_dimensions(hammer, ph.PulseTrain(hammer.waveform, period=period, pulses=2))


def test_maps_compose() -> None:
    """The derivative from a to c is composed of those from a to b and b to c, if the state at b varies."""
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform, period=1.2e-3, pulses=3)
    names = ["mass", "pack.front", "backstop.damping", "waveform.width", "period"]
    for a, b, c in ((0.1e-3, 0.38e-3, 0.9e-3), (0.3e-3, 0.75e-3, 1.6e-3), (0.0, 0.5e-3, 2.0e-3)):
        whole, first, second = (
            constant_map(hammer, drive, start, end, names, tolerance=1e-13)
            for start, end in ((a, c), (a, b), (b, c))
        )
        state = tangent_map(hammer, drive, b, c, tolerance=1e-13).matrix
        # A maximum in the pack at b may be part of the state there.
        together = second.matrix + state @ first.matrix[: state.shape[1]]
        assert state.shape[1] == len(first.matrix)
        units = np.array([[hammers.STROKE], [2.0], [hammers.STROKE]])
        scales = np.abs(whole.values) / units[: len(whole.matrix)]
        np.testing.assert_allclose(
            together * scales,
            whole.matrix * scales,
            rtol=0.0,
            atol=1e-7 * np.abs(whole.matrix * scales).max(),
        )


def test_the_period_of_a_strobe_map() -> None:
    """Start and end depend on the period, as if time were measured from the first of the two firings."""
    hammer = crude()
    period, n = 1.3e-3, 6
    drive = ph.PulseTrain(hammer.waveform, period=period, pulses=n + 2)
    times = drive.times
    found = constant_map(hammer, drive, times[n], times[n + 1], ["period"], tolerance=1e-13)
    state = tangent_map(hammer, drive, times[n], times[n + 1], tolerance=1e-13)
    moving = found.moving(state.matrix, float(n), float(n + 1))[:, 0]

    def strobed(spacing: float) -> np.ndarray:
        # The current of the pulses before is a millionth of a millionth by then.
        other = ph.PulseTrain(hammer.waveform, period=spacing, pulses=2)
        motion = ph.simulate(
            hammer,
            other,
            duration=spacing,
            state=found.state_at_start[:2],
            tolerance=1e-14,
            times=[spacing],
        )
        return np.array([motion.x[-1], motion.v[-1]])

    step = 1e-4 * period
    coarse, fine = ((strobed(period + h) - strobed(period - h)) / (2.0 * h) for h in (step, 0.5 * step))
    truth = (4.0 * fine - coarse) / 3.0
    units = np.array([hammers.STROKE, 2.0]) / period
    assert np.linalg.norm((moving - truth) / units) < 1e-6 * np.linalg.norm(truth / units)
