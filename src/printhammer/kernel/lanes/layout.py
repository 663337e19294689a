"""Layout of a pool of lanes: a flat array of blocks, each with one row of `BLOCK` lanes per quantity.

A lane holds one member of an ensemble, and all members in a pool are in the same mode. A loop over the lanes
of a block accesses contiguous memory, and the rows of a block are contiguous as well.
"""

LANES = 256
"""Maximum number of active members of a thread, and capacity of every pool."""

BLOCK = 16
"""Number of lanes of a block, which the compiled loops process together."""

MANY_STEPS, SHORT = 2e4, 1e-12
"""A member leaves the lanes if it takes more steps than the first number, and its latest step is shorter than
the second number times the elapsed time.

In a runaway, steps become ever shorter without underflow; the scalar kernel then determines the status.
"""

STALLED = 200.0
"""Number of consecutive events that do not advance the time after which a member leaves the lanes.

Locating a switching event takes four attempts and at most about forty halvings of the step.
"""

STILL = 1e-8
"""Acceleration, normalised by scales of velocity and time, below which a member coming to rest leaves
the lanes."""

# Indices of a hammer's constants in lanes; more compact than in `printhammer.kernel.model.layout`.
INVERSE_MASS = 0
POSITION = 1
FRONT = 2
DAMPING = 3
SPRING = 5
PACK = 9
BACKSTOP_PART = 15
MAGNET = 21
CONSTANTS = 27
"""Number of constants of a hammer in lanes."""
PLACES = {
    "damping": (DAMPING, 2),
    "spring": (SPRING, 4),
    "pack": (PACK, 6),
    "backstop": (BACKSTOP_PART, 6),
    "magnet": (MAGNET, 6),
}
"""First index and maximum number of the constants of each part in lanes."""

# Rows of the drive between two edges: reference time, constant, amplitudes of two exponentials, higher
# coefficients of the cubic, amplitude and phase of the sine. The rows of the waveform follow: rates of the
# exponentials and angular frequency of the sine.
DRIVE_WIDTH = 9
RATES_WIDTH = 3
"""Number of rows for the rates of a member's waveform."""

# Codes of the pools, one per mode.
FREE_POOL = 0
LOADING_POOL = 1
UNLOADING_POOL = 2
CONTACT_POOL = 3
POOLS = 4
"""Number of pools of lanes, one per mode of motion."""

# Rows of a block.
T = 0
X = 1
"""Row of the displacement [m]; in the pool of backstop contacts, w = sqrt(b - x) [m^0.5]."""
V = 2
A = 3
"""Row of the acceleration [m/s^2]; in the pool of backstop contacts, dv/ds (s: regularised variable)."""
H = 4
"""Row of the next step size: time [s] or, in the pool of backstop contacts, regularised variable s."""
NEXT = 5
"""Row of the time of the next edge of the drive or of the end of the run, whichever is earlier [s]."""
SAMPLE = 6
"""Row of the time of the next sample or strobe [s]."""
MEMORY = 7
PEAK = 8
FIRST = 9
"""Row of the step size proposed after the first step in the present mode; 0 before that step."""
STEPS = 10
LANDING = 11
"""Row of the code of the switching event at which the current step should end; 0 for none."""
DRIVE = 12
"""First row of the coefficients of the drive's closed formula."""
EXPONENTIAL_DRIVE = DRIVE + 4
"""Number of rows to copy when a member with a purely exponential drive moves to another pool."""
ANY_DRIVE = DRIVE + DRIVE_WIDTH
"""Number of rows to copy when a member with an arbitrary drive moves to another pool."""
RATES = ANY_DRIVE
CONTROL = RATES + RATES_WIDTH
LOWEST = CONTROL + 4
HIGHEST = CONTROL + 5
MOST_STEPS = CONTROL + 6
"""Row of the number of steps after which the member leaves the lanes."""
HAMMER = CONTROL + 7
OWN = HAMMER + CONSTANTS
"""First row of the results of the latest step, after the rows of the member and its hammer."""

OLD_T = OWN
OLD_X = OWN + 1
OLD_V = OWN + 2
OLD_A = OWN + 3
NEW_T = OWN + 4
NEW_X = OWN + 5
NEW_V = OWN + 6
NEW_A = OWN + 7
LENGTH = OWN + 8
"""Row of the length of the latest step."""
FOLLOWING = OWN + 9
"""Row of the proposed length of the step after the latest step."""
EVENT = OWN + 10
ROWS = OWN + 11

BLOCK_SIZE = ROWS * BLOCK
POOL_SIZE = BLOCK_SIZE * (LANES // BLOCK)

# Columns of a slot, which holds data of a member outside its lane.
MEMBER = 0
NEXT_SAMPLE = 1
NEXT_STROBE = 2
FREE_STEP = 3
PACK_STEP = 4
CONTACT_STEP = 5
UNIT = 6
"""Column of the scale of the regularised variable s in a contact; 0 if the run began in this contact."""
DOT = 7
"""Column of the row index of the open pack contact in the dot data; -1 if none is open."""
END = 8
CAREFUL = 9
"""Column of a flag: 1 if the scalar kernel has to locate the next switching event, else 0."""
ATTEMPTS = 10
SAVED_STEP = 11
NEXT_TIME = 12
"""Column of the time of the next strobe [s]; infinity after the last strobe."""
EVENT_TIME = 13
"""Column of the time of the latest handled event [s]."""
EVENTS = 14
"""Column of the number of consecutive events that did not advance the time."""
EXTRA = 15
"""Column of the number of extra contacts up to the present time."""
SLOT_WIDTH = 16
"""Number of columns of a slot, the data of a member outside its lane."""

# Bit flags of the events of a lane, to be added.
SWITCH = 1.0
"""Event flag: the step may contain a switching event and has not been accepted."""
SAMPLED = 2.0
"""Event flag: a sample or strobe lies in the step."""
AT_EDGE = 4.0
"""Event flag: the step ends at an edge of the drive or at the end of the run."""
STUCK = 8.0
"""Event flag: the step is too short or not finite, or the step limit or a bound is reached."""
