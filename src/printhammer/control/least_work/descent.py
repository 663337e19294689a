"""Sequential quadratic programming (SLSQP: D. Kraft, DFVLR-FB 88-28 (1988)) on runs of a hammer.

Each step takes its derivatives from differences, all runs of which are one ensemble.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray

LOST: Final = 25.0  # What a run that failed counts as, in parts of the tolerances
_MISSED: Final = 0.05  # Deviation from the time of arrival up to which a dot meets it, in `ARRIVAL`
_SLACK: Final = 8e-3  # Lack of force up to which a dot has the force asked for, in `_FORCE`
ARRIVAL: Final = 20e-6  # Tolerance by which a time of arrival is measured, s
_FORCE: Final = 0.05  # Tolerance by which a force is measured, relative
_DIFFERENCE: Final = 1e-5  # Difference from which derivatives are taken
_ENDS_AT: Final = 1e-5  # Change of the cost at which a descent ends


def descend(
    measured: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    bounds: tuple[float, float],
    rounds: int,
    *,
    conditions: bool,
    linear: tuple[FloatArray, FloatArray] | None = None,
    inward: bool = False,
) -> tuple[FloatArray, float]:
    """Minimise the first row that `measured` returns; of two more the first is 0, the second not negative.

    `measured` returns rows (1 or 3, places) of many places (places, n); `conditions` says whether there are
    the two more. `bounds` hold for every number of a place. `linear`, an offset and a matrix, are further
    numbers that are not to be negative. With `inward`, differences are taken away from the nearer of the
    bounds 0 and 1. Returns the place, and the first row there.
    """
    from scipy import optimize

    known: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def values(place: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = place.tobytes()
        if key not in known:
            known.clear()
            side = np.where((place < 0.5) | (not inward), _DIFFERENCE, -_DIFFERENCE)
            rows = np.nan_to_num(measured(np.vstack([place, place + np.diag(side)])), nan=LOST)
            known[key] = rows[:, 0], (rows[:, 1:] - rows[:, :1]) / side
        return known[key]

    def row(number: int) -> dict[str, Any]:
        return {"fun": lambda y: values(y)[0][number], "jac": lambda y: values(y)[1][number]}

    asked: list[dict[str, Any]] = []
    if linear is not None:
        offset, matrix = linear
        asked.append({"type": "ineq", "fun": lambda y: offset + matrix @ y, "jac": lambda _y: matrix})
    if conditions:
        asked += [{"type": "eq", **row(1)}, {"type": "ineq", **row(2)}]
    minimize: Any = optimize.minimize
    optimum = minimize(
        **row(0),
        x0=start,
        bounds=[bounds] * start.size,
        method="SLSQP",
        options={"maxiter": rounds, "ftol": _ENDS_AT},
        constraints=asked,
    )
    return np.asarray(optimum.x, dtype=np.float64), float(optimum.fun)


def deviations(late: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return missed arrivals and spare forces, in parts of the tolerances.

    Of dots that come `late`, s, not finite where there is none, with a `force` in parts of that asked for.
    """
    return np.where(np.isfinite(late), late / ARRIVAL, LOST), (force - 1.0) / _FORCE


def met(missed: float, spare: float) -> bool:
    """Return whether a dot of such deviations does."""
    return abs(missed) < _MISSED and spare > -_SLACK


def best_of(
    badness: FloatArray,
    attempt: Callable[[int], tuple[float, FloatArray] | None],
    tries: int,
    most: int | None = None,
) -> FloatArray | None:
    """Return the best outcome of the best starts: of some tries, or of the first after them that has one.

    `attempt` returns cost and outcome of a start, by its number in `badness`; None where it has none. Starts
    are tried up to `most` of them while none has an outcome, by default no more than `tries`.
    """
    best: tuple[float, FloatArray] | None = None
    for number, start in enumerate(np.argsort(badness, kind="stable")[: most or tries].tolist()):
        if number >= tries and best is not None:
            break
        outcome = attempt(start)
        if outcome is not None and (best is None or outcome[0] < best[0]):
            best = outcome
    return None if best is None else best[1]


def sobol(dimensions: int, count: int) -> FloatArray:
    """Return points (count, dimensions) that are evenly spread over the unit cube: a Sobol sequence."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(dimensions, scramble=False).random(count))
