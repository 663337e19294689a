"""Codes of the modes, switches and statuses of the compiled kernel.

A mode is a stretch of the motion under one smooth force law; a switch is the instant at which a mode ends.
"""

# Modes.
FREE = 0
"""Neither the pack nor the backstop acts."""
LOADING = 1
"""In the pack on the loading branch (packs without memory have only this branch)."""
UNLOADING = 2
"""In the pack on the unloading branch of the latest local maximum."""
RELOADING = 3
"""In the pack, loading again along the unloading branch."""
PACK_RELEASED = 4
"""Beyond the pack front, but released by the pack, which does not pull."""
BACKSTOP = 5
"""In the backstop, integrated in the regularised variables."""
BACKSTOP_RELEASED = 6
"""Behind the backstop position, but released by the backstop, which does not pull."""
RESTING = 7
"""At rest on a rigid backstop."""
HELD = 8
"""At rest in the backstop, not integrated until the drive changes."""

HELD_LOADING = 9
"""At rest inside the pack on the loading branch, not integrated until the drive changes."""
HELD_UNLOADING = 10
"""At rest inside the pack on the unloading branch, not integrated until the drive changes."""

MODE_NAMES = (
    "free",
    "loading",
    "unloading",
    "reloading",
    "pack released",
    "backstop",
    "backstop released",
    "resting on the backstop",
    "held in the backstop",
    "held on the loading branch",
    "held on the unloading branch",
)
"""Public names of the modes, by code."""

# Switches that end a step.
NO_SWITCH = 0
EDGE = 1
REACHED_BACKSTOP = 2
REACHED_FRONT = 3
REVERSAL = 4
LEFT_FRONT = 5
REACHED_PEAK = 6
LEFT_BACKSTOP = 7
PUSH_ENDED = 8
PUSH_BEGAN = 9
UNRESOLVED = 10
"""Not a switch: the step is too long to decide, and is repeated with half its length."""
NEAR_TOUCH = 11
"""Not a switch: an extremum near a boundary has to be located before deciding."""
CIRCUIT = 12
"""The current of the coil takes another path."""
REST_ENDED = 13
"""The current of the coil moves an armature at rest."""
HOLDS = 14
"""Not a switch: the armature stays at rest, and the node at which the rest began remains valid."""

# Statuses of a run.
OK = 0
RANGE_LEFT = 1
RUNAWAY = 2
STEP_LIMIT = 3
STEP_UNDERFLOW = 4
PAUSED = 5
"""Not the end of a run: it continues with the next call."""
LOST = 6
"""Not the end of a run: its worker did not return."""

STATUS_NAMES = ("ok", "range left", "runaway", "step limit", "step underflow", "paused", "worker lost")
"""Public names of the statuses, by code."""

# Surfaces of a contact.
PACK_SURFACE = 0
BACKSTOP_SURFACE = 1

ANY_SCALES = (1.0, 1.0, 1.0)
"""Scales of an error estimate that is ignored."""
