"""General-purpose solvers on the equation of motion of the frozen hammer, as an engineer would call them.

Two ways: one right-hand side with all switches in it, handed to a solver as it is (`naive`), and one smooth
right-hand side for each mode, the solver restarted at every event and pulse edge (`event_split`).
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer import Hammer

FREE, LOADING, UNLOADING, BACKSTOP = range(4)


def constants_of(hammer: Hammer) -> np.ndarray:
    """Return the constants of a hammer with the laws of the paper, in one array."""
    magnet, spring, pack, backstop = hammer.magnet, hammer.spring, hammer.pack, hammer.backstop
    return np.array(
        [
            hammer.mass,
            *(magnet.F0, magnet.Am, magnet.Bm, spring.Bs, spring.As),
            *(pack.stiffness, pack.front, pack.thickness),
            *(backstop.position, backstop.stiffness, backstop.damping),
        ]
    )


@functools.cache
def current_of(hammer: Hammer, period: float) -> Callable[[float], float]:
    """Return the current [A] of a train of rectangular pulses as a function of time [s]."""
    form = hammer.waveform
    amplitude, width, rise, decay = form.amplitude, form.width, form.rise, form.decay

    @numba.njit
    def current(t: float) -> float:
        total = 0.0
        pulse = int(t / period)
        for p in range(max(pulse - 1, 0), pulse + 1):
            s = t - p * period
            if s < width:
                total += amplitude * (1.0 - math.exp(-s / rise))
            else:
                total += amplitude * (1.0 - math.exp(-width / rise)) * math.exp(-(s - width) / decay)
        return total

    return current


@functools.cache
def mode_force(current: Callable[[float], float]) -> Callable[..., float]:
    """Return the acceleration [m/s^2] as a compiled function of time, state, mode and peak indentation."""

    @numba.njit
    def acceleration(t: float, x: float, v: float, mode: int, peak: float, c: np.ndarray) -> float:
        if x <= 0.0:
            return math.nan
        f = c[1] - (c[2] - c[3] * current(t)) ** 2 / math.sqrt(x)
        f += c[4] - c[4] / c[5] * (x - c[9])
        r = (x - c[7]) / c[8]
        if mode == LOADING and r > 0.0:
            f -= c[6] * r**2.7
        elif mode == UNLOADING and r > 0.0:
            f -= c[6] * peak**-8.3 * r**11
        elif mode == BACKSTOP:
            delta = max(c[9] - x, 0.0) ** 1.5
            f += c[10] * delta - c[11] * v * delta
        return f / c[0]

    return acceleration


def naive(
    hammer: Hammer, period: float, x0: float, end: float, grid: np.ndarray, **options: Any
) -> np.ndarray:
    """Integrate with one right-hand side that tests for the contacts itself; return x on the grid."""
    c = constants_of(hammer)
    acceleration = mode_force(current_of(hammer, period))
    peak = 0.0

    def rates(t: float, y: np.ndarray) -> tuple[float, float]:
        nonlocal peak
        x, v = y
        r = (x - c[7]) / c[8]
        if r > 0.0:
            # As one would write it; the trial stages of rejected steps leave their mark, too.
            peak = max(peak, r)
            mode = LOADING if v >= 0.0 else UNLOADING
        else:
            peak = 0.0
            mode = BACKSTOP if x < c[9] else FREE
        return v, acceleration(t, x, v, mode, peak, c)

    found = solve_ivp(rates, (0.0, end), (x0, 0.0), t_eval=grid, **options)
    return np.asarray(found.y[0])


def event_split(
    hammer: Hammer, period: float, x0: float, end: float, grid: np.ndarray, **options: Any
) -> np.ndarray:
    """Integrate mode by mode, restarting at every event and pulse edge; return x on the grid."""
    c = constants_of(hammer)
    acceleration = mode_force(current_of(hammer, period))
    front, position = c[7], c[9]
    mode, peak = BACKSTOP, 0.0
    t, state = 0.0, np.array([x0, 0.0])
    edges = [p * period + s for p in range(int(end / period) + 1) for s in (0.0, hammer.waveform.width)]
    edges = sorted({edge for edge in edges if 0.0 < edge < end} | {end})
    out = np.empty_like(grid)

    def crossing(level: float, index: int, direction: int) -> Callable[..., float]:
        def gap(_t: float, y: np.ndarray) -> float:
            return float(y[index] - level)

        gap.terminal, gap.direction = True, direction  # type: ignore[attr-defined]
        return gap

    watched = {
        FREE: [(crossing(position, 0, -1), BACKSTOP), (crossing(front, 0, 1), LOADING)],
        LOADING: [(crossing(0.0, 1, -1), UNLOADING)],
        UNLOADING: [(crossing(front, 0, -1), FREE), (crossing(0.0, 1, 1), LOADING)],
        BACKSTOP: [(crossing(position, 0, 1), FREE)],
    }
    while t < end:
        until = next(edge for edge in edges if edge > t)
        found = solve_ivp(
            lambda s, y: (y[1], acceleration(s, y[0], y[1], mode, peak, c)),  # noqa: B023
            (t, until),
            state,
            events=[event for event, _next in watched[mode]],
            dense_output=True,
            first_step=min(1e-8, until - t),
            **options,
        )
        inside = (grid >= t) & (grid <= found.t[-1])
        if inside.any():
            out[inside] = found.sol(grid[inside])[0]
        t, state = float(found.t[-1]), found.y[:, -1].copy()
        for hits, (_event, following) in zip(found.t_events, watched[mode], strict=True):
            if len(hits):
                if following == UNLOADING:
                    peak, state[1] = (state[0] - front) / c[8], 0.0
                elif following in (BACKSTOP, FREE):
                    state[0] = front if mode == UNLOADING else position
                elif mode == FREE:
                    state[0] = front
                mode = following
                break
    return out
