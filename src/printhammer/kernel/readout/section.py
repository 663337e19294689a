"""Strobe section of an endless pulse train: largest Lyapunov exponent, and period by recurrence."""

from __future__ import annotations

import math
from typing import Any

FEWEST = 8
"""Smallest number of growth factors from which a standard error is estimated."""
SIGNIFICANT = 3.0
"""Number of standard errors by which the exponent of a strange motion exceeds zero."""

UNPROVED, SUPERSTABLE, RESTS_ONCE, KINKED, STRANGE, UNCERTAIN = -1, -2, -3, -4, -5, -6
"""Codes of the classes without a period; see :func:`class_of`."""

AGREES, DISTINCT = 1e-8, 1e-3
"""Distances, in units of the scales, below which states agree completely and above which they differ by more
than noise; as in `printhammer.chaos.orbits.settled`."""
SHRINKS, NOISE = 1e-5, 1e-9
"""Smallest decrease of the distance of states that approach each other: relative, and in scale units."""


def write_states(strobes: Any, front: float, states: Any, branches: Any) -> None:
    """Write the states of a strobe section, and the pack-law branch of each state (0 outside the pack).

    Parameters
    ----------
    strobes : float64 array, shape (n, 4), with a circuit (n, 7)
        Strobes; see :mod:`printhammer.kernel.single.stretch`.
    front : float
        Front of the pack [m].
    states : float64 array, shape (n, 3), with a circuit (n, 4)
        Output: displacement [m], velocity [m/s] and memory [m]; with a circuit also the coil current [A].
    branches : int64 array, shape (n,)
        Output.
    """
    for i in range(strobes.shape[0]):
        states[i, 0], states[i, 1], states[i, 2] = strobes[i, 0], strobes[i, 1], strobes[i, 3]
        if states.shape[1] > 3:
            states[i, 3] = strobes[i, 4]
        branches[i] = int(strobes[i, 2]) if strobes[i, 0] > front else 0


def class_of(agreed: int, settled: int, value: float, error: float, smooth: bool, rests: int) -> int:
    """Classify a motion by its strobe states and its Lyapunov exponent; return its period or verdict code.

    Parameters
    ----------
    agreed, settled : int
        Period after which the states agree, and the period that the states prove; 0 for none.
    value, error : float
        Largest Lyapunov exponent per firing and its standard error; used only without a period.
    smooth : bool
        Whether the motion is differentiable with respect to its initial state.
    rests : int
        Number of firings that were followed by a rest of the armature on the backstop.

    Returns
    -------
    int
        The proved period; `UNPROVED` if the states agree but still move; `SUPERSTABLE` or `RESTS_ONCE` if the
        motion forgets its past; `KINKED` without a derivative; `STRANGE` with a positive exponent; else
        `UNCERTAIN`.
    """
    if agreed > 0:
        return settled if settled > 0 else UNPROVED
    if value == -math.inf:
        return SUPERSTABLE if rests > 1 else RESTS_ONCE
    if not smooth:
        return KINKED
    return STRANGE if value > SIGNIFICANT * error else UNCERTAIN


def write_exponent(growth: Any, work: Any, out: Any) -> int:
    """Write the largest Lyapunov exponent and its standard error to `out`; return the number of rests.

    The exponent is the mean growth per firing. Its standard error is estimated by overlapping batch means,
    since successive values are correlated; see `printhammer.derivatives.states.standard_error`. The error is
    infinite for fewer than eight firings or if a value is not finite.

    Parameters
    ----------
    growth : float64 array, shape (n, any)
        Logarithm of the growth of small perturbations from each firing to the next; the largest in column 0.
    work : float64 array, shape (n + 1,)
        Working space.
    out : float64 array, shape (2,)
        Output.

    Returns
    -------
    int
        Number of values that are minus infinity, i.e. of rests on the backstop that erase the past.
    """
    n, rests = growth.shape[0], 0
    mean = 0.0
    for i in range(n):
        mean += growth[i, 0]
        if growth[i, 0] == -math.inf:
            rests += 1
    mean /= max(n, 1)
    out[0], out[1] = mean, math.inf
    if n < FEWEST or not math.isfinite(mean):
        return rests
    b = int(math.sqrt(n))
    b -= 1 if b * b > n else 0
    work[0] = 0.0
    for i in range(n):
        work[i + 1] = work[i] + (growth[i, 0] - mean)
    squares = 0.0
    for i in range(n + 1 - b):
        batch = (work[i + b] - work[i]) / b
        squares += batch * batch
    out[1] = math.sqrt(b / ((n - b) * (n - b + 1.0)) * squares)
    return rests


def write_distances(states: Any, branches: Any, scales: Any, distances: Any) -> tuple[int, int]:
    """Write the largest distance between states q firings apart, for q = 1, 2, and so on.

    Parameters
    ----------
    states : float64 array, shape (n, any)
        States at successive firings.
    branches : int64 array, shape (n,)
        Branch of the pack's law of each state, 0 outside the pack.
    scales : float64 array
        Scale of each component; the last element is the distance up to which states agree, in these units.
    distances : float64 array, shape (any,)
        Output for each q: largest absolute difference of a component, in units of its scale; infinite if
        states q firings apart lie on different branches, if a state is unknown, or if q exceeds half of n.

    Returns
    -------
    tuple
        Period, i.e. the smallest q at which all states agree, or 0; and the period or, if 0, the q of least
        distance.
    """
    n, parts = states.shape
    period, nearest, least = 0, 0, math.inf
    for place in range(distances.shape[0]):
        q = place + 1
        largest = 0.0 if q <= n // 2 else math.inf
        for i in range(n - q if q <= n // 2 else 0):
            if branches[i] != branches[i + q]:
                largest = math.inf
            for k in range(parts):
                apart = abs(states[i + q, k] / scales[k] - states[i, k] / scales[k])
                if not apart <= largest:
                    largest = apart if math.isfinite(apart) else math.inf
        distances[place] = largest
        if period == 0 and largest <= scales[parts]:
            period = q
        if largest < least:
            nearest, least = q, largest
    return period, period or nearest


def mean_apart(states: Any, scales: Any, count: int, period: int, late: bool) -> float:
    """Return the mean distance between states `count` firings apart, `late` or early in the series.

    The mean is over the last or the first quarter of the series, in whole multiples of `period` firings.
    """
    n, parts = states.shape
    pairs = n - count
    used = min(period * max(pairs // (4 * period), 1), pairs)
    total = 0.0
    for i in range(pairs - used if late else 0, pairs if late else used):
        largest = 0.0
        for k in range(parts):
            largest = max(largest, abs(states[i + count, k] / scales[k] - states[i, k] / scales[k]))
        total += largest
    return float(total / used)


def is_shrinking(states: Any, scales: Any, count: int, period: int) -> bool:
    """Whether states `count` firings apart are closer late than early in the series; see `mean_apart`."""
    early = mean_apart(states, scales, count, period, False)
    return early - mean_apart(states, scales, count, period, True) > SHRINKS * early + NOISE


def is_prime(number: int) -> bool:
    """Whether a number has no divisor but 1 and itself."""
    for divisor in range(2, number):
        if number % divisor == 0:
            return False
    return number > 1


def is_shown(states: Any, scales: Any, period: int) -> bool:
    """Whether the states alone prove the period `period`, without Newton's method."""
    if not mean_apart(states, scales, period, period, True) <= AGREES:
        return False
    for prime in range(2, period + 1):
        if period % prime == 0 and is_prime(prime):
            count = period // prime
            if is_shrinking(states, scales, count, period):
                return False
            if not mean_apart(states, scales, count, period, True) >= DISTINCT:
                return False
    return True


def settled_period(states: Any, scales: Any, period: int, planar: bool) -> int:
    """Return the period of a settled motion whose states agree `period` firings apart; 0 if undecided.

    The rules are as in `printhammer.chaos.orbits.settled`, without Newton's method. A motion is `planar`
    if displacement and velocity are its complete state at a firing; its period stays undecided if the states
    alone do not prove a period. A motion that is not planar is undecided only if its states still move.
    `states` and `scales` are as for `write_distances`.
    """
    for count in range(1, period + 1):
        if period % count == 0 and is_shown(states, scales, count):
            return count
    if planar:
        return 0
    early = mean_apart(states, scales, period, period, False)
    if not mean_apart(states, scales, period, period, True) <= max(AGREES, early):
        return 0
    for prime in range(2, period + 1):
        if period % prime == 0 and is_prime(prime) and is_shrinking(states, scales, period // prime, period):
            return 0
    return period
