"""Entry point of simulations: from hammer and drive to a motion.

`touches_of` stores only the touches of a surface, so that memory does not grow with the length of the run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model.modes import BACKSTOP_SURFACE, PACK_SURFACE, PAUSED, STATUS_NAMES
from printhammer.results import Declared, part, scalar
from printhammer.run.motion import Motion
from printhammer.run.problem import TOLERANCE, Problem, Stretch, check_tolerance
from printhammer.run.start import initial_state, read_state, state_beyond
from printhammer.run.window import end_of, unsettled
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray

Scheme = Literal["default", "trapezoid", "runge-kutta-4"]
SCHEMES: Final = get_args(Scheme)
"""Integrators: the default, with located contacts and high order, and the two schemes of the paper."""

# Limits on the number of output points, and number of points per time scale of the hammer; arbitrary
_FEWEST, _MOST, _PER_SCALE = 1001, 400_001, 100


@checked
def simulate(
    hammer: Hammer,
    drive: Drive,
    *,
    duration: float | str | None = None,
    state: Sequence[float | str] | None = None,
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
        End of the run, s, or text with a unit; by default the last firing plus the window of the device
        (`printhammer.run.window`). Required for a drive that does not end.
    state : sequence of float or str, optional
        Displacement [m] and velocity [m/s] at time 0, as numbers or text with units; by default the rest
        state. For a start inside the pack, mode and memory may be added, see
        `printhammer.run.ensemble.Strobes`. With a voltage drive, the coil current [A] may be added, or three
        values: the currents in the coil and in its shorted turn, A, and the voltage of the supply's
        capacitor, V. By default the currents are zero and the capacitor is charged. `Motion.state_at` returns
        all components.
    tolerance : float, optional
        Error tolerance of one step, in units of the distance from backstop to pack and of a typical speed.
    points : int, optional
        Number of points of a uniform output grid; by default about a hundred per flight time.
    times : array, optional
        Times of the output grid, ascending, s. The motion does not depend on the grid.
    scheme : str, optional
        "default", or an integrator of the paper, with the paper's step sizes: "trapezoid" or
        "runge-kutta-4".
    step_scale : float, optional
        Factor on all steps of the paper's schemes.
    ledger : bool, optional
        Whether to compute the energy ledger at once; otherwise it is computed on first access of
        `Motion.energy`.

    Returns
    -------
    Motion
        Motion with a status; a run that ends early raises no exception.
    """
    if scheme not in SCHEMES:
        raise InputError.of("scheme", scheme, f"one of {', '.join(SCHEMES)}")
    check_tolerance(tolerance)
    end = end_of_run(hammer, drive, duration)
    numbers = None if state is None else read_state(state)
    beyond = state_beyond(hammer, numbers, drive.quantity)
    start = initial_state(hammer, None if numbers is None else numbers[:2])
    if scheme == "default":
        problem = Problem(hammer, drive, start, 0.0, tolerance, beyond)
    else:
        from printhammer.run.scheme_runs import SchemeProblem

        problem = SchemeProblem(hammer, drive, start, tolerance, scheme, step_scale)
    record = problem.run(end)
    reached = float(record.nodes[-1, 0])
    motion = Motion(problem, record, end, _grid(problem, reached, points, times), scheme)
    if duration is None:
        motion.unsettled = unsettled(problem, record)
    if ledger:
        _ = motion.energy
    return motion


def announce_compiling(callback: Callable[[str], None], *, helped: bool = True) -> Callable[[], None]:
    """Register a callback for messages before compilation; return a function that unregisters it.

    A message names the compiled functions and the expected duration. Further messages report, once each, that
    machine code cannot be cached, or why cached code is invalid. If `helped`, a second process compiles the
    code that evaluates finished runs (`printhammer.run.ahead`).
    """
    from printhammer.kernel.compile import cache, specialise
    from printhammer.run import ahead

    def end() -> None:
        cache.listeners.discard(callback)
        if not cache.listeners:
            specialise.begin_ahead = None

    cache.listeners.add(callback)
    if helped:
        specialise.begin_ahead = ahead.begin
    return end


def watch_compiling(callback: Callable[[bool], None]) -> None:
    """Register a callback, called with True when a compilation begins, and with False when it ends."""
    from printhammer.kernel.compile import cache

    cache.watchers.add(callback)


def end_of_run(hammer: Hammer, drive: Drive, duration: float | str | None) -> float:
    """Return the end of a run, s: `duration`, or the window of the device after the last firing.

    Raises
    ------
    InputError
        The duration is not a positive number or a time with a unit; or it is missing for an endless drive.
    """
    if duration is None:
        if not math.isfinite(drive.end):
            raise InputError("duration is missing, and the drive does not end", key="duration")
        return end_of(hammer, drive)
    if isinstance(duration, str):
        from printhammer.units import parse

        duration = parse(duration, "s")
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError.of("duration", duration, "a positive number", unit="s")
    return float(duration)


def _grid(problem: Problem, end: float, points: int | None, times: npt.ArrayLike | None) -> FloatArray:
    if times is not None:
        grid = np.array(times, dtype=np.float64).reshape(-1)
        if grid.size == 0 or not np.isfinite(grid).all() or (np.diff(grid) < 0.0).any() or grid[0] < 0.0:
            raise InputError("times: expected ascending numbers, not negative, at least one", key="times")
        return grid[grid <= end]
    if points is None:
        scale = problem.scales[0] / problem.scales[1]
        points = int(min(max(_PER_SCALE * end / scale, _FEWEST), _MOST))
    if points < 2:
        raise InputError.of("points", points, "at least 2", written=str(points))
    return np.linspace(0.0, end, points)


Surface = Literal["pack", "backstop"]
CODES: Final = {"pack": PACK_SURFACE, "backstop": BACKSTOP_SURFACE}

_STRETCH: Final = 4096  # Number of nodes of a record processed at once, which bounds the memory; arbitrary
_SURFACE, _IN, _OUT, _INITIAL = 0, 1, 3, 6
"""Columns of a contact in the kernel's record: surface, touch, departure, open at the start."""


class Touches(Declared):
    """Contacts with one surface, pack or backstop, in a run: times and speeds of touch."""

    rows: FloatArray = part(
        "time, s, and velocity, m/s, at touch and at leaving, shape (n, 4)",
        more="NaN for a contact that is open at the end",
    )
    status: str = part("status of the run", more='"ok" also if the run ended after the requested touches')
    reached: float = scalar("s", "time that the run has reached")


def touches_of(problem: Problem, surface: Surface, after: float, end: float, most: int) -> Touches:
    """Integrate up to `most` touches of a surface, or to the end of the run; return the touches.

    Only touches between `after` [s] and the `end` [s] of the run count; a contact that is already
    open at the start of the run does not count.
    """

    def take(stretches: Iterator[Stretch]) -> Touches:
        kept: list[FloatArray] = []
        count = 0
        for stretch in stretches:
            goes_on = stretch.status == PAUSED and len(stretch.contacts) > 0
            goes_on = goes_on and bool(np.isnan(stretch.contacts[-1, _OUT]))
            done = stretch.contacts[:-1] if goes_on else stretch.contacts
            counts = (done[:, _SURFACE] == CODES[surface]) & (done[:, _IN] >= after)
            kept.append(done[counts & (done[:, _INITIAL] == 0.0), _IN : _OUT + 2].copy())
            count += len(kept[-1])
            if count >= most:
                break
        ended = "ok" if stretch.status == PAUSED else STATUS_NAMES[stretch.status]
        return Touches(np.concatenate(kept)[:most], ended, stretch.reached)

    return problem.in_stretches(end, _STRETCH, take)
