"""The two integrators of the paper, on its schedule of steps.

F. Hendriks, IBM J. Res. Develop. 27 (1983), "Numerical integration and graphics": the implicit trapezoidal
rule, and the classical fourth-order Runge-Kutta method. Steps of 10 us off the backstop, 1 us in contact with
it, 20 us late in the settle-out.

As a program of the time would, both evaluate the force as printed, step functions included, at whatever
point a step gets to: no switch is located, no step ends at a pulse edge. The local maximum inside the pack is
taken from the ends of steps. Hence a contact costs accuracy, of either scheme, and the order of the method
shows in smooth motion only. The schemes are here to be compared with, not to be relied on.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from printhammer.kernel.model.layout import END

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

Array = NDArray[np.float64]
Scheme = Literal["trapezoid", "runge-kutta-4"]

FREE_STEP = 10e-6
"""Step off the backstop, s."""
CONTACT_STEP = 1e-6
"""Step where x < b, or where the next free step would end there, s."""
LATE_STEP = 20e-6
"""Step in the backstop late in the settle-out, s."""
LATE_AFTER = 200e-6
"""Time without leaving the backstop, and without a firing, from which on the settle-out is late, s."""
NEWTON_LIMIT = 50
"""Newton iterations after which a step of the trapezoidal rule has failed."""

LAW_NAMES = (
    "magnet_force",
    "spring_force",
    "pack_loading",
    "pack_memory",
    "pack_unloading",
    "backstop_elastic",
    "backstop_viscous",
    "backstop_rebound",
)
"""Law functions that `integrate` needs."""

_STATUS = ("ok", "newton failed", "diverged")


@dataclass(frozen=True)
class SchemeRun:
    """Ends of the steps, ``t`` (s), ``x`` (m), ``v`` (m/s), and ``status``.

    The status is "ok", "newton failed" (no solution of an implicit step found) or "diverged" (the motion is
    no longer finite, has left the range of a law, or is further out than `integrate` was told).
    """

    t: Array
    x: Array
    v: Array
    status: str


def integrate(
    laws: Mapping[str, Callable[..., float]],
    constants: Mapping[str, Array],
    drive: tuple[Array, NDArray[np.int64], Array, bool, bool],
    *,
    mass: float,
    front: float,
    position: float,
    state: tuple[float, float],
    t_end: float,
    scheme: Scheme = "trapezoid",
    scale: float = 1.0,
    rigid: bool = False,
    reload_along_unloading: bool = False,
    far: float = 1.0,
) -> SchemeRun:
    """Integrate one run as in 1983.

    Parameters
    ----------
    laws : mapping
        The plain law functions called `LAW_NAMES`; compiled here, once for each set.
    constants : mapping
        Packed constants of "magnet", "spring", "pack" and "backstop", float64 arrays (empty for an absent
        part).
    drive : tuple
        Firing times (s), first row of the table of each, tables of the waveforms, whether a pulse replaces
        the one before, whether the drive is a force.
    mass : float
        kg.
    front, position : float
        First touch of pack and backstop, m; infinite, with the sign that is never reached, if absent.
    state : (x, v)
        Start, m and m/s.
    t_end : float
        Duration, s.
    scheme : {"trapezoid", "runge-kutta-4"}
        The trapezoidal rule is solved by Newton's method with a derivative by differences.
    scale : float
        Factor of all steps of the schedule.
    rigid : bool
        The backstop is rigid: a step that ends beyond it ends on it, with the rebound speed.
    reload_along_unloading : bool
        Reloading inside a contact follows the unloading branch up to the local maximum.
    far : float
        Displacement, m, beyond which the motion counts as diverged.

    Returns
    -------
    SchemeRun
        The start and the end of every step; after a failure, what was reached.

    Raises
    ------
    ValueError
        Unknown scheme, or a scale or duration that is not positive.
    """
    if scheme not in ("trapezoid", "runge-kutta-4"):
        raise ValueError(f"scheme {scheme!r}, expected 'trapezoid' or 'runge-kutta-4'")
    if not (scale > 0.0 and t_end > 0.0 and math.isfinite(scale) and math.isfinite(t_end)):
        raise ValueError(f"scale {scale} and duration {t_end} s are expected to be positive")
    program = _program(tuple(laws[name] for name in LAW_NAMES), scheme == "trapezoid")
    firings, begins, segments, replace, is_force = drive
    contact = CONTACT_STEP * scale
    n = math.ceil(t_end / contact) + 8
    t, x, v = np.empty(n), np.empty(n), np.empty(n)
    x[0], v[0] = state
    steps = np.array([FREE_STEP * scale, contact, LATE_STEP * scale])
    packed = tuple(
        np.ascontiguousarray(constants[role], dtype=np.float64)
        for role in ("magnet", "spring", "pack", "backstop")
    )
    options = (bool(replace), bool(is_force), rigid, reload_along_unloading)
    places = np.array([mass, front, position, t_end, far])
    table = (
        np.array(firings, dtype=np.float64),
        np.array(begins, dtype=np.int64),
        np.array(segments, dtype=np.float64),
    )
    size, status = program((packed, table, options, places), steps, t, x, v)
    return SchemeRun(t[:size].copy(), x[:size].copy(), v[:size].copy(), _STATUS[status])


@functools.lru_cache(maxsize=32)
def _program(functions: tuple[Callable[..., float], ...], implicit: bool) -> Callable[..., Any]:
    """Compile the program of 1983 for a set of laws; `model` is packed constants, drive, options, places."""
    import numba

    options: dict[str, Any] = {"error_model": "numpy"}
    magnet_force, spring_force, pack_loading, pack_memory, pack_unloading, elastic, viscous, rebound = (
        numba.njit(**options)(function) for function in functions
    )

    @numba.njit(**options)  # type: ignore[untyped-decorator]
    def drive_value(time: float, table: Any, replace: bool) -> float:
        firings, begins, segments = table
        longest = segments[segments.shape[0] - 1, 0]
        total = 0.0
        for i in range(firings.size - 1, -1, -1):
            tau = time - firings[i]
            if tau < 0.0:
                continue
            if tau >= longest:
                break
            k = begins[i]
            while segments[k, 1] != END and segments[k + 1, 0] <= tau:
                k += 1
            if segments[k, 1] == END:
                if replace:
                    break
                continue
            s = tau - segments[k, 0]
            p0, p1, p2, p3 = segments[k, 2], segments[k, 3], segments[k, 4], segments[k, 5]
            if segments[k, 1] == 1.0:
                total += p0 + p1 * math.exp(-p2 * s)
            elif segments[k, 1] == 2.0:
                total += p0 + p1 * math.sin(p2 * s + p3)
            else:
                total += p0 + s * (p1 + s * (p2 + s * p3))
            if replace:
                break
        return total

    @numba.njit(**options)  # type: ignore[untyped-decorator]
    def acceleration(time: float, x: float, v: float, peak: float, model: Any) -> float:
        packed, table, options, places = model
        replace, is_force, rigid, along = options
        drive = drive_value(time, table, replace)
        force = magnet_force(packed[0], x, 0.0 if is_force else drive) + spring_force(packed[1], x)
        if is_force:
            force += drive
        if x > places[1]:
            if v >= 0.0 and not (along and x < peak):
                force += pack_loading(packed[2], x, v)
            else:
                force += pack_unloading(packed[2], x, v, pack_memory(packed[2], max(peak, x)))
        if x < places[2] and not rigid:
            w = math.sqrt(places[2] - x)
            force += elastic(packed[3], w) + viscous(packed[3], w, v)
        return float(force / places[0])

    @numba.njit(**options)  # type: ignore[untyped-decorator]
    def runge_kutta(
        time: float, x: float, v: float, h: float, peak: float, model: Any
    ) -> tuple[float, float, bool]:
        half = 0.5 * h
        a1 = acceleration(time, x, v, peak, model)
        v2 = v + half * a1
        a2 = acceleration(time + half, x + half * v, v2, peak, model)
        v3 = v + half * a2
        a3 = acceleration(time + half, x + half * v2, v3, peak, model)
        v4 = v + h * a3
        a4 = acceleration(time + h, x + h * v3, v4, peak, model)
        return (
            x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4),
            v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4),
            True,
        )

    @numba.njit(**options)  # type: ignore[untyped-decorator]
    def trapezoid(
        time: float, x: float, v: float, h: float, peak: float, model: Any
    ) -> tuple[float, float, bool]:
        # The rule for x, x1 = x + h/2 (v + v1), is put into the one for v: one equation for v1.
        half = 0.5 * h
        a = acceleration(time, x, v, peak, model)
        known = v + half * a
        new = v + h * a
        # The least size keeps the tolerance above rounding where the hammer is at rest.
        size = abs(v) + abs(h * a) + 1e-3
        a1 = acceleration(time + h, x + half * (v + new), new, peak, model)
        residual = new - known - half * a1
        if not math.isfinite(residual):
            # The first guess is outside the range of a law; this one ends where the step began.
            new = -v
            a1 = acceleration(time + h, x, new, peak, model)
            residual = new - known - half * a1
        for _ in range(NEWTON_LIMIT):
            trial = new + 1e-7 * size
            a2 = acceleration(time + h, x + half * (v + trial), trial, peak, model)
            change = residual / (1.0 - half * (a2 - a1) / (trial - new))
            if abs(change) <= 1e-10 * size:
                new -= change
                return x + half * (v + new), new, True
            # Halved until the residual falls: the step functions and the stiff backstop would make it cycle.
            after = math.inf
            for _ in range(20):
                trial = new - change
                a2 = acceleration(time + h, x + half * (v + trial), trial, peak, model)
                after = trial - known - half * a2
                if abs(after) < abs(residual):
                    break
                change *= 0.5
            new, a1, residual = trial, a2, after
        return x, v, False

    step = trapezoid if implicit else runge_kutta

    @numba.njit(**options)  # type: ignore[untyped-decorator]
    def program(model: Any, steps: Any, t: Array, x: Array, v: Array) -> tuple[int, int]:
        packed, (firings, _begins, _segments), (_replace, _is_force, rigid, along), places = model
        front, position, t_end, far = places[1], places[2], places[3], places[4]
        time, place, speed, peak = 0.0, x[0], v[0], x[0]
        t[0] = 0.0
        n, fired, settling_since = 1, 0, 0.0
        # A remainder of rounding is no step.
        while time < t_end - 1e-9 * steps[1]:
            while fired < firings.size and firings[fired] <= time:
                settling_since = max(settling_since, firings[fired])
                fired += 1
            inside = place < position
            if not inside:
                settling_since = time
            h = steps[0]
            if inside:
                h = steps[2] if time - settling_since >= LATE_AFTER else steps[1]
            h = min(h, t_end - time)
            new_place, new_speed, solved = step(time, place, speed, h, peak, model)
            if not inside and h > steps[1] and not (solved and new_place >= position):
                h = steps[1]
                new_place, new_speed, solved = step(time, place, speed, h, peak, model)
            if not solved:
                return n, 1
            if not (abs(new_place) <= far and math.isfinite(new_speed)):
                return n, 2
            if rigid and new_place < position:
                new_place = position
                new_speed = rebound(packed[3], min(new_speed, -0.0))
            if new_place <= front:
                peak = new_place
            elif along:
                peak = max(peak, new_place)
            elif new_speed >= 0.0:
                peak = new_place
            elif speed >= 0.0:
                peak = max(place, new_place)
            time, place, speed = time + h, new_place, new_speed
            t[n], x[n], v[n] = time, place, speed
            n += 1
        t[n - 1] = t_end
        return n, 0

    compiled: Callable[..., Any] = program
    return compiled
