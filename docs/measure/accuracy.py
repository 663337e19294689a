"""Measure the tables of the page on numerics.

Run ``.venv/bin/python docs/measure/accuracy.py``, which takes a minute or two.
"""

import math

import numpy as np
from measured import MOTION, Cell, Column, write
from tests.oracle.integrator import horizon, reference

import printhammer as ph

HAMMER = ph.load("hendriks-1983")
SINGLE = ph.PulseTrain(HAMMER.waveform)
GRID = np.linspace(0.0, 4e-3, 4001)
FINEST = 1e-14
"""Tolerance of the reference, whose error is then about 1e-13 of the stroke."""
ROOMS = (*MOTION, "tests/oracle")


def single_pulse() -> float:
    """Tabulate the errors of a single-pulse cycle against the reference; return the stroke, m."""
    exact = reference(HAMMER, SINGLE, GRID[-1], tolerance=FINEST, times=GRID)
    stroke = float(exact.x.max()) - HAMMER.position
    finer = reference(HAMMER, SINGLE, GRID[-1], tolerance=1e-13, times=GRID)
    print(f"\nReferences of 1e-13 and 1e-14: {np.abs(finer.x - exact.x).max() / stroke:.1e} of the stroke")
    rows: list[list[Cell]] = []
    for tolerance in (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 2e-11, 1e-12, 1e-13):
        motion = ph.simulate(HAMMER, SINGLE, times=GRID, tolerance=tolerance)
        error = np.abs(motion.x - exact.x).max() / stroke
        residual = abs(motion.energy.residual) / motion.energy.throughput
        rows.append([tolerance, motion.steps, float(error), residual])
    columns = [
        Column(name="tolerance", format=".0e"),
        Column(name="steps"),
        Column(name="error / stroke", format=".1e"),
        Column(name="ledger residual / throughput", format=".1e"),
    ]
    settings = {"duration": float(GRID[-1]), "points": GRID.size, "reference": FINEST}
    write("accuracy-tolerance", columns, rows, settings, ROOMS)
    return stroke


def trains(stroke: float) -> None:
    """Tabulate the errors of trains up to the horizon of each train."""
    rows: list[list[Cell]] = []
    drives = {
        "two pulses, 700 µs": ph.PulseTrain(HAMMER.waveform, at=[0.0, 700e-6]),
        "three pulses, 1.2 kHz": ph.PulseTrain(HAMMER.waveform, rate=1200.0, pulses=3),
        "nine pulses, 1.35 ms": ph.PulseTrain(HAMMER.waveform, period=1.35e-3, pulses=9),
        "nine pulses, 1.05 ms": ph.PulseTrain(HAMMER.waveform, period=1.05e-3, pulses=9),
    }
    for name, drive in drives.items():
        end = float(drive.times[-1]) + 2e-3
        grid = np.linspace(0.0, end, 8001)
        until = horizon(HAMMER, drive, end, grid, stroke=stroke)
        exact = reference(HAMMER, drive, end, tolerance=1e-13, times=grid)
        motion = ph.simulate(HAMMER, drive, duration=end, times=grid)
        before = grid < until
        error = np.abs(motion.x - exact.x)[before].max() / stroke
        rows.append([name, f"none in {1e3 * end:.3g}" if until == end else 1e3 * until, float(error)])
    columns = [
        Column(name="drive"),
        Column(name="horizon", unit="ms", format=".2f"),
        Column(name="largest error / stroke before it", format=".1e"),
    ]
    write("accuracy-horizon", columns, rows, {"points": 8001, "reference": 1e-13}, ROOMS)


def pack_alone(tolerance: float) -> float:
    """Return the relative error of the rebound from the pack, exactly sqrt(3.7/12) of the approach speed."""
    pack = {"law": "power", "stiffness": "259 N", "front": "0 m", "thickness": "178 um"}
    mass = ph.Hammer.build("0.4 g", pack=pack)
    still = ph.SineForce(0.0, 1.0)
    motion = ph.simulate(mass, still, state=(-1e-5, 1.5), duration=1e-3, tolerance=tolerance)
    return abs(-motion.contacts[0].v_out / 1.5 / math.sqrt(3.7 / 12.0) - 1.0)


def backstop_alone(tolerance: float) -> float:
    """Return the relative error of z - ln(1 + z) = -(y + ln(1 - y)) for a free rebound from the backstop."""
    backstop = {"law": "hertz", "position": "0 m", "stiffness": 1.2e9, "damping": 4.2e8}
    mass = ph.Hammer.build("0.4 g", backstop=backstop)
    still = ph.SineForce(0.0, 1.0)
    motion = ph.simulate(mass, still, state=(1e-5, -1.95), duration=1e-3, tolerance=tolerance)
    z, y = (4.2e8 / 1.2e9 * abs(v) for v in (motion.contacts[0].v_in, motion.contacts[0].v_out))
    left, right = z - math.log1p(z), -(y + math.log1p(-y))
    return abs(left / right - 1.0)


def oracles() -> None:
    """Tabulate the errors against closed forms, at the default tolerance and at a tight tolerance."""
    rows: list[list[Cell]] = [
        [name, measure(2e-11), measure(1e-12)]
        for name, measure in (("pack alone", pack_alone), ("backstop alone", backstop_alone))
    ]
    errors = [Column(name=f"error at {tolerance}", format=".1e") for tolerance in ("2e-11", "1e-12")]
    write("accuracy-closed-forms", [Column(name="closed form"), *errors], rows, {}, MOTION, hammers=())


def schemes(stroke: float) -> None:
    """Tabulate the order of the 1983 schemes in smooth motion, and their errors on a cycle with contacts."""
    flight = {"state": (80e-6, 1.2), "duration": 80e-6, "times": [80e-6]}
    never = ph.PulseTrain(HAMMER.waveform, at=[1.0])
    landing = ph.simulate(HAMMER, never, tolerance=1e-14, **flight)
    assert not landing.contacts
    exact = ph.simulate(HAMMER, SINGLE, times=GRID, tolerance=1e-13).x
    rows: list[list[Cell]] = []
    for scale in (4.0, 2.0, 1.0, 0.5, 0.25, 0.125):
        cells: list[Cell] = [scale]
        for scheme in ("trapezoid", "runge-kutta-4"):
            motion = ph.simulate(HAMMER, never, scheme=scheme, step_scale=scale, **flight)
            cells.append(float(abs(motion.x[0] - landing.x[0]) / stroke))
        for scheme in ("trapezoid", "runge-kutta-4"):
            motion = ph.simulate(HAMMER, SINGLE, times=GRID, scheme=scheme, step_scale=scale)
            cells.append(float(np.abs(motion.x - exact).max() / stroke) if motion.ok else motion.status)
        rows.append(cells)
    columns = [
        Column(name=f"{scheme}, {motion}", format=".1e")
        for motion in ("flight", "single pulse")
        for scheme in ("trapezoidal rule", "Runge-Kutta")
    ]
    factor = Column(name="factor on all steps", format="g")
    settings = {"flight": 80e-6, "duration": float(GRID[-1]), "points": GRID.size}
    write("accuracy-1983", [factor, *columns], rows, settings, MOTION)


def main() -> None:
    """Measure all tables."""
    stroke = single_pulse()
    trains(stroke)
    oracles()
    schemes(stroke)


if __name__ == "__main__":
    main()
