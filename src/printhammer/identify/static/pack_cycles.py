"""Load cycles of a pack: which rows are loading, which unloading, and whether the force grows as it must."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.residuals import robust_scale
from printhammer.results import Declared, part
from printhammer.units import from_si

if TYPE_CHECKING:
    from printhammer.identify.tables import Readings
    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

_TURN: Final = 0.05
"""Part of the largest indentation by which it has to turn back before the sense counts as changed."""

_FALL: Final = 0.05
"""Part of the largest force by which loading may fall before it counts as falling."""


class Cycles(Declared, eq=False):
    """Branch and load cycle of each row."""

    unloading: BoolArray = part("whether a row is on the unloading branch, shape (m,)")
    cycle: IntArray = part("number of the load cycle, from 0, shape (m,)")
    unloaded: IntArray = part("cycles with rows of unloading inside the pack, ascending")


def cycles_of(table: Readings) -> Cycles:
    """Divide a table into load cycles; each run of loading rows begins a new one.

    Without the column ``branch`` the sense of the indentation decides.
    """
    depth = table.values["indentation"]
    words = table.words.get("branch")
    unloading = _by_sense(depth) if words is None else np.array([word == "unloading" for word in words])
    cycle = np.zeros(len(depth), dtype=np.int64)
    deepest = depth[0]
    for k in range(1, len(depth)):
        # A run of loading alone that starts over is a cycle too.
        over = not unloading[k] and depth[k] < depth[k - 1] - 0.5 * deepest
        new = (unloading[k - 1] and not unloading[k]) or (over and not unloading[k - 1])
        cycle[k] = cycle[k - 1] + new
        deepest = depth[k] if new else max(deepest, depth[k])
    return Cycles(unloading, cycle, np.unique(cycle[unloading & (depth > 0.0)]))


def _by_sense(depth: FloatArray) -> BoolArray:
    """Return which rows come after a largest indentation and before the next smallest one."""
    unloading = np.zeros(len(depth), dtype=bool)
    least = _TURN * float(np.ptp(depth))
    extreme, falling = 0, False
    for k in range(1, len(depth)):
        ahead = depth[k] - depth[extreme]
        if (ahead <= 0.0) if falling else (ahead >= 0.0):
            extreme = k
        elif abs(ahead) > least:
            # What lies between the extreme and here already went the other way.
            unloading[extreme + 1 : k + 1] = not falling
            extreme, falling = k, not falling
        unloading[k] = falling
    return unloading


def check_loading(table: Readings, cycles: Cycles) -> None:
    """Refuse a loading branch that is none.

    Raises
    ------
    InputError
        In some cycle the indentation does not grow on the loading branch, or the force falls by more than
        noise explains.
    """
    depth, force = table.values["indentation"], table.values["force"]
    for cycle in np.unique(cycles.cycle):
        rows = np.flatnonzero((cycles.cycle == cycle) & ~cycles.unloading)
        if len(rows) < 2:
            continue
        first, last = table.lines[rows[0]], table.lines[rows[-1]]
        if depth[rows[-1]] <= depth[rows[0]]:
            raise InputError(
                f"{table.path}: lines {first} to {last} are loading, but their indentation falls from"
                f" {from_si(float(depth[rows[0]]), 'm', 'um'):.4g} to"
                f" {from_si(float(depth[rows[-1]]), 'm', 'um'):.4g} um, expected one that grows"
            )
        order = rows[np.argsort(depth[rows], kind="stable")]
        # Running medians, of as many values as there are enough for, pass single outliers over.
        width = 5 if len(order) >= 9 else 3 if len(order) >= 5 else 1
        padded = np.pad(force[order], width // 2, mode="edge")
        smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1)
        noise = robust_scale(np.diff(force[order], 2)) / float(np.sqrt(6.0)) if len(order) >= 9 else 0.0
        peaks = np.maximum.accumulate(smooth)
        k = int(np.argmax(peaks - smooth))
        fall = float(peaks[k] - smooth[k])
        if fall > max(_FALL * np.abs(force).max(), 4.0 * noise):
            high, low = (
                f"{force[row]:.4g} N at {at:.4g} um (line {table.lines[row]})"
                for row in (order[int(np.argmax(smooth[: k + 1]))], order[k])
                for at in (from_si(float(depth[row]), "m", "um"),)
            )
            raise InputError(
                f"{table.path}: the force of the loading branch falls from {high} to {low}, expected one that"
                " grows"
            )
