"""Hold general-purpose solvers against the reference, each called as one would without thinking of contacts.

One right-hand side with all branches of the force, equations (3) to (7); the local maximum in the pack is
kept in a variable. Run it with ``.venv/bin/python docs/measure/general_solvers.py``; it takes a minute.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

import printhammer as ph
from printhammer.reference.integrator import reference

HAMMER = ph.load("hendriks-1983")
RUNS = (
    ("a train, 1.35 ms", ph.PulseTrain(HAMMER.waveform, period=1.35e-3, pulses=9), 3e-3),
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


def right_hand_side(drive):
    """Return the function of time and state, and a counter of its calls."""
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


def compare(name: str, drive: ph.PulseTrain, end: float) -> None:
    """Print the table of one run."""
    grid = np.linspace(0.0, end, 3001)
    exact = reference(HAMMER, drive, end, tolerance=1e-13, times=grid)
    start = (ph.rest_state(HAMMER), 0.0)
    print(f"\n| {name} | rtol | it says | largest error (m) | force evaluations |")
    print("|---|---|---|---|---|")
    for method, rtol in CALLS:
        function, memory = right_hand_side(drive)
        options = {"method": method, "t_eval": grid, "rtol": rtol, "atol": 1e-4 * rtol}
        found = solve_ivp(function, (0.0, end), start, **options)
        error = np.abs(found.y[0] - exact.x[: found.y.shape[1]]).max()
        says = "success" if found.success else "failure"
        print(f"| {method} | {rtol:.0e} | {says} | {error:.0e} | {memory['calls']} |")
    motion = ph.simulate(HAMMER, drive, duration=end, times=grid)
    error = np.abs(motion.x - exact.x).max()
    print(f"| printhammer | 2e-11 | {motion.status} | {error:.0e} | |")


def main() -> None:
    """Print the tables."""
    for run in RUNS:
        compare(*run)


if __name__ == "__main__":
    main()
