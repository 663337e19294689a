"""Layout of a pool of lanes: one flat array of blocks, each of rows of `BLOCK` lanes.

All members in a pool are in the same mode. A row holds one quantity of all lanes of its block, so that a loop
over lanes reads and writes side by side; the rows of a block lie together.
"""

LANES = 256
"""Active members of a thread; capacity of every pool."""

BLOCK = 16
"""Lanes in one iteration of the compiled loops."""

MANY_STEPS, SHORT = 2e4, 1e-12
"""Number of steps, and ratio of step to elapsed time, at which a member leaves the lanes.

At a runaway, steps become ever shorter without underflow; the plain kernel determines the status.
"""

STALLED = 200.0
"""Number of consecutive events that do not advance time, after which a member leaves the lanes.

A switch that has to be located takes four attempts and at most some forty halvings of the step.
"""

STILL = 1e-8
"""Acceleration, in typical speeds over typical times, at which a member about to rest leaves the lanes."""

# Constants of a hammer, in the places that `layout` defines otherwise.
INVERSE_MASS = 0
POSITION = 1
FRONT = 2
DAMPING = 3
SPRING = 5
PACK = 9
BACKSTOP_PART = 15
MAGNET = 21
CONSTANTS = 27
PLACES = {
    "damping": (DAMPING, 2),
    "spring": (SPRING, 4),
    "pack": (PACK, 6),
    "backstop": (BACKSTOP_PART, 6),
    "magnet": (MAGNET, 6),
}
"""First place and number of places of the constants of each part."""

# The drive between two of its edges: reference time, constant, amplitudes of two exponentials, higher
# coefficients of the cubic, amplitude and phase of the sine; then data of the waveform alone: rates of the
# exponentials and angular frequency of the sine.
DRIVE_WIDTH = 9
RATES_WIDTH = 3

# Pools.
FREE_POOL = 0
LOADING_POOL = 1
UNLOADING_POOL = 2
CONTACT_POOL = 3
POOLS = 4

# Rows.
T = 0
X = 1
"""Displacement; in the contact pool w = sqrt(b - x)."""
V = 2
A = 3
"""Acceleration; in the contact pool dv/ds."""
H = 4
"""Next step, in time; in the contact pool in s."""
NEXT = 5
"""Time of the next edge of the drive, or of the end."""
SAMPLE = 6
"""Time of the next sample or strobe."""
MEMORY = 7
PEAK = 8
FIRST = 9
"""Step that followed the first one in this mode, 0 before that."""
STEPS = 10
LANDING = 11
"""Switch at which the current step is to end; 0 for none."""
DRIVE = 12
EXPONENTIAL_DRIVE = DRIVE + 4
"""Number of rows that a member with an exponential drive takes to another pool."""
ANY_DRIVE = DRIVE + DRIVE_WIDTH
"""Number of rows that a member with any drive takes to another pool."""
RATES = ANY_DRIVE
CONTROL = RATES + RATES_WIDTH
LOWEST = CONTROL + 4
HIGHEST = CONTROL + 5
MOST_STEPS = CONTROL + 6
"""Number of steps after which the member leaves the lanes."""
HAMMER = CONTROL + 7
OWN = HAMMER + CONSTANTS
"""Rows of the member's waveform and hammer come before this one."""

OLD_T = OWN
OLD_X = OWN + 1
OLD_V = OWN + 2
OLD_A = OWN + 3
NEW_T = OWN + 4
NEW_X = OWN + 5
NEW_V = OWN + 6
NEW_A = OWN + 7
LENGTH = OWN + 8
"""Length of the step that was taken."""
FOLLOWING = OWN + 9
"""Length of the step after it."""
EVENT = OWN + 10
ROWS = OWN + 11

BLOCK_SIZE = ROWS * BLOCK
POOL_SIZE = BLOCK_SIZE * (LANES // BLOCK)

# Columns of a slot: data of a member outside its lane.
MEMBER = 0
NEXT_SAMPLE = 1
NEXT_STROBE = 2
FREE_STEP = 3
PACK_STEP = 4
CONTACT_STEP = 5
UNIT = 6
"""Unit of s of the current backstop contact; 0 for one open since the start."""
DOT = 7
"""Row of the open pack contact among the dots and extra contacts of the member, -1 for none."""
END = 8
CAREFUL = 9
"""Whether the next switch is located with steps of the plain kernel."""
ATTEMPTS = 10
SAVED_STEP = 11
NEXT_TIME = 12
"""Time of the next strobe, infinity if there is none."""
EVENT_TIME = 13
"""Time of the latest handled event."""
EVENTS = 14
"""Number of consecutive events that did not advance time."""
EXTRA = 15
"""Number of extra contacts so far."""
SLOT_WIDTH = 16

# Events, bit flags to be added.
SWITCH = 1.0
"""The step may contain a switch and has not been accepted."""
SAMPLED = 2.0
AT_EDGE = 4.0
STUCK = 8.0
"""The step is too short, or not finite."""
