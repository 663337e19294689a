"""Closed forms that the motion must obey exactly; the package is not used.

Each is derived in its docstring. Logarithms that cancel are summed as series. SI throughout.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import beta

if TYPE_CHECKING:
    from collections.abc import Callable

LOADING_POWER = 2.7
UNLOADING_POWER = 11.0


def _time_factor(power: float) -> float:
    """Integral of (1 - u**power)**-0.5 over [0, 1], a Beta function (substitute w = u**power)."""
    return float(beta(1.0 / power, 0.5)) / power


@dataclass(frozen=True)
class PackRebound:
    """Rebound of a free mass from the pack alone, equation (5): indentation, times, exit speed."""

    indentation: float
    loading_time: float
    unloading_time: float
    speed_out: float


def pack_rebound(mass: float, stiffness: float, thickness: float, speed: float) -> PackRebound:
    """Rebound from the pack alone.

    Loading takes up S d rmax**3.7 / 3.7, unloading gives back S d rmax**3.7 / 12, so the ratio of the speeds
    is sqrt(3.7/12). Along loading v**2 = v_in**2 (1 - (r/rmax)**3.7), along unloading v**2 = v_out**2 (1 -
    (r/rmax)**12).
    """
    up, down = LOADING_POWER + 1.0, UNLOADING_POWER + 1.0
    r_max = (0.5 * mass * speed * speed * up / (stiffness * thickness)) ** (1.0 / up)
    indentation = thickness * r_max
    speed_out = math.sqrt(up / down) * speed
    return PackRebound(
        indentation,
        _time_factor(up) * indentation / speed,
        _time_factor(down) * indentation / speed_out,
        speed_out,
    )


def _lag(z: float) -> float:
    """z - ln(1 + z) for z > -1, without cancellation near zero."""
    if abs(z) > 0.25:
        return z - math.log1p(z)
    total, power = 0.0, z
    for n in range(2, 60):
        power *= -z
        total -= power / n
    return total


def backstop_speed_ratio(z: float) -> float:
    """Return v_out / v_in of the backstop alone, equations (6) and (7), at z = (l/k) v_in.

    With w the speed of indentation, m w dw = -k delta**1.5 (1 + (l/k) w) d(delta). Divided by 1 + (l/k) w and
    integrated in and out: z - ln(1 + z) = -(y + ln(1 - y)), y = (l/k) v_out.
    """
    wanted = _lag(z)
    if z < 1.0:
        # Newton on lag(-y) = wanted; its slope is y / (1 - y).
        y = z / (1.0 + 2.0 * z / 3.0)
        for _ in range(60):
            step = (_lag(-y) - wanted) * (1.0 - y) / y
            y -= step
            if abs(step) <= 1e-16 * y:
                break
        return y / z
    return (1.0 - _complement(z)) / z


def _complement(z: float) -> float:
    """1 - y for z >= 1 in the equation above, also where y rounds to 1."""
    # q = 1 - y solves q = exp(-(1 - q) - wanted), a contraction.
    wanted, q = _lag(z), 0.0
    for _ in range(200):
        q = math.exp(q - 1.0 - wanted)
    return q


def backstop_indentation(mass: float, stiffness: float, damping: float, speed: float) -> float:
    """Return the deepest indentation of the backstop alone.

    By the first integral above, k delta**2.5 / 2.5 = m (k/l)**2 (z - ln(1 + z)).
    """
    if damping == 0.0:
        energy = 0.5 * mass * speed * speed
    else:
        energy = mass * (stiffness / damping) ** 2 * _lag(damping / stiffness * speed)
    return float((2.5 * energy / stiffness) ** 0.4)


def backstop_times(mass: float, stiffness: float, damping: float, speed: float) -> tuple[float, float]:
    """Return the times in and out of a contact of the backstop alone, by quadrature along the speed.

    dt = m dw / (k delta**1.5 (1 + (l/k) w)), with delta(w) from the first integral between w and the speed
    w_end at first touch: with b = (l/k) w, d = (l/k) (w_end - w) and lag(z) = z - ln(1 + z) it is
    m (k/l)**2 (d b/(1 + b) + lag(d/(1 + b))), where nothing cancels. w = w_end (1 - q**5) makes the integrand
    smooth.
    """
    rate = damping / stiffness

    def one_way(end: float, rest: float) -> float:
        """Return the time from a speed `end` to rest; `rest` is 1 + (l/k) `end`, without cancellation."""

        def integrand(q: float) -> float:
            w, fall = end * (1.0 - q**5), end * q**5
            if rate == 0.0:
                energy = mass * fall * (w + 0.5 * fall)
            else:
                b, d = rate * w, rate * fall
                lasting = rest - d
                behind = d / lasting
                lag = _lag(behind) if abs(behind) <= 0.25 else behind - math.log(rest / lasting)
                energy = mass / rate**2 * (d * b / lasting + lag)
            delta = (2.5 * energy / stiffness) ** 0.4
            return 5.0 * q**4 * mass * abs(end) / (stiffness * delta**1.5 * (rest - rate * fall))

        return float(quad(integrand, 0.0, 1.0, epsabs=0.0, epsrel=1e-13, limit=200)[0])

    out = -speed * (backstop_speed_ratio(rate * speed) if rate > 0.0 else 1.0)
    rest = _complement(rate * speed) if rate * speed >= 1.0 else 1.0 + rate * out
    return one_way(speed, 1.0 + rate * speed), one_way(out, rest)


def hertz_duration(mass: float, stiffness: float, speed: float) -> float:
    """Return the duration of an undamped Hertz contact.

    2 delta/v times the integral of (1 - u**2.5)**-0.5 over [0, 1].
    """
    return 2.0 * _time_factor(2.5) * backstop_indentation(mass, stiffness, 0.0, speed) / speed


def bouncing_end(restitution: float, pull: float, speed: float) -> float:
    """Return the time from a touch at ``speed`` to the end of all bounces, under a constant pull (m/s**2)."""
    return 2.0 * restitution * speed / (pull * (1.0 - restitution))


@dataclass(frozen=True)
class LinearMotion:
    """Exact solution of m x'' + c x' + k (x - x_e) = amplitude sin(rate t + phase), underdamped, k > 0."""

    mass: float
    damping: float
    stiffness: float
    equilibrium: float
    amplitude: float
    rate: float
    phase: float
    t0: float
    x0: float
    v0: float

    def at(self, t: float) -> tuple[float, float]:
        """Return displacement and velocity at time t."""
        gamma = 0.5 * self.damping / self.mass
        omega = math.sqrt(self.stiffness / self.mass - gamma * gamma)
        response = self.amplitude / complex(
            self.stiffness - self.mass * self.rate**2, self.damping * self.rate
        )

        def forced(time: float) -> tuple[float, float]:
            angle = self.rate * time + self.phase
            turning = response * complex(math.cos(angle), math.sin(angle))
            return turning.imag, (turning * complex(0.0, self.rate)).imag

        xf, vf = forced(self.t0)
        a = self.x0 - self.equilibrium - xf
        b = (self.v0 - vf + gamma * a) / omega
        s = t - self.t0
        decay, cos, sin = math.exp(-gamma * s), math.cos(omega * s), math.sin(omega * s)
        xp, vp = forced(t)
        x = self.equilibrium + xp + decay * (a * cos + b * sin)
        v = vp + decay * (omega * (b * cos - a * sin) - gamma * (a * cos + b * sin))
        return x, v

    def first_fall(self, level: Callable[[float, float], float], t_end: float, step: float) -> float | None:
        """Return the first time after t0 at which level(x, v) falls through zero, sampled every ``step``."""
        start = self.t0
        before = level(*self.at(start))
        while start < t_end:
            end = min(start + step, t_end)
            after = level(*self.at(end))
            if after < 0.0 and before > 0.0:
                return float(brentq(lambda t: level(*self.at(t)), start, end, xtol=1e-18, rtol=1e-15))
            start, before = end, after
        return None


@dataclass(frozen=True)
class Oscillator:
    """Linear impact oscillator: spring to x = 0, sinusoidal force, and one surface.

    ``restitution`` set: a rigid surface at ``surface`` below the mass (a backstop). Otherwise a Kelvin-Voigt
    surface (a dashpot pack) above it, with ``contact_stiffness`` and ``contact_damping``, that never pulls.
    """

    mass: float
    stiffness: float
    amplitude: float
    rate: float
    phase: float
    surface: float
    restitution: float | None = None
    contact_stiffness: float = 0.0
    contact_damping: float = 0.0

    def _piece(self, t: float, x: float, v: float, touching: bool) -> LinearMotion:
        stiffness, damping, equilibrium = self.stiffness, 0.0, 0.0
        if touching:
            stiffness += self.contact_stiffness
            damping = self.contact_damping
            equilibrium = self.contact_stiffness * self.surface / stiffness
        return LinearMotion(
            self.mass, damping, stiffness, equilibrium, self.amplitude, self.rate, self.phase, t, x, v
        )

    def run(self, x: float, v: float, t_end: float) -> tuple[list[LinearMotion], list[tuple[float, float]]]:
        """Return the pieces of the motion from t = 0, and (time, velocity just before) of each touch.

        Switches are sought on a fine grid: choose a motion without grazing touches.
        """
        t, touching = 0.0, False
        pieces: list[LinearMotion] = []
        touches: list[tuple[float, float]] = []
        fastest = math.sqrt((self.stiffness + self.contact_stiffness) / self.mass)
        step = 0.005 * 2.0 * math.pi / max(fastest, self.rate)
        side = -1.0 if self.restitution is None else 1.0
        while True:
            piece = self._piece(t, x, v, touching)
            pieces.append(piece)
            if touching:
                hit = piece.first_fall(self._push, t_end, 0.1 * step)
            else:
                hit = piece.first_fall(lambda x, v: side * (x - self.surface), t_end, step)
            if hit is None:
                return pieces, touches
            t = hit
            x, v = piece.at(t)
            if touching:
                touching = False
                # The dashpot has let go, inside the surface: free until the surface is left and met again.
                continue
            touches.append((t, v))
            x = self.surface
            if self.restitution is None:
                touching = True
            else:
                v = -self.restitution * v

    def _push(self, x: float, v: float) -> float:
        return self.contact_stiffness * (x - self.surface) + self.contact_damping * v


def piece_at(pieces: list[LinearMotion], t: float) -> tuple[float, float]:
    """Return displacement and velocity at time t of a motion in pieces."""
    current = [piece for piece in pieces if piece.t0 <= t][-1]
    return current.at(t)


def pack_under_force(
    mass: float, stiffness: float, thickness: float, force: float, speed: float, turns: int
) -> tuple[list[tuple[str, float]], float | None]:
    """Turning points of a mass pressed into the pack by a constant force, from a first touch at ``speed``.

    Each branch of equation (5) is conservative: with r = u/d, S d r**3.7/3.7 along loading and
    S d rmax**-8.3 r**12/12 along unloading. At a trough the wire goes in again if the force exceeds S r**2.7,
    and otherwise the trough is the next local maximum. Returns at most ``turns`` pairs ("peak" or "trough",
    indentation), and the speed out, or None if the pack has not been left by then.
    """
    up, down = LOADING_POWER + 1.0, UNLOADING_POWER + 1.0
    work = stiffness * thickness
    balance = thickness * (force / stiffness) ** (1.0 / LOADING_POWER)
    found: list[tuple[str, float]] = []
    u, energy, branch = 0.0, 0.5 * mass * speed * speed, "in"
    while len(found) < turns:
        if branch == "in":

            def loading(w: float, u: float = u, energy: float = energy) -> float:
                taken = work * ((w / thickness) ** up - (u / thickness) ** up) / up
                return energy + force * (w - u) - taken

            high = 2.0 * max(balance, u) + (energy * up / work) ** (1.0 / up) * thickness
            while loading(high) > 0.0:
                high *= 2.0
            u = float(brentq(loading, max(balance, u), high, xtol=1e-20, rtol=1e-15))
            branch = "out"
            found.append(("peak", u))
        r_max = u / thickness
        peak = u

        def unloading(w: float, peak: float = peak, r_max: float = r_max) -> float:
            given = work * r_max**up * (1.0 - (w / peak) ** down) / down
            return given - force * (peak - w)

        if unloading(0.0) >= 0.0:
            return found, math.sqrt(2.0 * unloading(0.0) / mass)
        even = peak * (force / (stiffness * r_max**LOADING_POWER)) ** (1.0 / UNLOADING_POWER)
        u = float(brentq(unloading, 0.0, even, xtol=1e-20, rtol=1e-15))
        found.append(("trough", u))
        if force > stiffness * (u / thickness) ** LOADING_POWER:
            branch, energy = "in", 0.0
        else:
            found.append(("peak", u))
    return found[:turns], None
