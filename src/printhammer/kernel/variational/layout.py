"""Layout of a column of a variational equation, and of the working space.

A column is the change of the motion, all at one time, per unit of an initial change or of a constant: of the
`STATE` components of the state, displacement [m] and velocity [m/s]; of the latest local maximum in the pack
[m], which changes at switches only; and, where constants force the equation, of the energies [J] that coil
and drive force have given and pack, backstop and damping have taken. Where a voltage drives the coil, four
more rows come last: of the electric state, flux linkage of the coil and of the shorted turn [Wb] and voltage
of the reservoir [V], and of the time [s] at which a fixed off-time of a chopper ends.
"""

from typing import Any, NamedTuple

from printhammer.kernel.methods.dop853_tableau import STAGES

STATE = 2
"""Components of the state: displacement and velocity."""
PEAK = STATE
ENERGY = STATE + 1
COIL, DRIVE, PACK_LOSS, BACKSTOP_LOSS, DAMPING_LOSS = range(ENERGY, ENERGY + 5)
ENERGIES = 5
ROWS = ENERGY + ENERGIES
"""Rows of a column without a circuit; without forcing the first three."""
ELECTRICS = 3
"""Components of the electric state; the end of an off-time is one row more."""

START, STAGE, MEMORIES = STAGES, STAGES + 1, STAGES + 2
WORK_ROWS = STAGES + 3
"""Rows of the working space: slopes of the stages, state at the start, state at a stage, memories."""
TIME = STATE
"""Place of the time in a row of the working space, after displacement or w and velocity."""
FIRST_COLUMN = TIME + 1
"""Place there of the first column."""

# Places in `track`.
DUE = 0
"""Number of the next mark."""
SMOOTH = 1
"""Whether the map is differentiable so far, 1 or 0."""
GROWN = 2
"""From here on: logarithms of growth since the latest mark."""

# Forcing: each constant changes the array of the hammer's constants, the firing times and the waveforms.
SPACING = 1e-3
"""Step of difference quotients with constants, as a fraction of the constant or its scale."""
MIDDLE = 4
"""Row of `varied` with the unchanged constants."""
VARIED = 9
"""Rows of `varied`: row 4 + j holds the constants with j times `SPACING` of the change."""
FIELD_MOVES, PACK_MOVES, BACKSTOP_MOVES, DAMPING_MOVES, CIRCUIT_MOVES = 1, 2, 4, 8, 16
"""Bits of `of_hammer`: which laws a column changes; mass and position of the backstop are no law's."""
DELAYED = 5
"""Numbers kept for each pulse under way: delay of its piece, changes of p0 to p3, from place 1 on."""


class Forcing(NamedTuple):
    """Changes of the kernel's arrays with n constants, and working space; an empty tuple without constants.

    Attributes
    ----------
    varied, moves : float64 arrays, shapes (n, 9, h) and (n, h)
        The hammer's constants moved by -4 to 4 times `SPACING` of their changes, and the changes.
    of_hammer : int64 array, shape (n,)
        Laws that a column changes, as a sum of bits.
    fire_moves, piece_moves : float64 arrays, shapes (n, f) and (n, m, 6)
        Changes of the firing times [s] and of the waveforms' tables.
    live_moves, memories : float64 arrays, shapes (n, 5 f) and (n, 9)
        Working space.
    value_spacing : float
        Step of the drive for the derivative of the force [A or N].
    """

    varied: Any
    moves: Any
    of_hammer: Any
    fire_moves: Any
    piece_moves: Any
    live_moves: Any
    memories: Any
    value_spacing: float


class Carried(NamedTuple):
    """Columns during their propagation along a run, and their values at marks and requested nodes.

    Without forcing a column has r = 3 rows, with it 8; with a circuit four more.

    Attributes
    ----------
    columns : float64 array, shape (r, n)
        Columns at the end of the stretch or at the last mark.
    work : float64 array, shape (15, `work_width`)
        Working space.
    track : float64 array, shape (2 + n,)
        Before the first stretch zeros, except a one at index 1; afterwards the data for the next stretch,
        with at index 1 whether the motion is differentiable so far.
    states : float64 array, shape (m, 4), with a circuit (m, 8)
        Displacement, velocity, mode and latest local maximum at the marks; electric state and path.
    changes, growth : float64 array, shapes (m, r, n) and (m, n)
        Columns at the marks, and the logarithms of their growth since the mark before.
    passed : float64 array, shape (q, 2, r, n)
        Columns at the requested nodes, before and after the switch there.
    """

    columns: Any
    work: Any
    track: Any
    states: Any
    changes: Any
    growth: Any
    passed: Any


class Setting(NamedTuple):
    """Data that stay constant along a run."""

    scales: Any
    bounds: Any
    hammer: Any
    drive: Any
    forcing: Any


def electric_row(forced: bool) -> int:
    """Return the first row of the circuit in a column."""
    return ROWS if forced else ENERGY


def row_count(forced: bool, circuit: bool) -> int:
    """Return the number of rows of a column."""
    return electric_row(forced) + (ELECTRICS + 1 if circuit else 0)


def changing(forced: bool, damped: bool = True, circuit: bool = False) -> int:
    """Return the number of rows of a column that change between switches.

    The last of the energies is that of damping; with a circuit it is always there, and the electric state
    comes after it.
    """
    energies = ENERGIES - (not (damped or circuit)) if forced else 0
    return STATE + energies + (ELECTRICS if circuit else 0)


def work_width(columns: int, forced: bool, circuit: bool = False) -> int:
    """Return the length of the rows of the working space; `MEMORIES` needs five places.

    The electric state is in the last places.
    """
    width = max(FIRST_COLUMN + changing(forced, circuit=circuit) * columns, 5)
    return width + (ELECTRICS if circuit else 0)
