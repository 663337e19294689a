"""Tangent maps in closed form: flights, bounces, one contact, a damped oscillator, a plastic impact."""

import math

import numpy as np
import pytest
from tests import hammers
from tests.hammers import FRONT, MASS, STOP, THICKNESS, idle, interpreted, made_of
from tests.tangents import SHARP, richardson
from tests.truth import oracles

import printhammer as ph
from printhammer.derivatives.states import TangentMap, strobe_exponent, tangent_map
from printhammer.parts.pack.dashpot import DashpotPack

CLOSE = 1e-9


def map_of(
    hammer: ph.Hammer, end: float, state: tuple[float, float], start: float = 0.0, drive: object = None
) -> TangentMap:
    """Tangent map without a drive, computed in interpreted Python."""
    with interpreted():
        found = tangent_map(hammer, drive or idle(), start, end, state=state, tolerance=SHARP)
    assert found.ok
    assert found.smooth
    return found


def agree(matrix: np.ndarray, exact: np.ndarray, units: tuple[float, ...], close: float = CLOSE) -> None:
    """Assert that two maps agree in units of the given scales, relative to the norm."""
    scale = np.array(units)
    rows, columns = exact.shape
    weights = scale[:columns] / scale[:rows, np.newaxis]
    assert matrix.shape == exact.shape
    assert np.linalg.norm((matrix - exact) * weights) < close * np.linalg.norm(exact * weights)


def test_a_harmonic_oscillator() -> None:
    stiffness = 3e4
    hammer = made_of(spring=hammers.preload(0.0, stiffness), pack=hammers.power())
    rate, t = math.sqrt(stiffness / MASS), 0.7e-3
    turn = rate * t
    exact = np.array([[math.cos(turn), math.sin(turn) / rate], [-rate * math.sin(turn), math.cos(turn)]])
    agree(map_of(hammer, t, (1e-4, 0.1)).matrix, exact, (1e-4, 1.0))


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 1.0])
def test_one_bounce_on_a_rigid_stop(restitution: float) -> None:
    """Under a pull g: t1 = (v0 + u)/g, u = sqrt(v0^2 + 2 g y0); then y = e u (t - t1) - g/2 (t - t1)^2."""
    e, pull, height, speed, t = restitution, 1e4, 1e-4, 0.3, 0.22e-3
    hammer = made_of(spring=hammers.preload(-pull * MASS), pack=hammers.power(), backstop=hammers.rigid(e))
    u = math.sqrt(speed**2 + 2.0 * pull * height)
    t1 = (speed + u) / pull
    if e == 0.0:
        # It stays down: whatever was before is forgotten.
        found = map_of(hammer, t, (STOP + height, speed))
        assert not found.matrix.any()
        return
    assert t1 < t < t1 + 2.0 * e * u / pull
    du = np.array([pull / u, speed / u])
    dt1 = (np.array([0.0, 1.0]) + du) / pull
    dy = e * du * (t - t1) - (e * u - pull * (t - t1)) * dt1
    dv = e * du + pull * dt1
    agree(map_of(hammer, t, (STOP + height, speed)).matrix, np.array([dy, dv]), (1e-4, 1.0))


def test_the_undamped_hertz_backstop_alone() -> None:
    """The contact lasts T = C v^-0.2, so x = b - (x0 - b) + v t - C v^0.8 with v = -v0."""
    speed, height, t, stiffness = 0.8, 40e-6, 0.2e-3, 1.156e9
    hammer = made_of(backstop=hammers.hertz(stiffness), pack=hammers.power())
    lasts = oracles.hertz_duration(MASS, stiffness, speed)
    assert height / speed + lasts < t
    exact = np.array([[-1.0, -(t - 0.8 * lasts)], [0.0, -1.0]])
    found = map_of(hammer, t, (STOP + height, -speed))
    agree(found.matrix, exact, (1e-4, 1.0))
    assert found.determinant == pytest.approx(1.0, rel=CLOSE)


def test_the_damped_backstop_alone() -> None:
    """With z - ln(1 + z) = -(y + ln(1 - y)): dy/dz = z (1 - y) / (y (1 + z)); areas shrink by y/z dy/dz."""
    speed, stiffness, damping = 0.8, 1.156e9, 4.175e8
    hammer = made_of(backstop=hammers.hertz(stiffness, damping), pack=hammers.power())
    z = damping / stiffness * speed
    y = oracles.backstop_speed_ratio(z) * z
    slope = z * (1.0 - y) / (y * (1.0 + z))
    found = map_of(hammer, 0.2e-3, (STOP + 40e-6, -speed))
    assert found.matrix[1, 1] == pytest.approx(-slope, rel=CLOSE)
    assert found.matrix[0, 0] == pytest.approx(-y / z, rel=CLOSE)
    assert found.matrix[1, 0] == pytest.approx(0.0, abs=CLOSE * speed / 40e-6)
    assert found.determinant == pytest.approx(y / z * slope, rel=CLOSE)


def test_the_pack_alone() -> None:
    """Speed out = sqrt(3.7/12) speed in, at any speed; areas shrink by its square, 3.7/12."""
    speed, distance, t = 1.5, 30e-6, 0.25e-3
    hammer = made_of(pack=hammers.power(), backstop=hammers.rigid(0.5))
    exact = oracles.pack_rebound(MASS, 259.0, THICKNESS, speed)
    ratio = math.sqrt(3.7 / 12.0)
    assert distance / speed + exact.loading_time + exact.unloading_time < t
    found = map_of(hammer, t, (FRONT - distance, speed))
    assert found.matrix[1, 1] == pytest.approx(-ratio, rel=CLOSE)
    assert found.matrix[0, 0] == pytest.approx(-ratio, rel=CLOSE)
    assert found.matrix[1, 0] == pytest.approx(0.0, abs=CLOSE * speed / distance)
    assert found.determinant == pytest.approx(3.7 / 12.0, rel=CLOSE)


def test_the_memory_of_the_pack() -> None:
    """On the way out m v^2/2 + S d/12 rmax^-8.3 r^12 is kept, and rmax is part of the state."""
    speed, t = 1.5, 0.25e-3
    hammer = made_of(pack=hammers.power(), backstop=hammers.rigid(0.5))
    exact = oracles.pack_rebound(MASS, 259.0, THICKNESS, speed)
    start = 30e-6 / speed + exact.loading_time + 0.4 * exact.unloading_time
    found = map_of(hammer, t, (FRONT - 30e-6, speed), start)
    assert found.matrix.shape == (2, 3)
    x, v, peak = found.state_at_start
    assert peak == pytest.approx(FRONT + exact.indentation, rel=CLOSE)
    r, r_max, out = (x - FRONT) / THICKNESS, (peak - FRONT) / THICKNESS, -exact.speed_out
    work = 259.0 * THICKNESS / 12.0 * r_max**-8.3 * r**12
    # v_out^2 = v^2 + 2 work / m
    with_v = v / out
    with_x = 12.0 * work / (MASS * out * r * THICKNESS)
    with_peak = -8.3 * work / (MASS * out * r_max * THICKNESS)
    got = found.matrix[1] / [1.0 / THICKNESS, 1.0, 1.0 / THICKNESS]
    wanted = np.array([with_x, with_v, with_peak]) / [1.0 / THICKNESS, 1.0, 1.0 / THICKNESS]
    np.testing.assert_allclose(got, wanted, rtol=0.0, atol=1e-9 * float(np.abs(wanted).max()))


def test_areas_are_kept_until_the_first_reversal_in_the_pack() -> None:
    """Without dashpots, only reversals in the pack contract areas, for any drive."""
    hammer = hammers.shelf(-4.0)
    drive = hammers.drives("force")["half-sine"]
    end = 0.14e-3
    found = map_of(hammer, end, (STOP + 30e-6, 1.0), drive=drive)
    assert found.state_at_end[0] > FRONT
    assert found.determinant == pytest.approx(1.0, rel=CLOSE)


def test_the_linear_impact_oscillator() -> None:
    """Against differences of the piecewise exact motion, which has no tangent flow of its own."""
    mass, stiffness, frequency, end = 0.02, 3000.0, 95.0, 0.11
    oscillator = oracles.Oscillator(
        mass, stiffness, 40.0, 2.0 * math.pi * frequency, 0.3, surface=-1e-3, restitution=0.7
    )
    hammer = made_of(
        mass,
        spring=hammers.preload(3.0, stiffness),
        pack=hammers.power(front=0.5),
        backstop=hammers.rigid(0.7, -1e-3),
    )
    units = np.array([1e-2, 3.0])

    def at_end(x: float, v: float) -> np.ndarray:
        pieces, touches = oscillator.run(x, v, end)
        assert len(touches) == 10
        return np.array(oracles.piece_at(pieces, end))

    columns = []
    for j in range(2):

        def difference(step: float, j: int = j) -> np.ndarray:
            move = step * units[j] * np.eye(2)[j]
            return (at_end(*move) - at_end(*-move)) / (2.0 * step * units[j])

        columns.append(richardson(difference, 1e-3, 6, units))
    found = map_of(hammer, end, (0.0, 0.0), drive=ph.SineForce(40.0, frequency, 0.3))
    agree(found.matrix, np.array(columns).T, tuple(units))


def damped_oscillator(damping: float = 1.5, stiffness: float = 3e4) -> ph.Hammer:
    """A mass in permanent contact with a spring and a dashpot: both exponents are -damping / (2 m)."""
    pack = DashpotPack(stiffness=stiffness, damping=damping, front=-1.0, pull=True)
    return made_of(pack=pack, spring=hammers.preload(stiffness))


def test_exponents_of_a_damped_linear_oscillator() -> None:
    damping, period = 1.5, 0.4e-3
    drive = ph.SineForce(5.0, 1.0 / period)
    with interpreted():
        found = strobe_exponent(
            damped_oscillator(damping), drive, first=1, last=40, state=(0.0, 0.1), tolerance=SHARP
        )
    assert found.ok
    assert found.total == pytest.approx(-damping / MASS * period, rel=CLOSE)
    # Turning makes the growth waver; its mean settles as one over the number of firings.
    assert found.per_second == pytest.approx(-damping / (2.0 * MASS), rel=0.05)
    assert abs(found.value - found.total / 2.0) < 3.0 * max(found.standard_error, 0.01)


def test_a_ball_that_comes_to_rest_forgets_everything() -> None:
    """On a rigid stop, infinitely many bounces end in a finite time."""
    restitution, pull, speed = 0.5, 1e4, 0.4
    hammer = made_of(
        spring=hammers.preload(-pull * MASS),
        pack=hammers.power(),
        backstop=hammers.rigid(restitution),
    )
    end = oracles.bouncing_end(restitution, pull, speed)
    before = map_of(hammer, 0.9 * end, (STOP + 1e-12, -speed))
    assert before.matrix.any()
    after = map_of(hammer, 1.1 * end, (STOP + 1e-12, -speed))
    assert not after.matrix.any()
    drive = ph.PulseTrain(hammers.block(8.0, 50e-6).waveform, period=2e-3, pulses=30)
    with interpreted():
        found = strobe_exponent(hammer, drive, first=10, last=30, state=(STOP, 0.0))
    assert found.ok
    assert found.value == found.second == -math.inf
    assert found.standard_error == math.inf
