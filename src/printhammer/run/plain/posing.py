"""Scales, coil circuit and window (last firing to end) of a run, as plain functions.

`printhammer.run.problem`, `printhammer.run.supply` and `printhammer.run.window` call these functions, and so
do the entry points of a page in `printhammer.run.plain.page`.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from printhammer.hammer.statics import Statics, free_force, nearest_level, origin_of
from printhammer.kernel.model.modes import PACK_SURFACE

FAR: Final = 1e4
"""Distance from the origin, in strokes, beyond which the motion is a runaway; arbitrary."""

PLACES: Final = 33
"""Number of positions along the travel of the armature at which the inductance is checked; arbitrary."""

SHORT: Final = 1e-3
"""Time, s, in which a coil without resistance is assumed to reach its typical current; arbitrary."""

CYCLE: Final = 4e-3
"""Smallest default time from switch-off of the supply to the end of a run, s."""

FLIGHTS: Final = 3.0
"""Smallest time from the last firing to the end of a run, in flight times of a single pulse."""

SETTLED: Final = 0.05
"""Largest distance from rest at the end of a run, as a fraction of the distance from rest to the pack."""

PATIENCE: Final = 16.0
"""Largest time from the last firing to the end of a run if the armature does not settle, in flight times."""

LONGEST: Final = 64.0
"""Extension of the smallest window at which doubling stops, in typical displacement / typical speed."""

LAST: Final = 1.0
"""Extension of the smallest window at which doubling always stops, s."""


PAPER_X: Final = (38.1e-6, 88.9e-6)
"""Displacement range of the window of Fig. 11 of Hendriks (1983), m (0.0015 to 0.0035 inch)."""

PAPER_V: Final = (-0.635, 0.635)
"""Velocity range of the window of Fig. 11 of Hendriks (1983), m/s (-25 to +25 inch/s)."""

PAPER_BACKSTOP: Final = 50.8e-6
"""Position of the backstop in Hendriks (1983), m (0.002 inch)."""

PAPER_FRONT: Final = 203.2e-6
"""Position of the pack front in Hendriks (1983), m (0.008 inch)."""

SAME: Final = 1e-3
"""Relative tolerance within which positions are equal to those of Hendriks (1983)."""

PART: Final = 1.0 / 6.0
"""Half-width of the strobe window of Fig. 11, as a fraction of the distance from backstop to pack."""


def is_the_paper(position: float, front: float) -> bool:
    """Whether backstop position and pack front [m] are those of Hendriks (1983); False if either is NaN."""
    near = abs(position - PAPER_BACKSTOP) <= SAME * max(abs(position), PAPER_BACKSTOP)
    return near and abs(front - PAPER_FRONT) <= SAME * max(abs(front), PAPER_FRONT)


def part_of_window(position: float, front: float) -> float:
    """Return the ratio of the half-widths of the strobe window to the scales of a hammer.

    The scales are a typical displacement and speed; the ratio is 1 without a backstop or without a pack.
    """
    return 1.0 if math.isnan(position) or math.isnan(front) else PART


def write_half_widths(way: float, speed: float, position: float, front: float, out: Any) -> None:
    """Write the half-widths of the strobe window, m and m/s; see `printhammer.run.regime.window_of`.

    `way` and `speed` are the scales of a hammer that starts at its origin, m and m/s; `position` is the
    position of the backstop and `front` the front of the pack, m; NaN if missing.
    """
    part = part_of_window(position, front)
    out[0], out[1] = part * way, part * speed
    if is_the_paper(position, front):
        out[0], out[1] = 0.5 * (PAPER_X[1] - PAPER_X[0]), 0.5 * (PAPER_V[1] - PAPER_V[0])


class Coil(NamedTuple):
    """Functions and constants of a voltage-driven coil."""

    magnet_linkage: Any
    """Law function of the flux linkage, Wb."""
    magnet_inductance: Any
    """Law function of the differential inductance, H."""
    magnet: Any
    """Packed constants of the magnet."""
    coupled: bool
    """Whether the flux of the magnet is linked with the coil."""
    inductance: float
    """Constant inductance, H."""
    leakage: float
    """Leakage inductance, H."""
    resistance: float
    """Resistance at the temperature of the winding, ohm."""


def main_linkage(x: float, current: float, coil: Coil) -> float:
    """Return the flux linkage [Wb] of the main flux path of a coil at a displacement [m] and current [A]."""
    own = coil.inductance * current
    if not coil.coupled:
        return own
    return own + float(coil.magnet_linkage(coil.magnet, x, current))


def main_inductance(x: float, current: float, coil: Coil) -> float:
    """Return the differential inductance [H] of the main flux path of a coil, at x [m] and a current [A]."""
    if not coil.coupled:
        return coil.inductance
    return coil.inductance + float(coil.magnet_inductance(coil.magnet, x, current))


def sustained_current(
    voltage: float, series: float, support: float, upper: float, origin: float, coil: Coil
) -> tuple[float, float]:
    """Return the currents [A] that a voltage can sustain in a coil with and without the limit of a chopper.

    `series` is the resistance of the supply in series with the coil, ohm; `upper` is the current at which the
    chopper switches off, A, NaN without a chopper. Without resistance, the current is the current reached
    within the time `support` [s] of the pulse, but at most `SHORT`, at the displacement `origin` [m].
    """
    resistance = coil.resistance + series
    if resistance > 0.0:
        current = voltage / resistance
    else:
        slope = main_inductance(origin, 0.0, coil) + coil.leakage
        current = voltage * min(SHORT, support) / slope if slope > 0.0 else voltage
    return current if math.isnan(upper) else min(upper, current), current


def linkage_scale(origin: float, current: float, coil: Coil) -> float:
    """Return a typical flux linkage [Wb]: that due to the coil current [A] at displacement `origin` [m]."""
    span = abs(main_linkage(origin, current, coil) - main_linkage(origin, 0.0, coil))
    if not (math.isfinite(span) and span > 0.0):
        span = coil.inductance * current
    return span + coil.leakage * current


def falling_place(low: float, high: float, current: float, coil: Coil) -> tuple[float, float]:
    """Find a displacement at which the flux linkage does not increase with the current.

    The search covers displacements from `low` to `high` [m] and coil currents from 0 to `current` [A].

    Returns
    -------
    tuple of float
        Displacement [m] and derivative of the flux linkage with respect to current [H]; NaN and 0 if no
        such displacement is found.
    """
    count = PLACES if high > low else 1
    for k in range(count):
        x = low
        if k > 0:
            x = high if k == count - 1 else low + k * ((high - low) / (count - 1))
        for part in (0.0, 0.5, 1.0):
            slope = main_inductance(x, part * current, coil)
            if slope <= 0.0:
                return x, slope
    return math.nan, 0.0


def largest_force(x: float, current: float, push: float, s: Statics) -> float:
    """Return the larger of the absolute static forces at `x` without and with the current, plus `push`, N."""
    largest = 0.0
    for i in (0.0, current):
        size = abs(free_force(x, i, s))
        if math.isfinite(size):
            largest = max(largest, size)
    return push + largest


def typical_scales(
    mass: float, current: float, push: float, period: float, state: tuple[float, float], s: Statics
) -> tuple[float, float]:
    """Return a typical displacement [m] and speed [m/s]; see `printhammer.run.problem.scales_of`.

    `current` and `push` are the largest current [A] and force [N] of the drive; `period` is the drive's
    period [s], NaN without a period. `mass` is in kg, `state` is the initial displacement [m] and velocity
    [m/s], and `s` the static force of the hammer.
    """
    origin = origin_of(s)
    if s.position > -math.inf and s.front < math.inf:
        way = s.front - s.position
    else:
        near = largest_force(origin, current, push, s)
        step = 1e-6 * max(abs(origin), abs(state[0]), 1e-3)
        stiffness = abs(free_force(origin + step, 0.0, s) - free_force(origin, 0.0, s)) / step
        time = math.inf
        if stiffness > 0.0 and math.sqrt(mass / stiffness) > 0.0:
            time = math.sqrt(mass / stiffness)
        if period / (2.0 * math.pi) > 0.0:
            time = min(time, period / (2.0 * math.pi))
        if math.isinf(time):
            time = 1e-3
        reach = max(near * time * time / mass, abs(state[1]) * time)
        way = max(min(reach, nearest_level(origin, s)), abs(state[0] - origin))
        if way == 0.0:
            way = 1e-4
    largest = max(largest_force(origin, current, push, s), largest_force(origin + way, current, push, s))
    speed = max(math.sqrt(largest * way / mass), abs(state[1]))
    return way, speed if speed != 0.0 else way


def allowances(tolerance: float) -> tuple[float, float]:
    """Return the tolerances of the two error estimates, of orders 6 and 7, for the tolerance of a run."""
    return (10.0 * tolerance) ** (7.0 / 9.0), 10.0 * tolerance


def least_window(support: float, replaces: bool) -> float:
    """Return the smallest time [s] from the last firing to the end of a run, for any device.

    `support` is the duration of the pulse or, with a driver, the time until its supply is off, s. `replaces`
    states whether the latest firing replaces earlier firings, as with a driver.
    """
    lasts = support if math.isfinite(support) else 0.0
    return CYCLE + lasts if replaces else max(CYCLE, lasts)


def last_window(least: float, way: float, speed: float) -> float:
    """Return the window [s] at which the search by doubling stops.

    `least` is the smallest window [s]; `way` and `speed` are a typical displacement [m] and speed [m/s].
    """
    return least + min(LONGEST * way / speed, LAST)


def is_window(ok: bool, flight: float, x: float, v: float, rest: float, front: float, wait: float) -> bool:
    """Whether a window is long enough: it holds `FLIGHTS` flight times and ends with the armature at rest.

    `ok` is whether the single pulse was completed, `flight` its flight time [s], NaN without a dot; `x` and
    `v` (SI) are the state at the end of the window `wait` [s].
    """
    if not ok:
        return True
    struck = math.isfinite(flight)
    if struck and wait < FLIGHTS * flight:
        return False
    if struck and wait >= PATIENCE * flight:
        return True
    near = SETTLED * (front - rest)
    time = flight if struck else wait / FLIGHTS
    return abs(x - rest) <= near and abs(v) * time <= near


def flight_of(contacts: Any) -> float:
    """Return the time of the first pack contact after the start, s; NaN without a contact."""
    for k in range(len(contacts)):
        if contacts[k, 0] == PACK_SURFACE and contacts[k, 6] == 0.0:
            return float(contacts[k, 1])
    return math.nan
