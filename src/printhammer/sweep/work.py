"""Computation of sweep blocks: the members of a block are integrated together, in threads."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, Final

import numpy as np

from printhammer.drive.batch import firings_of
from printhammer.errors import InputError
from printhammer.run.ensemble import DotTable, Ensemble, EnsembleResult
from printhammer.run.motion import Motion
from printhammer.run.simulate import simulate
from printhammer.run.waits import longest_waveforms
from printhammer.run.window import Window, has_flight, has_window, is_held, is_settled
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.threads import in_threads, thread_count
from printhammer.sweep.members import Base, Maker, Members
from printhammer.sweep.outputs import (
    DISPLACEMENT,
    DOTS,
    FINAL,
    NO_HAMMER,
    OF_DOTS,
    OF_MOTION,
    STATUSES,
    STROBES,
    UNSETTLED,
    Outputs,
)
from printhammer.sweep.plan import Plan

Results = dict[str, Any]
"""Arrays by name, of shape (members of the block, ...)."""

# Prevents two threads from compiling the same laws at once.
_MAKING: Final = threading.Lock()


def run_chunk(
    base: Base,
    outputs: Outputs,
    rows: FloatArray,
    *,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Results:
    """Integrate the members of a block, one per row of axis values in SI; return the output arrays by name.

    A member that is invalid or stops early is a row with a status. `progress` is called from time to time
    with the fraction done; an exception that it raises stops the work.
    """
    if base.hammer.replace({}).fingerprint != base.hammer.fingerprint:
        raise InputError(
            f"{base.hammer.path}: a table that it names has changed since the sweep began",
            file=base.hammer.path,
            key="table",
        )
    results = outputs.empty(len(rows))
    results["status"][:] = NO_HAMMER
    results["reached"][:] = np.nan
    with _MAKING:
        which, members = Maker(base).members(rows, threads)
    if not which.size:
        return results
    ensemble = Ensemble(
        members.hammers, members.drives, members.ends, states=members.states, tolerance=base.tolerance
    )
    with _MAKING:
        _ = ensemble.groups
    motions = outputs.wants(*OF_MOTION)
    share = 0.2 if motions else 1.0

    def tell(done: int, total: int) -> None:
        if progress is not None:
            progress(share * done / total)

    _from_ensemble(ensemble, members, outputs, which, results, threads, tell)
    if motions:

        def tell_motion(done: int, total: int) -> None:
            if progress is not None:
                progress(share + (1.0 - share) * done / total)

        def piece(first: int, last: int) -> None:
            for i in range(first, last):
                _from_motion(ensemble.motion(i), which[i], results)

        in_threads([piece], [len(which)], threads, tell_motion)
    return results


def _from_ensemble(
    ensemble: Ensemble,
    members: Members,
    outputs: Outputs,
    which: IntArray,
    results: Results,
    threads: int,
    tell: Callable[[int, int], None],
) -> None:
    windows = members.windows
    moments, places, ends = _moments(members, outputs, ending=windows is not None or outputs.wants(*FINAL))
    runs = ensemble.run(
        dots=outputs.wants(*DOTS, *OF_DOTS),
        strobes=moments,
        times=outputs.times if outputs.wants(DISPLACEMENT) else None,
        threads=threads,
        progress=tell,
    )
    results["status"][which] = [STATUSES.index(name) for name in runs.status_names]
    results["reached"][which] = runs.reached
    results["steps"][which] = runs.steps
    if runs.x is not None:
        results[DISPLACEMENT.name][which] = runs.x
    if runs.dots is not None:
        for output in DOTS:
            if output.name in results:
                table = getattr(runs.dots, output.name)
                results[output.name][which, : table.shape[1]] = table
        if outputs.wants(*OF_DOTS):
            for name, values in _scalars(runs.dots, results.keys()).items():
                results[name][which] = values
    if windows is not None:
        results[UNSETTLED.name][which] = _unsettled(members, windows, ends, runs, ensemble.tolerance)
    if runs.strobes is not None:
        for i, row in enumerate(which):
            for output in STROBES:
                if output.name in results:
                    values = getattr(runs.strobes, output.name.removeprefix("strobe_"))[i, places[i]]
                    results[output.name][row, : len(values)] = values
            for output in FINAL:
                if output.name in results:
                    values = getattr(runs.strobes, output.name.removeprefix("final_"))
                    results[output.name][row] = values[i, ends[i]]


def _unsettled(
    members: Members, windows: Sequence[Window], ends: Sequence[int], runs: EnsembleResult, tolerance: float
) -> list[bool]:
    """Return, for each member, whether the armature is still moving at the end of its window.

    The criterion is that of `printhammer.run.window.unsettled`; `ends` are the indices of the end states.
    """
    assert runs.strobes is not None
    found = []
    waveforms = longest_waveforms(members.drives)
    for i, (hammer, waveform) in enumerate(zip(members.hammers, waveforms, strict=True)):
        place = i, ends[i]
        x, v, mode = (float(getattr(runs.strobes, name)[place]) for name in ("x", "v", "branch"))
        if not runs.ok[i] or is_held(mode):
            found.append(False)
        elif hammer.front is not None and has_window(hammer, waveform) and has_flight(hammer):
            found.append(not is_settled(windows[i], x, v, hammer.rest, hammer.front))
        else:
            # The threshold depends on the largest displacement of the motion.
            state = tuple(members.states[i].tolist())
            motion = simulate(hammer, members.drives[i], state=state, tolerance=tolerance, points=2)
            found.append(bool(motion.unsettled))
    return found


def _moments(
    members: Members, outputs: Outputs, *, ending: bool
) -> tuple[list[FloatArray] | None, list[Any], list[int]]:
    """Return each member's output times [s] and the array indices of the firings and of the end time.

    `ending` states whether the end time is an output time.
    """
    strobes, final = outputs.wants(*STROBES), ending
    if not strobes and not final:
        return None, [], []
    moments, places, ends = [], [], []
    fired = firings_of(members.drives)
    for i, until in enumerate(members.ends):
        firings = fired[i] if strobes else np.zeros(0)
        end = int(np.searchsorted(firings, until))
        moments.append(np.insert(firings, end, until) if final else firings)
        order = np.arange(len(firings))
        places.append(np.where(final & (order >= end), order + 1, order))
        ends.append(end)
    return moments, places, ends


def _scalars(dots: DotTable, wanted: Collection[str]) -> dict[str, Any]:
    """Compute the selected scalar outputs from the dots of each member, arrays of shape (members,)."""
    struck, counts = dots.struck, dots.struck.sum(axis=1)
    scalars: dict[str, Any] = {"struck_dots": counts, "lost_dots": (dots.fired & ~struck).sum(axis=1)}
    for name in ("flight_time", "peak_force"):
        values = getattr(dots, name)
        if f"{name}_mean" in wanted:
            # math.fsum rounds only once, so that a mean does not depend on the number of padded entries.
            sums = [math.fsum(row[made]) for row, made in zip(values, struck, strict=True)]
            scalars[f"{name}_mean"] = np.where(counts > 0, sums, np.nan) / np.maximum(counts, 1)
        if f"{name}_spread" in wanted:
            high = np.where(struck, values, -np.inf).max(axis=1, initial=-np.inf)
            low = np.where(struck, values, np.inf).min(axis=1, initial=np.inf)
            scalars[f"{name}_spread"] = np.where(counts > 0, high - low, np.nan)
    return {name: values for name, values in scalars.items() if name in wanted}


def _from_motion(motion: Motion, row: int, results: Results) -> None:
    energy = motion.energy
    _, x = motion.maxima
    scalars = {
        "peak_displacement": x.max() if len(x) else math.nan,
        "backstop_touches": sum(
            contact.surface == "backstop" and not contact.initial for contact in motion.contacts
        ),
        "coil_work": energy.coil_work,
        "drive_work": energy.drive_work,
        "pack_loss": energy.pack_loss,
        "backstop_loss": energy.backstop_loss,
        "damping_loss": energy.damping_loss,
        "energy_residual": energy.residual,
    }
    for name, value in scalars.items():
        if name in results:
            results[name][row] = value


Index = tuple[int, ...]

_INTERVAL: Final = 0.1  # Interval between progress reports, s; arbitrary


class _StopError(Exception):
    """Raised to stop a block whose results are no longer needed."""


def run_local(
    plan: Plan,
    todo: Iterable[Index],
    write: Callable[[Index, Results], None],
    tell: Callable[[float], None],
    threads: int | None = None,
) -> None:
    """Compute blocks in threads, by default one per core; write each block when the block is done.

    `write` receives the index of a block in the chunk grid and its results, in this thread; `tell` is called
    from time to time with the number of members done in unfinished blocks, possibly fractional.

    Raises
    ------
    InputError
        Raised by `run_chunk` or `write`.
    KeyboardInterrupt
        On Ctrl-C; unfinished blocks are dropped.
    """
    blocks = list(todo)
    workers = thread_count(threads)
    at_once = max(1, min(workers, len(blocks)))
    stop = threading.Event()
    shares: dict[Index, float] = {}

    def work(index: Index) -> Results:
        members = plan.blocks.members(index)

        def progress(share: float) -> None:
            shares[index] = share * len(members)
            if stop.is_set():
                raise _StopError

        progress(0.0)
        rows = plan.rows(members)
        return run_chunk(
            plan.spec.base, plan.spec.outputs, rows, threads=workers // at_once, progress=progress
        )

    left = iter(blocks)
    under_way: dict[Future[Results], Index] = {}
    with ThreadPoolExecutor(at_once) as pool:
        try:
            while True:
                # One more than the number of threads, so that no thread waits for the disk.
                while len(under_way) <= at_once and (index := next(left, None)) is not None:
                    under_way[pool.submit(work, index)] = index
                if not under_way:
                    return
                finished, _ = wait(under_way, timeout=_INTERVAL, return_when=FIRST_COMPLETED)
                for future in finished:
                    index = under_way.pop(future)
                    write(index, future.result())
                    shares.pop(index, None)
                tell(sum(list(shares.values())))
        finally:
            stop.set()
            for future in under_way:
                future.cancel()
