"""The tangent flow through the coil circuit: a linear device, and differences of runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from tests.circuit_tangents import deviation
from tests.circuits import integrate
from tests.hammers import interpreted
from tests.tangents import richardson
from tests.truth.test_circuit import TIGHT, as_device, paper, random_driver

import printhammer as ph
from printhammer.derivatives.states import strobe_exponent, tangent_map
from printhammer.drive.waveforms.drivers import Bridge, Capacitor, Chopper, PeakAndHold, Rail
from printhammer.drive.waveforms.shapes import Rectangle, Waveform
from printhammer.run.problem import Problem

WANTED = 1e-6
R, L = 10.0, 20e-3
MASS, STIFFNESS, DAMPING, FACTOR = 0.01, 400.0, 0.3, 6.0
RATES = np.array(
    [[0.0, 1.0, 0.0], [-STIFFNESS / MASS, -DAMPING / MASS, FACTOR / MASS], [0.0, -FACTOR / L, -R / L]]
)
"""Of displacement, velocity and current of a moving coil."""
LINKED = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [FACTOR, 0.0, L]])
"""The same with the flux linkage in place of the current."""


def moving_coil() -> ph.Hammer:
    return ph.Hammer.build(
        MASS,
        magnet={"law": "moving-coil", "constant": FACTOR},
        spring={"law": "preload", "preload": "0 N", "stiffness": STIFFNESS},
        damping={"law": "viscous", "coefficient": DAMPING},
        coil={"resistance": R, "inductance": L},
    )


def flow_for(time: float) -> np.ndarray:
    """Return the matrix exponential in displacement, velocity and flux linkage."""
    return np.asarray(LINKED @ expm(RATES * time) @ np.linalg.inv(LINKED))


def relative(matrix: np.ndarray, truth: np.ndarray) -> float:
    return float(np.abs(matrix / truth - 1.0).max())


def test_a_moving_coil_is_a_matrix_exponential() -> None:
    drive = ph.PulseTrain(Rail(voltage=12.0, width=1.0), rate="1 Hz", pulses=1)
    with interpreted():
        found = tangent_map(moving_coil(), drive, 0.0, 0.02, state=(1e-3, 0.2), tolerance=TIGHT)
    assert found.smooth
    assert relative(found.matrix, flow_for(0.02)) < 1e-10


def test_the_end_of_a_decay_leaves_the_linkage_to_the_place() -> None:
    """A positive current decays to zero; then the armature moves alone, and its position sets the linkage."""
    drive = ph.PulseTrain(
        Rail(voltage=12.0, width=2e-3, decay="zener", decay_voltage=60.0), rate="1 Hz", pulses=1
    )
    with interpreted():
        motion = ph.simulate(moving_coil(), drive, state=(0.0, 0.0), duration=4e-3, tolerance=TIGHT)
        times, paths = motion.switchings
        found = tangent_map(moving_coil(), drive, 0.0, 4e-3, state=(0.0, 0.0), tolerance=TIGHT)
    assert paths == ("blocked",)
    x, v = motion.at(times)
    on = float(times[0])
    before = flow_for(on)
    # The current ends later by -di / (di/dt); it has no force there, and the linkage is then k x.
    free = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    truth = np.zeros((3, 3))
    truth[:2] = expm(free * (4e-3 - on)) @ before[:2]
    truth[2] = FACTOR * truth[0]
    assert np.isfinite([x, v]).all()
    assert np.abs(found.matrix - truth).max() < 1e-10 * np.abs(truth).max()
    assert np.abs(found.matrix[2] - FACTOR * found.matrix[0]).max() < 1e-14


def test_the_exponents_of_a_linear_device_are_its_decay_rates() -> None:
    source = Rectangle(amplitude=5.0, width=1e-3, rise=0.0, decay=0.0, quantity="voltage")
    period = 4e-3
    with interpreted():
        found = strobe_exponent(moving_coil(), source, period, first=21, last=41, tolerance=1e-9)
    rates = np.sort(np.linalg.eigvals(RATES).real)[::-1]
    assert found.ok
    assert found.states.shape == (21, 8)
    assert found.total == pytest.approx(period * float(rates[:2].sum()), rel=1e-2)


def test_the_exponents_of_an_orbit_are_the_logarithms_of_its_multipliers() -> None:
    """Period 1 with a rail driver: after many firings the state repeats."""
    hammer = behind(PLAIN)
    train = ph.PulseTrain(DRIVERS["rail"], period=1.1e-3, pulses=121)
    found = strobe_exponent(hammer, train, first=100, last=120, tolerance=TIGHT)
    matrix = tangent_map(hammer, train, train.times[110], train.times[111], tolerance=TIGHT).matrix
    multipliers = np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1]
    assert [found.value, found.second] == pytest.approx(np.log(multipliers[:2]), rel=1e-6)


PLAIN = {"coil": {"resistance": "3 ohm", "inductance": "3 mH"}}
TURN = {**PLAIN, "coil.turn_resistance": "5 ohm", "coil.leakage": "1 mH"}
DRIVERS: dict[str, Waveform] = {
    "rail": Rail(voltage=24.0, width=2e-4),
    "chopper": Chopper(voltage=30.0, width=2.5e-4, upper=0.8, lower=0.6, decay="zener", decay_voltage=15.0),
    "off-time": Chopper(voltage=30.0, width=2.5e-4, upper=0.8, off_time=2e-5, decay="rail"),
    "peak-and-hold": PeakAndHold(voltage=30.0, width=3e-4, peak_time=1.2e-4, hold_upper=0.5, hold_lower=0.4),
    "capacitor": Capacitor(voltage=30.0, width=3e-4, capacitance=20e-6, charging_resistance=100.0, coils=2),
    "bridge": Bridge(voltage=24.0, width=1.5e-4, reverse=1e-4, decay="rail"),
}


def behind(circuit: dict[str, Any]) -> ph.Hammer:
    """The paper's hammer, pack and backstop, with a rail driver."""
    hammer = ph.load("hendriks-1983-1").replace("coil", circuit["coil"])
    return hammer.replace({key: value for key, value in circuit.items() if key != "coil"})


@pytest.mark.parametrize("name", DRIVERS)
@pytest.mark.parametrize("circuit", [PLAIN, TURN], ids=["plain", "turn"])
def test_through_contacts_and_switches(name: str, circuit: dict[str, Any]) -> None:
    """Two firings pass thresholds, the end of the current, both branches of the pack, and the backstop."""
    hammer = behind(circuit)
    drive = ph.PulseTrain(DRIVERS[name], period=1.1e-3, pulses=2)
    for end in (1e-4, 1.9e-4, 3e-4, 5e-4, 1.4e-3):
        assert deviation(hammer, drive, 0.0, end) < WANTED, end


@pytest.mark.parametrize(("start", "end"), [(2.2e-4, 4.5e-4), (6e-4, 1.3e-3), (1.1e-3, 1.5e-3)])
def test_from_other_times(start: float, end: float) -> None:
    """From a decay, from an armature without current, and from a firing."""
    drive = ph.PulseTrain(DRIVERS["rail"], period=1.1e-3, pulses=2)
    assert deviation(behind(PLAIN), drive, start, end) < WANTED


@pytest.mark.parametrize("seed", [0, 1, 2, 5])
def test_random_coils_against_an_independent_integration(seed: int) -> None:
    """Perturbations of the position and speed with which a run begins without current."""
    rng = np.random.default_rng(seed)
    resistance, inductance = rng.uniform(1.0, 8.0), rng.uniform(2.5e-3, 6e-3)
    hammer, device = (
        paper(resistance, inductance),
        as_device(paper(resistance, inductance), resistance, inductance),
    )
    waveform, phases = random_driver(rng)
    drive = ph.PulseTrain(waveform, rate="1200 Hz", pulses=2)
    end = 3.5e-4
    found = tangent_map(hammer, drive, 0.0, end, tolerance=TIGHT)
    x, v, _memory = found.state_at_start
    # Without current the linkage at the start is that of the place.
    start = found.matrix[:, :2].copy()
    start[:, 0] += device.emf(x, 0.0) * found.matrix[:, 2]
    scales = Problem(hammer, drive, (x, v), 0.0, TIGHT).scales
    motion = ph.simulate(hammer, drive, duration=end, tolerance=TIGHT)
    place, current = float(motion.at([end])[0][0]), float(motion.driven_at([end])[0])
    total = inductance + device.slope(place, current)
    by_current = (start[2] - device.emf(place, current) * start[0]) / total
    for j in range(2):

        def difference(step: float, j: int = j) -> np.ndarray:
            ends = []
            for sign in (1.0, -1.0):
                begun = [x, v]
                begun[j] += sign * step
                run = integrate(
                    device,
                    phases,
                    drive.times.tolist(),
                    (begun[0], begun[1]),
                    end,
                    longest=2e-5,
                    tolerance=3e-13,
                )
                ends.append(run.final)
            return np.asarray((ends[0] - ends[1]) / (2.0 * step))

        sizes = np.array([scales[0], scales[1], 1.0]) / scales[j]
        truth = richardson(difference, 4e-5 * scales[j], 4, sizes)
        own = np.array([start[0, j], start[1, j], by_current[j]])
        assert np.linalg.norm((own - truth) / sizes) < 3e-6 * float(np.linalg.norm(truth / sizes))
