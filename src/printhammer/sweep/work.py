"""The work of a block: its members integrated together, and what is kept of them."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.run.ensemble import DotTable, Ensemble
from printhammer.support.threads import in_threads
from printhammer.sweep.members import Base, Maker, Member
from printhammer.sweep.outputs import (
    DISPLACEMENT,
    DOTS,
    FINAL,
    NO_HAMMER,
    OF_DOTS,
    OF_MOTION,
    STATUSES,
    STROBES,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.run.motion import Motion
    from printhammer.support.arrays import FloatArray
    from printhammer.sweep.outputs import Outputs

Results = dict[str, Any]
"""Arrays by name, of shape (members of the block, ...)."""

# Two kernels for the same laws must not be made at once.
_MAKING: Final = threading.Lock()


def run_chunk(
    base: Base,
    outputs: Outputs,
    rows: FloatArray,
    *,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Results:
    """Integrate the members of a block, one for each row of axis values, SI; return arrays by name.

    A member that cannot be made or does not get to its end is a row with a status. `progress` is called now
    and then with the share done; what it raises ends the work.

    Raises
    ------
    InputError
        The tables that the hammer names have changed.
    """
    if base.hammer.replace({}).fingerprint != base.hammer.fingerprint:
        raise InputError(f"{base.hammer.path}: a table that it names has changed since the sweep began")
    results = outputs.empty(len(rows))
    results["status"][:] = NO_HAMMER
    results["reached"][:] = np.nan
    maker = Maker(base)
    which: list[int] = []
    members: list[Member] = []
    for i, row in enumerate(rows):
        try:
            members.append(maker.member(row))
        except InputError:
            continue
        which.append(i)
    if not members:
        return results
    ensemble = Ensemble(
        [member.hammer for member in members],
        [member.drive for member in members],
        [member.end for member in members],
        states=[member.state for member in members],
        tolerance=base.tolerance,
    )
    with _MAKING:
        _ = ensemble.groups
    motions = outputs.wants(*OF_MOTION)
    share = 0.2 if motions else 1.0

    def tell(done: int, total: int) -> None:
        if progress is not None:
            progress(share * done / total)

    rows_of = np.array(which)
    _from_ensemble(ensemble, members, outputs, rows_of, results, threads, tell)
    if motions:

        def tell_motion(done: int, total: int) -> None:
            if progress is not None:
                progress(share + (1.0 - share) * done / total)

        def piece(first: int, last: int) -> None:
            for i in range(first, last):
                _from_motion(ensemble.motion(i), which[i], results)

        in_threads([piece], [len(members)], threads, tell_motion)
    return results


def _from_ensemble(
    ensemble: Ensemble,
    members: Sequence[Member],
    outputs: Outputs,
    which: Any,
    results: Results,
    threads: int,
    tell: Callable[[int, int], None],
) -> None:
    moments, places, ends = _moments(members, outputs)
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
            for i, row in enumerate(which):
                for name, value in _scalars(runs.dots, i).items():
                    if name in results:
                        results[name][row] = value
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


def _moments(
    members: Sequence[Member], outputs: Outputs
) -> tuple[list[FloatArray] | None, list[Any], list[int]]:
    """Return the times of the strobes of each member; which are firings, and which is the end."""
    strobes, final = outputs.wants(*STROBES), outputs.wants(*FINAL)
    if not strobes and not final:
        return None, [], []
    moments, places, ends = [], [], []
    for member in members:
        firings = np.asarray(member.drive.times) if strobes else np.zeros(0)
        end = int(np.searchsorted(firings, member.end))
        moments.append(np.insert(firings, end, member.end) if final else firings)
        order = np.arange(len(firings))
        places.append(np.where(final & (order >= end), order + 1, order))
        ends.append(end)
    return moments, places, ends


def _scalars(dots: DotTable, i: int) -> dict[str, float]:
    """Return the scalars that follow from the dots of a member."""
    struck = dots.struck[i]
    scalars: dict[str, float] = {
        "struck_dots": int(struck.sum()),
        "lost_dots": int((dots.fired[i] & ~struck).sum()),
    }
    for name in ("flight_time", "peak_force"):
        values = getattr(dots, name)[i][struck]
        # math.fsum rounds once, so that a mean does not depend on how many empty places follow.
        scalars[f"{name}_mean"] = math.fsum(values) / len(values) if len(values) else math.nan
        scalars[f"{name}_spread"] = float(values.max() - values.min()) if len(values) else math.nan
    return scalars


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
        "energy_residual": energy.residual,
    }
    for name, value in scalars.items():
        if name in results:
            results[name][row] = value
