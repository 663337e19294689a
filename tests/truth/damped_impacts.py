"""Orbits of the damped impact oscillator, closed by an independent Newton method.

No code is shared with the program.

x'' + b x' + x = 1 + F cos(w t) for x > 0, restitution e at 0: the mirror image of -1 + F cos(w t) for x < 0.
Between impacts x = P(t) + Q(t) with the forced oscillation P = 1 + Re(G exp(i w t)), where
G = F / (1 - w^2 + i b w), and the free one Q. An orbit with k impacts in n periods is given by their phases
and the speeds at which it meets the stop; the flight from each has to lead to the next. Through an impact
w- -> -e w- deviations go as

    S = [[-e, 0], [(a+ + e a-) / w-, -e]]

with the accelerations on both sides.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def newton(function: Callable[[Array], Array], guess: Array, rounds: int = 40) -> Array:
    """Solve n equations, the derivatives from central differences."""
    z = np.array(guess, dtype=np.float64)
    for _ in range(rounds):
        value = function(z)
        columns = []
        for k in range(len(z)):
            step = 1e-6 * max(1.0, abs(z[k]))
            move = step * np.eye(len(z))[k]
            columns.append((function(z + move) - function(z - move)) / (2.0 * step))
        change = -np.linalg.solve(np.column_stack(columns), value)
        z = z + change
        if np.abs(change).max() < 1e-13:
            break
    assert np.abs(function(z)).max() < 1e-9
    return z


@dataclass(frozen=True)
class DampedImpacts:
    damping: float = 0.04
    restitution: float = 0.9

    @property
    def own(self) -> float:
        """Frequency of the free damped oscillation."""
        return math.sqrt(1.0 - 0.25 * self.damping**2)

    def free(self, t: float) -> Array:
        c, s = math.cos(self.own * t), math.sin(self.own * t) / self.own
        half = 0.5 * self.damping
        return math.exp(-half * t) * np.array([[c + half * s, s], [-s, c - half * s]])

    def forced(self, omega: float, force: float, phase: float) -> Array:
        z = force / complex(1.0 - omega**2, self.damping * omega) * complex(math.cos(phase), math.sin(phase))
        return np.array([1.0 + z.real, (1j * omega * z).real])

    def grazing(self, omega: float) -> float:
        """Amplitude of the force at which the oscillation without impact touches the stop."""
        return math.hypot(1.0 - omega**2, self.damping * omega)

    def resonance(self, omega: float, n: int) -> float:
        """Zero where n periods are a whole number of half free oscillations."""
        return math.sin(self.own * 2.0 * math.pi * n / omega)

    def product(self, omega: float, impacts: int, n: int) -> float:
        """Product of the multipliers of an orbit with a given number of impacts in n periods."""
        return float(self.restitution ** (2 * impacts) * math.exp(-self.damping * 2.0 * math.pi * n / omega))

    def misses(self, omega: float, force: float, impacts: Array, n: int) -> Array:
        """Distance by which each flight misses the next impact; rows of phase, rad, and speed before it."""
        out = []
        for i, (phase, speed) in enumerate(impacts):
            after, before = impacts[(i + 1) % len(impacts)]
            if i + 1 == len(impacts):
                after += 2.0 * math.pi * n
            start = np.array([0.0, self.restitution * speed]) - self.forced(omega, force, phase)
            end = self.free((after - phase) / omega) @ start + self.forced(omega, force, after)
            out += [end[0], end[1] + before]
        return np.array(out)

    def monodromy(self, omega: float, force: float, impacts: Array, n: int) -> Array:
        """Derivative of the state after the first impact n periods later with respect to itself."""
        matrix = np.eye(2)
        for i, (phase, _) in enumerate(impacts):
            after, speed = impacts[(i + 1) % len(impacts)]
            if i + 1 == len(impacts):
                after += 2.0 * math.pi * n
            drive = 1.0 + force * math.cos(after)
            e = self.restitution
            before, behind = drive + self.damping * speed, drive - self.damping * e * speed
            saltation = np.array([[-e, 0.0], [-(behind + e * before) / speed, -e]])
            matrix = saltation @ self.free((after - phase) / omega) @ matrix
        return matrix

    def orbit(self, omega: float, force: float, guess: npt.ArrayLike, n: int) -> Array:
        """Phases and speeds of the impacts of an orbit near a guess, a row each."""
        shape = np.array(guess, dtype=np.float64)
        rows = newton(lambda z: self.misses(omega, force, z.reshape(shape.shape), n), shape.reshape(-1))
        return rows.reshape(shape.shape)

    def bifurcation(self, omega: float, multiplier: float, guess: npt.ArrayLike, n: int) -> Array:
        """Phase, speed and force at which an orbit with one impact in n periods has a multiplier."""

        def equations(z: Array) -> Array:
            row = z[np.newaxis, :2]
            matrix = self.monodromy(omega, z[2], row, n)
            return np.append(
                self.misses(omega, z[2], row, n), z[1] * np.linalg.det(matrix - multiplier * np.eye(2))
            )

        return newton(equations, np.array(guess, dtype=np.float64))

    def state(self, omega: float, force: float, impacts: Array, phase: float) -> Array:
        """Displacement and velocity of an orbit at a phase, rad, after its first impact."""
        begin, speed = impacts[0]
        start = np.array([0.0, self.restitution * speed]) - self.forced(omega, force, begin)
        return self.free((phase - begin) / omega) @ start + self.forced(omega, force, phase)
