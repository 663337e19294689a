"""Compare general-purpose solvers, called without regard to contacts, with the reference.

All solvers use one right-hand side with all branches of the force, equations (3) to (7); the local
maximum in the pack is stored in a variable. Run ``.venv/bin/python
docs/measure/general_solvers.py``, which takes a minute.
"""

import math

import numpy as np
from measured import MOTION, Cell, Column, write
from scipy.integrate import solve_ivp
from tests.oracle.integrator import reference

import printhammer as ph

HAMMER = ph.load("hendriks-1983")
RUNS = (
    ("train of 1.35 ms, first 3 ms", ph.PulseTrain(HAMMER.waveform, period=1.35e-3, pulses=9), 3e-3),
    ("two pulses, 20 ms apart", ph.PulseTrain(HAMMER.waveform, at=[0.0, 20e-3]), 21e-3),
)
CALLS = (
    ("RK45", 1e-3),
    ("RK45", 1e-6),
    ("RK45", 1e-9),
    ("RK45", 1e-11),
    ("DOP853", 1e-9),
    ("DOP853", 1e-11),
    ("Radau", 1e-6),
    ("BDF", 1e-6),
    ("LSODA", 1e-9),
)
FEW = 100
"""Number of force evaluations below which a solver must have missed the pulses."""


def right_hand_side(drive):
    """Return the right-hand side as a function of time and state, and a counter of its calls."""
    magnet, spring, pack, backstop = HAMMER.magnet, HAMMER.spring, HAMMER.pack, HAMMER.backstop
    wave, b, front = HAMMER.waveform, HAMMER.position, HAMMER.front
    memory = {"r_max": 0.0, "calls": 0}

    def current(t: float) -> float:
        total = 0.0
        for fired in drive.times:
            tau = t - fired
            if 0.0 <= tau < wave.width:
                total += wave.amplitude * (1.0 - math.exp(-tau / wave.rise))
            elif tau >= wave.width:
                reached = wave.amplitude * (1.0 - math.exp(-wave.width / wave.rise))
                total += reached * math.exp(-(tau - wave.width) / wave.decay)
        return total

    def function(t: float, state: np.ndarray) -> tuple[float, float]:
        x, v = state
        memory["calls"] += 1
        root = math.sqrt(x) if x > 0.0 else math.nan
        force = magnet.F0 - (magnet.Am - magnet.Bm * current(t)) ** 2 / root
        force += spring.Bs - spring.Bs / spring.As * (x - b)
        r = (x - front) / pack.thickness
        if r > 0.0 and v >= 0.0:
            memory["r_max"] = r
            force -= pack.stiffness * r**2.7
        elif r > 0.0:
            force -= pack.stiffness * max(memory["r_max"], r) ** -8.3 * r**11
        if x < b:
            force += (backstop.k - backstop.l * v) * (b - x) ** 1.5
        return v, force / HAMMER.mass

    return function, memory


def compare(drive: ph.PulseTrain, end: float) -> list[Cell]:
    """Return the errors of all solvers in one run, or their error messages."""
    grid = np.linspace(0.0, end, 3001)
    exact = reference(HAMMER, drive, end, tolerance=1e-13, times=grid)
    start = (ph.rest_state(HAMMER), 0.0)
    cells: list[Cell] = []
    for method, rtol in CALLS:
        function, memory = right_hand_side(drive)
        options = {"method": method, "t_eval": grid, "rtol": rtol, "atol": 1e-4 * rtol}
        found = solve_ivp(function, (0.0, end), start, **options)
        error = np.abs(found.y[0] - exact.x[: found.y.shape[1]]).max()
        if not found.success:
            cells.append(f"failure: {found.message}")
        elif memory["calls"] < FEW:
            cells.append(f"{error:.0e}, {memory['calls']} evaluations in all".replace("e-0", "e-"))
        else:
            cells.append(float(error))
    motion = ph.simulate(HAMMER, drive, duration=end, times=grid)
    return [*cells, float(np.abs(motion.x - exact.x).max()) if motion.ok else motion.status]


def main() -> None:
    """Measure the table."""
    solvers = [f"{method}, {rtol:.0e}".replace("e-0", "e-") for method, rtol in CALLS]
    errors = [compare(drive, end) for _, drive, end in RUNS]
    solvers.append("printhammer, default")
    rows: list[list[Cell]] = [list(row) for row in zip(solvers, *errors, strict=True)]
    columns = [Column(name=name, unit="m", format=".0e") for name, _, _ in RUNS]
    settings = {name: end for name, _, end in RUNS}
    first = Column(name="solver, relative tolerance")
    write("general-solvers", [first, *columns], rows, settings, (*MOTION, "tests/oracle"))


if __name__ == "__main__":
    main()
