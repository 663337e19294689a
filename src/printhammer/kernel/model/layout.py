"""Where the constants of a hammer lie in the one array that the kernel works with.

Inverse mass, position of the backstop and front of the pack come first, then the packed constants of damping,
spring, pack, backstop and magnet, each from a fixed place on: sixteen places each, thirteen for the damping,
the magnet's last and of any length.
"""

from typing import Any, NamedTuple

INVERSE_MASS = 0
POSITION = 1
FRONT = 2
DAMPING = 3
SPRING = 16
PACK = 32
BACKSTOP_PART = 48
MAGNET = 64
PLACES = {"damping": DAMPING, "spring": SPRING, "pack": PACK, "backstop": BACKSTOP_PART, "magnet": MAGNET}
ROOM = {"damping": SPRING - DAMPING, "spring": 16, "pack": 16, "backstop": 16}
"""Number of constants that a part may have; a magnet any."""

CUBIC_PIECE, EXPONENTIAL_PIECE, SINE_PIECE, END = 0.0, 1.0, 2.0, 3.0
"""Kinds of the rows of a table of pieces, see `printhammer.kernel.model.pulses`; the last ends a waveform."""


class Train(NamedTuple):
    """A drive of n firings, see `printhammer.kernel.model.pulses`, and working space for a pass over it.

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
    live : float64 array, shape (1 + 7 n,)
        Working space.
    """

    firings: Any
    begins: Any
    pieces: Any
    replace: bool
    under_way: Any
    live: Any


class ForceLaw(NamedTuple):
    """What the force off the backstop depends on beside time, displacement and velocity."""

    mode: int
    memory: float
    hammer: Any
    drive: Any


Control = tuple[float, float, float, float]
"""Scales of displacement and velocity, allowances of the error estimates of order 6 and 7."""
