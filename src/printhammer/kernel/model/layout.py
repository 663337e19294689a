"""Layout of a hammer's constants in the parameter array of the kernel.

Inverse mass [1/kg], backstop position [m] and pack front [m] come first. The packed constants of damping,
spring, pack, backstop, coil with supply, and magnet follow, each part at a fixed index: thirteen elements
are reserved for the damping, 272 for the spring, sixteen for each other part, and any number for the
magnet, which is last.
"""

from typing import Any, NamedTuple

INVERSE_MASS = 0
POSITION = 1
FRONT = 2
DAMPING = 3
SPRING = 16
PACK = 288
BACKSTOP_PART = 304
COIL = 320
SUPPLY = 328
MAGNET = 336
PLACES = {
    "damping": DAMPING,
    "spring": SPRING,
    "pack": PACK,
    "backstop": BACKSTOP_PART,
    "coil": COIL,
    "magnet": MAGNET,
}
ROOM = {
    "damping": SPRING - DAMPING,
    "spring": PACK - SPRING,
    "pack": 16,
    "backstop": 16,
    "coil": SUPPLY - COIL,
}
"""Maximum number of constants of each part; a magnet may have any number."""
MOST_LEVELS = 112
"""Maximum number of displacements at which the slope of the spring force changes."""

# Indices of the coil constants.
RESISTANCE, INDUCTANCE, TURN_RESISTANCE, LEAKAGE, COUPLED = range(COIL, COIL + 5)
"""Indices of the coil constants: coil resistance [ohm], constant inductance [H], resistance [ohm] and leakage
inductance [H] of the shorted turn (0 if absent), and 1 if the coil links the flux of the magnet, else
0."""
# Indices of the supply constants.
DIODE, SERIES, CAPACITANCE, CHARGING, CHARGED, COILS, CURRENT_SCALE, LINKAGE_SCALE = range(SUPPLY, SUPPLY + 8)
"""Indices of the supply constants: voltage of the freewheeling diode [V], series resistance of an ideal
source [ohm], capacitance of the reservoir [F] (0 if absent), resistance [ohm] and voltage [V] that
charge the reservoir, number of coils that share it; typical current [A] and flux linkage [Wb], the scales of
the error estimates."""

CUBIC_PIECE, EXPONENTIAL_PIECE, SINE_PIECE, END = 0.0, 1.0, 2.0, 3.0
"""Kinds of waveform pieces; see `printhammer.kernel.model.pulses`; END marks the end of a waveform."""

SWITCHED_PIECE, DECAY_PIECE, RESERVOIR_PIECE = 4.0, 5.0, 6.0
"""Kinds of pieces of a driver waveform; see `printhammer.kernel.model.circuit`."""


NODE_WIDTH = 5
"""Number of columns of a node in the record of a run; see `printhammer.kernel.single.record`."""
ELECTRIC = NODE_WIDTH
"""Index of the first of four additional columns of a node with a coil circuit: the three components of the
electric state, and the conduction path of the coil current."""
CIRCUIT_NODE_WIDTH = NODE_WIDTH + 4


class Train(NamedTuple):
    """Pulse train of n firings as arrays (`printhammer.kernel.model.pulses`), and working space for a run.

    Attributes
    ----------
    firings : float64 array, shape (n,)
        Firing times [s], ascending.
    begins : int64 array, shape (n,)
        Row of `pieces` at which the table of each firing's waveform begins.
    pieces : float64 array, shape (m, 6)
        Concatenated tables of waveform pieces of all waveforms.
    replace : bool
        Whether a firing ends all earlier pulses.
    under_way : int64 array, shape (n,)
    live : float64 array, shape (3 + 7 n,)
        Working space: the active piece of each pulse, and the parameters of all active pieces.
    """

    firings: Any
    begins: Any
    pieces: Any
    replace: bool
    under_way: Any
    live: Any


class ForceLaw(NamedTuple):
    """Arguments of the acceleration off the backstop other than time, displacement and velocity."""

    mode: int
    memory: float
    hammer: Any
    drive: Any


Control = tuple[float, float, float, float]
"""Step-size control: scales of displacement [m] and velocity [m/s], and the tolerances, relative to the
scales, of the order 6 and order 7 error estimates."""
