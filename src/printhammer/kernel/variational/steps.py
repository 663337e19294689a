"""Tangent columns propagated from one node of a recorded run to the next, in motion and at rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    CAPACITANCE,
    CHARGED,
    CHARGING,
    ELECTRIC,
    FRONT,
    INVERSE_MASS,
    POSITION,
)
from printhammer.kernel.variational.layout import BACKSTOP_LOSS, ELECTRICS, MEMORIES, PEAK, START, TIME

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import contact_rate, length_of
    from printhammer.kernel.methods.dop853 import contact_end
    from printhammer.kernel.model.circuit import driven, path_of
    from printhammer.kernel.model.forces import Hammer, acceleration, is_on_stop, value_at
    from printhammer.kernel.model.laws import (
        ELECTRIC_ROW,
        FORCED,
        FRICTION,
        HAS_BACKSTOP,
        HAS_CIRCUIT,
        HAS_PACK,
        MEMORY,
        RIGID_FRONT,
    )
    from printhammer.kernel.model.pulses import Drive
    from printhammer.kernel.single.resample import is_held, memory_of
    from printhammer.kernel.variational.circuit import (
        couples,
        current_slopes,
        electric_at_node,
        electric_in,
        hold_linkage,
        main_row,
    )
    from printhammer.kernel.variational.columns import (
        bring_back,
        column_rates,
        column_step,
        longest_step,
        take_in,
    )
    from printhammer.kernel.variational.forcing import (
        contact_changes,
        field_changes,
        force_with_value,
        note_changed_memories,
        pack_change,
        stored_change,
    )
    from printhammer.kernel.variational.layout import Forcing, Setting
    from printhammer.kernel.variational.slopes import (
        contact_slopes,
        damping_slope,
        field_slope,
        note_memories,
        pack_slopes,
    )

GRADING = 1.0 / 64.0
"""Smallest step after a touch of the pack, where the stiffness is not smooth, as a fraction of the run's
step."""


@compiled
def begin_step(node: Any, work: Any) -> None:
    """Copy the state at a node of the record to row START of `work`."""
    work[START, 0] = node[4] if int(node[3]) == M.BACKSTOP else node[1]
    work[START, 1] = node[2]
    work[START, TIME] = node[0]
    if HAS_CIRCUIT:
        for i in range(ELECTRICS):
            work[START, work.shape[1] - ELECTRICS + i] = node[ELECTRIC + i]


@compiled
def length_in_contact(
    t: float, leaves: bool, t0: float, w0: float, v0: float, hammer: Hammer, drive: Drive
) -> float:
    """Return the increment of the regularised variable s from time `t0` to `t` [s] in a backstop contact.

    The accuracy is lower than that of :func:`printhammer.kernel.methods.contact.s_at`, but sufficient for the
    tangent columns. If the armature `leaves` the backstop at `t`, the equation solved is w = 0, since there
    dt/ds = 0.
    """
    kv0 = contact_rate(w0, v0, t0, hammer, drive)
    s, change = 0.0, math.inf
    t1, w1, v1, kv1 = t0, w0, v0, kv0
    for number in range(12):
        if abs(change) <= 1e-8 * s:
            break
        at_the_end = leaves and number > 0 and v1 > 0.0
        change = w1 / v1 if at_the_end else length_of(t - t1, w1, v1, kv1)
        s += change
        t1, w1, v1, kv1, _electric = contact_end(t0, w0, v0, kv0, s, hammer, drive)
    return s


@compiled
def place_of_rest(t: float, node: Any, k: int, columns: Any, setting: Setting) -> float:
    """Return the derivative of the displacement at rest with respect to constant k, at time `t` [s].

    The rest is the step of the run that begins at `node`.
    """
    scales, bounds, hammer, live, forcing = setting
    x, mode, moves = node[1], int(node[3]), forcing.moves
    if mode == M.RESTING:
        return float(moves[k, POSITION])
    if RIGID_FRONT and mode == M.RESTING_FRONT:
        return float(moves[k, FRONT])
    drive = driven(live, electric_at_node(node))
    value = value_at(t, x, hammer, drive)
    with_value = force_with_value(x, value, hammer, drive, forcing)
    change, _coil, _drive = field_changes(t, x, value, with_value, k, drive, setting)
    if mode == M.HELD:
        w = node[4]
        with_x = -contact_slopes(w, 0.0, scales, hammer)[0] / (2.0 * w)
        change += contact_changes(w, 0.0, k, forcing)[0] - with_x * moves[k, POSITION]
    else:
        with_x = pack_slopes(x, 0.0, M.LOADING, 0.0, x, scales, hammer)[0]
        change += pack_change(x, 0.0, M.LOADING, k, forcing) - with_x * moves[k, FRONT]
    with_x += field_slope(x, 0.0, value, scales, bounds, hammer)
    if HAS_CIRCUIT:
        current_x, by_linkage, force = current_slopes(x, electric_at_node(node), hammer, live)
        with_x += force * current_x
        change += force * by_linkage * columns[main_row(hammer), k]
    return float(-change / with_x)


@compiled
def settle(pause: float, node: Any, columns: Any, setting: Setting) -> float:
    """Propagate the columns for `pause` [s] at rest in contact with an elastic backstop, in closed form.

    The perturbation obeys the linear oscillator with the stiffness and damping at the rest position. Returns
    the logarithm of a factor that has been divided out of the columns.
    """
    scales, bounds, hammer = setting.scales, setting.bounds, setting.hammer
    x, w = node[1], node[4]
    slopes = contact_slopes(w, 0.0, scales, hammer)
    by_x = (field_slope(x, 0.0, 0.0, scales, bounds, hammer) - slopes[0] / (2.0 * w)) * hammer[INVERSE_MASS]
    by_v = (slopes[1] + damping_slope(x, 0.0, scales, hammer)) * hammer[INVERSE_MASS]
    half = 0.5 * by_v
    under_root = half * half + by_x
    if under_root < 0.0:
        rate = math.sqrt(-under_root)
        grown, even, odd = half * pause, math.cos(rate * pause), math.sin(rate * pause) / rate
    else:
        rate = math.sqrt(under_root)
        grown = (half + rate) * pause
        once = math.exp(-2.0 * rate * pause)
        even = 0.5 * (1.0 + once)
        odd = 0.5 * (1.0 - once) / rate if rate * pause > 1e-8 else pause
    for k in range(columns.shape[1]):
        dx, dv = columns[0, k], columns[1, k]
        columns[0, k] = (even - half * odd) * dx + odd * dv
        columns[1, k] = by_x * odd * dx + (even + half * odd) * dv
    return float(grown)


@compiled
def rest(t: float, t_to: float, node: Any, columns: Any, setting: Setting) -> float:
    """Propagate the columns through a rest from `t` to `t_to` [s]; earlier perturbations vanish or decay.

    Returns the logarithm of a factor that has been divided out of the columns.
    """
    grown = 0.0
    if FRICTION and is_held(int(node[3])):
        # Dry friction holds the neighbouring motion at its own position.
        for k in range(columns.shape[1]):
            columns[1, k] = 0.0
        return grown
    if int(node[3]) != M.HELD:
        for k in range(columns.shape[1]):
            place = 0.0
            if FORCED:
                place = place_of_rest(t_to, node, k, columns, setting)
            columns[0, k], columns[1, k] = place, 0.0
            columns[PEAK, k] = 0.0 if is_on_stop(int(node[3])) else place
        return grown
    if FORCED:
        for k in range(columns.shape[1]):
            columns[0, k] -= place_of_rest(t, node, k, columns, setting)
    grown = settle(t_to - t, node, columns, setting)
    if FORCED:
        for k in range(columns.shape[1]):
            place = place_of_rest(t, node, k, columns, setting)
            columns[0, k] = columns[0, k] * math.exp(grown) + place
            columns[1, k] *= math.exp(grown)
        return 0.0
    return grown


@compiled
def rest_with_current(t: float, t_to: float, node: Any, columns: Any, work: Any, setting: Setting) -> float:
    """Propagate the columns through a rest from `t` to `t_to` [s] while the circuit evolves.

    In an elastic backstop, perturbations oscillate about the rest position; elsewhere the armature is fixed.
    Returns the logarithm of a factor that has been divided out of the columns.
    """
    hammer, live = setting.hammer, setting.drive
    mode, grown = int(node[3]), 0.0
    if mode == M.HELD and not couples(hammer, live):
        grown = rest(t, t_to, node, columns, setting)
        if hammer[CAPACITANCE] == 0.0:
            return grown
        # Meanwhile a reservoir charges with the time constant of its RC circuit.
        fall = math.exp(-(t_to - t) / (hammer[CHARGING] * hammer[CAPACITANCE]))
        for k in range(columns.shape[1]):
            columns[0, k] *= math.exp(grown)
            columns[1, k] *= math.exp(grown)
            full = setting.forcing.moves[k, CHARGED] if FORCED else 0.0
            columns[ELECTRIC_ROW + 2, k] = full + (columns[ELECTRIC_ROW + 2, k] - full) * fall
        return 0.0
    if mode != M.HELD:
        grown = rest(t, t_to, node, columns, setting)
    law, pace = mode, 1.0
    if mode == M.HELD:
        law, pace = M.BACKSTOP, 1.0 / (2.0 * node[4])
        work[START, 0] = node[4]
    take_in(work, columns)
    length = (t_to - t) * pace
    count = 1 + int(length / longest_step(law, 0.0, 0.0, work, setting))
    for _ in range(count):
        column_step(length / count, columns, work, law, 0.0, 0.0, setting)
    bring_back(work, columns)
    work[START, 0], work[START, 1] = node[1], node[2]
    return grown


@compiled
def set_in(t: float, t_to: float, node: Any, columns: Any, work: Any, setting: Setting) -> None:
    """Propagate the columns through the short first step of a backstop contact that begins at rest."""
    hammer, drive, forcing = setting.hammer, setting.drive, setting.forcing
    x, pause = node[1], t_to - t
    if HAS_CIRCUIT:
        work[START, 0], work[START, TIME] = x, t
        take_in(work, columns)
        column_rates(work[0], work[START], columns, M.FREE, 0.0, 0.0, work[MEMORIES], setting)
        for i in range(work.shape[1]):
            work[START, i] += pause * work[0, i]
        bring_back(work, columns)
        work[START, 0], work[START, 1], work[START, TIME] = 0.0, 0.0, t_to
        return
    for k in range(columns.shape[1]):
        columns[0, k] += pause * columns[1, k]
        if FORCED:
            value = value_at(t, x, hammer, drive)
            with_value = force_with_value(x, value, hammer, drive, forcing)
            change = field_changes(t, x, value, with_value, k, drive, setting)[0] * hammer[INVERSE_MASS]
            a = acceleration(t, x, 0.0, M.FREE, 0.0, hammer, drive)
            change += a * forcing.moves[k, INVERSE_MASS] / hammer[INVERSE_MASS]
            columns[1, k] += pause * change


@compiled
def add_stored(sign: float, columns: Any, work: Any, hammer: Hammer, forcing: Forcing) -> None:
    """Add the derivatives of the energy stored in a released backstop to the backstop-loss rows.

    The derivatives are multiplied by `sign`.
    """
    for k in range(columns.shape[1]):
        columns[BACKSTOP_LOSS, k] += sign * stored_change(work[START, 0], columns[0, k], k, hammer, forcing)


@compiled
def carry(t_to: float, node: Any, after: Any, columns: Any, work: Any, setting: Setting) -> float:
    """Propagate state and columns from row START of `work` to `t_to` [s], in the step from `node`.

    Returns the logarithm of a factor that has been divided out of the columns.
    """
    grown = carry_state(t_to, node, after, columns, work, setting)
    if HAS_CIRCUIT:
        place = work[START, 0]
        x = setting.hammer[POSITION] - place * place if int(node[3]) == M.BACKSTOP else place
        hold_linkage(x, columns, path_of(setting.drive), setting)
    return grown


@compiled
def carry_state(t_to: float, node: Any, after: Any, columns: Any, work: Any, setting: Setting) -> float:
    """Propagate state and columns like `carry`, except the flux-linkage rows of a coil without current.

    Returns the logarithm of a factor that has been divided out of the columns.
    """
    hammer, drive, forcing = setting.hammer, driven(setting.drive, electric_in(work[START])), setting.forcing
    t = work[START, TIME]
    if t_to <= t:
        return 0.0
    mode, kept = int(node[3]), node[4]
    if mode >= M.RESTING:
        if HAS_CIRCUIT:
            grown = rest_with_current(t, t_to, node, columns, work, setting)
            work[START, TIME] = t_to
            return grown
        work[START, TIME] = t_to
        return rest(t, t_to, node, columns, setting)
    if HAS_BACKSTOP and mode == M.BACKSTOP and work[START, 0] == 0.0 and work[START, 1] == 0.0:
        work[START, TIME] = t_to
        set_in(t, t_to, node, columns, work, setting)
        return 0.0
    # The energy still stored in a released backstop is dissipated while the backstop recovers.
    if FORCED and HAS_BACKSTOP and mode == M.BACKSTOP_RELEASED:
        add_stored(1.0, columns, work, hammer, forcing)
    take_in(work, columns)
    if HAS_BACKSTOP and mode == M.BACKSTOP:
        leaves = t_to == after[0] and int(after[3]) == M.FREE
        length = length_in_contact(t_to, leaves, t, work[START, 0], work[START, 1], hammer, drive)
        count = 1 + int(length / longest_step(mode, 0.0, 0.0, work, setting))
        for _ in range(count):
            column_step(length / count, columns, work, mode, 0.0, 0.0, setting)
    else:
        memory = memory_of(mode, kept, hammer)
        if HAS_PACK and MEMORY and mode in (M.UNLOADING, M.RELOADING):
            note_memories(work[MEMORIES], kept, hammer)
            if FORCED:
                note_changed_memories(kept, forcing)
        longest = longest_step(mode, memory, kept, work, setting)
        left = t_to - t
        while left > 0.0:
            length = min(left, longest)
            if HAS_PACK and mode == M.LOADING and work[START, 1] > 0.0:
                since = (work[START, 0] - hammer[FRONT]) / work[START, 1]
                length = min(length, max(since, GRADING * (t_to - t)))
            column_step(length, columns, work, mode, memory, kept, setting)
            left = 0.0 if length == left else t_to - work[START, TIME]
    work[START, TIME] = t_to
    bring_back(work, columns)
    if FORCED and HAS_BACKSTOP and mode == M.BACKSTOP_RELEASED:
        add_stored(-1.0, columns, work, hammer, forcing)
    return 0.0
