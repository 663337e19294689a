"""Vector lanes: members of an ensemble in the same mode step together, each with a separate step size.

A thread has up to `LANES` active members, stored in pools, one pool per mode. A sweep takes one step in every
lane of every pool, then handles the lanes with events. When a member is finished, the next member takes its
lane. The results of a member do not depend on other members: all lanes of a block, including idle lanes, are
always computed by the same machine code.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, entry, inlined
from printhammer.kernel.lanes import layout as R
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    DAMPING,
    FRONT,
    MAGNET,
    PACK,
    POSITION,
    SPRING,
    Train,
)
from printhammer.kernel.model.modes import BACKSTOP, EDGE, FREE, NEAR_TOUCH, NO_SWITCH, OK, UNRESOLVED

if TYPE_CHECKING:
    from printhammer.kernel.lanes.batch import Batch, Kept
    from printhammer.kernel.lanes.drive import add_up
    from printhammer.kernel.lanes.events import (
        DONE,
        LEAVES,
        STAYS,
        after_switch,
        close_member,
        copy_lane,
        locate,
        new_edge,
        note_samples,
        note_strobes,
        place,
    )
    from printhammer.kernel.lanes.landing import GOES_ON, aim, guess, land
    from printhammer.kernel.lanes.members import control_of, train_of
    from printhammer.kernel.lanes.steps import (
        contact_block,
        free_block,
        loading_block,
        unloading_block,
    )
    from printhammer.kernel.methods.contact import contact_rate
    from printhammer.kernel.model.forces import Hammer, acceleration
    from printhammer.kernel.model.laws import CUBIC, SINE
    from printhammer.kernel.model.pulses import edges_at
    from printhammer.kernel.single.around import first_mode
    from printhammer.kernel.single.stretch import blank_states, clear_dots


FINE = 1e-6
"""Tolerance of the order 7 error estimate, below which samples use an additional force evaluation."""


@compiled
def place_constants(
    pool: Any, i: int, hammer: Hammer, control: Any, bounds: Any, rates: Any, most_steps: float
) -> None:
    """Write hammer constants, waveform rates, step-size control and bounds of a member into a lane."""
    for row in range(R.RATES_WIDTH):
        pool[(R.RATES + row) * R.BLOCK + i] = rates[row]
    at = R.HAMMER * R.BLOCK + i
    for row in range(R.CONSTANTS):
        pool[at + row * R.BLOCK] = 0.0
    for row in range(3):
        pool[at + row * R.BLOCK] = hammer[row]
    for row in range(R.SPRING - R.DAMPING):
        pool[at + (R.DAMPING + row) * R.BLOCK] = hammer[DAMPING + row]
    for row in range(R.PACK - R.SPRING):
        pool[at + (R.SPRING + row) * R.BLOCK] = hammer[SPRING + row]
    for row in range(R.BACKSTOP_PART - R.PACK):
        pool[at + (R.PACK + row) * R.BLOCK] = hammer[PACK + row]
    for row in range(R.MAGNET - R.BACKSTOP_PART):
        pool[at + (R.BACKSTOP_PART + row) * R.BLOCK] = hammer[BACKSTOP_PART + row]
    for row in range(min(R.CONSTANTS - R.MAGNET, hammer.size - MAGNET)):
        pool[at + (R.MAGNET + row) * R.BLOCK] = hammer[MAGNET + row]
    for row in range(4):
        pool[(R.CONTROL + row) * R.BLOCK + i] = control[row]
    pool[R.MOST_STEPS * R.BLOCK + i] = most_steps
    pool[R.LOWEST * R.BLOCK + i] = max(bounds[0], bounds[2] - bounds[3])
    pool[R.HIGHEST * R.BLOCK + i] = min(bounds[1], bounds[2] + bounds[3])


@compiled
def begin_member(
    pool: Any,
    i: int,
    state: Any,
    end: float,
    rates: Any,
    train: Train,
    hammer: Hammer,
    control: Any,
    slot: Any,
) -> int:
    """Write the initial state of a member into a lane; return the index of its pool of lanes, or LEAVES."""
    t, x, v = state[0], state[1], state[2]
    scale = control[0] / control[1]
    slot[R.FREE_STEP] = 0.02 * scale
    slot[R.PACK_STEP] = 0.005 * scale
    slot[R.CONTACT_STEP] = 0.05
    slot[R.UNIT] = 0.0
    slot[R.DOT] = -1.0
    slot[R.EXTRA] = 0.0
    slot[R.END] = end
    slot[R.CAREFUL] = 0.0
    slot[R.EVENT_TIME] = t
    slot[R.EVENTS] = 0.0
    _first, _last, edge = edges_at(t, train)
    a = acceleration(t, x, v, FREE, 0.0, hammer, train.live)
    mode = first_mode(x, v, a, hammer)
    if state[3] >= 0.0 or not end > t:
        return LEAVES
    for row in range(R.RATES):
        pool[row * R.BLOCK + i] = 0.0
    add_up(t, train.live, rates, pool, i)
    pool[i] = t
    pool[R.NEXT * R.BLOCK + i] = min(edge, end)
    pool[R.V * R.BLOCK + i] = v
    if mode == FREE:
        if x == hammer[POSITION] or x == hammer[FRONT]:
            return LEAVES
        pool[R.X * R.BLOCK + i] = x
        pool[R.A * R.BLOCK + i] = a
        pool[R.H * R.BLOCK + i] = slot[R.FREE_STEP]
        return R.FREE_POOL
    if mode == BACKSTOP and x < hammer[POSITION]:
        w = math.sqrt(hammer[POSITION] - x)
        pool[R.X * R.BLOCK + i] = w
        pool[R.A * R.BLOCK + i] = contact_rate(w, v, t, hammer, train.live)
        pool[R.H * R.BLOCK + i] = slot[R.FREE_STEP] / (2.0 * w)
        return R.CONTACT_POOL
    return LEAVES


@inlined
def step_block(which: int, pool: Any, begin: int) -> None:
    """Advance all lanes of a block by one step, idle lanes included, with the step function of their pool."""
    if which == R.FREE_POOL:
        free_block(pool, begin)
    elif which == R.LOADING_POOL:
        loading_block(pool, begin)
    elif which == R.UNLOADING_POOL:
        unloading_block(pool, begin)
    else:
        contact_block(pool, begin)


@inlined
def look_after(
    pool: Any,
    i: int,
    which: int,
    slot: Any,
    batch: Batch,
    kept: Kept,
    under_way: Any,
    live: Any,
) -> int:
    """Handle the event at which a lane stopped after a step.

    Return the index of the pool of lanes in which the member continues (one pool per mode of motion), or
    STAYS (in its lane), LEAVES (the scalar kernel repeats the run) or DONE (the run is complete).
    """
    m = int(slot[R.MEMBER])
    row = batch.hammer_of[m]
    hammer, control = batch.hammers[row], control_of(batch, row)
    train = train_of(batch, m, under_way, live)
    times = kept.strobe_times[kept.strobe_starts[m] : kept.strobe_starts[m + 1]]
    strobes = kept.strobes[kept.strobe_starts[m] : kept.strobe_starts[m + 1]]
    dots = kept.dots[kept.dot_starts[m] : kept.dot_starts[m + 1]]
    event = int(pool[R.EVENT * R.BLOCK + i])
    switch = NO_SWITCH
    t, x, v = pool[i], 0.0, 0.0
    slot[R.EVENTS] = slot[R.EVENTS] + 1.0 if t == slot[R.EVENT_TIME] else 0.0
    slot[R.EVENT_TIME] = t
    if event & int(R.STUCK) or slot[R.EVENTS] > R.STALLED:
        return LEAVES
    if event & int(R.SWITCH):
        if slot[R.CAREFUL] != 0.0:
            switch = NEAR_TOUCH
        elif pool[R.LANDING * R.BLOCK + i] != 0.0:
            switch, t, x, v = land(pool, i, which, slot, hammer, control)
            if switch == GOES_ON:
                return STAYS
        else:
            switch, part = guess(pool, i, which, hammer)
            t, x = pool[R.NEW_T * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
            v = pool[R.NEW_V * R.BLOCK + i]
            if switch not in (NO_SWITCH, UNRESOLVED, NEAR_TOUCH) and part < 1.0:
                aim(pool, i, slot, switch, part)
                return STAYS
        if switch == NEAR_TOUCH:
            slot[R.CAREFUL] = 0.0
            edges_at(pool[i], train)
            switch, t, x, v = locate(pool, i, which, hammer, train.live, control)
        if switch == UNRESOLVED:
            pool[R.H * R.BLOCK + i] = 0.5 * pool[R.LENGTH * R.BLOCK + i]
            return STAYS if pool[R.H * R.BLOCK + i] > 1e-12 * control[0] / control[1] else LEAVES
        if switch in (NO_SWITCH, EDGE):
            pool[i] = t
            pool[R.X * R.BLOCK + i] = x
            pool[R.V * R.BLOCK + i] = v
            pool[R.A * R.BLOCK + i] = pool[R.NEW_A * R.BLOCK + i]
    done = t >= slot[R.END] and switch in (NO_SWITCH, EDGE)
    if pool[R.SAMPLE * R.BLOCK + i] <= t:
        if slot[R.NEXT_TIME] <= t:
            note_strobes(pool, i, which, t, done, slot, times, strobes, train, hammer)
        note_samples(pool, i, which, t, done, control[3] < FINE, slot, kept.grid, kept.x, hammer[POSITION])
    if done:
        close_member(pool, i, which, slot, dots, hammer)
        kept.status[m] = OK
        kept.reached[m] = pool[i]
        kept.steps[m] = int(pool[R.STEPS * R.BLOCK + i])
        kept.extra[m] = int(slot[R.EXTRA])
        sample = int(slot[R.NEXT_SAMPLE])
        blank_states(strobes, int(slot[R.NEXT_STROBE]), times.size, kept.x[m], sample, kept.grid.size)
        return DONE
    target = STAYS
    if switch not in (NO_SWITCH, EDGE):
        target = after_switch(
            switch, pool, i, t, x, v, which, slot, dots, kept.want_dots, train.firings, hammer, control
        )
        if target == LEAVES:
            return LEAVES
        which = target
    if t >= pool[R.NEXT * R.BLOCK + i]:
        new_edge(pool, i, which, slot[R.END], train, batch.rates[batch.waveform_of[m]])
    return target


@entry
def lanes(
    which: Any,
    batch: Batch,
    kept: Kept,
    uniform: bool,
    under_way: Any,
    live: Any,
    pools: Any,
    counts: Any,
    members_in: Any,
    slots: Any,
    spare: Any,
    left_over: Any,
) -> int:
    """Integrate the members `which` of an ensemble in lanes; write the results to their rows of `kept`.

    Parameters
    ----------
    which, batch, kept
        As in :func:`printhammer.kernel.lanes.members.members`.
    uniform : bool
        Whether all members have the same hammer and waveforms.
    under_way, live : array
        Working space, as in :class:`printhammer.kernel.model.layout.Train`.
    pools : float64 array, shape (POOLS + 1, POOL_SIZE)
    counts : int64 array, shape (POOLS,)
    members_in : int64 array, shape (POOLS, LANES)
    slots : float64 array, shape (LANES, SLOT_WIDTH)
    spare : int64 array, shape (LANES,)
        Working space.
    left_over : int64 array, shape of `which`
        Filled with the indices of the members that left the lanes or are not supported by them.

    Returns
    -------
    int
        Number of members in `left_over`.
    """
    left = 0
    waiting = 0
    stage = pools[R.POOLS]
    spares = R.LANES
    carried = R.OWN
    most_steps = float(batch.max_steps)
    if uniform:
        carried = R.ANY_DRIVE if CUBIC or SINE else R.EXPONENTIAL_DRIVE
    for p in range(R.POOLS):
        counts[p] = 0
    for lane in range(R.LANES):
        spare[lane] = lane
    if uniform and which.size > 0:
        row, rates = batch.hammer_of[which[0]], batch.rates[batch.waveform_of[which[0]]]
        hammer, bounds = batch.hammers[row], batch.bounds[row]
        for p in range(R.POOLS):
            for lane in range(R.LANES):
                place_constants(
                    pools[p], place(lane), hammer, control_of(batch, row), bounds, rates, most_steps
                )
    while True:
        while spares > 0 and waiting < which.size:
            m = which[waiting]
            waiting += 1
            number = spare[spares - 1]
            slot = slots[number]
            row, rates = batch.hammer_of[m], batch.rates[batch.waveform_of[m]]
            hammer, control = batch.hammers[row], control_of(batch, row)
            train = train_of(batch, m, under_way, live)
            if kept.want_dots:
                clear_dots(kept.dots[kept.dot_starts[m] : kept.dot_starts[m + 1]])
            slot[R.MEMBER] = m
            slot[R.NEXT_SAMPLE] = 0
            slot[R.NEXT_STROBE] = 0
            first = kept.strobe_starts[m]
            slot[R.NEXT_TIME] = kept.strobe_times[first] if first < kept.strobe_starts[m + 1] else math.inf
            target = begin_member(
                stage, 0, batch.states[m], batch.ends[m], rates, train, hammer, control, slot
            )
            if target == LEAVES:
                left_over[left] = m
                left += 1
                continue
            if not uniform:
                place_constants(stage, 0, hammer, control, batch.bounds[row], rates, most_steps)
            spares -= 1
            copy_lane(stage, 0, pools[target], place(counts[target]), carried)
            members_in[target, counts[target]] = number
            counts[target] += 1
        if spares == R.LANES:
            return left
        for p in range(R.POOLS):
            pool = pools[p]
            # Process lanes from last to first, so that a lane moved into a gap has already been stepped.
            top = counts[p] - 1
            for lane in range(top, -1, -1):
                if lane == top or lane % R.BLOCK == R.BLOCK - 1:
                    # Handle events right after the step of a block, while its rows are in the cache.
                    step_block(p, pool, (lane // R.BLOCK) * R.BLOCK_SIZE)
                i = place(lane)
                if pool[R.EVENT * R.BLOCK + i] == 0.0:
                    continue
                number = members_in[p, lane]
                slot = slots[number]
                m = int(slot[R.MEMBER])
                if pool[R.EVENT * R.BLOCK + i] == R.SAMPLED and slot[R.NEXT_TIME] > pool[i]:
                    row = batch.hammer_of[m]
                    fine, b = batch.controls[row, 3] < FINE, batch.hammers[row, POSITION]
                    note_samples(pool, i, p, pool[i], False, fine, slot, kept.grid, kept.x, b)
                    continue
                target = look_after(pool, i, p, slot, batch, kept, under_way, live)
                if target in (STAYS, p):
                    continue
                if target >= 0:
                    copy_lane(pool, i, pools[target], place(counts[target]), carried)
                    members_in[target, counts[target]] = number
                    counts[target] += 1
                else:
                    if target == LEAVES:
                        left_over[left] = m
                        left += 1
                    spare[spares] = number
                    spares += 1
                counts[p] -= 1
                copy_lane(pool, place(counts[p]), pool, i, carried)
                members_in[p, lane] = members_in[p, counts[p]]
