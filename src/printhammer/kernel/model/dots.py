"""Rule by which a contact makes a dot, and the columns of a dot's row.

A pack contact belongs to the latest firing at or before its touch. The first contact of a firing makes its
dot, later ones are extra contacts. A contact that is open at the start of a run belongs to no firing.

The rows of one run are those of its firings, in order, and after them those of its extra contacts, by time of
touch. A row of an extra contact has the index of its firing in the first column and is otherwise that of a
dot.
"""

from typing import Any

from printhammer.kernel.model.modes import PACK_SURFACE

CONTACTS = 0
"""Number of pack contacts of a firing."""
FIRING = 0
"""Index of the firing, in the row of an extra contact."""
TIME_IN, SPEED_IN, TIME_OUT = 1, 2, 3
"""Time [s] and velocity [m/s] at touch, time of leaving [s]."""
DEPTH, FORCE = 4, 5
"""Largest indentation [m] and pack force [N]."""
DOT_WIDTH = 6
"""Number of columns."""

DOT = 0
"""Number of the contact that makes the dot of its firing; extra contacts have 1, 2, and so on."""
NO_DOT = -1
"""Marks a contact that belongs to no firing."""


def contact_number(surface: int, initial: bool, fired: int, earlier: int) -> int:
    """Return the index of a contact among the pack contacts of its firing, or `NO_DOT`.

    Parameters
    ----------
    surface : int
        Code of the surface.
    initial : bool
        Whether the contact was open at the start of the run.
    fired : int
        Index of the latest firing at or before the touch, -1 if there is none.
    earlier : int
        Number of earlier contacts of that firing.
    """
    if surface != PACK_SURFACE or initial or fired < 0:
        return NO_DOT
    return earlier


def firing_before(t: float, firings: Any) -> int:
    """Return the index of the latest firing at or before time `t` [s], or -1."""
    low, high = 0, firings.size
    while low < high:
        middle = (low + high) // 2
        if firings[middle] <= t:
            low = middle + 1
        else:
            high = middle
    return low - 1
