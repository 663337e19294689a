"""Dry friction against closed forms: sticking, release, decay, forced motion, and a coil at rest."""

import math

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import interpreted
from tests.oracle.den_hartog import DenHartog

import printhammer as ph
from printhammer.run.motion import Motion

CLOSE = 1e-11
G = 9.80665


def block(mass: float, kinetic: float, static: float | None = None, **terms: dict[str, object]) -> ph.Hammer:
    """Return a mass under dry friction and further forces, by name."""
    friction: dict[str, object] = {"law": "friction", "kinetic": kinetic}
    if static is not None:
        friction["static"] = static
    added = {f"force.{name}": term for name, term in {"guide": friction, **terms}.items()}
    return ph.Hammer.build(mass, name="block").replace(added)


def still(hammer: ph.Hammer, x: float, v: float, duration: float, **more: object) -> Motion:
    """Run without a drive."""
    drive = ph.SineForce(0.0, "1 Hz")
    return ph.simulate(hammer, drive, duration=duration, state=(x, v), tolerance=1e-13, **more)


def test_a_block_on_an_incline_is_released_at_the_angle_of_static_friction() -> None:
    static, kinetic = 0.5, 0.3
    for angle in (math.atan(static) * (1.0 + sign * 1e-14) for sign in (-1.0, 1.0)):
        normal = G * math.cos(angle)
        weight = {"law": "gravity", "angle": angle}
        with interpreted():
            motion = still(block(1.0, kinetic * normal, static * normal, weight=weight), 1.0, 0.0, 1.0)
            energy = motion.energy
        if angle < math.atan(static):
            (held,) = motion.sticks
            assert (held.t_in, held.t_out, held.x, held.initial) == (0.0, None, 1.0, True)
            continue
        assert len(motion.sticks) == 0
        pull = G * math.sin(angle) - kinetic * normal
        assert motion.state_at(1.0)[0] == pytest.approx(1.0 - 0.5 * pull, rel=CLOSE)
        assert energy.damping_loss == pytest.approx(kinetic * normal * 0.5 * pull, rel=CLOSE)


@pytest.mark.parametrize("static", [1.0, 1.9, 2.4])
def test_free_decay_ends_where_friction_holds(static: float) -> None:
    """A half cycle takes π/w and costs 2 Fk/k; the mass stops where k |x| <= Fs first (Lorenz 1924)."""
    mass, k, kinetic, start = 0.5, 200.0, 1.0, 0.0631
    spring = {"law": "spring", "stiffness": k, "position": 0.0}
    motion = still(block(mass, kinetic, static, spring=spring), start, 0.0, 5.0)
    swings, place = 0, start
    while k * abs(place) > static:
        place, swings = -math.copysign(abs(place) - 2.0 * kinetic / k, place), swings + 1
    (held,) = motion.sticks
    assert held.t_in == pytest.approx(swings * math.pi * math.sqrt(mass / k), rel=CLOSE)
    assert held.x == pytest.approx(place, rel=CLOSE)
    assert motion.state_at(4.9)[:2] == (held.x, 0.0)
    travel = sum(2.0 * start - 2.0 * (2 * n + 1) * kinetic / k for n in range(swings))
    assert motion.energy.damping_loss == pytest.approx(kinetic * travel, rel=CLOSE)
    assert abs(motion.energy.residual) < 1e-10 * motion.energy.throughput
    # While the mass is held, friction balances the spring.
    forces = motion.curves_at(np.array([4.9]))[4]
    assert forces["drag"][0] == pytest.approx(k * held.x, rel=1e-14)


@pytest.mark.parametrize("beta", [0.42, 0.7, 1.4, 2.5])
def test_forced_motion_under_friction(beta: float) -> None:
    """Outside Den Hartog's boundary the mass never stops; just inside, it does."""
    exact = DenHartog(beta, 0.3)
    hammer = block(1.0, 0.3, spring={"law": "spring", "stiffness": 1.0, "position": 0.0})
    cycle = 2.0 * math.pi / beta
    for excess in (0.1, 1e-7, -1e-7):
        a = exact.boundary * (1.0 + excess)
        x0, phase = exact.motion(a)
        drive = ph.SineForce(a, 1.0 / cycle, phase=phase + 0.5 * math.pi)
        motion = ph.simulate(hammer, drive, duration=3.0 * cycle, state=(x0, 0.0), tolerance=1e-13)
        assert (len(motion.sticks) > 0) == (excess < 0.0)
        if excess == 0.1:
            t = np.linspace(0.0, 0.5 * cycle, 9)
            wave = 0.3 * (1.0 - np.cos(t) - beta * exact.big_u * np.sin(t))
            wave += a * exact.big_v * np.cos(beta * t + phase)
            places = motion.curves_at(t + 2.0 * cycle)[0]
            np.testing.assert_allclose(places, wave, rtol=0.0, atol=10.0 * CLOSE * x0)


@pytest.mark.parametrize("kinetic", [0.7, 1.0])
def test_a_growing_force_releases_a_mass_at_its_static_force(kinetic: float) -> None:
    """From A sin w s = Fs on: x = A (sin w s - sin w t + w (t - s) cos w s)/(m w²) - Fk (t - s)²/2m."""
    mass, size, rate, static = 0.2, 3.0, 2.0 * math.pi, 1.0
    hammer, drive = block(mass, kinetic, static), ph.SineForce(size, "1 Hz")
    with interpreted():
        motion = ph.simulate(hammer, drive, duration=0.2, state=(0.0, 0.0), tolerance=1e-13)
        (held,), place = motion.sticks, motion.state_at(0.2)[0]
    start = math.asin(static / size) / rate
    assert held.t_out == pytest.approx(start, rel=CLOSE)
    s = 0.2 - start
    swing = size * (math.sin(rate * start) - math.sin(rate * 0.2)) / rate**2
    expected = (swing + size * s * math.cos(rate * start) / rate - 0.5 * kinetic * s * s) / mass
    assert place == pytest.approx(expected, rel=1e-10)


def test_a_brief_excess_over_the_static_force_is_not_missed() -> None:
    """A sine that exceeds the static force by 1e-8, for 0.005 % of its period, releases the mass."""
    # With another force, which is zero, the laws are those of the other tests.
    hammer = block(0.2, 0.9, 1.0, load={"law": "constant", "force": 0.0})
    for start in np.random.default_rng(38).uniform(-0.24, 0.24, 40):
        for excess in (1e-8, -1e-8):
            drive = ph.SineForce(1.0 + excess, "1 Hz", phase=2.0 * math.pi * float(start))
            motion = ph.simulate(hammer, drive, duration=0.5, state=(0.0, 0.0))
            releases = [held.t_out for held in motion.sticks if held.t_out is not None]
            assert (len(releases) > 0) == (excess > 0.0)
            if releases:
                begin = math.asin(1.0 / (1.0 + excess)) / (2.0 * math.pi) - start
                assert releases[0] == pytest.approx(begin, abs=1e-8)


def test_a_coil_builds_up_its_current_before_friction_lets_go() -> None:
    """A current U/R (1 - exp(-R t/L)) reaches Fs/k at -L/R ln(1 - Fs R/k U)."""
    k, resistance, inductance, static, voltage = 4.0, 5.0, 0.02, 2.5, 24.0
    hammer = block(0.05, 1.0, static).replace(
        {
            "magnet": {"law": "moving-coil", "constant": k},
            "coil": {"law": "winding", "resistance": resistance, "inductance": inductance},
            "waveform": {"shape": "rail", "voltage": f"{voltage} V", "width": "10 ms", "decay": "diode"},
        }
    )
    assert hammer.waveform is not None
    drive = ph.PulseTrain(hammer.waveform, at=[1e-3])
    with interpreted():
        motion = ph.simulate(hammer, drive, duration=8e-3, state=(0.0, 0.0), tolerance=1e-12)
        (held,), energy, place = motion.sticks, motion.energy, motion.state_at(8e-3)[0]
    reached = -inductance / resistance * math.log(1.0 - static * resistance / (k * voltage))
    assert held.t_out == pytest.approx(1e-3 + reached, rel=1e-11)
    assert abs(energy.residual) < 1e-10 * energy.throughput
    assert place > 1e-4


@pytest.mark.parametrize("friction", [0.5, 1.5])
def test_bounces_follow_a_geometric_series(friction: float) -> None:
    """Up with (W + Fk)/m, down with (W - Fk)/m: speeds shrink by e sqrt(down/up) a flight."""
    weight, mass, height, restitution = 4.0, 0.1, 2e-3, 0.6
    up, down = (weight + friction) / mass, (weight - friction) / mass
    hammer = block(mass, friction, load={"law": "constant", "force": -weight}).replace(
        "backstop", {"law": "rigid", "position": 0.0, "restitution": restitution}
    )
    motion = still(hammer, height, 0.0, 1.0)
    speed, ratio = math.sqrt(2.0 * down * height), restitution * math.sqrt(down / up)
    for bounce, contact in enumerate(motion.contacts[:12]):
        assert -contact.v_in == pytest.approx(speed * ratio**bounce, rel=1e-10)
    # The last bounces, less than 1e-12 of a characteristic length high, are left out.
    flights = restitution * speed * (1.0 / up + 1.0 / math.sqrt(up * down)) / (1.0 - ratio)
    rest = motion.contacts[-1]
    assert rest.t_out is None
    assert rest.t_in == pytest.approx(math.sqrt(2.0 * height / down) + flights, abs=2e-6)
    assert abs(motion.energy.residual) < 1e-10 * motion.energy.throughput
    assert len(motion.sticks) == 0


def test_a_pack_with_memory_holds_an_armature_under_friction() -> None:
    """After an impact that friction stops in the pack, the armature stays there; the ledger closes."""
    hammer = ph.load("hendriks-1983").replace("backstop", None).replace("coil", None)
    front = hammer.front
    assert front is not None
    state, rest = (front - 1e-5, 1.0), ph.SineForce(0.0, "1 Hz")
    dry = hammer.replace("force.guide", {"law": "friction", "kinetic": "1 N", "static": "200 N"})
    loose = hammer.replace("force.guide", {"law": "friction", "kinetic": "1 N", "static": "1.5 N"})
    with interpreted():
        stuck, back = (
            ph.simulate(each, rest, duration=2e-3, state=state, tolerance=1e-12) for each in (dry, loose)
        )
        ledgers = stuck.energy, back.energy
    (held,) = stuck.sticks
    assert held.t_out is None
    assert held.x > front
    assert back.contacts[0].t_out is not None
    for energy in ledgers:
        assert abs(energy.residual) < 1e-8 * energy.throughput


@pytest.mark.slow
def test_random_plungers_stop_and_start_in_a_pack_with_memory() -> None:
    """Coil, spring, friction and a pack with memory, half of them with equal static and kinetic force."""
    rng = np.random.default_rng(38)

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    pack = {"law": "power", "thickness": 178e-6, "stiffness": 184.0}
    sticks = 0
    for _ in range(60):
        kinetic = log(0.05, 1.0)
        static = kinetic * (1.0 if rng.random() < 0.5 else float(rng.uniform(1.0, 2.5)))
        spring = {"law": "preload", "preload": -log(0.05, 1.0), "stiffness": log(50.0, 1e3)}
        coil = {"law": "winding", "resistance": log(2.0, 20.0), "inductance": log(1e-3, 5e-2)}
        wave = {
            "shape": "rail",
            "voltage": f"{log(3.0, 30.0)!r} V",
            "width": log(2e-3, 2e-2),
            "decay": "diode",
        }
        reloading = "unloading-curve" if rng.random() < 0.5 else "loading-branch"
        hammer = block(log(2e-3, 5e-2), kinetic, static).replace(
            {
                "spring": spring,
                "magnet": {"law": "moving-coil", "constant": log(1.0, 10.0)},
                "coil": coil,
                "backstop": {"law": "rigid", "position": 0.0, "restitution": float(rng.uniform(0.0, 0.8))},
                "pack": {**pack, "front": log(5e-4, 5e-3), "reloading": reloading},
                "waveform": wave,
            }
        )
        assert hammer.waveform is not None
        drive = ph.PulseTrain(hammer.waveform, rate=float(rng.uniform(10.0, 60.0)), pulses=3)
        motion = ph.simulate(hammer, drive, duration=0.12, tolerance=1e-10)
        assert motion.ok
        assert abs(motion.energy.residual) <= 1e-8 * motion.energy.throughput
        sticks += len(motion.sticks)
    assert sticks > 60


def test_a_stop_in_the_pack_at_the_limit_of_friction() -> None:
    """With equal static and kinetic force, rounding decides between rest and reloading; both continue."""
    friction = 0.3064143688906136
    hammer = block(0.03766332309391442, friction, friction).replace(
        {
            "spring": {"law": "preload", "preload": -0.3652675404168696, "stiffness": 683.6313887945818},
            "magnet": {"law": "moving-coil", "constant": 4.858806555919351},
            "coil": {"law": "winding", "resistance": 2.0159338096857597, "inductance": 0.002982930650914256},
            "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.5104536748545296},
            "pack": {
                "law": "power",
                "stiffness": 183.962,
                "front": 0.0022170337338572573,
                "thickness": 0.0001778,
                "reloading": "loading-branch",
            },
            "waveform": {
                "shape": "rail",
                "voltage": "18.22442253914435 V",
                "width": 0.017938284661937694,
                "decay": "diode",
            },
        }
    )
    assert hammer.waveform is not None
    drive = ph.PulseTrain(hammer.waveform, period=0.01963735079152686, pulses=3)
    for tolerance in (1e-9, 1e-11, 1e-13):
        motion = ph.simulate(hammer, drive, duration=0.12, tolerance=tolerance)
        assert motion.ok
        assert len(motion.sticks) > 20


def test_what_friction_cannot_be() -> None:
    hammer = block(1.0, 0.3)
    with refused("force.guide"):
        hammer.replace("force.guide.static", 0.2)
    with refused("force.guide.kinetic", 0.0):
        hammer.replace("force.guide.kinetic", 0.0)
    with refused("backstop.law", "hertz"):
        ph.load("hendriks-1983").replace("force.guide", {"law": "friction", "kinetic": 0.3})
