"""Members of an ensemble as arrays: hammers, drives, initial states, end times and requested results."""

from __future__ import annotations

from typing import Any, NamedTuple


class Batch(NamedTuple):
    """Inputs of an ensemble of M members with H hammers and W sets of waveforms.

    Attributes
    ----------
    hammer_of, waveform_of : int64 array, shape (M,)
        For each member: row of `hammers`, `controls` and `bounds`, and index of the waveform set.
    hammers, controls, bounds : float64 array, shape (H, any), (H, 4), (H, 4)
        Parameter array, step-size control and bounds of each hammer, as in
        :class:`printhammer.kernel.single.carry.Setup`.
    piece_starts, pieces
        Index of the first piece of each waveform set, and the concatenated pieces of all sets.
    rates : float64 array, shape (W, 3)
        Rates of the two exponentials [1/s] and angular frequency of the sine [rad/s] in the waveforms of
        each set; used by lanes only.
    firing_starts, firings, begins
        Start index of each member, and the concatenated firing times [s] and first pieces of all members.
        The index of a first piece counts from the start of the member's waveform set.
    replace : bool
        Whether a firing ends all earlier pulses.
    states : float64 array, shape (M, 8)
        Initial states: time [s], displacement [m], velocity [m/s], mode (negative: to be derived from the
        state), latest local maximum in the pack [m], currents in coil and shorted turn [A], reservoir
        voltage [V] (NaN if full).
    ends : float64 array, shape (M,)
        End times of the runs [s].
    max_steps : int
        Maximum number of steps of each member.
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
    """Requested times and output arrays of an ensemble of M members.

    Strobes and displacements after an early end of a run are NaN.

    Attributes
    ----------
    strobe_starts, strobe_times
        Start index of each member, and the concatenated, ascending strobe times [s] of all members.
    grid : float64 array, shape (T,)
        Ascending output times of the displacement [s]; empty if no displacements are requested.
    want_dots : bool
        Whether to fill `dots`.
    status, reached, steps : array, shape (M,)
        Status code (int64), time reached [s] and number of steps (int64) of each member.
    extra : int64 array, shape (M,)
        Number of extra contacts of each member.
    dot_starts, dots
        Start index of each member, and the concatenated rows of dot data of all members, see
        :mod:`printhammer.kernel.model.dots`: a row for each firing, then a row for each extra contact that
        fits.
    strobes : float64 array, shape (strobe times, 4), with a coil circuit (strobe times, 7)
        States at the strobe times; see :mod:`printhammer.kernel.single.stretch`.
    x : float32 array, shape (M, T)
        Displacement [m] of each member at the times `grid`.
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
