"""Members of an ensemble as arrays: hammers, drives, starts and ends, and requested results."""

from __future__ import annotations

from typing import Any, NamedTuple


class Batch(NamedTuple):
    """Inputs of M members.

    Attributes
    ----------
    hammer_of, waveform_of : int64 array, shape (M,)
        Row of `hammers`, `controls` and `bounds`, and set of waveforms, of each member.
    hammers, controls, bounds : float64 array, shape (H, any), (H, 4), (H, 4)
        As in :class:`printhammer.kernel.single.carry.Setup`.
    piece_starts, pieces
        Concatenated pieces of all sets of waveforms, and the index of the first piece of each set.
    rates : float64 array, shape (W, 3)
        Rates of the two exponentials and angular frequency of the sine in the waveforms of each set; for
        lanes.
    firing_starts, firings, begins
        Concatenated firing times [s] and first pieces of all members, and the start index of each member;
        pieces are counted within the member's set.
    replace : bool
        Whether a firing cuts off the pulses before it.
    states : float64 array, shape (M, 8)
        Time, displacement, velocity, mode (negative: as follows from the state), memory, currents in coil
        and shorted turn [A] and voltage of the reservoir [V] (NaN for a full one) at the start.
    ends : float64 array, shape (M,)
        Ends of the runs [s].
    max_steps : int
        Largest number of steps of a member.
    """

    hammer_of: Any
    hammers: Any
    controls: Any
    bounds: Any
    waveform_of: Any
    piece_starts: Any
    pieces: Any
    rates: Any
    firing_starts: Any
    firings: Any
    begins: Any
    replace: bool
    states: Any
    ends: Any
    max_steps: int


class Kept(NamedTuple):
    """Requested results of M members, and their arrays; NaN after an early end of a run.

    Attributes
    ----------
    strobe_starts, strobe_times
        Concatenated ascending times [s] of all members, and the start index of each member.
    grid : float64 array, shape (T,)
        Times of the pictures, ascending [s]; may be empty.
    want_dots : bool
        Whether to fill `dots`.
    status, reached, steps : array, shape (M,)
        Status code (int64), time reached [s], number of steps (int64).
    extra : int64 array, shape (M,)
        Number of extra contacts.
    dot_starts, dots
        Concatenated rows of :mod:`printhammer.kernel.model.dots` of all members, and the start index of each
        member: the firings of the member, then its extra contacts as far as there is room.
    strobes : float64 array, shape (strobe times, 4), with a coil circuit (strobe times, 7)
        See :mod:`printhammer.kernel.single.stretch`.
    x : float32 array, shape (M, T)
        Displacement [m].
    """

    strobe_starts: Any
    strobe_times: Any
    grid: Any
    want_dots: bool
    status: Any
    reached: Any
    steps: Any
    extra: Any
    dot_starts: Any
    dots: Any
    strobes: Any
    x: Any
