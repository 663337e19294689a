"""Many runs one after the other, each to its end: what is asked for is kept, the record is not.

A run is integrated in stretches that fit the working space; after each, dots, strobes and samples are taken
from its record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import entry
from printhammer.kernel.model.layout import Train
from printhammer.kernel.model.modes import BACKSTOP, PAUSED
from printhammer.kernel.single import carry as C

if TYPE_CHECKING:
    from printhammer.kernel.single.run import run
    from printhammer.kernel.single.stretch import blank_states, clear_dots, note_dots, note_states


@entry
def members(
    which: Any,
    hammer_of: Any,
    hammers: Any,
    controls: Any,
    bounds: Any,
    waveform_of: Any,
    piece_starts: Any,
    pieces: Any,
    firing_starts: Any,
    firings: Any,
    begins: Any,
    replace: bool,
    states: Any,
    ends: Any,
    max_steps: int,
    strobe_starts: Any,
    strobe_times: Any,
    grid: Any,
    want_dots: bool,
    under_way: Any,
    live: Any,
    nodes: Any,
    contacts: Any,
    carry: Any,
    status: Any,
    reached: Any,
    steps: Any,
    dots: Any,
    strobes: Any,
    x: Any,
) -> int:
    """Integrate the members `which` and fill their rows of the results.

    Parameters
    ----------
    which : int64 array
        Numbers of the members.
    hammer_of, waveform_of : int64 array, shape (M,)
        Row of `hammers`, `controls` and `bounds`, and set of waveforms, of each member.
    hammers, controls, bounds : float64 array, shape (H, any), (H, 4), (H, 4)
        As `hammer`, `control` and `bounds` in :func:`printhammer.kernel.single.run.run`.
    piece_starts, pieces
        Pieces of all sets of waveforms one after the other, and the first of each set.
    firing_starts, firings, begins
        Firing times [s] and first pieces of all members one after the other, and the first of each; pieces
        are counted within the member's set.
    replace : bool
        Whether a firing cuts off the pulses before it.
    states : float64 array, shape (M, 5)
        Time, displacement, velocity, mode (negative: as follows from the state), memory at the start.
    ends : float64 array, shape (M,)
        Ends of the runs [s].
    max_steps : int
        Largest number of steps of a member.
    strobe_starts, strobe_times
        Ascending times [s] of all members one after the other, and the first of each.
    grid : float64 array, shape (T,)
        Times of the pictures, ascending [s]; may be empty.
    want_dots : bool
        Whether to fill `dots`.
    under_way, live : array, shape (2, any)
        Working space as in :func:`printhammer.kernel.single.run.run`, for the run and for its record.
    nodes, contacts, carry
        Working space as in :func:`printhammer.kernel.single.run.run`.
    status, reached, steps : array, shape (M,)
        Results: status code (int64), time reached [s], number of steps (int64).
    dots : float64 array, shape (firings, 6)
        Results, see :mod:`printhammer.kernel.single.stretch`; rows as in `firings`.
    strobes : float64 array, shape (strobe times, 4)
        Results, see :mod:`printhammer.kernel.single.stretch`; NaN where a run did not get.
    x : float32 array, shape (M, T)
        Results: displacement [m]; NaN where a run did not get.

    Returns
    -------
    int
        How many of `which` are done; fewer than all where the working space is too small for the next.
    """
    for number in range(which.size):
        m = which[number]
        row = hammer_of[m]
        hammer = hammers[row]
        control = (controls[row, 0], controls[row, 1], controls[row, 2], controls[row, 3])
        limits = (bounds[row, 0], bounds[row, 1], bounds[row, 2], bounds[row, 3])
        own = firings[firing_starts[m] : firing_starts[m + 1]]
        own_begins = begins[firing_starts[m] : firing_starts[m + 1]]
        wave = waveform_of[m]
        table = pieces[piece_starts[wave] : piece_starts[wave + 1]]
        taken = Train(own, own_begins, table, replace, under_way[1], live[1])
        own_dots = dots[firing_starts[m] : firing_starts[m + 1]]
        own_times = strobe_times[strobe_starts[m] : strobe_starts[m + 1]]
        own_strobes = strobes[strobe_starts[m] : strobe_starts[m + 1]]
        picture = x[m]
        begin = states[m, 0]
        strobe = 0
        while strobe < own_times.size and own_times[strobe] < begin:
            strobe += 1
        sample = 0
        while sample < grid.size and grid[sample] < begin:
            sample += 1
        blank_states(own_strobes, 0, strobe, picture, 0, sample)
        if want_dots:
            clear_dots(own_dots)
        carry[C.STATE] = C.FRESH
        carry[C.PAUSE_AFTER] = nodes.shape[0] // 2
        if states[m, 3] >= 0.0:
            carry[C.STATE] = C.ON_BRANCH
            carry[C.MODE], carry[C.PEAK] = states[m, 3], states[m, 4]
        code, count = PAUSED, 0
        while code == PAUSED:
            code, used, touched, count = run(
                (own, own_begins, table, replace, under_way[0], live[0]),
                hammer,
                begin,
                states[m, 1],
                states[m, 2],
                ends[m],
                control,
                limits,
                max_steps,
                nodes,
                contacts,
                carry,
            )
            if used > nodes.shape[0] or touched > contacts.shape[0]:
                return number
            record = nodes[:used]
            if want_dots:
                note_dots(own_dots, contacts[:touched], record, taken, hammer)
            strobe, sample = note_states(
                own_strobes,
                own_times,
                strobe,
                picture,
                grid,
                sample,
                code != PAUSED,
                record,
                taken,
                hammer,
            )
            if code == PAUSED and carry[C.MODE] == BACKSTOP:
                for j in range(contacts.shape[1]):
                    contacts[0, j] = contacts[touched - 1, j]
        blank_states(own_strobes, strobe, own_times.size, picture, sample, grid.size)
        status[m] = code
        steps[m] = count
        reached[m] = carry[C.TIME]
    return len(which)
