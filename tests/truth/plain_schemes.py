"""The two schemes of the paper, implemented independently from its equations and its schedule.

No code is shared with the package: floats, lists and the constants of a hammer file.
"""

import math
from collections.abc import Callable
from typing import Any

from scipy.optimize import root_scalar

Derivative = Callable[[float, float, float, float], float]


def current(c: dict[str, float], t: float) -> float:
    """One rectangle with exponential flanks, fired at 0, A."""
    if t < 0.0:
        return 0.0
    if t < c["waveform.width"]:
        return -c["waveform.amplitude"] * math.expm1(-t / c["waveform.rise"])
    reached = -c["waveform.amplitude"] * math.expm1(-c["waveform.width"] / c["waveform.rise"])
    return reached * math.exp(-(t - c["waveform.width"]) / c["waveform.decay"])


def acceleration(c: dict[str, float], period: float) -> Derivative:
    """Equations (1) to (7) under an endless train from time 0 on; the last argument is the place of rmax."""
    b, front, depth = c["backstop.position"], c["pack.front"], c["pack.thickness"]

    def of(t: float, x: float, v: float, peak: float) -> float:
        number = math.floor(t / period + 1e-9)
        drive = sum(current(c, t - k * period) for k in (number, number - 1) if k >= 0)
        force = c["magnet.F0"] - (c["magnet.Am"] - c["magnet.Bm"] * drive) ** 2 / math.sqrt(x)
        force += c["spring.Bs"] - c["spring.Bs"] / c["spring.As"] * (x - b)
        if x > front:
            r = (x - front) / depth
            if v >= 0.0:
                force -= c["pack.stiffness"] * r**2.7
            else:
                force -= c["pack.stiffness"] * ((max(peak, x) - front) / depth) ** -8.3 * r**11
        if x < b:
            force += (c["backstop.stiffness"] - c["backstop.damping"] * v) * (b - x) ** 1.5
        return force / c["mass"]

    return of


def runge_kutta(f: Derivative, t: float, x: float, v: float, h: float, peak: float) -> tuple[float, float]:
    """Take one classical step of fourth order."""
    k1 = v, f(t, x, v, peak)
    k2 = v + h / 2 * k1[1], f(t + h / 2, x + h / 2 * k1[0], v + h / 2 * k1[1], peak)
    k3 = v + h / 2 * k2[1], f(t + h / 2, x + h / 2 * k2[0], v + h / 2 * k2[1], peak)
    k4 = v + h * k3[1], f(t + h, x + h * k3[0], v + h * k3[1], peak)
    ends = (y + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) for i, y in enumerate((x, v)))
    return next(ends), next(ends)


def trapezoid(f: Derivative, t: float, x: float, v: float, h: float, peak: float) -> tuple[float, float]:
    """Take one implicit step; solve for the velocity at its end by the secant method."""
    begins = f(t, x, v, peak)

    def residual(new: float) -> float:
        return new - v - h / 2 * (begins + f(t + h, x + h / 2 * (v + new), new, peak))

    guess = v + h * begins
    new = root_scalar(residual, x0=guess, x1=guess + 1e-6 * (abs(guess) + 1e-3), xtol=1e-14).root
    return x + h / 2 * (v + new), new


SCHEMES = {"runge-kutta-4": runge_kutta, "trapezoid": trapezoid}


def strobed(
    c: dict[str, float], rest: float, period: float, firings: int, scheme: str, reading: str
) -> list[tuple[float, float]]:
    """Return displacement and velocity at firings, by the cubic over the step that contains each firing.

    Steps of 10 us off the backstop, 1 us in it or where a free one would end there, 20 us after 200 us in it.
    """
    f, step = acceleration(c, period), SCHEMES[scheme]
    b, front = c["backstop.position"], c["pack.front"]
    t, x, v, peak = 0.0, rest, 0.0, rest
    states, settling, short = [(x, v)], 0.0, 0
    while len(states) < firings:
        inside = x < b
        if not inside:
            settling = t
        # The wait for the late steps begins anew with each firing.
        settling = max(settling, math.floor(t / period + 1e-9) * period)
        late = inside and reading != "no-late-step" and t - settling >= 200e-6
        small = short > 0 or (inside and not late)
        if small and short == 0 and reading == "grid":
            short = 10
        h = 1e-6 if small else 20e-6 if late else 10e-6
        if reading == "firings":
            h = min(h, (math.floor(t / period + 1e-9) + 1) * period - t)
        x1, v1 = step(f, t, x, v, h, peak)
        if h > 1e-6 and not inside and x1 < b and reading != "inside":
            h = 1e-6
            short = 10 if reading == "grid" else 0
            x1, v1 = step(f, t, x, v, h, peak)
        short = max(short - 1, 0)
        if x1 <= front or v1 >= 0.0:
            peak = x1
        elif v >= 0.0:
            peak = max(x, x1)
        while len(states) < firings and len(states) * period <= t + h + 1e-15:
            states.append(between((t, x, v), (t + h, x1, v1), len(states) * period))
        t, x, v = t + h, x1, v1
    return states


def between(
    first: tuple[float, float, float], last: tuple[float, float, float], t: float
) -> tuple[float, float]:
    """The cubic through position and velocity at both ends of a step."""
    h = last[0] - first[0]
    s = min((t - first[0]) / h, 1.0)
    a, da, b, db = first[1], first[2] * h, last[1], last[2] * h
    x = (1 + 2 * s) * (1 - s) ** 2 * a + s * (1 - s) ** 2 * da + s**2 * (3 - 2 * s) * b + s**2 * (s - 1) * db
    slope = 6 * s * (s - 1) * (a - b) + (1 - s) * (1 - 3 * s) * da + s * (3 * s - 2) * db
    return x, slope / h


def constants_of(hammer: Any) -> dict[str, float]:
    """The constants of a hammer, SI, by their keys."""
    return {key: constant.si for key, constant in hammer.constants.items()}
