"""Damping of the armature: closed forms, the reference, differences of runs; mostly interpreted Python."""

import math

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import (
    BACKSTOPS,
    MAGNETS,
    PACKS,
    SPRINGS,
    STOP,
    STROKE,
    compare,
    drives,
    idle,
    interpreted,
    made_of,
)
from tests.moved import far_off, quantity_differences

import printhammer as ph
from printhammer.derivatives.states import tangent_map
from printhammer.parts.damping import ViscousDamping

STATE = STOP + 20e-6, -0.4
MASS, STIFFNESS, START = 0.4e-3, 2e4, 80e-6


def oscillator(coefficient: float) -> ph.Hammer:
    """A damped mass on a spring without preload."""
    spring = {"law": "preload", "preload": "0 N", "stiffness": f"{STIFFNESS} N/m"}
    return made_of(MASS, spring=spring, damping=ViscousDamping(coefficient=coefficient))


def decay(coefficient: float, t: np.ndarray) -> np.ndarray:
    """Return the displacement [m] from START at rest."""
    rate, own = 0.5 * coefficient / MASS, STIFFNESS / MASS
    if rate * rate < own:
        w = math.sqrt(own - rate * rate)
        return START * np.exp(-rate * t) * (np.cos(w * t) + rate / w * np.sin(w * t))
    w = math.sqrt(rate * rate - own)
    slow, fast = rate - w, rate + w
    return START * (fast * np.exp(-slow * t) - slow * np.exp(-fast * t)) / (fast - slow)


@pytest.mark.parametrize("coefficient", [0.0, 0.05, 0.5, 20.0])
def test_free_oscillations_from_none_to_creeping(coefficient: float) -> None:
    t = np.linspace(0.0, 8e-3, 101)
    with interpreted():
        motion = ph.simulate(oscillator(coefficient), idle(), times=t, duration=8e-3, state=(START, 0.0))
    assert motion.ok
    assert np.abs(motion.x - decay(coefficient, t)).max() < 1e-9 * START
    np.testing.assert_allclose(motion.force["drag"], -coefficient * motion.v, rtol=1e-15)
    energy = motion.energy
    assert abs(energy.residual) < 1e-8 * 0.5 * STIFFNESS * START**2
    given = 0.5 * STIFFNESS * (START**2 - motion.x[-1] ** 2) - 0.5 * MASS * motion.v[-1] ** 2
    assert energy.damping_loss == pytest.approx(given, abs=1e-9 * 0.5 * STIFFNESS * START**2)


def test_machine_code_does_the_same() -> None:
    t = np.linspace(0.0, 8e-3, 101)
    # The backstop is out of reach: other tests have the machine code for these laws.
    place = -1.2e-4
    hammer = oscillator(0.5).replace(
        {
            "backstop": {"law": "rigid", "position": place, "restitution": 0.5},
            "spring.preload": -STIFFNESS * place,
        }
    )
    motion = ph.simulate(hammer, idle(), times=t, duration=8e-3, state=(START, 0.0))
    assert np.abs(motion.x - decay(0.5, t)).max() < 1e-9 * START


CASES = [
    ("inverse-root", "linear", "power", "hertz", "train", 1.5),
    ("inverse-root", "linear", "curve", "elastomer", "overlap", 0.3),
    ("", "preload", "dashpot", "rigid", "sine", 0.8),
    ("", "preload", "power", "rigid", "sharp", 5.0),
    ("inverse-root", "linear", "dashpot-pull", "hertz-no-pull", "half-sine", 1.0),
    ("", "linear", "", "hertz", "single", 40.0),
]


def case_of(row: tuple[str, str, str, str, str, float]) -> tuple[ph.Hammer, ph.PulseTrain | ph.SineForce]:
    magnet, spring, pack, backstop, drive, coefficient = row
    hammer = made_of(
        magnet=MAGNETS[magnet],
        spring=SPRINGS[spring],
        pack=PACKS[pack],
        backstop=BACKSTOPS[backstop],
        damping=ViscousDamping(coefficient=coefficient),
    )
    return hammer, drives("current" if magnet else "force")[drive]


@pytest.mark.parametrize("row", CASES, ids=lambda row: "-".join(word or "none" for word in row[:5]))
def test_contacts_against_the_reference(row: tuple[str, str, str, str, str, float]) -> None:
    hammer, drive = case_of(row)
    with interpreted():
        found = compare(hammer, drive, 2.4e-3, state=STATE, sensitive=True)
    assert found.motion.ok
    assert found.error < 1e-8
    for surface in ("pack", "backstop"):
        mine, theirs = found.touches(surface)
        assert len(mine) == len(theirs)
    energy = found.motion.energy
    assert energy.damping_loss > 0.0
    assert abs(energy.residual) < 1e-8 * energy.throughput


def test_a_flight_shrinks_areas_as_the_damping_says() -> None:
    """The determinant of the tangent map is exp(-c t / m), for any other forces."""
    hammer = made_of(
        magnet=MAGNETS["inverse-root"], spring=SPRINGS["linear"], damping=ViscousDamping(coefficient=2.0)
    )
    drive = drives("current")["single"]
    with interpreted():
        found = tangent_map(hammer, drive, 0.0, 0.3e-3, state=(150e-6, 0.4))
    determinant = float(np.linalg.det(found.matrix))
    assert determinant == pytest.approx(math.exp(-2.0 * 0.3e-3 / hammer.mass), rel=1e-9)


@pytest.mark.parametrize(
    ("row", "constant"), [(0, "damping.coefficient"), (2, "damping.coefficient"), (2, "mass")]
)
def test_what_the_constant_does_against_differences(row: int, constant: str) -> None:
    hammer, drive = case_of(CASES[row])
    with interpreted():
        assert far_off(hammer, drive, [constant], 1.0e-3, STATE) == []


@pytest.mark.slow
def test_lanes_take_damped_hammers_too(hammer: ph.Hammer) -> None:
    """Dots, states and pictures equal those of members that run one by one."""
    coefficients = np.linspace(0.0, 8.0, 40)
    damped = [
        hammer.replace({"damping": {"law": "viscous", "coefficient": f"{c} N s/m"}}) for c in coefficients
    ]
    drive = ph.PulseTrain(hammer.waveform, rate=900.0, pulses=2)
    times = np.linspace(0.0, 3e-3, 301)
    ensemble = ph.Ensemble(damped, drive, 3e-3)
    lanes = ensemble.run(dots=True, strobes=[times] * 40, times=times, engine="lanes")
    plain = ensemble.run(dots=True, strobes=[times] * 40, times=times, engine="plain")
    assert lanes.dots is not None
    assert plain.dots is not None
    assert lanes.strobes is not None
    assert plain.strobes is not None
    assert lanes.x is not None
    assert plain.x is not None
    np.testing.assert_array_equal(lanes.status, 0)
    np.testing.assert_array_equal(lanes.dots.struck, plain.dots.struck)
    np.testing.assert_allclose(lanes.strobes.x, plain.strobes.x, rtol=0.0, atol=2e-8 * STROKE)
    np.testing.assert_allclose(lanes.x, plain.x, rtol=0.0, atol=1e-7 * STROKE)
    np.testing.assert_allclose(lanes.dots.peak_force, plain.dots.peak_force, rtol=1e-6)
    assert not lanes.dots.struck[-1].any()


def test_the_schemes_of_1983_have_no_damping(hammer: ph.Hammer) -> None:
    damped = hammer.replace({"damping": {"law": "viscous", "coefficient": "0.5 N s/m"}})
    with interpreted(), refused("damping"):
        ph.simulate(damped, ph.PulseTrain(hammer.waveform), scheme="trapezoid")


def test_a_file_says_it_with_a_unit(hammer: ph.Hammer) -> None:
    damped = hammer.replace({"damping": {"law": "viscous", "coefficient": "0.5 N s/m"}})
    again = ph.Hammer.from_toml(damped.to_toml())
    assert again == damped
    assert again.fingerprint != hammer.fingerprint
    assert again.damping == ViscousDamping(coefficient=0.5)
    assert "drag" not in ph.simulate(hammer, ph.PulseTrain(hammer.waveform)).force
    with refused("damping.coefficient"):
        hammer.replace({"damping": {"law": "viscous", "coefficient": "-1.0 N s/m"}})


@pytest.mark.parametrize("row", [pytest.param(0, marks=pytest.mark.slow), 2])
def test_sensitivities_of_the_energies_against_differences(row: int) -> None:
    """Also through impacts on a rigid backstop, before and after which the damping acts at other speeds."""
    hammer, drive = case_of(CASES[row])
    names = ["damping.coefficient", "mass"]
    with interpreted():
        found = ph.sensitivities(
            hammer, drive, constants=names, duration=1.0e-3, state=STATE, tolerance=1e-13
        )
        assert found.run_quantities[-1] == "damping_loss"
        for k, name in enumerate(names):
            truth = quantity_differences(hammer, drive, name, 1.0e-3, STATE, size=1e-5, levels=2)[-5:]
            mine = found.run_derivatives[:, k] * abs(found.values[k])
            np.testing.assert_allclose(mine, truth, rtol=0.0, atol=1e-7 * np.abs(truth).max())


def test_without_damping_there_is_no_such_energy() -> None:
    hammer, drive = case_of(CASES[2])
    with interpreted():
        found = ph.sensitivities(
            hammer.replace("damping", None), drive, constants=["mass"], duration=0.2e-3, state=STATE
        )
    assert found.run_quantities[-1] == "backstop_loss"
