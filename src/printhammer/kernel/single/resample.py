"""States and forces at arbitrary times of a recorded run.

The state inside a step is computed by one shortened step of the integrator from the preceding node. No
interpolation is needed, and the result does not depend on the output grid.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, entry, inlined
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.circuit import BLOCKED
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    ELECTRIC,
    INVERSE_MASS,
    MAGNET,
    PACK,
    POSITION,
    SPRING,
    ForceLaw,
    Train,
)

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import contact_rate, s_at
    from printhammer.kernel.methods.dop853 import contact_end, whole_time_step
    from printhammer.kernel.methods.landing import plain_step
    from printhammer.kernel.model.circuit import (
        Electric,
        coil_current,
        driven,
        electric_in,
        electric_rates,
        moved,
        open_rate,
        path_of,
        source_of,
        take_path,
        turn_current,
    )
    from printhammer.kernel.model.forces import (
        Hammer,
        acceleration,
        friction,
        pack_force,
        value_at,
        viscous_force,
    )
    from printhammer.kernel.model.laws import (
        FORCE_DRIVE,
        FRICTION,
        HAS_CIRCUIT,
        HAS_PACK,
        MEMORY,
        RIGID_FRONT,
        backstop_elastic,
        backstop_viscous,
        magnet_force,
        pack_memory,
        spring_force,
    )
    from printhammer.kernel.model.pulses import Drive, edges_at, pass_edges

GOLDEN = 0.3819660112501051  # Square of the inverse golden ratio
NEAR = 1e-6  # Bracket width, relative to the first bracket, at which a search ends; arbitrary
ASIDE = 1e-6  # Step of the slope test at the edge of a contact, in sample intervals; arbitrary
SAMPLES = 4
"""Number of samples per step in the search for the largest depth and force of a contact; arbitrary."""


@compiled
def memory_of(mode: int, kept: float, hammer: Hammer) -> float:
    """Return the memory value of the pack law for the local maximum `kept` [m] stored in a node.

    In other modes, a node stores the direction of sliding under dry friction, which is returned.
    """
    if HAS_PACK and MEMORY and mode in (M.UNLOADING, M.RELOADING, M.HELD_UNLOADING):
        return pack_memory(hammer[PACK:BACKSTOP_PART], kept)
    return kept if FRICTION else 0.0


@inlined
def is_held(mode: int) -> bool:
    """Whether the armature is at rest off backstop and rigid stops: in the pack, or held by dry friction."""
    return M.HELD < mode <= M.HELD_FREE


@compiled
def branch_of(mode: int) -> int:
    """Return the mode whose force law applies in `mode`; differs from `mode` only at rest."""
    if mode == M.HELD:
        return M.BACKSTOP
    if mode == M.HELD_LOADING:
        return M.LOADING
    if mode == M.HELD_FREE:
        return M.FREE
    return M.UNLOADING if mode == M.HELD_UNLOADING else mode


@compiled
def state_in_step(
    t: float, t0: float, x0: float, v0: float, mode: int, kept: float, hammer: Hammer, drive: Drive
) -> tuple[float, float, float, Electric]:
    """Return x [m], v [m/s], w = sqrt(b - x) [m^0.5] and electric state at `t` [s] in the step after a node.

    The node is at time `t0` [s] and has displacement `x0` [m], velocity `v0` [m/s], mode and memory `kept`.
    """
    rests = mode >= M.RESTING
    first = electric_in(drive)
    if t <= t0 or (rests and not HAS_CIRCUIT):
        return x0, v0, kept if mode in (M.BACKSTOP, M.HELD) else 0.0, first
    if mode == M.BACKSTOP and not (kept == 0.0 and v0 == 0.0):
        kv0 = contact_rate(kept, v0, t0, hammer, drive)
        s = s_at(t, t0, kept, v0, kv0, hammer, drive)
        t1, w1, v1, _kv1, electric = contact_end(t0, kept, v0, kv0, s, hammer, drive)
        x1 = hammer[POSITION] - w1 * w1
        if HAS_CIRCUIT:
            electric = moved(electric, t - t1, electric_rates(t1, x1, v1, electric, hammer, drive[0]))
        return x1, v1, w1, electric
    memory = memory_of(mode, kept, hammer)
    a0 = acceleration(t0, x0, v0, branch_of(mode), memory, hammer, drive)
    if mode in (M.BACKSTOP, M.HELD):
        # The armature touches the backstop without compression, or is held there: to second order in time.
        electric = first
        if HAS_CIRCUIT:
            electric = moved(first, t - t0, electric_rates(t0, x0, 0.0, first, hammer, drive[0]))
        if rests:
            return x0, v0, kept, electric
        pause = t - t0
        return x0 + 0.5 * a0 * pause**2, a0 * pause, math.sqrt(max(-0.5 * a0, 0.0)) * pause, electric
    law = ForceLaw(mode, memory, hammer, drive)
    if HAS_CIRCUIT:
        x1, v1, _a1, _error_x, _error_v, electric, _error = whole_time_step(t0, x0, v0, a0, t - t0, law)
        return x1, v1, 0.0, electric
    x1, v1, _a1, _error_x, _error_v = plain_step(t0, x0, v0, a0, t - t0, law)
    return x1, v1, 0.0, first


@compiled
def drive_at(node: Any, live: Any) -> Drive:
    """Return the drive argument of the force functions at a node: `live`, or `live` and electric state."""
    if HAS_CIRCUIT:
        take_path(live, node[ELECTRIC + 3], math.inf)
        return live, (node[ELECTRIC], node[ELECTRIC + 1], node[ELECTRIC + 2])
    return live


@entry
def resample(
    times: Any,
    nodes: Any,
    train: Any,
    hammer: Hammer,
    out: Any,
) -> None:
    """Write states and forces at the requested times of a recorded run to the rows of `out`.

    Parameters
    ----------
    times : float64 array, shape (n,)
        Output times, ascending, within the run [s].
    nodes, train, hammer
        Nodes recorded by :func:`printhammer.kernel.single.run.run`, and the pulse train and parameter array
        that were passed to it.
    out : float64 array, shape (n, 10), with a coil circuit (n, 15)
        Columns: displacement [m], velocity [m/s], drive [A or N], forces of magnet, spring, pack, backstop
        (elastic), backstop (viscous) and damping [N], mode; with a circuit also coil current [A], voltage
        across the coil [V], flux linkage [Wb], reservoir voltage [V], current in the shorted turn [A]. At
        the time of an impact or a switching event, the state after the event.
    """
    train = Train(*train)
    first, last, _edge = edges_at(nodes[0, 0], train)
    i = 0
    for row in range(times.size):
        t = times[row]
        moved = False
        while i + 1 < nodes.shape[0] and nodes[i + 1, 0] <= t:
            i += 1
            moved = True
        if moved:
            first, last, _edge = pass_edges(nodes[i, 0], train, first, last)
        mode = int(nodes[i, 3])
        kept = nodes[i, 4]
        start = drive_at(nodes[i], train.live)
        x, v, w, electric = state_in_step(t, nodes[i, 0], nodes[i, 1], nodes[i, 2], mode, kept, hammer, start)
        drive = driven(train.live, electric)
        value = value_at(t, x, hammer, drive)
        out[row, 0] = x
        out[row, 1] = v
        out[row, 2] = value
        out[row, 3] = magnet_force(hammer[MAGNET:], x, 0.0 if FORCE_DRIVE else value)
        out[row, 4] = spring_force(hammer[SPRING:PACK], x)
        out[row, 5] = pack_force(x, v, branch_of(mode), memory_of(mode, kept, hammer), hammer)
        compressed = mode in (M.BACKSTOP, M.HELD)
        out[row, 6] = backstop_elastic(hammer[BACKSTOP_PART:MAGNET], w) if compressed else 0.0
        out[row, 7] = backstop_viscous(hammer[BACKSTOP_PART:MAGNET], w, v) if compressed else 0.0
        out[row, 8] = viscous_force(x, v, hammer)
        if FRICTION:
            memory = memory_of(mode, kept, hammer)
            out[row, 8] += friction(mode, memory, hammer)
            if is_held(mode):
                out[row, 8] = -acceleration(t, x, 0.0, mode, memory, hammer, drive) / hammer[INVERSE_MASS]
        out[row, 9] = mode
        if HAS_CIRCUIT:
            live = train.live
            current = coil_current(x, electric, hammer, live)
            out[row, 10] = current
            if path_of(live) == BLOCKED:
                out[row, 11] = open_rate(x, v, electric, hammer)
            else:
                voltage, series = source_of(t, electric, hammer, live)
                out[row, 11] = voltage - series * current
            out[row, 12] = electric[0]
            out[row, 13] = electric[2]
            out[row, 14] = turn_current(x, electric, hammer, live)


@compiled
def depth_and_force(t: float, node: Any, surface: int, hammer: Hammer, live: Any) -> tuple[float, float]:
    """Return indentation [m] and contact force [N] at time `t` [s] in the step that begins at `node`."""
    mode = int(node[3])
    drive = drive_at(node, live)
    x, v, w, _electric = state_in_step(t, node[0], node[1], node[2], mode, node[4], hammer, drive)
    if surface == M.BACKSTOP_SURFACE:
        force = 0.0
        if mode in (M.BACKSTOP, M.HELD):
            c = hammer[BACKSTOP_PART:MAGNET]
            force = backstop_elastic(c, w) + backstop_viscous(c, w, v)
        return hammer[POSITION] - x, force
    return x - hammer[2], -pack_force(x, v, branch_of(mode), memory_of(mode, node[4], hammer), hammer)


@compiled
def sample_time(place: int, nodes: Any) -> float:
    """Return the time [s] of sample number `place`; `SAMPLES` samples divide each step evenly."""
    k, j = place // SAMPLES, place % SAMPLES
    t: float = nodes[k, 0]
    return t + (nodes[k + 1, 0] - t) * j / SAMPLES if j else t


@compiled
def value_of(
    which: int, t: float, first: int, last: int, surface: int, nodes: Any, train: Train, hammer: Hammer
) -> float:
    """Return the depth [m] (`which` 0) or the force [N] (`which` 1) of a contact at time `t` [s].

    The time lies in the step that begins at the node with the index `last` or, if earlier, `first`.
    """
    k = last if t >= nodes[last, 0] else first
    edges_at(nodes[k, 0], train)
    return depth_and_force(t, nodes[k], surface, hammer, train.live)[which]


@compiled
def refined(
    which: int,
    place: int,
    value: float,
    begin: int,
    end: int,
    surface: int,
    nodes: Any,
    train: Train,
    hammer: Hammer,
) -> tuple[float, float]:
    """Return time [s] and value of the largest depth (`which` 0) or force (`which` 1) near a sample.

    Brent's method (*Algorithms for Minimization Without Derivatives*, 1973, chapter 5) is applied between the
    two neighbours of the largest sample, which has the number `place` and the value `value`. `begin` and
    `end` are the indices of the first and the last node of the contact.
    """
    left, right = max(place - 1, begin * SAMPLES), min(place + 1, end * SAMPLES)
    low, high, x, fx = sample_time(left, nodes), sample_time(right, nodes), sample_time(place, nodes), value
    first, last = left // SAMPLES, max(right - 1, left) // SAMPLES
    if place in (left, right):
        # At the edge of the contact, the sample is the largest value unless the values rise from it inwards.
        inward = ASIDE * (high - low) * (1.0 if place == left else -1.0)
        if value_of(which, x + inward, first, last, surface, nodes, train, hammer) <= value:
            return x, value
        x = low + GOLDEN * (high - low)
        fx = value_of(which, x, first, last, surface, nodes, train, hammer)
    v, fv = low, value_of(which, low, first, last, surface, nodes, train, hammer)
    w, fw = high, value_of(which, high, first, last, surface, nodes, train, hammer)
    step = before = high - low
    close = NEAR * (high - low) + 2.0**-52 * high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if abs(x - middle) <= 2.0 * close - 0.5 * (high - low):
            break
        r, q = (x - w) * (fx - fv), (x - v) * (fx - fw)
        p, q = (x - v) * q - (x - w) * r, 2.0 * (q - r)
        p = -p if q > 0.0 else p
        q = abs(q)
        if abs(p) < abs(0.5 * q * before) and q * (low - x) < p < q * (high - x):
            before, step = step, p / q
            if min(x + step - low, high - x - step) < 2.0 * close:
                step = math.copysign(close, middle - x)
        else:
            before = (high if x < middle else low) - x
            step = GOLDEN * before
        u = x + (step if abs(step) >= close else math.copysign(close, step))
        fu = value_of(which, u, first, last, surface, nodes, train, hammer)
        if fu >= fx:
            low, high = (x, high) if u >= x else (low, x)
            v, fv, w, fw, x, fx = w, fw, x, fx, u, fu
        else:
            low, high = (low, u) if u >= x else (u, high)
            if fu >= fw or w == x:
                v, fv, w, fw = w, fw, u, fu
            elif fu >= fv or v in (x, w):
                v, fv = u, fu
    return x, fx


@compiled
def peaks_of(
    contact: Any,
    nodes: Any,
    train: Train,
    hammer: Hammer,
) -> tuple[float, float, float]:
    """Return the time of the largest depth [s], the largest depth [m] and the peak force [N] of a contact."""
    surface = int(contact[0])
    if RIGID_FRONT and surface == M.PACK_SURFACE:
        return contact[1], 0.0, math.nan
    begin = int(contact[5])
    end = begin
    deepest = strongest = begin * SAMPLES
    deepest_value = strongest_value = 0.0
    first, last, _edge = edges_at(nodes[begin, 0], train)
    while end + 1 < nodes.shape[0] and not (nodes[end, 0] >= contact[3]):
        node = nodes[end]
        first, last, _edge = pass_edges(node[0], train, first, last)
        is_last = not (end + 2 < nodes.shape[0] and not (nodes[end + 1, 0] >= contact[3]))
        for j in range(SAMPLES + 1 if is_last else SAMPLES):
            t = node[0] + (nodes[end + 1, 0] - node[0]) * j / SAMPLES
            depth, force = depth_and_force(t, node, surface, hammer, train.live)
            if depth > deepest_value:
                deepest, deepest_value = end * SAMPLES + j, depth
            if force > strongest_value:
                strongest, strongest_value = end * SAMPLES + j, force
        end += 1
    peak_time = sample_time(deepest, nodes)
    if end > begin:
        t, value = refined(0, deepest, deepest_value, begin, end, surface, nodes, train, hammer)
        if value > deepest_value:
            peak_time, deepest_value = t, value
        value = refined(1, strongest, strongest_value, begin, end, surface, nodes, train, hammer)[1]
        strongest_value = max(value, strongest_value)
    return peak_time, deepest_value, strongest_value


@entry
def peaks(
    contacts: Any,
    nodes: Any,
    train: Any,
    hammer: Hammer,
    out: Any,
) -> None:
    """Write time of largest depth [s], largest depth [m] and peak force [N] of m contacts to `out`, (m, 3).

    `contacts` and `nodes` are the record of the run; `train` and `hammer` are as for `resample`.
    """
    train = Train(*train)
    for row in range(contacts.shape[0]):
        out[row, 0], out[row, 1], out[row, 2] = peaks_of(contacts[row], nodes, train, hammer)
