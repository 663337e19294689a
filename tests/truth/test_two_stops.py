"""Motion between a rigid backstop and a rigid front stop: closed forms, and the mirror image."""

import math

import numpy as np
import pytest
from tests.hammers import interpreted
from tests.tangents import SHARP, deviation

import printhammer as ph
from printhammer.run.motion import Motion

GRAVITY = 9.80665


def between(front: float, back: float, restitution: float = 0.8, mass: float = 1e-3) -> ph.Hammer:
    """Mass without a spring between two rigid stops."""
    return ph.Hammer.build(
        mass,
        pack={"law": "rigid", "front": front, "restitution": restitution},
        backstop={"law": "rigid", "position": back, "restitution": restitution},
    )


def quiet(duration: float = 1.0) -> ph.SineForce:
    """Drive without a force."""
    return ph.SineForce(0.0, 1.0 / duration)


def test_a_free_mass_flies_from_stop_to_stop() -> None:
    """Every impact multiplies the speed by e: flights last play / (v e^n)."""
    play, speed, e = 2e-3, 0.5, 0.7
    with interpreted():
        motion = ph.simulate(between(play, 0.0, e), quiet(), duration=0.2, state=(0.0, speed))
        energy = motion.energy
    times = np.cumsum([play / (speed * e**n) for n in range(20)])
    times = times[times < 0.2]
    assert len(times) == 8
    np.testing.assert_allclose([each.t_in for each in motion.contacts], times, rtol=1e-12)
    assert [each.surface for each in motion.contacts] == ["pack", "backstop"] * (len(times) // 2) + [
        "pack"
    ] * (len(times) % 2)
    losses = [0.5e-3 * speed**2 * e ** (2 * n) * (1.0 - e**2) for n in range(len(times))]
    np.testing.assert_allclose([each.loss for each in motion.contacts], losses, rtol=1e-11)
    assert energy.pack_loss == pytest.approx(sum(losses[::2]), rel=1e-11)
    assert energy.backstop_loss == pytest.approx(sum(losses[1::2]), rel=1e-11)


@pytest.mark.parametrize("e", [0.0, 0.4, 0.8])
def test_bouncing_to_rest_on_the_front(e: float) -> None:
    """A weight that falls on the front from h rests after sqrt(2 h / g) (1 + e) / (1 - e).

    A force of -F sin(w t) lifts it off where F sin(w t) exceeds the weight.
    """
    height, mass, amplitude, rate = 1e-3, 1e-3, 15e-3, 0.5
    hammer = between(0.0, -5e-3, e, mass).replace("force.weight", {"law": "gravity", "angle": "-90 deg"})
    motion = ph.simulate(
        hammer,
        ph.SineForce(-amplitude, rate),
        duration=0.25 / rate,
        state=(-height, 0.0),
        ledger=True,
        tolerance=1e-12,
    )
    assert motion.status == "ok"
    last = [each for each in motion.contacts if each.surface == "pack"][-1]
    lift = math.asin(mass * GRAVITY / amplitude) / (2.0 * math.pi * rate)
    assert last.t_out == pytest.approx(lift, rel=1e-11)
    fall = math.sqrt(2.0 * height / GRAVITY)
    quiet_fall = ph.simulate(hammer, quiet(), duration=0.2, state=(-height, 0.0))
    rest = quiet_fall.contacts[-1]
    assert rest.t_out is None
    # Bounces lower than 1e-12 typical displacements are not followed.
    assert rest.t_in == pytest.approx(fall * (1.0 + e) / (1.0 - e), rel=1e-5)
    assert (quiet_fall.x[-1], quiet_fall.v[-1]) == (0.0, 0.0)
    assert abs(motion.energy.residual) < 1e-11 * motion.energy.throughput


def mirrored(rng: np.random.Generator) -> tuple[ph.Hammer, ph.Hammer, dict[str, float]]:
    """Return a random oscillator with a backstop, and its mirror image with a front stop."""

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    stiffness, cubic, center = log(20.0, 500.0), log(1e6, 1e8), float(rng.uniform(-1e-3, 1e-3))
    place, e, force = -float(rng.uniform(0.0, 5e-4)), float(rng.uniform(0.2, 0.9)), 0.1 * float(rng.normal())
    changes: dict[str, dict[str, object]] = {}
    if rng.random() < 0.5:
        changes["damping"] = {"law": "viscous", "coefficient": log(1e-3, 0.1)}
    elif rng.random() < 0.5:
        changes["force.guide"] = {"law": "friction", "kinetic": log(1e-3, 0.05)}
    else:
        # No damping, by the same laws as with it.
        changes["damping"] = {"law": "viscous", "coefficient": 0.0}
    hammers = []
    for sign in (1.0, -1.0):
        stop = {"backstop": "position", "pack": "front"}
        role = "backstop" if sign > 0.0 else "pack"
        parts: dict[str, object] = {role: {"law": "rigid", stop[role]: sign * place, "restitution": e}}
        hammer = ph.Hammer.build(1e-3, name="mirror", **parts)
        spring = {"law": "cubic", "stiffness": stiffness, "cubic": cubic, "center": sign * center}
        hammer = hammer.replace(
            {"force.spring": spring, "force.push": {"law": "constant", "force": sign * force}}
        )
        hammers.append(hammer.replace(changes))
    drive = {"amplitude": log(0.05, 1.0), "frequency": log(30.0, 400.0)}
    return hammers[0], hammers[1], drive


def events(motion: Motion, sign: float) -> list[tuple[float, float]]:
    """Return times and velocities of the impacts faster than 10 mm/s, mirrored for `sign` -1."""
    return [(each.t_in, sign * each.v_in) for each in motion.contacts if abs(each.v_in) > 1e-2]


def test_a_mirror_image() -> None:
    rng = np.random.default_rng(12)
    compared = 0
    for _ in range(30):
        right, left, about = mirrored(rng)
        state = (float(rng.uniform(0.0, 1e-3)), float(rng.normal()) * 0.3)
        motions = [
            ph.simulate(
                hammer,
                ph.SineForce(sign * about["amplitude"], about["frequency"]),
                duration=0.02,
                state=(sign * state[0], sign * state[1]),
                ledger=True,
                tolerance=SHARP,
            )
            for hammer, sign in ((right, 1.0), (left, -1.0))
        ]
        one, other = events(motions[0], 1.0), events(motions[1], -1.0)
        assert len(one) == len(other)
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-8)
        held, image = ([(s.t_in, s.t_out) for s in motion.sticks] for motion in motions)
        assert len(held) == len(image)
        for motion in motions:
            assert abs(motion.energy.residual) < 1e-10 * motion.energy.throughput
        np.testing.assert_allclose(motions[0].x[-1], -motions[1].x[-1], rtol=0.0, atol=1e-10)
        compared += len(one)
    assert compared > 60


def test_tangent_maps_between_two_stops() -> None:
    rng = np.random.default_rng(83)
    impacts = 0
    for k in range(16):
        hammer = between(5e-4, -5e-4, float(rng.uniform(0.4, 0.9)))
        spring = {"law": "cubic", "stiffness": 100.0, "cubic": 1e7, "center": 0.0}
        hammer = hammer.replace("force.spring", spring)
        hammer = hammer.replace("damping", {"law": "viscous", "coefficient": 0.05 * (k % 2)})
        drive = ph.SineForce(float(rng.uniform(0.2, 0.8)), float(rng.uniform(50.0, 200.0)))
        state, end = (1e-4, float(rng.uniform(0.2, 0.6))), float(rng.uniform(5e-3, 1.2e-2))
        impacts += len(ph.simulate(hammer, drive, duration=end, state=state).contacts)
        assert deviation(hammer, drive, 0.0, end, state=state, size=1e-5) < 1e-6
    assert impacts > 40
