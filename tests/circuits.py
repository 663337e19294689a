"""Independent integration of a coil under a driver, for tests: current as state, SciPy's event detection.

Nothing is shared with the kernel: the state holds the current where the kernel has the flux linkage, laws and
paths are written out anew, every step is short, and every event is a root of SciPy's dense output.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    Array = npt.NDArray[np.float64]


@dataclass
class Device:
    """Mass, forces and coil of one device; functions of displacement, or of displacement and current."""

    mass: float
    resistance: float
    inductance: float
    force: Callable[[float, float], float]
    """Of displacement and current, all of it but contacts, N."""
    emf: Callable[[float, float], float]
    """Slope of the force of the magnet with the current, N/A."""
    slope: Callable[[float, float], float]
    """Slope of the magnet's flux linkage with the current, H."""
    stop: tuple[float, float, float] | None = None
    """Position, m, stiffness, N/m^1.5, and damping, N s/m^2.5, of a Hertzian backstop."""


@dataclass
class Phase:
    """One phase of a driver, from a time since the firing onward."""

    start: float
    voltage: float
    """Of the supply; of a decay the voltage against which the current decays."""
    series: float = 0.0
    upper: float = math.inf
    lower: float = 0.0
    off_time: float = 0.0
    decay: bool = False


@dataclass
class Run:
    """Outcome of an integration."""

    t: list[float] = field(default_factory=list)
    switchings: list[tuple[float, str]] = field(default_factory=list)
    final: Array = field(default_factory=lambda: np.zeros(3))
    solutions: list[tuple[float, float, Callable[[float], Array]]] = field(default_factory=list)

    def at(self, t: float) -> Array:
        """Return displacement, velocity and current at a time."""
        for begin, end, solution in self.solutions:
            if begin <= t <= end:
                return solution(t)
        raise ValueError(f"{t} s is outside the run")


def integrate(
    device: Device,
    phases: list[Phase],
    firings: list[float],
    state: tuple[float, float],
    end: float,
    *,
    diode: float = 0.7,
    longest: float = math.inf,
    tolerance: float = 1e-12,
) -> Run:
    """Integrate a device to `end`, s, from rest without current; a driver fires at given times."""
    run = Run()
    t, y = 0.0, np.array([*state, 0.0])
    edges = sorted({f + p.start for f in firings for p in phases} | {end})
    path, phase, until = "blocked", None, math.inf
    scale = np.array([1e-4, 1.0, 1.0])

    def rates(path: str, now: Phase | None) -> Callable[[float, Array], list[float]]:
        def slope(_t: float, y: Array) -> list[float]:
            x, v, i = float(y[0]), float(y[1]), float(y[2])
            force = device.force(x, i)
            if device.stop is not None and x < device.stop[0]:
                depth = device.stop[0] - x
                force += depth**1.5 * (device.stop[1] - device.stop[2] * v)
            if path == "blocked":
                return [v, force / device.mass, 0.0]
            assert now is not None
            if path == "chopped":
                u, series = -diode, 0.0
            elif now.decay:
                u, series = -now.voltage, now.series
            else:
                u, series = now.voltage, now.series
            total = device.inductance + device.slope(x, i)
            return [
                v,
                force / device.mass,
                (u - (device.resistance + series) * i - device.emf(x, i) * v) / total,
            ]

        return slope

    def gap(path: str, now: Phase | None) -> Callable[[float, Array], float]:
        def number(_t: float, y: Array) -> float:
            x, v, i = float(y[0]), float(y[1]), float(y[2])
            if now is None:
                return 1.0
            if path == "supply":
                return i if now.decay else (1.0 if math.isinf(now.upper) else now.upper - i)
            if path == "chopped":
                return i - now.lower
            against = now.voltage if now.decay else diode
            return device.emf(x, 0.0) * v + against

        number.terminal = True  # type: ignore[attr-defined]
        number.direction = -1  # type: ignore[attr-defined]
        return number

    def touch(_t: float, y: Array) -> float:
        return float(y[0]) - device.stop[0] if device.stop is not None else 1.0

    touch.terminal = True  # type: ignore[attr-defined]

    def enter(at: float) -> tuple[str, Phase | None, float]:
        fired = [f for f in firings if f <= at + 1e-15]
        if not fired:
            return "blocked", None, math.inf
        now = [p for p in phases if fired[-1] + p.start <= at + 1e-15][-1]
        if now.decay:
            return ("supply" if y[2] > 1e-12 else "blocked"), now, math.inf
        if y[2] >= now.upper:
            return "chopped", now, at + now.off_time if now.off_time else math.inf
        return "supply", now, math.inf

    def note(before: str, at: float) -> None:
        if path != before:
            run.switchings.append((at, path))

    before = path
    path, phase, until = enter(t)
    note(before, t)
    while t < end:
        stop = min([e for e in edges if e > t + 1e-15] + [until])
        solution = solve_ivp(
            rates(path, phase),
            (t, stop),
            y,
            method="DOP853",
            rtol=tolerance,
            atol=tolerance * scale,
            max_step=longest,
            events=[gap(path, phase), touch],
            dense_output=True,
        )
        reached = float(solution.t[-1])
        run.solutions.append((t, reached, solution.sol))
        t, y = reached, solution.y[:, -1].copy()
        before = path
        if solution.t_events[0].size:
            assert phase is not None
            if path == "blocked":
                path = "supply" if phase.decay else "chopped"
            elif path == "supply" and not phase.decay:
                path, until = "chopped", (t + phase.off_time if phase.off_time else math.inf)
            elif path == "chopped" and phase.lower > 0.0:
                path = "supply"
            else:
                path, y[2] = "blocked", 0.0
        elif solution.t_events[1].size and t < stop:
            y[0] += math.copysign(1e-18, y[1])
        elif t >= until:
            path, until = "supply", math.inf
        else:
            path, phase, until = enter(t)
        note(before, t)
    run.final = y
    return run
