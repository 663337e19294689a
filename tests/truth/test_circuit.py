"""The circuit of the coil: closed forms, and an independent integration of random coils and drivers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from tests.circuits import Device, Phase, Run, integrate
from tests.errors import refused
from tests.hammers import DRAWS, interpreted

import printhammer as ph
from printhammer.drive.waveforms.drivers import Bridge, Capacitor, Chopper, PeakAndHold, Rail
from printhammer.drive.waveforms.shapes import Waveform

TIGHT = 1e-13
R, L = 10.0, 20e-3
STROKE = 1.5e-4
FAR = 0.1
"""Distance by which a pack is moved out of reach, m."""


def locked(**coil: str) -> ph.Hammer:
    """A coil on a nearly immobile mass."""
    spring = {"law": "preload", "preload": "0 N", "stiffness": "100 N/m"}
    return ph.Hammer.build("1 kg", spring=spring, coil={"resistance": f"{R} ohm", **coil})


def driven(waveform: Waveform, end: float, **coil: str) -> ph.Motion:
    coil = coil or {"inductance": f"{L} H"}
    drive = ph.PulseTrain(waveform, rate="10 Hz", pulses=1)
    with interpreted():
        motion = ph.simulate(locked(**coil), drive, state=(1e-4, 0.0), duration=end, tolerance=TIGHT)
        assert motion.ok
        _ = motion.current
        return motion


def test_rise_and_decay_of_a_coil_without_a_magnet() -> None:
    width, clamp = 2e-3, 10.0
    motion = driven(Rail(voltage=24.0, width=width, decay="zener", decay_voltage=clamp), 6e-3)
    tau = L / R
    reached = 2.4 * -math.expm1(-width / tau)
    off = width + tau * math.log1p(reached * R / clamp)
    t = motion.t
    rise = 2.4 * -np.expm1(-t / tau)
    fall = (reached + clamp / R) * np.exp(-(t - width) / tau) - clamp / R
    expected = np.where(t < width, rise, np.where(t < off, fall, 0.0))
    assert np.abs(motion.current - expected).max() < 1e-11
    times, paths = motion.switchings
    assert paths == ("blocked",)
    assert times[0] == pytest.approx(off, abs=1e-14)


def test_a_chopper_of_two_thresholds_has_the_closed_form_s_instants() -> None:
    upper, lower, diode, voltage = 1.0, 0.8, 0.7, 24.0
    width = 8e-3
    motion = driven(Chopper(voltage=voltage, width=width, upper=upper, lower=lower), 8e-3)
    tau = L / R
    at = -tau * math.log1p(-upper * R / voltage)
    expected = [at]
    down = tau * math.log((upper + diode / R) / (lower + diode / R))
    up = tau * math.log((voltage / R - lower) / (voltage / R - upper))
    while expected[-1] < width:
        expected.append(expected[-1] + (down if len(expected) % 2 else up))
    times, paths = motion.switchings
    assert paths[:3] == ("chopped", "supply", "chopped")
    # The last one is the decay after the width.
    assert times[:-1] == pytest.approx([t for t in expected if t < width], abs=1e-12)


@pytest.mark.parametrize("ulps", [-50, -1, 0, 1, 50])
def test_a_threshold_that_is_reached_at_the_end_of_the_pulse_switches_once(ulps: int) -> None:
    """Pulse and threshold end the supply together: the current decays through the diode, switched once."""
    upper, voltage, diode, tau = 1.0, 24.0, 0.7, L / R
    width = -tau * math.log1p(-upper * R / voltage)
    width += ulps * math.ulp(width)
    end = 5e-3
    motion = driven(Chopper(voltage=voltage, width=width, upper=upper, lower=0.8), end)
    assert len(motion.switchings[0]) <= 1
    expected = (upper + diode / R) * math.exp(-(end - width) / tau) - diode / R
    assert motion.current[-1] == pytest.approx(expected, abs=1e-11)


def test_a_fixed_off_time_and_a_current_that_ends_in_it() -> None:
    motion = driven(Chopper(voltage=24.0, width=6e-3, upper=0.05, off_time=3e-3), 5e-3)
    times, paths = motion.switchings
    tau = L / R
    first = -tau * math.log1p(-0.05 * R / 24.0)
    assert paths[:3] == ("chopped", "blocked", "supply")
    assert times[0] == pytest.approx(first, abs=1e-13)
    assert times[1] == pytest.approx(first + tau * math.log1p(0.05 * R / 0.7), abs=1e-12)
    assert times[2] == pytest.approx(first + 3e-3, abs=1e-13)


def test_a_capacitor_is_a_damped_oscillation() -> None:
    capacitance, charging = 100e-6, 1e4
    waveform = Capacitor(
        voltage=30.0, width=5e-3, capacitance=capacitance, charging_resistance=charging, coils=2
    )
    motion = driven(waveform, 4e-3)
    a = np.array([[-R / L, 1.0 / L], [-2.0 / capacitance, -1.0 / (charging * capacitance)]])
    steady = np.linalg.solve(a, [0.0, -30.0 / (charging * capacitance)])
    for t, current in zip(motion.t[::100], motion.current[::100], strict=True):
        exact = steady + expm(a * t) @ (np.array([0.0, 30.0]) - steady)
        assert current == pytest.approx(exact[0], abs=1e-11)


def test_a_shorted_turn_is_a_second_exponential() -> None:
    turn, leakage = 3.0, 2e-3
    motion = driven(
        Rail(voltage=24.0, width=5e-3),
        4e-3,
        inductance=f"{L} H",
        turn_resistance=f"{turn} ohm",
        leakage=f"{leakage} H",
    )
    # Of the flux linkages of coil and turn.
    a = np.array(
        [
            [-R / leakage, R / leakage],
            [turn / leakage, -turn * (1.0 / L + 1.0 / leakage)],
        ]
    )
    steady = np.linalg.solve(a, [-24.0, 0.0])
    for t, current in zip(motion.t[::100], motion.current[::100], strict=True):
        coil, main = steady - expm(a * t) @ steady
        assert current == pytest.approx((coil - main) / leakage, abs=1e-11)


def test_a_bridge_drives_the_current_through_zero() -> None:
    motion = driven(Bridge(voltage=24.0, width=1e-3, reverse=2e-3, decay="rail"), 8e-3)
    tau = L / R
    first = 2.4 * -math.expm1(-1e-3 / tau)
    second = (first + 2.4) * math.exp(-2e-3 / tau) - 2.4
    assert motion.driven_at([1e-3, 3e-3]) == pytest.approx([first, second], abs=1e-11)
    times, paths = motion.switchings
    assert paths == ("backward", "blocked")
    assert times[1] == pytest.approx(3e-3 + tau * math.log1p(-second * R / 24.0), abs=1e-12)


def test_a_moving_coil_is_linear() -> None:
    """Force k i and back-EMF k v: agreement with the matrix exponential to 1e-12."""
    mass, stiffness, damping, factor, voltage = 0.01, 400.0, 0.3, 6.0, 12.0
    hammer = ph.Hammer.build(
        mass,
        magnet={"law": "moving-coil", "constant": factor},
        spring={"law": "preload", "preload": "0 N", "stiffness": stiffness},
        damping={"law": "viscous", "coefficient": damping},
        coil={"resistance": R, "inductance": L},
    )
    a = np.array(
        [
            [0.0, 1.0, 0.0],
            [-stiffness / mass, -damping / mass, factor / mass],
            [0.0, -factor / L, -R / L],
        ]
    )
    steady = np.linalg.solve(a, [0.0, 0.0, -voltage / L])
    start = np.array([1e-3, 0.2, 0.0])
    drive = ph.PulseTrain(Rail(voltage=voltage, width=1.0), rate="1 Hz", pulses=1)
    with interpreted():
        motion = ph.simulate(hammer, drive, state=(1e-3, 0.2), duration=0.02, tolerance=TIGHT)
        times = np.linspace(0.0, 0.02, 21)
        x, v = motion.at(times)
        current = motion.driven_at(times)
        ledger = motion.energy
    exact = np.array([steady + expm(a * t) @ (start - steady) for t in times])
    assert np.abs(x - exact[:, 0]).max() < 1e-12 * np.abs(exact[:, 0]).max()
    assert np.abs(v - exact[:, 1]).max() < 1e-12 * np.abs(exact[:, 1]).max()
    assert np.abs(current - exact[:, 2]).max() < 1e-12 * np.abs(exact[:, 2]).max()
    assert abs(ledger.residual) < 1e-12 * ledger.throughput
    assert abs(ledger.electric_residual) < 1e-12 * ledger.throughput


def paper(resistance: float, inductance: float, **more: Any) -> ph.Hammer:
    """The hammer of the paper with a rail driver, its pack out of reach; tests share the machine code."""
    paper = {"pack.front": "1 mm", "platen": "1.1 mm", "pack.thickness": "0.1 mm"}
    return ph.load("hendriks-1983-1").replace(
        {"coil.resistance": resistance, "coil.inductance": inductance, **paper, **more}
    )


def as_device(hammer: ph.Hammer, resistance: float, inductance: float) -> Device:
    """The same hammer, defined by its constants for the independent integration."""
    c = {key: constant.si for key, constant in hammer.constants.items()}
    f0, am, bm = c["magnet.F0"], c["magnet.Am"], c["magnet.Bm"]
    bs, stiffness, place = c["spring.Bs"], c["spring.Bs"] / c["spring.As"], c["backstop.position"]

    def root(x: float) -> float:
        return math.sqrt(max(x, 1e-9))

    return Device(
        mass=c["mass"],
        resistance=resistance,
        inductance=inductance,
        force=lambda x, i: f0 - (am - bm * i) ** 2 / root(x) + bs - stiffness * (x - place),
        emf=lambda x, i: 2.0 * bm * (am - bm * i) / root(x),
        slope=lambda x, _i: -4.0 * bm * bm * root(x),
        stop=(place, c["backstop.stiffness"], c["backstop.damping"]),
    )


def random_driver(rng: np.random.Generator) -> tuple[Waveform, list[Phase]]:
    """Return a driver of random kind, and its definition for the independent integration."""
    voltage, width = rng.uniform(10.0, 40.0), rng.uniform(60e-6, 250e-6)
    clamp, series = rng.uniform(0.5, 30.0), rng.uniform(0.0, 2.0)
    upper = rng.uniform(0.3, 1.5)
    lower, off_time = upper * rng.uniform(0.6, 0.95), rng.uniform(5e-6, 40e-6)
    rest = {"decay": "zener", "decay_voltage": clamp, "source_resistance": series}
    off = Phase(width, clamp, decay=True)
    on = Phase(0.0, voltage, series)
    match int(rng.integers(4)):
        case 0:
            return Rail(voltage=voltage, width=width, **rest), [on, off]
        case 1:
            chopped = Phase(0.0, voltage, series, upper, lower)
            return Chopper(voltage=voltage, width=width, upper=upper, lower=lower, **rest), [chopped, off]
        case 2:
            chopped = Phase(0.0, voltage, series, upper, off_time=off_time)
            waveform = Chopper(voltage=voltage, width=width, upper=upper, off_time=off_time, **rest)
            return waveform, [chopped, off]
        case _:
            peak = 0.4 * width
            hold = Phase(peak, voltage, series, 0.4 * upper, 0.4 * lower)
            waveform = PeakAndHold(
                voltage=voltage,
                width=width,
                peak_time=peak,
                hold_upper=0.4 * upper,
                hold_lower=0.4 * lower,
                **rest,
            )
            return waveform, [on, hold, off]


def compare(seed: int, tolerance: float) -> tuple[ph.Motion, Run]:
    """Run one random coil and driver with both integrators."""
    rng = np.random.default_rng(seed)
    resistance, inductance = rng.uniform(1.0, 8.0), rng.uniform(2.5e-3, 6e-3)
    hammer = paper(resistance, inductance)
    waveform, phases = random_driver(rng)
    end = 1.5e-3
    motion = ph.simulate(
        hammer, ph.PulseTrain(waveform, rate="1200 Hz", pulses=2), duration=end, tolerance=tolerance
    )
    firings = motion.drive.times.tolist()
    run = integrate(
        as_device(hammer, resistance, inductance),
        phases,
        firings,
        (float(motion.x[0]), 0.0),
        end,
        longest=2e-5,
        tolerance=max(tolerance, 3e-13),
    )
    return motion, run


def agrees(motion: ph.Motion, run: Run, time: float) -> None:
    """Compare the switchings of two runs; the first switching of the second run is its start."""
    times, paths = motion.switchings
    others = [entry for entry in run.switchings if entry[0] > 0.0]
    assert list(paths) == [path for _t, path in others]
    assert times == pytest.approx([t for t, _path in others], abs=time)


@pytest.mark.parametrize("seed", range(12))
def test_random_coils_against_an_independent_integration(seed: int) -> None:
    motion, run = compare(seed, TIGHT)
    assert motion.ok
    agrees(motion, run, 1e-11)
    t = np.linspace(0.0, 1.5e-3, 31)
    other = np.array([run.at(float(moment)) for moment in t])
    x, v = motion.at(t)
    assert np.abs(x - other[:, 0]).max() < 1e-11
    assert np.abs(v - other[:, 1]).max() < 1e-7
    assert np.abs(motion.driven_at(t) - other[:, 2]).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("block", range(3))
def test_no_switching_of_many_runs_is_lost(block: int) -> None:
    """Ten blocks of 100 runs have passed; `PRINTHAMMER_DRAWS=4` repeats three of them."""
    for seed in range(100 * block, 100 * block + 25 * DRAWS):
        motion, run = compare(1000 + seed, 1e-11)
        assert motion.ok
        agrees(motion, run, 1e-8)


@pytest.mark.parametrize("seed", range(200))
def test_both_ledgers_close(seed: int) -> None:
    rng = np.random.default_rng(500 + seed)
    turn = {"coil.turn_resistance": rng.uniform(1.0, 10.0), "coil.leakage": 1e-3} if seed % 2 else {}
    hammer = paper(rng.uniform(1.0, 8.0), rng.uniform(2.5e-3, 6e-3), **turn)
    waveform, _phases = random_driver(rng)
    motion = ph.simulate(hammer, ph.PulseTrain(waveform, rate="1200 Hz", pulses=2), duration=1.5e-3)
    ledger = motion.energy
    assert motion.ok
    assert abs(ledger.residual) < 1e-8 * ledger.throughput
    assert abs(ledger.electric_residual) < 1e-8 * ledger.throughput
    assert ledger.supply_work > ledger.copper_loss > 0.0


def test_a_coil_without_back_emf_leaves_the_motion_of_the_current_as_it_was() -> None:
    """The voltage R i + L di/dt of a given current reproduces this current, and the motion with it."""
    shipped = ph.load("hendriks-1983-1")
    # The armature does not reach the pack; laws without a pack would be compiled for this test alone.
    hammer = shipped.replace({"pack.front": shipped.front + FAR, "platen": shipped.platen + FAR})
    pulse = hammer.waveform
    assert pulse is not None
    amplitude, width, rise, decay = (getattr(pulse, k) for k in ("amplitude", "width", "rise", "decay"))
    resistance, inductance = 3.0, 1e-3
    end = 8e-4
    with interpreted():
        old = ph.simulate(hammer, ph.PulseTrain(pulse, rate=1e3, pulses=1), duration=end, tolerance=TIGHT)
        _ = old.at([0.0])
    coil = hammer.replace(
        {"coil.resistance": resistance, "coil.inductance": inductance, "coil.back_emf": False}
    )
    reached = -amplitude * math.expm1(-width / rise)
    source = Exponentials(
        (0.0, resistance * amplitude, amplitude * (inductance / rise - resistance), 1.0 / rise),
        (width, 0.0, reached * (resistance - inductance / decay), 1.0 / decay),
    )
    drive = ph.PulseTrain(source, rate=1000.0, pulses=1)
    new = ph.simulate(coil, drive, duration=end, tolerance=TIGHT)
    t = np.linspace(0.0, end, 101)
    with interpreted():
        before = old.at(t)[0]
    assert np.abs(new.driven_at(t) - old.drive.value(t)).max() < 1e-9 * amplitude
    assert np.abs(new.at(t)[0] - before).max() < 1e-9 * STROKE
    assert {contact.surface for contact in (*old.contacts, *new.contacts)} == {"backstop"}


class Exponentials(Waveform):
    """Voltages that are exponentials, in succession."""

    shape = "exponentials"
    rows: tuple[tuple[float, float, float, float], ...] = ()

    def __init__(self, *rows: tuple[float, float, float, float]) -> None:
        super().__init__(rows=rows, quantity="voltage")

    def segments(self) -> Any:
        from printhammer.drive.segments import EXPONENTIAL, table

        return table([(s, EXPONENTIAL, a, b, rate, 0.0) for s, a, b, rate in self.rows], 1e-2)

    def scaled(self, factor: float) -> Any:
        raise NotImplementedError


@pytest.mark.parametrize(
    ("coil", "waveform", "key"),
    [
        ({}, Rail(voltage=24.0, width=1e-3), "coil.resistance"),
        (
            {"resistance": "2 ohm", "inductance": "0.5 mH"},
            Rail(voltage=24.0, width=1e-3),
            "coil.inductance",
        ),
        (
            {"resistance": "20 ohm", "inductance": "3 mH"},
            PeakAndHold(voltage=24.0, width=1e-3, peak_time=1e-4, hold_upper=2.0, hold_lower=1.0),
            "hold_upper",
        ),
    ],
)
def test_a_coil_that_is_no_circuit_is_one_sentence(
    coil: dict[str, str], waveform: Waveform, key: str
) -> None:
    hammer = ph.load("hendriks-1983-1")
    if coil:
        hammer = hammer.replace("coil", coil)
    with refused(key):
        ph.simulate(hammer, ph.PulseTrain(waveform, rate="1 kHz", pulses=1))


def test_thresholds_in_the_wrong_order_and_negative_resistance_are_refused() -> None:
    with refused(None, file="chopper waveform"):
        Chopper(voltage=24.0, width=1e-3, upper=1.0, lower=1.2)
    with refused(None, file="chopper waveform"):
        Chopper(voltage=24.0, width=1e-3, upper=1.0)
    with refused("coil.resistance"):
        ph.load("hendriks-1983-1").replace("coil.resistance", "-1 ohm")
    with refused(None, file="rail waveform"):
        Rail(voltage=24.0, width=1e-3, decay="zener")
