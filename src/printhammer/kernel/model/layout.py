"""Layout of the hammer's constants in the single array of the kernel.

Inverse mass, position of the backstop and front of the pack come first. The packed constants of damping,
spring, pack, backstop, coil with its supply, and magnet follow, each part at a fixed index: thirteen places
for the damping, sixteen for each of the others, and any number for the magnet, which is last.
"""

from typing import Any, NamedTuple

INVERSE_MASS = 0
POSITION = 1
FRONT = 2
DAMPING = 3
SPRING = 16
PACK = 32
BACKSTOP_PART = 48
COIL = 64
SUPPLY = 72
MAGNET = 80
PLACES = {
    "damping": DAMPING,
    "spring": SPRING,
    "pack": PACK,
    "backstop": BACKSTOP_PART,
    "coil": COIL,
    "magnet": MAGNET,
}
ROOM = {"damping": SPRING - DAMPING, "spring": 16, "pack": 16, "backstop": 16, "coil": SUPPLY - COIL}
"""Number of constants available to a part; unlimited for a magnet."""

# Coil, from COIL on.
RESISTANCE, INDUCTANCE, TURN_RESISTANCE, LEAKAGE, COUPLED = range(COIL, COIL + 5)
"""Resistance [ohm], constant inductance [H], resistance [ohm] and leakage [H] of a shorted turn, or 0, and
whether the magnet's flux is linked: 1 or 0."""
# Supply of the coil, from SUPPLY on.
DIODE, SERIES, CAPACITANCE, CHARGING, CHARGED, COILS, CURRENT_SCALE, LINKAGE_SCALE = range(SUPPLY, SUPPLY + 8)
"""Voltage of the diode in which a chopped current circulates [V], resistance of an ideal source [ohm],
capacitance of a reservoir [F] or 0, the resistance [ohm] and the voltage [V] from which it is charged, number
of coils on it; typical current [A] and flux linkage [Wb], by which errors are measured."""

CUBIC_PIECE, EXPONENTIAL_PIECE, SINE_PIECE, END = 0.0, 1.0, 2.0, 3.0
"""Kinds of rows in a table of pieces, see `printhammer.kernel.model.pulses`; END marks the end of a waveform.
"""
SWITCHED_PIECE, DECAY_PIECE, RESERVOIR_PIECE = 4.0, 5.0, 6.0
"""Kinds of rows of a driver, see `printhammer.kernel.model.circuit`."""


NODE_WIDTH = 5
"""Columns of a node of a record, see `printhammer.kernel.single.record`."""
ELECTRIC = NODE_WIDTH
"""First of the four additional columns of a node with a coil circuit: electric state and path."""
CIRCUIT_NODE_WIDTH = NODE_WIDTH + 4


class Train(NamedTuple):
    """Drive of n firings, see `printhammer.kernel.model.pulses`, with working space for a pass over it.

    Attributes
    ----------
    firings : float64 array, shape (n,)
        Firing times [s], ascending.
    begins : int64 array, shape (n,)
        Row of `pieces` at which the table of each firing's waveform begins.
    pieces : float64 array, shape (m, 6)
        The tables of all waveforms.
    replace : bool
        Whether a firing cuts off the pulses before it.
    under_way : int64 array, shape (n,)
    live : float64 array, shape (3 + 7 n,)
        Working space.
    """

    firings: Any
    begins: Any
    pieces: Any
    replace: bool
    under_way: Any
    live: Any


class ForceLaw(NamedTuple):
    """Arguments of the force off the backstop besides time, displacement and velocity."""

    mode: int
    memory: float
    hammer: Any
    drive: Any


Control = tuple[float, float, float, float]
"""Scales of displacement and velocity, allowances of the error estimates of order 6 and 7."""
