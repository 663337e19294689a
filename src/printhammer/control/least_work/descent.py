"""Local optimisation of coil currents, evaluated by simulation, with sequential quadratic programming.

The method is SLSQP (D. Kraft, DFVLR-FB 88-28 (1988)) as implemented in SciPy. The derivatives are finite
differences, all of whose simulations form one ensemble.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from printhammer.support.arrays import FloatArray

LOST: Final = 25.0  # Deviation assigned to a failed simulation, in tolerances
_MISSED: Final = 0.05  # Accepted deviation from the arrival time, in units of `ARRIVAL`
_SLACK: Final = 8e-3  # Accepted shortfall of the force, in units of `_FORCE`
ARRIVAL: Final = 20e-6  # Scale of arrival deviations, s
_FORCE: Final = 0.05  # Scale of force deviations, relative
_DIFFERENCE: Final = 1e-5  # Step of the finite differences
_ENDS_AT: Final = 1e-5  # Change of the cost at which SLSQP stops


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
    """Minimise the first row of `measured` by SLSQP, subject to optional constraints.

    `measured` maps points (places, n) to rows (1 or 3, places). With `conditions` there are three rows: the
    objective, an equality constraint (second row = 0) and an inequality constraint (third row >= 0). `bounds`
    apply to every variable. `linear`, an offset and a matrix, are linear inequality constraints, offset +
    matrix @ y >= 0. With `inward`, the difference step points away from the nearer one of the bounds 0 and 1.
    Returns the final point and its objective.
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
    """Normalise arrival deviations and excess forces by their tolerances.

    `late`, s, is not finite for a lost dot; `force` is relative to the requested force.
    """
    return np.where(np.isfinite(late), late / ARRIVAL, LOST), (force - 1.0) / _FORCE


def is_acceptable(missed: float, spare: float) -> bool:
    """Whether a dot is acceptable, from its normalised deviations of arrival and force."""
    return abs(missed) < _MISSED and spare > -_SLACK


def best_of(
    badness: FloatArray,
    attempt: Callable[[int], tuple[float, FloatArray] | None],
    tries: int,
    most: int | None = None,
) -> FloatArray | None:
    """Run a multi-start search; return the outcome of least cost among the most promising starts.

    Starts are ordered by `badness`. `attempt` maps the index of a start to cost and outcome, or to None if it
    fails. The first `tries` starts are always run; further starts, up to `most` (by default `tries`), only
    until one succeeds.
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
    """Return the first points of an unscrambled Sobol sequence, shape (count, dimensions), in [0, 1)."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(dimensions, scramble=False).random(count))
