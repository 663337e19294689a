"""State of a run: one array with named indices, shared by all functions of the run loop.

A run that pauses leaves its complete state in the array; the next call with the same array and drive
continues exactly as without the pause.

Before the first call of a run, the caller sets `TIME`, `POSITION_NOW` and `VELOCITY`; `STATE`, to `FRESH`, or
to `ON_BRANCH` if the run begins inside the pack on the branch `MODE` with the latest local maximum `PEAK`
[m]; `PAUSE_AFTER`, the number of nodes after which the run pauses once outside the pack; and `WITH_CURRENT`,
to 1 if a coil circuit begins with a current. The three elements from `ELECTRIC` on are then the currents in
coil and shorted turn [A] and the reservoir voltage [V], where NaN denotes a full reservoir.
"""

from typing import Any, NamedTuple

STATE = 0
PAUSE_AFTER = 1
MODE = 2
PEAK = 3
"""Index of the displacement at the latest local maximum in the pack [m]."""
TIME = 4
POSITION_NOW = 5
VELOCITY = 6
ACCELERATION = 7
ROOT = 8
"""Index of w = sqrt(b - x) in backstop contact [m^0.5]."""
ROOT_RATE = 9
"""Index of dv/ds, the derivative of the velocity in the regularised variables of the backstop."""
MEMORY_NOW = 10
"""Index of the memory value of the pack law for the latest local maximum."""
STEP = 11
"""Index of the next step size: in seconds or, in backstop contact, in the regularised variable s."""
FREE_STEP = 12
"""Index of the initial step size of the next free flight [s]."""
PACK_STEP = 13
"""Index of the initial step size of the next pack contact [s]."""
CONTACT_STEP = 14
"""Index of the initial step size of the next backstop contact, in multiples of `contact_unit`."""
STARTED = 15
"""Index of the mode of the latest step."""
ENTERED = 16
"""Index of the flag that is 1 if `ROOT_RATE` must be recomputed."""
WAIT = 17
"""Index of the time after which the forces on an armature at rest are checked again [s]."""
STUCK = 18
"""Index of the number of consecutive steps that did not advance the time."""
TIME_BEFORE = 19
"""Index of the time at the start of the latest step [s]."""
FIRST = 20
"""Index of the element that holds the index of the first active firing."""
LAST = 21
"""Index of the element that holds the index of the next firing."""
EDGE = 22
"""Index of the time of the next edge of the drive [s]."""
STEPS = 23
ELECTRIC = 24
PATH = 27
UNTIL = 28
WITH_CURRENT = 29
USED = 30
"""Index of the number of nodes that the present call has recorded."""
TOUCHED = 31
"""Index of the number of contacts that the present call has recorded."""
SIZE = 32
"""Length of the state array of a run."""

SHORTEST_WAIT = 0.005
"""Shortest interval between checks of an armature at rest, in characteristic times; arbitrary."""

FRESH = 0.0
"""Value of `STATE`: new run."""
GOES_ON = 1.0
"""Value of `STATE`: run that continues after a pause."""
ON_BRANCH = 2.0
"""Value of `STATE`: new run on a branch inside the pack."""


class Setup(NamedTuple):
    """Constant data of a run: pulse train, hammer, step-size control, bounds and limits.

    Attributes
    ----------
    train : Train
        Pulse train; see :class:`printhammer.kernel.model.layout.Train`.
    hammer : float64 array
        Parameter array; see :mod:`printhammer.kernel.model.layout`.
    control : tuple of float
        Scales of displacement [m] and velocity [m/s], tolerances of the order 6 and order 7 error estimates.
    bounds : tuple of float
        Lowest and highest displacement, origin, and largest distance from the origin before a runaway [m].
    max_steps : int
        Maximum number of steps of the run.
    """

    train: Any
    hammer: Any
    control: Any
    bounds: Any
    max_steps: int
