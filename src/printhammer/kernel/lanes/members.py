"""Scalar loop over the members of an ensemble, which stores only the requested results.

A run is integrated in segments that fit the working space. After each segment, dots, strobes and samples are
extracted from its record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import entry, inlined
from printhammer.kernel.model.layout import Control, Train
from printhammer.kernel.model.modes import BACKSTOP, PAUSED
from printhammer.kernel.single import carry as C
from printhammer.kernel.single.stretch import ELECTRIC_WIDTH

if TYPE_CHECKING:
    from printhammer.kernel.lanes.batch import Batch, Kept
    from printhammer.kernel.model.laws import HAS_CIRCUIT
    from printhammer.kernel.single.run import run
    from printhammer.kernel.single.stretch import blank_states, clear_dots, note_dots, note_states


@inlined
def control_of(batch: Batch, row: int) -> Control:
    """Return the step-size control (`Control`) of the hammer in row `row` of a batch."""
    controls = batch.controls
    return controls[row, 0], controls[row, 1], controls[row, 2], controls[row, 3]


@inlined
def train_of(batch: Batch, m: int, under_way: Any, live: Any) -> Train:
    """Return the pulse train of member `m` of a batch, with the given working space."""
    begin, end = batch.firing_starts[m], batch.firing_starts[m + 1]
    wave = batch.waveform_of[m]
    pieces = batch.pieces[batch.piece_starts[wave] : batch.piece_starts[wave + 1]]
    return Train(batch.firings[begin:end], batch.begins[begin:end], pieces, batch.replace, under_way, live)


@entry
def members(
    which: Any,
    batch: Batch,
    kept: Kept,
    under_way: Any,
    live: Any,
    nodes: Any,
    contacts: Any,
    carry: Any,
) -> int:
    """Integrate the members `which` of an ensemble one by one; write the results to their rows of `kept`.

    Parameters
    ----------
    which : int64 array
        Indices of the members.
    batch, kept : Batch, Kept
        Inputs of the ensemble, and output arrays.
    under_way, live : array, shape (2, any)
        Working space, as in :class:`printhammer.kernel.model.layout.Train`, for the run and for its record.
    nodes, contacts, carry
        Working space: the arguments `nodes`, `contacts` and `state` of
        :func:`printhammer.kernel.single.run.run`.

    Returns
    -------
    int
        Number of members of `which` that are finished; less than the length of `which` if the working space
        is too small for the next member.
    """
    grid, states, bounds = kept.grid, batch.states, batch.bounds
    for number in range(which.size):
        m = which[number]
        row = batch.hammer_of[m]
        hammer = batch.hammers[row]
        control = control_of(batch, row)
        limits = (bounds[row, 0], bounds[row, 1], bounds[row, 2], bounds[row, 3])
        train = train_of(batch, m, under_way[1], live[1])
        own_dots = kept.dots[kept.dot_starts[m] : kept.dot_starts[m + 1]]
        own_times = kept.strobe_times[kept.strobe_starts[m] : kept.strobe_starts[m + 1]]
        own_strobes = kept.strobes[kept.strobe_starts[m] : kept.strobe_starts[m + 1]]
        picture = kept.x[m]
        begin = states[m, 0]
        strobe = 0
        while strobe < own_times.size and own_times[strobe] < begin:
            strobe += 1
        sample = 0
        while sample < grid.size and grid[sample] < begin:
            sample += 1
        blank_states(own_strobes, 0, strobe, picture, 0, sample)
        if kept.want_dots:
            clear_dots(own_dots)
        carry[C.STATE] = C.FRESH
        carry[C.TIME], carry[C.POSITION_NOW], carry[C.VELOCITY] = begin, states[m, 1], states[m, 2]
        carry[C.PAUSE_AFTER] = nodes.shape[0] // 2
        if states[m, 3] >= 0.0:
            carry[C.STATE] = C.ON_BRANCH
            carry[C.MODE], carry[C.PEAK] = states[m, 3], states[m, 4]
        if HAS_CIRCUIT:
            carry[C.WITH_CURRENT] = 1.0
            for j in range(ELECTRIC_WIDTH):
                carry[C.ELECTRIC + j] = states[m, 5 + j]
        code, count, extra = PAUSED, 0, 0
        while code == PAUSED:
            code, used, touched, count = run(
                (
                    (train.firings, train.begins, train.pieces, batch.replace, under_way[0], live[0]),
                    hammer,
                    control,
                    limits,
                    batch.max_steps,
                ),
                batch.ends[m],
                nodes,
                contacts,
                carry,
            )
            if used > nodes.shape[0] or touched > contacts.shape[0]:
                return number
            record = nodes[:used]
            if kept.want_dots:
                extra = note_dots(own_dots, extra, contacts[:touched], record, train, hammer)
            strobe, sample = note_states(
                own_strobes,
                own_times,
                strobe,
                picture,
                grid,
                sample,
                code != PAUSED,
                record,
                train,
                hammer,
            )
            if code == PAUSED and carry[C.MODE] == BACKSTOP:
                for j in range(contacts.shape[1]):
                    contacts[0, j] = contacts[touched - 1, j]
        blank_states(own_strobes, strobe, own_times.size, picture, sample, grid.size)
        kept.status[m] = code
        kept.steps[m] = count
        kept.extra[m] = extra
        kept.reached[m] = carry[C.TIME]
    return len(which)
