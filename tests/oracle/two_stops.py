"""Symmetric orbits with one impact at each of two rigid stops, in closed form; part of the oracle.

S. W. Shaw, J. Appl. Mech. 52 (1985) 453, with a spring and damping; A. Heiman, A. Bajaj and P. Sherman,
J. Sound Vib. 124 (1988) 55, without (impact pair). The stops are at -1 and 1, the mass is 1.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

Orbit = tuple[float, float]
"""Phase φ of the force at the impact at -1, and speed just after it."""


@dataclass(frozen=True)
class TwoStops:
    """x'' + c x' + k x = A cos(w t + φ) for -1 < x < 1, with v -> -e v at both stops."""

    stiffness: float
    damping: float
    amplitude: float
    rate: float
    restitution: float

    @property
    def half(self) -> np.ndarray:
        """Transition matrix of the motion without force over half a period."""
        generator = np.array([[0.0, 1.0], [-self.stiffness, -self.damping]])
        matrix: np.ndarray = expm(generator * math.pi / self.rate)
        return matrix

    @property
    def impedance(self) -> complex:
        """Ratio of the force to the steady response."""
        return complex(self.stiffness - self.rate**2, self.damping * self.rate)

    @property
    def shape(self) -> tuple[float, float]:
        """Speed just after an impact, and X sin θ, by the free part y of the displacement at -1.

        Remove the steady response X cos(w t + θ): y(π/w) = -y(0) for both stops, y'(0) = v + X w sin θ and
        y'(π/w) = v/e - X w sin θ, with y' proportional to y by the transition matrix.
        """
        m = self.half
        a = -(1.0 + m[0, 0]) / m[0, 1]
        b = m[1, 0] + m[1, 1] * a
        speed = (a + b) * self.restitution / (1.0 + self.restitution)
        return float(speed), float((a - speed) / self.rate)

    def orbits(self) -> list[Orbit]:
        """Return phase and speed of the orbits that go from -1 to 1 in half a period.

        X cos θ = -(1 + y) and X sin θ = slope y, so that cos² + sin² = 1 is a quadratic equation for y.
        """
        response = self.amplitude / self.impedance
        size, lag = abs(response), -math.atan2(response.imag, response.real)
        speed, slope = self.shape
        orbits = []
        for y in np.roots([1.0 + slope**2, 2.0, 1.0 - size**2]):
            if abs(y.imag) < 1e-12 and speed * y.real > 0.0:
                theta = math.atan2(slope * y.real / size, -(1.0 + y.real) / size)
                orbits.append((theta + lag, float(speed * y.real)))
        return orbits

    def half_cycle(self, phase: float, speed: float) -> np.ndarray:
        """Derivative of (time, speed) just after an impact by those after the impact before."""
        return self.impact_map(self.amplitude * math.cos(phase) + self.stiffness, speed)

    def impact_map(self, force: float, speed: float) -> np.ndarray:
        """Derivative of the map over half a period, with the force of drive and spring at an impact.

        At (t, v) just after an impact a change (dt, dv) is dx = -v dt, dv - a dt of the motion; it goes
        through the transition matrix, changes the time of the next impact by -dx/v and its speed by
        dv + a dt.
        """
        before = speed / self.restitution
        after = self.half @ np.array([[-speed, 0.0], [self.damping * speed - force, 1.0]])
        delay = -after[0] / before
        return np.array([delay, self.restitution * (after[1] - (force + self.damping * before) * delay)])

    def multipliers(self, phase: float, speed: float) -> np.ndarray:
        """Multipliers of the map over half a period; those over a period are their squares."""
        return np.linalg.eigvals(self.half_cycle(phase, speed))

    @property
    def fold(self) -> float:
        """Amplitude at which both orbits meet: the quadratic equation for y has a double root."""
        slope = self.shape[1]
        return abs(self.impedance) * abs(slope) / math.hypot(1.0, slope)

    @property
    def pitchfork(self) -> float:
        """Amplitude at which a multiplier of the map over half a period is -1: the symmetry breaks.

        The characteristic polynomial at -1 is affine in the ratio of force and speed at the impact, and both
        are affine in y.
        """
        at = [np.linalg.det(self.impact_map(force, 1.0) + np.eye(2)) for force in (0.0, 1.0)]
        ratio = at[0] / (at[0] - at[1])
        speed, slope = self.shape
        z = self.impedance
        y = self.rate**2 / (ratio * speed + z.real + z.imag * slope)
        return float(abs(z) * math.hypot(1.0 + y, slope * y))

    @property
    def grazing(self) -> float:
        """Amplitude at which the oscillation without impacts touches both stops."""
        return abs(self.impedance)
