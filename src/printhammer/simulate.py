"""The one entry to the kernel: a hammer, a drive, and out comes the motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from printhammer.errors import InputError
from printhammer.motion import Motion
from printhammer.problem import TOLERANCE, Problem

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from printhammer.drive import Drive
    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray

CYCLE: Final = 4e-3
"""Time after the last firing, s, at which a run ends unless told otherwise."""

Scheme = Literal["default", "trapezoid", "runge-kutta-4"]
SCHEMES: Final = get_args(Scheme)
"""Integrators: located contacts and high order; the two of the paper."""

_FEWEST, _MOST, _PER_SCALE = 1001, 400_001, 100


def simulate(
    hammer: Hammer,
    drive: Drive,
    *,
    duration: float | str | None = None,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
    points: int | None = None,
    times: npt.ArrayLike | None = None,
    scheme: Scheme = "default",
    step_scale: float = 1.0,
    ledger: bool = False,
) -> Motion:
    """Integrate the equation of motion, equations (1) and (2), of one hammer under one drive.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    drive : Drive
        The drive.
    duration : float or str, optional
        End of the run, s, or text with a unit; by default 4 ms after the last firing, and required for a
        drive that does not end.
    state : tuple of float, optional
        Displacement, m, and velocity, m/s, at time 0; by default the rest state.
    tolerance : float, optional
        Error allowed in one step, in units of the way from backstop to pack and of a typical speed.
    points : int, optional
        Number of points of a uniform output grid; by default about a hundred in the time of one flight.
    times : array, optional
        The output grid itself, ascending, s. The motion does not depend on it.
    scheme : str, optional
        "default", or one of the paper's: "trapezoid", "runge-kutta-4", in fixed steps on its schedule.
    step_scale : float, optional
        Factor on all steps of the paper's schemes.
    ledger : bool, optional
        Compute the energy ledger at once; otherwise when `Motion.energy` is first asked for.

    Returns
    -------
    Motion
        With a status; a run that could not go on is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above, or the hammer has no rest state to start from.
    """
    if scheme not in SCHEMES:
        raise InputError(f"scheme = {scheme!r}, expected one of {', '.join(SCHEMES)}")
    if not 1e-15 <= tolerance <= 1e-2:
        raise InputError(f"tolerance = {tolerance!r}, expected a number from 1e-15 to 1e-2")
    end = _end(drive, duration)
    start = _state(hammer, state)
    if scheme == "default":
        problem = Problem(hammer, drive, start, 0.0, tolerance)
    else:
        from printhammer.scheme_runs import SchemeProblem

        problem = SchemeProblem(hammer, drive, start, tolerance, scheme, step_scale)
    record = problem.run(end)
    reached = float(record.nodes[-1, 0])
    motion = Motion(problem, record, end, _grid(problem, reached, points, times), scheme)
    if ledger:
        _ = motion.energy
    return motion


def announce_compiling(callback: Callable[[str], None] | None) -> None:
    """Have `callback` called with one sentence before machine code is made that is not kept on disk yet."""
    from printhammer.kernel import specialise

    specialise.announce = callback


def _state(hammer: Hammer, state: tuple[float, float] | None) -> tuple[float, float]:
    if state is None:
        from printhammer.equilibrium import rest_state

        return rest_state(hammer), 0.0
    x, v = (float(number) for number in state)
    if not (math.isfinite(x) and math.isfinite(v)):
        raise InputError(
            f"state = {state!r}, expected two finite numbers, displacement in m and velocity in m/s"
        )
    if hammer.magnet is not None:
        low, high = hammer.magnet.domain
        if not low <= x <= high:
            raise InputError(
                f"state = {state!r}, expected a displacement from {low:.9g} m to {high:.9g} m, where the law"
                " of the magnet holds"
            )
    rigid = hammer.backstop is not None and hammer.backstop.law == "rigid"
    if rigid and hammer.position is not None and x < hammer.position:
        raise InputError(f"state = {state!r}, expected a displacement not behind the rigid backstop")
    return x, v


def _end(drive: Drive, duration: float | str | None) -> float:
    if duration is None:
        if not math.isfinite(drive.end):
            raise InputError("duration is missing, and the drive does not end")
        return float(drive.times[-1]) + CYCLE
    if isinstance(duration, str):
        from printhammer.units import parse

        duration = parse(duration, "s")
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"duration = {duration!r} s, expected a positive number")
    return float(duration)


def _grid(problem: Problem, end: float, points: int | None, times: npt.ArrayLike | None) -> FloatArray:
    if times is not None:
        grid = np.array(times, dtype=np.float64).reshape(-1)
        if grid.size == 0 or not np.isfinite(grid).all() or (np.diff(grid) < 0.0).any() or grid[0] < 0.0:
            raise InputError("times: expected ascending numbers, not negative, at least one")
        return grid[grid <= end]
    if points is None:
        scale = problem.scales[0] / problem.scales[1]
        points = int(min(max(_PER_SCALE * end / scale, _FEWEST), _MOST))
    if points < 2:
        raise InputError(f"points = {points}, expected at least 2")
    return np.linspace(0.0, end, points)
