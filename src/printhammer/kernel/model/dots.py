"""Assignment of pack contacts to firings and dots, and the columns of a row of dot data.

A pack contact belongs to the latest firing at or before its touch. The first contact of a firing makes its
dot, later contacts are extra contacts. A contact that is open at the start of a run belongs to no firing.

The dot array of one run has a row for each firing, in order, followed by a row for each extra contact, sorted
by touch time. In a row of an extra contact, the first column holds the index of its firing; the other columns
are the same as in the row of a dot.
"""

from typing import Any

from printhammer.kernel.model.modes import PACK_SURFACE

CONTACTS = 0
"""Column of the number of pack contacts assigned to a firing."""
FIRING = 0
"""Column of the firing index, in the row of an extra contact."""
TIME_IN, SPEED_IN, TIME_OUT = 1, 2, 3
"""Columns of the touch time [s], the velocity at touch [m/s] and the time of separation [s]."""
DEPTH, FORCE = 4, 5
"""Columns of the largest indentation [m] and the peak pack force [N]."""
DOT_WIDTH = 6
"""Number of columns of a row of dot data."""

DOT = 0
"""Contact number of the first pack contact of a firing, which makes the dot; extra contacts are 1, 2, and so
on."""
NO_DOT = -1
"""Contact number of a contact that belongs to no firing."""


def contact_number(surface: int, initial: bool, fired: int, earlier: int) -> int:
    """Return the 0-based number of a contact among the pack contacts of its firing, or `NO_DOT`.

    Parameters
    ----------
    surface : int
        Code of the contacted surface, pack or backstop.
    initial : bool
        Whether the contact was open at the start of the run.
    fired : int
        Index of the latest firing at or before the touch; -1 if no firing is that early.
    earlier : int
        Number of earlier pack contacts of the same firing.
    """
    if surface != PACK_SURFACE or initial or fired < 0:
        return NO_DOT
    return earlier


def firing_before(t: float, firings: Any) -> int:
    """Return the index of the latest firing at or before time `t` [s]; -1 if `t` precedes all firings."""
    low, high = 0, firings.size
    while low < high:
        middle = (low + high) // 2
        if firings[middle] <= t:
            low = middle + 1
        else:
            high = middle
    return low - 1
