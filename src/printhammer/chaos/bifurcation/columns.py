"""Columns of a bifurcation diagram: the states of many trains at successive firings, and their periods."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.chaos.orbits.settled import Settled, settled, shown
from printhammer.chaos.strobe.train import FROM_REST, NO_CURRENT, State, handed_on, pack_branches
from printhammer.chaos.strobe.verdict import AGREEMENT, LARGEST_PERIOD
from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.results import Declared, column, part
from printhammer.run.effort import Effort
from printhammer.run.ensemble import Ensemble
from printhammer.run.regime import Regime, window_of
from printhammer.run.start import AT_REST, check_branch, initial_state
from printhammer.run.supply import current_scale
from printhammer.support.arrays import FloatArray, IntArray, TextArray

TOLERANCE: Final = 1e-9
"""Default tolerance of diagrams and basins; its errors are far below `AGREEMENT`, the period criterion.

Tuned: with `DISPLAY_TOLERANCE` of `printhammer.run.ensemble`, weakly stable orbits never settle to within
1e-6 of the half-width of the strobe window.
"""

EFFORT: Final = Effort(TOLERANCE)

OK: Final = "ok"
NOT_RUN: Final = "not run"
_STATUS: Final = "U16"

MOST_STATES: Final = 1 << 19
"""Maximum number of states computed in one batch, which bounds the memory; arbitrary."""


class Columns(Declared):
    """States of many trains at successive sections, with the final state of each train."""

    x: FloatArray = column("m", "displacement", "train point", more="NaN after the end of a run")
    v: FloatArray = column("m/s", "velocity", "train point", more="NaN after the end of a run")
    branch: npt.NDArray[np.int8] = column(
        "1",
        "mode of motion, as an index of `printhammer.run.ensemble.MODE_NAMES`",
        "train point",
        more="-1 after the end of a run",
    )
    memory: FloatArray = column(
        "m", "latest local maximum on the unloading branch inside the pack", "train point", more="else 0"
    )
    current: FloatArray = column("A", "current in the coil", "train point", more="0 without a voltage drive")
    status: TextArray = column("", "status of each run; `NOT_RUN` before the run", "train")
    last: FloatArray = part(
        "state from which the next train can continue, one firing after the last requested firing, shape (M,"
        " 7): displacement, velocity, branch of the pack or -1, memory, and the electric part of the state;"
        " `FROM_REST` if no train can continue"
    )

    def __len__(self) -> int:
        """Return the number of trains."""
        return len(self.x)

    def handed(self, row: int) -> State:
        """Return the final state of the train in row `row`, from which the next train starts."""
        return tuple(self.last[row].tolist())


def blank_columns(count: int, points: int) -> Columns:
    """Build columns for `count` trains that have not been run: NaN states, status "not run"."""
    return Columns(
        x=np.full((count, points), np.nan),
        v=np.full((count, points), np.nan),
        branch=np.full((count, points), -1, np.int8),
        memory=np.full((count, points), np.nan),
        current=np.zeros((count, points)),
        status=np.full(count, NOT_RUN, _STATUS),
        last=np.tile(np.array(FROM_REST), (count, 1)),
    )


def put(columns: Columns, rows: Sequence[int] | IntArray, others: Columns) -> None:
    """Copy all rows of `others`, in order, into the rows `rows` of `columns`."""
    where = np.asarray(rows, dtype=np.int64)
    for name, values in vars(others).items():
        getattr(columns, name)[where] = values


def run_columns(
    regimes: Sequence[Regime], states: FloatArray, firings: int, transient: int, effort: Effort
) -> Columns:
    """Simulate many trains over `firings` firings; return their states after the first `transient` firings.

    `states`, shape (M, 7), are the initial states of the M trains. A row contains, in this order: the
    displacement [m]; the velocity [m/s]; the branch of the pack's force law, negative if it is to be derived
    from displacement and velocity; the memory of the pack [m]; and three electric variables, used with a
    voltage drive only (`printhammer.run.start.Beyond`). Initial states apply at the first firing, with pulses
    of earlier firings still active. For a train from rest without earlier firings, the row is `FROM_REST`.
    """
    points = firings - transient
    columns = blank_columns(len(regimes), points)
    at_rest = np.isnan(states[:, 0])
    in_pack = ~at_rest & (states[:, 2] >= 0.0)
    piece = max(1, MOST_STATES // (points + 1))
    done = 0
    for kind in (at_rest, in_pack, ~at_rest & ~in_pack):
        rows = np.flatnonzero(kind)
        for first in range(0, len(rows), piece):
            some = rows[first : first + piece]
            own = [regimes[row] for row in some]
            part = effort.within(done, len(regimes))
            put(columns, some, _run(own, states[some], firings, transient, part))
            done += len(some)
    return columns


def _run(
    regimes: Sequence[Regime], states: FloatArray, firings: int, transient: int, effort: Effort
) -> Columns:
    """Simulate trains that all start from rest, all inside the pack, or all outside; return their columns.

    The arguments are as for `run_columns`.
    """
    rest = bool(np.isnan(states[0, 0]))
    # The cells of a basin share one regime; the columns of a diagram have one regime each.
    known = {id(regime): regime for regime in regimes}
    made = {key: _train(regime, firings, rest) for key, regime in known.items()}
    trains = [made[id(regime)] for regime in regimes]
    moments = [
        np.append(times[transient:-1] + regime.phase * regime.period, times[-1])
        for regime, (_drive, times) in zip(regimes, trains, strict=True)
    ]
    places = [0, 1, 2, 3] if states[0, 2] >= 0.0 else [0, 1]
    if any(regime.fired.quantity == "voltage" for regime in known.values()):
        places = list(range(states.shape[1]))
    ensemble = Ensemble(
        [regime.hammer for regime in regimes],
        [drive for drive, _times in trains],
        # The run extends one period beyond the last firing, so that its end does not affect the last state.
        [float(times[-1]) + regime.period for regime, (_drive, times) in zip(regimes, trains, strict=True)],
        states=None if rest else states[:, places],
        starts=[float(times[0]) for _drive, times in trains],
        tolerance=effort.tolerance,
    )
    result = ensemble.run(strobes=moments, **effort.running)
    table = result.strobes
    assert table is not None
    reached = np.isfinite(table.x[:, -1])
    status = np.where(reached, OK, np.array(result.status_names)).astype(_STATUS)
    ends = np.column_stack(
        [table.x[:, -1], table.v[:, -1], table.branch[:, -1], table.memory[:, -1]]
    ).tolist()
    electric = np.tile(NO_CURRENT, (len(regimes), 1)) if table.electric is None else table.electric[:, -1]
    last = [
        handed_on(regime.hammer, x, v, int(branch), memory, currents) if ok else FROM_REST
        for regime, (x, v, branch, memory), currents, ok in zip(
            regimes, ends, electric.tolist(), reached, strict=True
        )
    ]
    return Columns(
        table.x[:, :-1],
        table.v[:, :-1],
        table.branch[:, :-1].astype(np.int8),
        table.memory[:, :-1],
        np.zeros_like(table.x[:, :-1]) if table.current is None else table.current[:, :-1],
        status,
        np.array(last),
    )


def run_in_stretches(
    regimes: Sequence[Regime], states: FloatArray, firings: int, transient: int, effort: Effort
) -> Columns:
    """Simulate trains without memory (`is_memoryless`) one period at a time.

    Arguments and result are as for `run_columns`. The computation is slower than one long run, but the
    rounding error does not grow with time; see `printhammer.chaos.strobe.train.STRETCH`.
    """
    columns = blank_columns(len(regimes), firings - transient)
    begun = [
        initial_state(regime.hammer, None if math.isnan(state[0]) else (float(state[0]), float(state[1])))
        for regime, state in zip(regimes, states, strict=True)
    ]
    left, now = np.arange(len(regimes)), np.array(begun)
    periods, phases = (
        np.array([getattr(regime, name) for regime in regimes]) for name in ("period", "phase")
    )
    positions = np.array([regime.hammer.position for regime in regimes])
    drives = [regime.train(1)[0] for regime in regimes]
    columns.status[:] = OK
    for firing in range(firings):
        ensemble = Ensemble(
            [regimes[int(row)].hammer for row in left],
            [drives[int(row)] for row in left],
            2.0 * periods[left],
            states=now,
            tolerance=effort.tolerance,
        )
        marks = np.column_stack([phases[left] * periods[left], periods[left]])
        result = ensemble.run(strobes=list(marks), threads=effort.threads)
        table = result.strobes
        assert table is not None
        if firing >= transient:
            place = firing - transient
            columns.x[left, place], columns.v[left, place] = table.x[:, 0], table.v[:, 0]
            columns.branch[left, place], columns.memory[left, place] = table.branch[:, 0], table.memory[:, 0]
        going = np.isfinite(table.x[:, 1])
        columns.status[left[~going]] = np.array(result.status_names)[~going]
        left = left[going]
        if not left.size:
            return columns
        now = np.column_stack([np.maximum(table.x[going, 1], positions[left]), table.v[going, 1]])
    columns.last[left, :2], columns.last[left, 2:] = now, AT_REST
    return columns


def _train(regime: Regime, firings: int, rest: bool) -> tuple[Drive, FloatArray]:
    """Build the drive of a train of `firings` firings; return the drive and `firings` + 1 firing times [s].

    The additional time, one period after the last firing of the train, is the time of the next firing. If
    `rest`, no pulses are fired before the start of the run.
    """
    if rest and regime.drive is None:
        drive = regime.pulses(firings + 2)
        return drive, drive.times[: firings + 1]
    drive, _ = regime.train(firings)
    return drive, regime.moments(drive, firings, 0.0)


def state_or_rest(regime: Regime, state: State) -> State:
    """Return `state`, the final state of a train, if the next train can start from it, else `FROM_REST`."""
    if math.isnan(state[0]):
        return FROM_REST
    try:
        initial_state(regime.hammer, state[:2])
        if state[2] >= 0.0:
            check_branch(regime.hammer, state)
    except InputError:
        return FROM_REST
    return state


def scales_of_columns(regimes: Sequence[Regime]) -> FloatArray:
    """Compute the scales of displacement, velocity, memory and current of each train, shape (M, 4).

    The scales of displacement, velocity and memory are half-widths of the strobe window of the train
    (`printhammer.run.regime`); the scale of the current is a typical current.
    """
    known: dict[tuple[int, float], tuple[float, ...]] = {}
    rows = []
    for regime in regimes:
        drive = regime.train(1)[0] if regime.hammer.front is None or regime.hammer.position is None else None
        key = (id(regime.hammer), 0.0 if drive is None else regime.period)
        if key not in known or regime.drive is not None or regime.fired.quantity == "voltage":
            window = window_of(regime.hammer, drive if drive is not None else regime.train(1)[0])
            way, speed = window.half_widths.tolist()
            known[key] = (way, speed, way, current_scale(regime.hammer, regime.train(1)[0]))
        rows.append(known[key])
    return np.array(rows)


def cycles_of(columns: Columns, fronts: FloatArray, scales: FloatArray) -> tuple[IntArray, FloatArray]:
    """Compute the periods of trains, in firings, by the rule of `printhammer.chaos.strobe.verdict`.

    Returns two arrays with one entry per train. The first is the period: the smallest q, at most 64 and at
    most half the number of points, for which states q firings apart agree; 0 if there is no such q. The
    second is the largest distance of states q firings apart, in units of the scales; NaN for an aperiodic
    train. `fronts` are the front positions of the packs [m], infinite without a pack; `scales` are from
    `scales_of_columns`.
    """
    branch = pack_branches(columns.x, columns.branch, fronts[:, np.newaxis])
    states = np.stack([columns.x, columns.v, columns.memory, columns.current], axis=2) / scales[:, np.newaxis]
    cycles = np.zeros(len(states), np.int64)
    distances = np.full(len(states), np.nan)
    left = np.flatnonzero(np.isfinite(states).all(axis=(1, 2)))
    for q in range(1, min(LARGEST_PERIOD, states.shape[1] // 2) + 1):
        # Compare the last two states first: a cheap test that excludes most trains.
        near = left[(np.abs(states[left, -1] - states[left, -1 - q]) <= AGREEMENT).all(axis=1)]
        if not near.size:
            continue
        apart = np.abs(states[near, q:] - states[near, :-q]).max(axis=(1, 2))
        agree = (apart <= AGREEMENT) & (branch[near, q:] == branch[near, :-q]).all(axis=1)
        cycles[near[agree]] = q
        distances[near[agree]] = apart[agree]
        left = left[cycles[left] == 0]
    return cycles, distances


def confirm(
    columns: Columns,
    cycles: IntArray,
    distances: FloatArray,
    regimes: Sequence[Regime],
    scales: FloatArray,
    effort: Effort,
) -> None:
    """Check ambiguous periods from `cycles_of` by Newton's method; update periods and distances in place.

    A period is ambiguous if the states alone do not prove the period (`printhammer.chaos.orbits.settled`).
    If Newton's method does not confirm a period, it is set to 0, which stands for an aperiodic train.
    """
    doubtful: list[int] = []
    for q in np.unique(cycles[cycles > 0]).tolist():
        rows = np.flatnonzero(cycles == q)
        points = np.stack([columns.x[rows], columns.v[rows]], axis=2) / scales[rows, np.newaxis, :2]
        doubtful += rows[~shown(points, q)].tolist()

    def settled_of(row: int) -> Settled:
        points = np.column_stack([columns.x[row], columns.v[row]])
        return settled(regimes[row], points, int(cycles[row]), scales[row, :2])

    for row, ends_at in zip(doubtful, effort.quiet.mapped(settled_of, doubtful), strict=True):
        q = cycles[row] = ends_at.period or 0
        parts = (columns.x, columns.v, columns.memory, columns.current)
        points = np.column_stack([part[row] for part in parts]) / scales[row]
        distances[row] = np.abs(points[q:] - points[:-q]).max() if q else math.nan


def orbit_distance(one: FloatArray, other: FloatArray) -> float:
    """Compute the distance between two periodic orbits of q firings, the smallest over all cyclic shifts.

    An orbit is given by its scaled states, shape (q, 2). For each cyclic shift of the other orbit, the
    distance is the largest absolute difference of any component of corresponding states.
    """
    count = len(one)
    shifted = other[(np.arange(count) + np.arange(count)[:, np.newaxis]) % count]
    return float(np.abs(shifted - one).max(axis=(1, 2)).min())
