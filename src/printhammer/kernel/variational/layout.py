"""Layout of the tangent columns of the variational equations, and of the working space.

A column is a tangent vector: the derivative of the motion, at fixed time, with respect to an initial
condition or a constant. Its first rows are the derivatives of displacement [m], velocity [m/s] and the latest
local maximum in the pack [m], which changes at switching events only. If derivatives with respect to
constants are computed (forcing), the energies [J] follow: work of coil and drive force, losses in pack,
backstop and damping. A coil circuit adds four rows at the end: flux linkages of coil and shorted turn [Wb],
reservoir voltage [V], and the end of the off-time [s] of a fixed off-time chopper.
"""

from typing import Any, NamedTuple

from printhammer.kernel.methods.dop853_tableau import STAGES

STATE = 2
"""Number of mechanical state components: displacement and velocity."""
PEAK = STATE
ENERGY = STATE + 1
COIL, DRIVE, PACK_LOSS, BACKSTOP_LOSS, DAMPING_LOSS = range(ENERGY, ENERGY + 5)
ENERGIES = 5
ROWS = ENERGY + ENERGIES
"""Number of rows of a tangent column without a coil circuit; without forcing, only the first three exist."""
ELECTRICS = 3
"""Number of components of the electric state; the end of an off-time is an additional row."""

START, STAGE, MEMORIES = STAGES, STAGES + 1, STAGES + 2
WORK_ROWS = STAGES + 3
"""Number of rows of the working space: stage slopes, initial state, stage state, pack memory values."""
TIME = STATE
"""Index of the time in a row of the working space, after displacement (or w) and velocity."""
FIRST_COLUMN = TIME + 1
"""Index of the first tangent column in a row of the working space."""

# Indices in `track`.
DUE = 0
"""Index of the number of output times already passed."""
SMOOTH = 1
"""Index of a flag: 1 if the present state depends differentiably on the initial state, else 0."""
GROWN = 2
"""Index of the first column's logarithm of growth since the latest output time; other columns follow."""

# Forcing: a constant may change the parameter array of the hammer, the firing times and the waveforms.
SPACING = 1e-3
"""Step of difference quotients with respect to a constant, as a fraction of the constant or its scale."""
MIDDLE = 4
"""Row of `varied` that holds the unchanged parameters."""
VARIED = 9
"""Number of rows of `varied`: row 4 + j holds the parameters shifted by j * `SPACING` * `moves`."""
FIELD_MOVES, PACK_MOVES, BACKSTOP_MOVES, DAMPING_MOVES, CIRCUIT_MOVES = 1, 2, 4, 8, 16
"""Bits of `of_hammer`, one per law that depends on a constant; mass and backstop position have no bit."""
DELAYED = 5
"""Number of values per active pulse: derivatives of the piece's start and of coefficients p0 to p3."""


class Forcing(NamedTuple):
    """Derivatives of the kernel's input arrays with respect to n constants, and working space.

    The parameter array of the hammer has h elements, the pulse train f firings and m waveform pieces.

    Attributes
    ----------
    varied, moves : float64 arrays, shapes (n, 9, h) and (n, h)
        Parameter arrays p + j * `SPACING` * `moves` for j from -4 to 4, where p is the array of the hammer;
        and the derivatives of p with respect to each constant.
    of_hammer : int64 array, shape (n,)
        Bit mask of the laws that depend on each constant; the bits are `FIELD_MOVES` and so on.
    fire_moves, piece_moves : float64 arrays, shapes (n, f) and (n, m, 6)
        Derivatives of the firing times [s] and of the waveform tables with respect to each constant.
    live_moves, memories : float64 arrays, shapes (n, 5 f) and (n, 9)
        Working space.
    value_spacing : float
        Step of the drive [A or N] for the derivative of the force with respect to the drive.
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
    """Tangent columns during their propagation along a run, and their values at requested times and nodes.

    There are n columns, m requested times (marks) and q requested nodes. A column has r = 3 rows without
    forcing and 8 rows with forcing; a circuit adds four rows.

    Attributes
    ----------
    columns : float64 array, shape (r, n)
        Columns at the end of the segment or at the last mark.
    work : float64 array, shape (15, `work_width`)
        Working space.
    track : float64 array, shape (2 + n,)
        Data passed from one segment to the next; element 1 is 1 while the motion is differentiable, else 0.
        Before the first segment, all elements are zero except element 1, which is one.
    states : float64 array, shape (m, 4), with a circuit (m, 8)
        Displacement, velocity, mode and latest local maximum at the marks; with a circuit, also electric
        state and conduction path of the coil current.
    changes, growth : float64 array, shapes (m, r, n) and (m, n)
        Columns at the marks, and the logarithms of their growth since the preceding mark.
    passed : float64 array, shape (q, 2, r, n)
        Columns at the requested nodes, before and after the switching event at the node.
    """

    columns: Any
    work: Any
    track: Any
    states: Any
    changes: Any
    growth: Any
    passed: Any


class Setting(NamedTuple):
    """Arguments of the functions that compute derivatives: scales, bounds, parameters, drive, forcing.

    The bounds are the result of `smooth_bounds`.
    """

    scales: Any
    bounds: Any
    hammer: Any
    drive: Any
    forcing: Any


def electric_row(forced: bool) -> int:
    """Return the index of the first row of the electric state in a tangent column."""
    return ROWS if forced else ENERGY


def row_count(forced: bool, circuit: bool) -> int:
    """Return the number of rows of a tangent column."""
    return electric_row(forced) + (ELECTRICS + 1 if circuit else 0)


def changing(forced: bool, damped: bool = True, circuit: bool = False) -> int:
    """Return the number of rows of a tangent column that change between switching events.

    The damping loss, which is the last energy, is included if the armature is damped or a circuit is present;
    the electric state follows it.
    """
    energies = ENERGIES - (not (damped or circuit)) if forced else 0
    return STATE + energies + (ELECTRICS if circuit else 0)


def work_width(columns: int, forced: bool, circuit: bool = False) -> int:
    """Return the length of a row of the working space, at least 5, since one row stores five memory values.

    The electric state is stored in the last elements of a row.
    """
    width = max(FIRST_COLUMN + changing(forced, circuit=circuit) * columns, 5)
    return width + (ELECTRICS if circuit else 0)
