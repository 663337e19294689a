"""Periodic orbits of rigid impact oscillators in closed form: bouncing ball and linear oscillator.

The formulas are derived here; no code is shared with the program.

*Bouncing ball.* A table moves as A sin(w t); a ball under gravity g bounces on it with restitution e.
Relative to the table it feels m (A w^2 sin(w t) - g). On an orbit with one impact in n periods T = 2 pi / w
it meets the table each time at the same height, so it leaves at g n T / 2 and arrives at minus that, in the
frame of the ground. The law of impact gives the velocity c of the table then, and with Gamma = A w^2 / g and
the phase p of the impact

    c = (g n T / 2) (1 - e) / (1 + e),   Gamma cos p = n pi (1 - e) / (1 + e).

With a = -A w^2 sin p the map from impact to impact, linearised, has the determinant e^2 and the trace
1 + e^2 + (1 + e)^2 a / g. A multiplier is 1 where a = 0, and -1 where Gamma sin p = 2 (1 + e^2) / (1 + e)^2.

*Linear oscillator.* x'' + x = F cos(w t) for x > b, restitution e at b (S. W. Shaw and P. J. Holmes, J. Sound
Vib. 90 (1983) 129, without damping). After an impact at t0

    x = A cos(t - t0) + B sin(t - t0) + G cos(w t),   G = F / (1 - w^2).

For one impact in n periods T, x is b at both ends, so B = A tan(T/2) and A = b - G cos(w t0); the velocities
at both ends give G w sin(w t0) = B (1 - e) / (1 + e), and the impact leaves with 2 e B / (1 + e). From
cos^2 + sin^2 = 1 follows a quadratic equation for B. The map from impact to impact has the determinant e^2
and the trace -2 e cos T - (1 + e)^2 a sin T / (2 B), a = -b + F cos(w t0).

*With damping*, x'' + c x' + x = F cos(w t), the free oscillation is exp(-c t/2) (A cos(W t) + B sin(W t)),
W^2 = 1 - c^2/4, and the forced one has the gain 1/sqrt((1 - w^2)^2 + c^2 w^2) and lags by
atan2(c w, 1 - w^2). With g cos p and g sin p the latter's parts at the impact, A = b - g cos p; x = b after n
periods gives B / A = (exp(c T/2) - cos(W T)) / sin(W T), and both velocities there the speed after the impact
and g sin p: all are multiples of A. The monodromy matrix is the flight, of the determinant exp(-c T), times
the saltation matrix of the impact,

    [[-e, 0], [-e (1 + e) a / V, -e]],   a = F cos(w t0) - b,

V the speed after it: the forces of the damping before and after it cancel there. So the multipliers have the
product e^2 exp(-c T).
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BouncingBall:
    """n: periods of the table between impacts."""

    gravity: float
    restitution: float
    frequency: float
    n: int = 1

    @property
    def omega(self) -> float:
        return 2.0 * math.pi * self.frequency

    @property
    def fold(self) -> float:
        """Gamma at which the two orbits with one impact in n periods appear."""
        return self.n * math.pi * (1.0 - self.restitution) / (1.0 + self.restitution)

    @property
    def doubling(self) -> float:
        """Gamma at which the stable of the two orbits doubles its period."""
        e = self.restitution
        return math.hypot(self.fold, 2.0 * (1.0 + e * e) / (1.0 + e) ** 2)

    def impact_phase(self, gamma: float, stable: bool = True) -> float:
        """Phase of the impacts, rad; the stable orbit meets the table while it slows down."""
        p = math.acos(self.fold / gamma)
        return p if stable else -p

    def trace(self, gamma: float, stable: bool = True) -> float:
        e = self.restitution
        return 1.0 + e * e - (1.0 + e) ** 2 * gamma * math.sin(self.impact_phase(gamma, stable))

    def state(self, gamma: float, t: float, stable: bool = True) -> tuple[float, float]:
        """Height above the table and its rate, at a time between the impact near 0 and the next."""
        height = gamma * self.gravity / self.omega**2
        t0 = self.impact_phase(gamma, stable) / self.omega
        up, dt = 0.5 * self.gravity * self.n / self.frequency, t - t0
        y = height * (math.sin(self.omega * t0) - math.sin(self.omega * t)) + up * dt
        v = up - self.gravity * dt - height * self.omega * math.cos(self.omega * t)
        return y - 0.5 * self.gravity * dt * dt, v


@dataclass(frozen=True)
class LinearImpacts:
    """n: periods of the force between impacts; mass and stiffness are 1."""

    omega: float
    stop: float
    restitution: float
    n: int = 1

    @property
    def period(self) -> float:
        return 2.0 * math.pi * self.n / self.omega

    @property
    def _tangent(self) -> float:
        return math.tan(0.5 * self.period)

    @property
    def _share(self) -> float:
        return (1.0 - self.restitution) / ((1.0 + self.restitution) * self.omega)

    def gain(self, force: float) -> float:
        return force / (1.0 - self.omega**2)

    @property
    def fold(self) -> float:
        """Amplitude of the force at which the quadratic equation has one root."""
        kt = self._share * abs(self._tangent)
        return abs(1.0 - self.omega**2) * abs(self.stop) * kt / math.sqrt(1.0 + kt * kt)

    @property
    def grazing(self) -> float:
        """Amplitude of the force at which the oscillation without impact touches the stop."""
        return abs(1.0 - self.omega**2) * abs(self.stop)

    @property
    def doubling(self) -> tuple[float, float]:
        """Amplitude of the force at which a multiplier is -1, and B there."""
        e, period = self.restitution, self.period
        k = 2.0 * (1.0 + e * e - 2.0 * e * math.cos(period)) / ((1.0 + e) ** 2 * math.sin(period))
        b = -(self.omega**2) * self.stop / (k + (1.0 - self.omega**2) / self._tangent)
        gain = math.hypot(self.stop - b / self._tangent, b * self._share)
        return abs(1.0 - self.omega**2) * gain, b

    def roots(self, force: float) -> list[tuple[float, float]]:
        """B and the phase of the impact, rad, of the orbits under a force, if any."""
        gain = self.gain(force)
        square = 1.0 / self._tangent**2 + self._share**2
        half, rest = -self.stop / self._tangent, self.stop**2 - gain**2
        inside = half * half - square * rest
        if inside < 0.0:
            return []
        found = []
        for sign in (1.0, -1.0):
            b = (-half + sign * math.sqrt(inside)) / square
            sine = b * self._share / gain
            found.append((b, math.atan2(sine, (self.stop - b / self._tangent) / gain)))
        return found

    def trace(self, b: float) -> float:
        e = self.restitution
        a = -(self.omega**2) * self.stop - (1.0 - self.omega**2) * b / self._tangent
        return -2.0 * e * math.cos(self.period) - (1.0 + e) ** 2 * a * math.sin(self.period) / (2.0 * b)

    def state(self, force: float, b: float, phase: float, t: float) -> tuple[float, float]:
        """Displacement and velocity a time t after the impact."""
        gain = self.gain(force)
        a = self.stop - gain * math.cos(phase)
        x = a * math.cos(t) + b * math.sin(t) + gain * math.cos(self.omega * t + phase)
        v = b * math.cos(t) - a * math.sin(t) - gain * self.omega * math.sin(self.omega * t + phase)
        return x, v

    def possible(self, force: float, b: float, phase: float) -> bool:
        """Whether it leaves the stop and stays off it until the next impact."""
        times = [self.period * i / 1000.0 for i in range(1, 1000)]
        return b > 0.0 and all(self.state(force, b, phase, t)[0] > self.stop for t in times)


@dataclass(frozen=True)
class DampedImpacts:
    """n: periods of the force between impacts; mass and stiffness are 1. An orbit is named by its A."""

    omega: float
    stop: float
    restitution: float
    damping: float
    n: int = 1

    @property
    def period(self) -> float:
        return 2.0 * math.pi * self.n / self.omega

    @property
    def _own(self) -> float:
        return math.sqrt(1.0 - 0.25 * self.damping**2)

    @property
    def _gain(self) -> float:
        return 1.0 / math.hypot(1.0 - self.omega**2, self.damping * self.omega)

    @property
    def _lag(self) -> float:
        return math.atan2(self.damping * self.omega, 1.0 - self.omega**2)

    @property
    def grazing(self) -> float:
        """Amplitude of the force at which the oscillation without impact touches the stop."""
        return abs(self.stop) / self._gain

    @property
    def product(self) -> float:
        """Product of the multipliers."""
        return self.restitution**2 * math.exp(-self.damping * self.period)

    def _turn(self) -> tuple[float, float, float]:
        """exp(-c T/2), cos(W T) and sin(W T)."""
        angle = self._own * self.period
        return math.exp(-0.5 * self.damping * self.period), math.cos(angle), math.sin(angle)

    def orbit(self, a: float) -> tuple[float, float, float]:
        """Amplitude of the force, its phase at the impact, rad, and the speed after it."""
        shrinks, cosine, sine = self._turn()
        b = (1.0 / shrinks - cosine) / sine
        speed = (
            self._own * a * (b * (1.0 - shrinks * cosine) + shrinks * sine) / (1.0 + 1.0 / self.restitution)
        )
        across = (a * (self._own * b - 0.5 * self.damping) - speed) / self.omega
        along = self.stop - a
        return math.hypot(along, across) / self._gain, math.atan2(across, along) + self._lag, speed

    def trace(self, a: float) -> float:
        """Sum of the multipliers."""
        force, angle, speed = self.orbit(a)
        shrinks, cosine, sine = self._turn()
        e = self.restitution
        corner = -e * (1.0 + e) * (force * math.cos(angle) - self.stop) / speed
        return shrinks * (-2.0 * e * cosine + corner * sine / self._own)

    def branch_point(self, multiplier: float, low: float, high: float) -> tuple[float, float]:
        """A between two values, and the amplitude of the force, at which a multiplier is 1 or -1."""

        def miss(a: float) -> float:
            return multiplier * self.trace(a) - 1.0 - self.product

        rising = miss(high) > 0.0
        assert (miss(low) > 0.0) != rising
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (low, middle) if (miss(middle) > 0.0) == rising else (middle, high)
        return low, self.orbit(low)[0]

    def state(self, a: float, t: float) -> tuple[float, float]:
        """Displacement and velocity a time t after the impact."""
        force, angle, _ = self.orbit(a)
        shrinks, cosine, sine = self._turn()
        b = a * (1.0 / shrinks - cosine) / sine
        own, gain, phase = self._own, force * self._gain, self.omega * t + angle - self._lag
        free = a * math.cos(own * t) + b * math.sin(own * t)
        turned = own * (b * math.cos(own * t) - a * math.sin(own * t))
        fading = math.exp(-0.5 * self.damping * t)
        x = fading * free + gain * math.cos(phase)
        return x, fading * (turned - 0.5 * self.damping * free) - gain * self.omega * math.sin(phase)

    def possible(self, a: float) -> bool:
        """Whether it leaves the stop and stays off it until the next impact."""
        times = [self.period * i / 2000.0 for i in range(1, 2000)]
        return self.orbit(a)[2] > 0.0 and all(self.state(a, t)[0] > self.stop for t in times)
