"""Integer codes of the modes, switching events and run statuses of the compiled kernel.

A mode is a phase of the motion, such as free flight, with one smooth force law. A switching event, called
`switch` in the code, ends a step: the mode changes, or a piece of the drive begins or ends.
"""

# Modes of the motion.
FREE = 0
"""Mode: free flight; neither the pack nor the backstop acts on the armature."""
LOADING = 1
"""Mode: in the pack, on the loading branch of the law; the only branch of a pack law without memory."""
UNLOADING = 2
"""Mode: in the pack, on the unloading branch that starts at the latest displacement maximum."""
RELOADING = 3
"""Mode: in the pack, moving inward again along the unloading branch."""
PACK_RELEASED = 4
"""Mode: beyond the pack front, but without pack force, because the law would pull there."""
BACKSTOP = 5
"""Mode: in contact with the elastic backstop, integrated in the regularised variables."""
BACKSTOP_RELEASED = 6
"""Mode: behind the backstop position, but without backstop force, because the law would pull there."""
RESTING = 7
"""Mode: at rest on a rigid backstop."""
HELD = 8
"""Mode: at rest on an elastic backstop; the motion is not integrated until the drive changes."""

HELD_LOADING = 9
"""Mode: at rest in the pack on the loading branch; the motion is not integrated until the drive changes."""
HELD_UNLOADING = 10
"""Mode: at rest in the pack on an unloading branch; the motion is not integrated until the drive changes."""

HELD_FREE = 11
"""Mode: held by dry friction outside the pack; the motion is not integrated until the drive changes."""
RESTING_FRONT = 12
"""Mode: at rest on a rigid front. From `RESTING` on, all modes are modes of an armature at rest."""

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
    "held by friction",
    "resting on the front",
)
"""Public names of the modes, indexed by mode code."""

# Switching events, which end a step, and special codes in place of an event.
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
"""Not an event: the step is too long to detect events reliably, and is repeated with half the length."""
NEAR_TOUCH = 11
"""Not an event: the displacement has an extremum near a boundary; locate the extremum before deciding."""
CIRCUIT = 12
"""Switching event: the coil current changes to another path through the driver."""
REST_ENDED = 13
"""Switching event: the coil current sets an armature at rest in motion."""
REACHED_LEVEL = 15
"""Switching event: the displacement reaches a kink of the spring force."""
HOLDS = 14
"""Not an event: the armature stays at rest, so the latest node of the record remains valid."""

# Statuses of a run.
OK = 0
RANGE_LEFT = 1
RUNAWAY = 2
STEP_LIMIT = 3
STEP_UNDERFLOW = 4
PAUSED = 5
"""Run status: paused after the requested number of nodes; the next call continues the run."""
LOST = 6
"""Run status: the worker process of the run ended without a result."""

STATUS_NAMES = ("ok", "range left", "runaway", "step limit", "step underflow", "paused", "worker lost")
"""Public names of the run statuses, indexed by status code."""

# Surfaces that the armature can contact.
PACK_SURFACE = 0
BACKSTOP_SURFACE = 1

ANY_SCALES = (1.0, 1.0, 1.0)
"""Unit error scales, passed where the error estimate of a step is ignored."""
