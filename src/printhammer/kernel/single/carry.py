"""State of a run: one array of numbers with named places, shared by every phase of the run.

A run that pauses leaves its complete state in the array; the next call with the same array and drive
continues exactly as without the pause.

For a run that begins the caller sets `TIME`, `POSITION_NOW`, `VELOCITY`; `STATE` to `FRESH`, or to
`ON_BRANCH` for one that begins inside the pack on the branch `MODE` with the latest local maximum at `PEAK`
[m]; `PAUSE_AFTER` to the number of nodes after which to pause outside the pack; and `WITH_CURRENT` to 1 for a
run with a coil circuit that does not begin without current: the three numbers from `ELECTRIC` on are then the
currents in the coil and in the shorted turn [A], and the voltage of the reservoir [V], NaN for a full one.
"""

from typing import Any, NamedTuple

STATE = 0
PAUSE_AFTER = 1
MODE = 2
PEAK = 3
"""Displacement of the latest local maximum in the pack [m]."""
TIME = 4
POSITION_NOW = 5
VELOCITY = 6
ACCELERATION = 7
ROOT = 8
"""w = sqrt(b - x) in the backstop."""
ROOT_RATE = 9
"""dv/ds in the backstop."""
MEMORY_NOW = 10
"""Memory of the pack law for the latest local maximum."""
STEP = 11
"""Length of the next step [s], in the backstop in s of the regularised variables."""
FREE_STEP = 12
PACK_STEP = 13
CONTACT_STEP = 14
"""Lengths of the first steps in free flight, in the pack and in the backstop."""
STARTED = 15
"""Mode of the latest step."""
ENTERED = 16
"""Whether the rate in the backstop has to be recomputed."""
WAIT = 17
"""Waiting time before an armature at rest is checked again [s]."""
STUCK = 18
"""Number of consecutive steps that did not advance time."""
TIME_BEFORE = 19
FIRST = 20
LAST = 21
EDGE = 22
"""First and last active firing, time of the next edge of the drive [s]."""
STEPS = 23
ELECTRIC = 24
PATH = 27
UNTIL = 28
WITH_CURRENT = 29
USED = 30
TOUCHED = 31
"""Numbers of nodes and contacts of the record of this call."""
SIZE = 32

SHORTEST_WAIT = 0.005
"""Shortest wait, in characteristic times, before an armature at rest is checked again; arbitrary."""

FRESH = 0.0
GOES_ON = 1.0
ON_BRANCH = 2.0


class Setup(NamedTuple):
    """Data that stay constant during a run.

    Attributes
    ----------
    train : Train
        See :class:`printhammer.kernel.model.layout.Train`.
    hammer : float64 array
        See :mod:`printhammer.kernel.model.layout`.
    control : tuple of float
        Scales of displacement and velocity, allowances of the two error estimates.
    bounds : tuple of float
        Lowest and highest displacement, origin and farthest distance from it [m].
    max_steps : int
        Largest number of steps.
    """

    train: Any
    hammer: Any
    control: Any
    bounds: Any
    max_steps: int
