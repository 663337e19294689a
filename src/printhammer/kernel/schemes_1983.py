"""The two integration schemes of the 1983 paper, with the step sizes that the paper states.

F. Hendriks, IBM J. Res. Develop. 27 (1983), "Numerical integration and graphics": the implicit trapezoidal
rule, and the classical fourth-order Runge-Kutta method. The step is 10 us off the backstop, 1 us in contact
with the backstop, and 20 us late in the settle-out.

As a program of that time would, both schemes evaluate the force as printed, including step functions, at the
points of the scheme: no discontinuity is located, and no step is aligned with a pulse edge. The local maximum
in the pack is the largest displacement at the end of a step. Each contact therefore reduces the accuracy of
both schemes, and the order of the method shows only in smooth motion. The schemes serve for comparison with
the paper, not for production runs.

The paper states "typical step sizes" but not when the short step begins and ends. `READINGS` lists possible
rules; the claims use the first rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from printhammer.kernel.compile.signatures import Plain
from printhammer.kernel.compile.specialise import specialise
from printhammer.kernel.model.laws import Laws
from printhammer.kernel.model.layout import END

if TYPE_CHECKING:
    from collections.abc import Mapping

    # Names of laws, bound when the functions are compiled.
    from printhammer.kernel.model.laws import (
        backstop_elastic,
        backstop_rebound,
        backstop_viscous,
        magnet_force,
        pack_loading,
        pack_memory,
        pack_unloading,
        spring_force,
    )

Array = NDArray[np.float64]
Scheme = Literal["trapezoid", "runge-kutta-4"]
Reading = Literal["look-ahead", "inside", "grid", "no-late-step", "firings"]
READINGS: Final[tuple[Reading, ...]] = get_args(Reading)
"""Rules for when the short step is used. "look-ahead": if x < b, or if the next free step would end there.
"inside": only if x < b, so that the step that enters the backstop is long. "grid": a free step that
begins or would end there is divided into ten short steps, so that free steps begin on a grid of 10 us.
"no-late-step": like "look-ahead", with short steps late in the settle-out as well. "firings": like
"look-ahead", and a step ends at each firing, where the state of Fig. 11 is read."""

FREE_STEP = 10e-6
"""Step size off the backstop, s."""
CONTACT_STEP = 1e-6
"""Step size if x < b, or if the next free step would end at x < b, s."""
LATE_STEP = 20e-6
"""Step size in backstop contact late in the settle-out, s."""
LATE_AFTER = 200e-6
"""Time since the last separation from the backstop and the last firing after which the settle-out is late,
s."""
SAME_TIME = 1e-15
"""Rounding tolerance of times, s, within which a firing at the end of a step belongs to the next step."""
NEWTON_LIMIT = 50
"""Limit of Newton iterations in a step of the trapezoidal rule; arbitrary."""

_STATUS = ("ok", "newton failed", "diverged")


@dataclass(frozen=True)
class SchemeRun:
    """Result of a run with an integration scheme of the 1983 paper, in SI units.

    The arrays have one element per end of a step or per requested time. The `memory` is the latest local
    maximum while the armature moves out of the pack, and 0 elsewhere.

    The status is "ok", "newton failed" (no solution of an implicit step found) or "diverged" (the motion is
    no longer finite, has left the range of a law, or exceeds the displacement limit `far` of `integrate`).
    """

    t: Array
    x: Array
    v: Array
    memory: Array
    status: str


def integrate(
    laws: Laws,
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
    reading: Reading = "look-ahead",
    moments: Array | None = None,
    rigid: bool = False,
    reload_along_unloading: bool = False,
    far: float = 1.0,
) -> SchemeRun:
    """Integrate the motion with an integration scheme of the 1983 paper.

    Parameters
    ----------
    laws : Laws
        Modules of the force laws; the schemes are compiled once for each combination.
    constants : mapping
        Packed constants of "magnet", "spring", "pack" and "backstop", float64 arrays (empty for an absent
        part).
    drive : tuple
        Firing times (s), first row of the waveform table of each firing, waveform tables, whether a pulse
        replaces the pulse before it, and whether the drive is a force.
    mass : float
        Mass of the armature, kg.
    front, position : float
        Displacements of the pack front and the backstop, m; +inf and -inf for an absent pack and backstop.
    state : (x, v)
        Initial displacement [m] and velocity [m/s].
    t_end : float
        Duration of the run, s.
    scheme : {"trapezoid", "runge-kutta-4"}
        Integration scheme. The trapezoidal rule is solved by Newton's method with a finite-difference
        derivative.
    scale : float
        Factor that multiplies all step sizes.
    reading : str
        Rule that decides when a short step is taken, one of `READINGS`.
    moments : array, optional
        Ascending output times, s (default: the ends of the steps). The state is interpolated by the cubic
        Hermite polynomial of the step.
    rigid : bool
        Whether the backstop is rigid: a step that ends behind the backstop is reset to the backstop position,
        with the rebound velocity.
    reload_along_unloading : bool
        Whether reloading inside a contact follows the unloading branch up to the local maximum.
    far : float
        Absolute displacement [m] beyond which the motion counts as diverged.

    Returns
    -------
    SchemeRun
        States at the start and at the end of every step, or at `moments`; after a failure, only the states
        reached.

    Raises
    ------
    ValueError
        The scheme or reading is unknown, or the scale or duration is not positive.
    """
    if scheme not in ("trapezoid", "runge-kutta-4"):
        raise ValueError(f"scheme {scheme!r}, expected 'trapezoid' or 'runge-kutta-4'")
    if reading not in READINGS:
        raise ValueError(f"reading {reading!r}, expected one of {', '.join(READINGS)}")
    if not (scale > 0.0 and t_end > 0.0 and math.isfinite(scale) and math.isfinite(t_end)):
        raise ValueError(f"scale {scale} and duration {t_end} s are expected to be positive")
    # The options of the laws are arguments here: the machine code does not depend on them.
    bare = Laws(laws.magnet, laws.spring, laws.pack, laws.backstop, laws.absent)
    program = specialise(bare).plain("scheme", PROGRAM)
    firings, begins, segments, replace, is_force = drive
    contact = CONTACT_STEP * scale
    wanted = np.zeros(0) if moments is None else np.array(moments, dtype=np.float64)
    # Each firing can divide one step into two.
    most = math.ceil(t_end / contact) + len(firings) + 8
    rows = np.empty((most if moments is None else wanted.size, 4))
    steps = np.array([FREE_STEP * scale, contact, LATE_STEP * scale])
    packed = tuple(
        np.ascontiguousarray(constants[role], dtype=np.float64)
        for role in ("magnet", "spring", "pack", "backstop")
    )
    options = (bool(replace), bool(is_force), rigid, reload_along_unloading)
    places = np.array([mass, front, position, t_end, far, *state])
    table = (
        np.array(firings, dtype=np.float64),
        np.array(begins, dtype=np.int64),
        np.array(segments, dtype=np.float64),
        np.zeros(1, dtype=np.int64),
    )
    model = (packed, table, options, places)
    size, status = program(
        model, steps, READINGS.index(reading), scheme == "trapezoid", wanted, moments is not None, rows
    )
    t, x, v, memory = rows[:size].T.copy()
    return SchemeRun(t, x, v, memory, _STATUS[status])


def drive_value(time: float, table: Any, replace: bool) -> float:
    """Return the drive value [A or N] at a time: the sum of all active pulses, or the latest pulse alone.

    The latest pulse alone counts with `replace`. `table` holds, in this order: the firing times; for each
    firing, the row at which its waveform begins; the rows of all waveforms; the number of earlier firings.
    """
    firings, begins, segments, fired = table
    longest = segments[segments.shape[0] - 1, 0]
    total = 0.0
    # `fired` counts the earlier firings; only firings within this step remain to be added.
    last = fired[0]
    while last < firings.size and firings[last] <= time + SAME_TIME:
        last += 1
    for i in range(last - 1, -1, -1):
        tau = max(time - firings[i], 0.0)
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


def acceleration(time: float, x: float, v: float, peak: float, model: Any) -> float:
    """Return the acceleration of the armature, m/s^2; `peak` is the latest local maximum in the pack, m.

    `model` is as for `write_steps`, also in the functions below.
    """
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
        force += backstop_elastic(packed[3], w) + backstop_viscous(packed[3], w, v)
    return float(force / places[0])


def runge_kutta(
    time: float, x: float, v: float, h: float, peak: float, model: Any
) -> tuple[float, float, bool]:
    """Compute a step of the classical fourth-order Runge-Kutta method; return position, velocity and True."""
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


def trapezoid(
    time: float, x: float, v: float, h: float, peak: float, model: Any
) -> tuple[float, float, bool]:
    """Compute a step of the trapezoidal rule; return position, velocity, and whether the step is solved."""
    # Substituting x1 = x + h/2 (v + v1) into the rule for v leaves one equation for v1.
    half = 0.5 * h
    a = acceleration(time, x, v, peak, model)
    known = v + half * a
    new = v + h * a
    # The lower bound keeps the tolerance above rounding errors for a hammer at rest.
    size = abs(v) + abs(h * a) + 1e-3
    a1 = acceleration(time + h, x + half * (v + new), new, peak, model)
    residual = new - known - half * a1
    if not math.isfinite(residual):
        # The initial guess lies outside the range of a law: start from the state before the step.
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
        # Halve the Newton step until the residual decreases; otherwise step functions and the stiff
        # backstop would make the iteration cycle.
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


def one_step(
    implicit: bool, time: float, x: float, v: float, h: float, peak: float, model: Any
) -> tuple[float, float, bool]:
    """Compute a step of the trapezoidal rule if `implicit`, otherwise of the Runge-Kutta method."""
    if implicit:
        return trapezoid(time, x, v, h, peak, model)
    return runge_kutta(time, x, v, h, peak, model)


def keep(row: Array, time: float, x: float, v: float, peak: float, front: float) -> None:
    """Write time, position, velocity and memory to a row of the result.

    The memory is 0, except while the armature moves out of the pack.
    """
    row[0], row[1], row[2], row[3] = time, x, v, 0.0
    if x > front and v < 0.0:
        row[3] = max(peak, x)


def write_steps(
    model: Any, steps: Any, reading: int, implicit: bool, moments: Array, at_moments: bool, rows: Array
) -> tuple[int, int]:
    """Write the states at the ends of all steps to `rows`; return their number and the index of the status.

    With `at_moments`, the states are those at the times `moments` [s] instead. `model` holds, in this order:
    the packed constants of magnet, spring, pack and backstop; the table of `drive_value`; the options
    `replace`, `is_force`, `rigid` and `reload_along_unloading` of `integrate`; and mass, front, backstop
    position, end time, displacement limit, initial displacement and velocity, in SI units. `steps` holds the
    step sizes [s] off the backstop, in contact, and late in the settle-out.
    """
    packed, (firings, _begins, _segments, fired), (_replace, _is_force, rigid, along), places = model
    front, position, t_end, far = places[1], places[2], places[3], places[4]
    time, place, speed, peak = 0.0, places[5], places[6], places[5]
    n, settling_since, short = 0, 0.0, 0
    if not at_moments or (moments.size > 0 and moments[0] <= 0.0):
        keep(rows[0], time, place, speed, peak, front)
        n = 1
    # Do not take a step for a remainder that is only a rounding error.
    while time < t_end - 1e-9 * steps[1] and not (at_moments and n == moments.size):
        while fired[0] < firings.size and firings[fired[0]] <= time + SAME_TIME:
            settling_since = max(settling_since, firings[fired[0]])
            fired[0] += 1
        inside = place < position
        if not inside:
            settling_since = time
        late = inside and reading != 3 and time - settling_since >= LATE_AFTER
        h = steps[0]
        if short > 0 or (inside and not late):
            h = steps[1]
        elif late:
            h = steps[2]
        if reading == 2 and h == steps[1] and short == 0:
            short = 10
        h = min(h, t_end - time)
        if reading == 4 and fired[0] < firings.size:
            h = min(h, firings[fired[0]] - time)
        new_place, new_speed, solved = one_step(implicit, time, place, speed, h, peak, model)
        ends_inside = not (solved and new_place >= position)
        if reading != 1 and not inside and h > steps[1] and ends_inside:
            h = steps[1]
            short = 10 if reading == 2 else 0
            new_place, new_speed, solved = one_step(implicit, time, place, speed, h, peak, model)
        short = max(short - 1, 0)
        if not solved:
            return n, 1
        if not (abs(new_place) <= far and math.isfinite(new_speed)):
            return n, 2
        if rigid and new_place < position:
            new_place = position
            new_speed = backstop_rebound(packed[3], min(new_speed, -0.0))
        if new_place <= front:
            peak = new_place
        elif along:
            peak = max(peak, new_place)
        elif new_speed >= 0.0:
            peak = new_place
        elif speed >= 0.0:
            peak = max(place, new_place)
        if at_moments:
            while n < moments.size and moments[n] <= time + h * (1.0 + 1e-9):
                s = min((moments[n] - time) / h, 1.0)
                rise = (new_place - place) / h
                c2, c3 = 3.0 * rise - 2.0 * speed - new_speed, speed + new_speed - 2.0 * rise
                x = place + h * s * (speed + s * (c2 + s * c3))
                v = speed + s * (2.0 * c2 + 3.0 * s * c3)
                keep(rows[n], moments[n], x, v, peak, front)
                n += 1
        time, place, speed = time + h, new_place, new_speed
        if not at_moments:
            keep(rows[n], time, place, speed, peak, front)
            n += 1
    if not at_moments:
        rows[n - 1, 0] = t_end
    return n, 0


PROGRAM: Final = Plain(
    write_steps,
    ((("f1",) * 4, ("f1", "i1", "f2", "i1"), ("b",) * 4, "f1"), "f1", "i", "b", "f1", "b", "f2"),
    results=2,
    laws=True,
)
"""Both schemes as a plain function of the kernel, compiled for the laws of a hammer."""
