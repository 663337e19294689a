"""Where a run keeps what it needs to go on: places in the array `carry`.

A run that pauses fills it; the next call with the same array and drive continues to the bit as
if there had been no pause. The caller sets `STATE` to `FRESH` for a run that begins; to `ON_BRANCH` for one
that begins inside the pack on the branch `MODE` with the latest local maximum at `PEAK` [m];
`PAUSE_AFTER` to the number of nodes after which to pause outside the pack; and `WITH_CURRENT` to 1 for a run
with a coil circuit that does not begin without current: the three numbers from `ELECTRIC` on are then the
currents in the coil and in the shorted turn [A], and the voltage of the reservoir [V], NaN for a full one.
"""

STATE = 0
PAUSE_AFTER = 1
MODE = 2
PEAK = 3
TIME = 4
POSITION_NOW = 5
VELOCITY = 6
ACCELERATION = 7
ROOT = 8
ROOT_RATE = 9
MEMORY_NOW = 10
STEP = 11
FREE_STEP = 12
PACK_STEP = 13
CONTACT_STEP = 14
STARTED = 15
ENTERED = 16
WAIT = 17
STUCK = 18
TIME_BEFORE = 19
FIRST = 20
LAST = 21
EDGE = 22
STEPS = 23
ELECTRIC = 24
PATH = 27
UNTIL = 28
WITH_CURRENT = 29
SIZE = 30

FRESH = 0.0
GOES_ON = 1.0
ON_BRANCH = 2.0
