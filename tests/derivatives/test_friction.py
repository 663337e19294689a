"""Tangent maps under dry friction: stops, releases and reversals, against differences and a closed form."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from tests.circuit_tangents import deviation as circuit_deviation
from tests.circuit_tangents import deviations, problem_of
from tests.oracle.den_hartog import DenHartog
from tests.tangents import SHARP, deviation

import printhammer as ph
from printhammer.derivatives.flow import flow as constant_flow
from printhammer.derivatives.flow import rest_columns
from printhammer.derivatives.parameters import parameter_names, parameters
from printhammer.derivatives.states import tangent_map
from printhammer.drive.waveforms.drivers import Chopper


def oscillator(kinetic: float, static: float | None = None) -> ph.Hammer:
    """Oscillator of unit mass and stiffness under dry friction."""
    friction: dict[str, object] = {"law": "friction", "kinetic": kinetic}
    if static is not None:
        friction["static"] = static
    spring = {"law": "spring", "stiffness": 1.0, "position": 0.0}
    return ph.Hammer.build(1.0, name="dry").replace({"force.guide": friction, "force.spring": spring})


@pytest.mark.parametrize("beta", [0.7, 1.4, 2.5])
def test_a_cycle_with_two_reversals(beta: float) -> None:
    """The map of half a cycle is S R(π/β): a rotation, and at the turn the ratio of the accelerations.

    At the turn the other forces are x0 β², so that S = diag(1, (x0 β² - f)/(x0 β² + f)).
    """
    exact = DenHartog(beta, 0.3)
    a = 1.2 * exact.boundary
    x0, phase = exact.motion(a)
    drive = ph.SineForce(a, 0.5 * beta / math.pi, phase=phase + 0.5 * math.pi)
    cycle = 2.0 * math.pi / beta
    # Half a cycle later the motion is at its other turn; the ends lie between turns.
    found = tangent_map(oscillator(0.3), drive, 0.25 * cycle, 1.25 * cycle, state=(x0, 0.0), tolerance=SHARP)
    assert found.smooth

    def rotation(angle: float) -> np.ndarray:
        return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])

    turn = np.diag([1.0, (x0 * beta**2 - 0.3) / (x0 * beta**2 + 0.3)])
    quarter = rotation(0.25 * cycle)
    expected = quarter @ turn @ quarter @ quarter @ turn @ quarter
    np.testing.assert_allclose(found.matrix, expected, rtol=0.0, atol=1e-9)


def test_random_oscillators_that_stick() -> None:
    rng = np.random.default_rng(38)

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    sticks = 0
    for _ in range(24):
        kinetic = log(0.1, 0.4)
        hammer = oscillator(kinetic, kinetic * float(rng.choice([1.0, 1.3, 2.0])))
        if rng.random() < 0.5:
            leaf = {"law": "linear", "side": "front", "position": 0.4, "stiffness": 20.0}
            hammer = hammer.replace("contact.leaf", leaf)
        if rng.random() < 0.4:
            stop = {"law": "rigid", "position": -0.5, "restitution": 0.6}
            hammer = hammer.replace("backstop", stop)
        drive = ph.SineForce(
            log(0.3, 1.0), log(0.3, 2.0) / (2.0 * math.pi), phase=float(rng.uniform(0.0, 6.0))
        )
        state, end = (
            (float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-1.0, 1.0))),
            float(rng.uniform(3.0, 9.0)),
        )
        motion = ph.simulate(hammer, drive, duration=end, state=state, tolerance=SHARP)
        sticks += len(motion.sticks)
        assert deviation(hammer, drive, 0.0, end, state=state, size=1e-5) < 1e-6
    assert sticks > 12


def test_random_hammers_that_strike_a_pack_under_friction() -> None:
    """A pack with memory; a rest on its unloading branch has no derivative, and is reported."""
    rng = np.random.default_rng(7)
    pack = {"law": "power", "stiffness": 184.0, "front": 1e-3, "thickness": 178e-6}
    compared = sticks = 0
    for _ in range(16):
        kinetic = float(0.1 * 10.0 ** rng.random())
        static = kinetic * float(rng.choice([1.0, 1.5, 3.0]))
        hammer = ph.Hammer.build(5e-3, name="dry").replace(
            {
                "force.guide": {"law": "friction", "kinetic": kinetic, "static": static},
                "spring": {"law": "preload", "preload": -0.3, "stiffness": 200.0},
                "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.5},
                "pack": {**pack, "reloading": "unloading-curve"},
            }
        )
        size, rate = float(0.5 * 8.0 ** rng.random()), float(20.0 * 10.0 ** rng.random())
        drive = ph.SineForce(size, rate, phase=float(rng.uniform(0.0, 6.0)))
        state, end = (
            (float(rng.uniform(5e-4, 1.03e-3)), float(rng.uniform(0.2, 1.0))),
            float(rng.uniform(2e-3, 1.2e-2)),
        )
        motion = ph.simulate(hammer, drive, duration=end, state=state, tolerance=SHARP)
        found = tangent_map(hammer, drive, 0.0, end, state=state, tolerance=SHARP)
        if not found.smooth:
            assert any(held.x > 1e-3 for held in motion.sticks)
            continue
        assert deviation(hammer, drive, 0.0, end, state=state, found=found, size=1e-6) < 1e-6
        compared, sticks = compared + 1, sticks + len(motion.sticks)
    assert compared > 8
    assert sticks > 3


def test_exponents_of_a_periodic_motion_that_sticks() -> None:
    """A motion that sticks once per cycle forgets its velocity: one multiplier is 0."""
    wave = {"shape": "half-sine", "amplitude": "3 N", "width": 1.5}
    hammer = oscillator(0.3, 0.5).replace("waveform", wave)
    found = ph.lyapunov(hammer, rate=0.05, state=(0.0, 0.0), firings=40, transient=10)
    assert found.exponents[1] == -math.inf


DOT = ("flight_time", "impact_speed", "net_loss")
RUN = ("pack_loss", "damping_loss")
EDGES = ("rise", "decay")
STEPS = ((1, 8.0), (-1, -8.0), (2, -1.0), (-2, 1.0))
"""Offsets and weights, times 12, of central differences: Abramowitz and Stegun (1964), table 25.2."""


def stops_of(rng: np.random.Generator, kind: str) -> dict[str, object]:
    """Return a spring with two rigid stops or, for the kind "free", with a pack and without a backstop."""
    if kind == "free":
        # Without a preload, friction holds the plunger somewhere on its way back.
        return {
            "spring": {"law": "preload", "preload": 0.0, "stiffness": float(rng.uniform(500.0, 3000.0))},
            "pack": {"law": "dashpot", "front": 0.5e-3, "stiffness": 1e6, "damping": 10.0},
        }
    preload, stiffness = -float(rng.uniform(0.1, 0.5)), float(rng.uniform(100.0, 1500.0))
    return {
        "spring": {"law": "preload", "preload": preload, "stiffness": stiffness},
        "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
        "pack": {"law": "rigid", "front": 0.5e-3, "restitution": 0.4},
    }


def plunger(rng: np.random.Generator, kind: str) -> tuple[ph.Hammer, float]:
    """A plunger in a tube, and the time between its pulses: between stops, or without a backstop."""
    kinetic = float(rng.uniform(0.05, 0.2))
    friction = {"law": "friction", "kinetic": kinetic, "static": kinetic * float(rng.uniform(1.2, 2.0))}
    parts: dict[str, object] = {
        "force.guide": friction,
        "force.weight": {"law": "gravity", "angle": "60 deg"},
        "contact.leaf": {"law": "linear", "side": "front", "position": 0.3e-3, "stiffness": 3e3},
        "damping": {"law": "viscous", "coefficient": float(rng.uniform(0.02, 0.06))},
        "waveform": {"shape": "half-sine", "amplitude": "3 N", "width": 1.5e-3},
    }
    parts |= stops_of(rng, kind)
    if kind == "sharp":
        sharp = {"shape": "rectangle", "amplitude": "3 N", "width": 0.5e-3, "rise": 0.0, "decay": 0.0}
        parts["waveform"] = sharp
    return ph.Hammer.build(1e-3).replace(parts), float(rng.uniform(6e-3, 12e-3))


def numbers_of(hammer: ph.Hammer, period: float) -> np.ndarray:
    """Quantities of the dots, and losses of the run."""
    drive = ph.PulseTrain(hammer.waveform, period=period, pulses=3)
    # The period has no effect on the state of rest, whose derivatives take long without a backstop.
    result = ph.sensitivities(hammer, drive, duration=0.05, tolerance=1e-14, constants=["period"])
    dots = result.dots[:, [result.quantities.index(name) for name in DOT]]
    losses = result.run[[result.run_quantities.index(name) for name in RUN]]
    return np.concatenate([dots.ravel(), losses])


@pytest.mark.parametrize("kind", ["stops", "sharp", "free"])
def test_sensitivities_follow_stops_and_releases(kind: str) -> None:
    """Releases by a growing force and by a sharp edge, from rigid stops and where friction holds.

    Every constant is varied in one of three random plungers.
    """
    rng = np.random.default_rng(1931)
    sticks = 0
    for number in range(3):
        hammer, period = plunger(rng, kind)
        drive = ph.PulseTrain(hammer.waveform, period=period, pulses=3)
        sticks += len(ph.simulate(hammer, drive).sticks)
        # A rise and a decay of zero have no derivative.
        known = [name for name in parameter_names(hammer, drive) if name.rpartition(".")[2] not in EDGES]
        names = known[number::3]
        result = ph.sensitivities(hammer, drive, duration=0.05, tolerance=1e-13, constants=names)
        assert result.ok
        assert list(result.constants) == names
        base = numbers_of(hammer, period)
        rows = [result.quantities.index(name) for name in DOT]
        ledger = [result.run_quantities.index(name) for name in RUN]
        for column, key in enumerate(names):
            value = period if key == "period" else hammer.constants[key].si
            step = 1e-5 * (abs(value) or 1e-3)
            moved = [
                weight * numbers_of(hammer, value + k * step)
                if key == "period"
                else weight * numbers_of(hammer.replace(key, value + k * step), period)
                for k, weight in STEPS
            ]
            own = np.concatenate(
                [result.derivatives[:, rows, column].ravel(), result.run_derivatives[ledger, column]]
            )
            scale = np.abs(base) / (abs(value) or 1e-3)
            assert np.abs((own - sum(moved) / (12.0 * step)) / scale).max() < 1e-6, key
    assert sticks >= (2 if kind == "free" else 0)


def test_an_edge_that_ends_a_rest_on_a_stop_takes_the_motion_along() -> None:
    """Without friction, a dot from rest is the same at any time; the time between pulses has no effect."""
    sharp = {"shape": "rectangle", "amplitude": "3 N", "width": 0.5e-3, "rise": 0.0, "decay": 0.0}
    hammer = ph.Hammer.build(1e-3).replace(
        {
            "spring": {"law": "preload", "preload": -0.5, "stiffness": 100.0},
            "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
            "pack": {"law": "dashpot", "front": 0.5e-3, "stiffness": 1e6, "damping": 10.0},
            "waveform": sharp,
        }
    )
    drive = ph.PulseTrain(hammer.waveform, period=20e-3, pulses=3)
    result = ph.sensitivities(hammer, drive, constants=["period"], tolerance=1e-13)
    scale = np.abs(result.dots) / 20e-3
    assert (np.abs(result.derivatives[:, :, 0]) <= 1e-6 * scale).all()
    moved = ph.sensitivities(hammer, drive, constants=["firing.0", "firing.1"], tolerance=1e-13)
    assert (np.abs(moved.derivatives) <= 1e-6 * scale[:, :, np.newaxis]).all()


def coil_plunger(rng: np.random.Generator, kind: str) -> ph.Hammer:
    """Plunger on a rail, in a tube: between rigid stops, or held by friction wherever it stops."""
    kinetic = float(rng.uniform(0.1, 0.3))
    rail = {"shape": "rail", "voltage": 12.0, "width": float(rng.uniform(0.8e-3, 2e-3))}
    decay = {"decay": "zener", "decay_voltage": 24.0} if rng.random() < 0.5 else {"decay": "diode"}
    parts: dict[str, object] = {
        "force.guide": {
            "law": "friction",
            "kinetic": kinetic,
            "static": kinetic * float(rng.choice([1.2, 1.5, 2.0])),
        },
        "contact.leaf": {"law": "linear", "side": "front", "position": 0.3e-3, "stiffness": 3e3},
        "magnet": {"law": "moving-coil", "constant": float(rng.uniform(2.0, 6.0))},
        "coil": {"resistance": float(rng.uniform(4.0, 12.0)), "inductance": float(rng.uniform(2e-3, 8e-3))},
        "waveform": rail | decay,
    }
    parts |= stops_of(rng, kind)
    hammer = ph.Hammer.build(1e-3).replace(parts)
    if rng.random() < 0.5:
        turn = {
            "coil.turn_resistance": float(rng.uniform(3.0, 10.0)),
            "coil.leakage": float(rng.uniform(5e-4, 2e-3)),
        }
        hammer = hammer.replace(turn)
    return hammer


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["free", "stops"])
def test_random_coils_that_release_a_held_armature(kind: str) -> None:
    """States and every constant, through releases by the current and later stops and rests."""
    rng = np.random.default_rng(3)
    sticks = 0
    for _ in range(4):
        hammer, period = coil_plunger(rng, kind), float(rng.uniform(5e-3, 9e-3))
        drive, end = ph.PulseTrain(hammer.waveform, period=period, pulses=2), float(rng.uniform(6e-3, 14e-3))
        motion = ph.simulate(hammer, drive, duration=end, tolerance=SHARP)
        sticks += len(motion.sticks)
        # At rest, friction stops a neighbouring velocity, and a neighbouring position lies behind the stop.
        times = np.linspace(2e-4, 2e-3, 40)
        start = float(times[np.argmax(np.abs(motion.at(times)[1]) > 0.05)])
        assert circuit_deviation(hammer, drive, start, end, size=1e-4) < 1e-6
        # A release magnifies the errors of a run, and smaller steps magnify them further.
        moved = deviations(hammer, drive, end, size=6.4e-4, levels=6)
        assert {"force.guide.static", "magnet.constant", "coil.resistance"} <= set(moved)
        assert all(change < 1e-6 for change in moved.values()), moved
    assert sticks > 4


@pytest.mark.slow
def test_releases_by_a_saturating_magnet_behind_a_chopper() -> None:
    """The release is located less exactly than with a moving coil; every release has a derivative."""
    base = ph.load("dot-peen").replace("force.guide", {"law": "friction", "kinetic": 0.5, "static": 0.75})
    chopper = Chopper(voltage=28.0, width=4e-3, upper=2.5, lower=2.0, decay="zener", decay_voltage=30.0)
    drive = ph.PulseTrain(chopper, period=12e-3, pulses=2)
    for factor in np.linspace(0.8, 1.2, 9):
        flux = base.constants["magnet.saturation_flux"].si * float(factor)
        hammer = base.replace("magnet.saturation_flux", flux)
        moved = deviations(hammer, drive, 5e-3, ["mass", "coil.resistance", "force.guide.static"])
        assert len(moved) == 3
        assert all(change < 1e-6 for change in moved.values()), moved


def test_a_current_that_releases_an_armature() -> None:
    """A moving coil at rest: the release is K V/R (1 - exp(-R t/L)) = Fs, and then the motion is linear.

    With z = (x, v, i) after the release at t1, dz/dV = Z_V(T - t1) - z'(T) dt1/dV, since the current at the
    release is Fs/K for any voltage; Z_V is the response of the linear system to a voltage of 1 V.
    """
    mass, factor, resistance, inductance, kinetic, static = 2e-3, 4.0, 6.0, 5e-3, 0.4, 0.9
    voltage, stiffness, end = 9.0, 100.0, 4e-3
    hammer = ph.Hammer.build(mass).replace(
        {
            "force.guide": {"law": "friction", "kinetic": kinetic, "static": static},
            "magnet": {"law": "moving-coil", "constant": factor},
            "coil": {"resistance": resistance, "inductance": inductance},
            "spring": {"law": "preload", "preload": 0.0, "stiffness": stiffness},
            "waveform": {"shape": "rail", "voltage": voltage, "width": 1.0, "decay": "diode"},
        }
    )
    current = static / factor
    release = -inductance / resistance * math.log(1.0 - current * resistance / voltage)
    later = -static / (factor * voltage) / ((voltage - resistance * current) / inductance)
    system = np.zeros((5, 5))
    system[0, 1] = 1.0
    system[1, 0], system[1, 2], system[1, 4] = -stiffness / mass, factor / mass, -kinetic / mass
    system[2, 1:4] = -factor / inductance, -resistance / inductance, 1.0 / inductance
    flow = expm(system * (end - release))
    state = flow @ np.array([0.0, 0.0, current, voltage, 1.0])
    expected = flow[:3, 3] - (system @ state)[:3] * later

    drive = ph.PulseTrain(hammer.waveform, at=[0.0])
    problem = problem_of(hammer, drive, (0.0, 0.0))
    record = problem.run(end)
    wanted = parameters(hammer, drive, ["waveform.voltage", "force.guide.static"])
    found = constant_flow(problem, record, wanted, np.array([0.0, end]), rest_columns(problem, wanted))
    assert found.smooth
    held = ph.simulate(hammer, drive, state=(0.0, 0.0), duration=end).sticks[0]
    assert held.t_out == pytest.approx(release, rel=1e-10)
    # The flux linkage of a moving coil is L i + K x.
    by_voltage = np.array([*expected[:2], inductance * expected[2] + factor * expected[0]])
    own = found.changes[1][[0, 1, 8]] / np.array([parameter.scale for parameter in wanted])
    np.testing.assert_allclose(own[:, 0], by_voltage, rtol=1e-9)
    # A change of the static friction changes the current at the release, and the time of the release.
    later = inductance / (factor * (voltage - resistance * current))
    by_static = flow[:3, 2] / factor - (system @ state)[:3] * later
    by_static[2] = inductance * by_static[2] + factor * by_static[0]
    np.testing.assert_allclose(own[:, 1], by_static, rtol=1e-9)
