"""Fit the pack to its force over indentation: the stiffness AiEp of equation (5), optionally the exponents.

  loading    F = S r^p                    r = indentation / d,  p = 2.7,  q = 11
  unloading  F = S rho^(p - q) r^q        rho = r at the turning point

Data: the columns ``indentation`` from the front of the pack, ``force`` as a magnitude, and ``branch``, with
the words "loading" or "unloading"; rows in the order of measurement. Without ``branch``, the direction of the
indentation separates loading from unloading. The turning point of each cycle is fitted, not read off: the
unloading force depends on its 8.3th power, and the largest measured indentation is biased upward by noise.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import NoSolutionError, Solution, solve
from printhammer.identify.noise import robust_scale
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, check_rows, judge, solved
from printhammer.results import Declared, part
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.support.tables.readings import Readings, read_table
from printhammer.units import from_si

_TURN: Final = 0.05  # Arbitrary
"""Smallest reversal that counts as a change of direction, as a fraction of the largest indentation."""

_FALL: Final = 0.05  # Arbitrary
"""Smallest drop of the loading force that counts as a decrease, as a fraction of the largest force."""


class Cycles(Declared, eq=False):
    """Branch (loading or unloading) and load cycle of each row of a table."""

    unloading: BoolArray = part("whether a row is on the unloading branch, shape (m,)")
    cycle: IntArray = part("index of the load cycle, shape (m,)")
    unloaded: IntArray = part("indices of the cycles with unloading rows inside the pack, ascending")


def cycles_of(table: Readings) -> Cycles:
    """Divide a table into load cycles; each sequence of loading rows begins a new cycle.

    Without the column ``branch``, the direction of the indentation separates loading from unloading.
    """
    depth = table.values["indentation"]
    words = table.words.get("branch")
    unloading = _by_sense(depth) if words is None else np.array([word == "unloading" for word in words])
    cycle = np.zeros(len(depth), dtype=np.int64)
    deepest = depth[0]
    for k in range(1, len(depth)):
        # A loading sequence that starts over without unloading is a new cycle too.
        over = not unloading[k] and depth[k] < depth[k - 1] - 0.5 * deepest
        new = (unloading[k - 1] and not unloading[k]) or (over and not unloading[k - 1])
        cycle[k] = cycle[k - 1] + new
        deepest = depth[k] if new else max(deepest, depth[k])
    return Cycles(unloading, cycle, np.unique(cycle[unloading & (depth > 0.0)]))


def _by_sense(depth: FloatArray) -> BoolArray:
    """Return the mask of the unloading rows, between a maximum of the indentation and the next minimum."""
    unloading = np.zeros(len(depth), dtype=bool)
    least = _TURN * float(np.ptp(depth))
    extreme, falling = 0, False
    for k in range(1, len(depth)):
        ahead = depth[k] - depth[extreme]
        if (ahead <= 0.0) if falling else (ahead >= 0.0):
            extreme = k
        elif abs(ahead) > least:
            # The rows since the extreme already belong to the new direction.
            unloading[extreme + 1 : k + 1] = not falling
            extreme, falling = k, not falling
        unloading[k] = falling
    return unloading


def check_loading(table: Readings, cycles: Cycles) -> None:
    """Check that indentation and force grow on the loading branch of each load cycle.

    Raises
    ------
    InputError
        In a cycle, the indentation does not grow on the loading branch, or the force falls by more than noise
        explains.
    """
    depth, force = table.values["indentation"], table.values["force"]
    for cycle in np.unique(cycles.cycle):
        rows = np.flatnonzero((cycles.cycle == cycle) & ~cycles.unloading)
        if len(rows) < 2:
            continue
        first, last = table.lines[rows[0]], table.lines[rows[-1]]
        if depth[rows[-1]] <= depth[rows[0]]:
            raise InputError(
                (
                    f"{table.path}: lines {first} to {last} are loading, but their indentation falls"
                    f" from {from_si(float(depth[rows[0]]), 'm', 'um'):.4g}"
                    f" to {from_si(float(depth[rows[-1]]), 'm', 'um'):.4g} um"
                ),
                file=table.path,
                key="indentation",
                expected="growing values",
            )
        order = rows[np.argsort(depth[rows], kind="stable")]
        # Running medians, as wide as the number of rows allows, suppress single outliers.
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
                f"{table.path}: the force of the loading branch falls from {high} to {low}",
                file=table.path,
                key="force",
                expected="growing values",
            )


LOADING, UNLOADING = 2.7, 11.0
"""Exponents of the loading and unloading branches of equation (5)."""

_SPARE: Final = 4  # Smallest number of rows beyond the number of unknowns; arbitrary
_LOADING_ROWS: Final = 4  # Smallest number of rows of a loading branch; arbitrary
_MEETS: Final = 0.02
"""Smallest relative deviation of a fitted from a measured turning point that is reported; arbitrary."""

_FAR: Final = 1.0
"""Largest accepted absolute logarithm of the ratio of fitted to measured turning point; arbitrary."""


class PackLaw:
    """Pack force, equation (5), at measured indentations r, as fractions of the pack thickness, shape (m,).

    p = [S, ln rho of each cycle with unloading rows], followed by the two exponents if they are fitted.
    `thickness` [m] converts an error of the indentation to an error of r.
    """

    def __init__(self, r: FloatArray, cycles: Cycles, exponents: bool, thickness: float) -> None:
        self.inside = r > 0.0
        self.log_r = np.log(np.where(self.inside, r, 1.0))
        self.cycles, self.free, self.thickness = cycles, exponents, thickness
        self.turns = cycles.unloaded
        self.column = np.searchsorted(self.turns, cycles.cycle)
        self.column[self.column == len(self.turns)] = 0
        self.parameters = 1 + len(self.turns) + 2 * exponents

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the pack force [N] of equation (5) at the measured indentations."""
        low, high = self.exponents(p)
        power = low * self.log_r
        if len(self.turns):
            depth = p[1 + self.column]
            power = np.where(self.cycles.unloading, low * depth + high * (self.log_r - depth), power)
        return np.where(self.inside, p[0] * np.exp(power), 0.0)

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the pack force with respect to the parameters."""
        force, (low, high) = self.value(p), self.exponents(p)
        columns = [force / p[0]]
        for k in range(len(self.turns)):
            mine = self.cycles.unloading & (self.column == k)
            columns.append(np.where(mine, (low - high) * force, 0.0))
        if self.free:
            columns += self.by_exponents(p)
        return np.column_stack(columns)

    def by_exponents(self, p: FloatArray) -> list[FloatArray]:
        """Compute the derivatives of the force with respect to the two exponents."""
        force, out = self.value(p), self.cycles.unloading
        depth = p[1 + self.column] if len(self.turns) else np.zeros_like(force)
        return [np.where(out, depth, self.log_r) * force, np.where(out, (self.log_r - depth) * force, 0.0)]

    def variance_columns(self, p: FloatArray) -> FloatArray:
        """Return the variance coefficients of absolute and relative force errors and indentation errors."""
        force, (low, high) = self.value(p), self.exponents(p)
        steep = np.where(self.cycles.unloading, high, low) / (np.exp(self.log_r) * self.thickness)
        return np.column_stack([np.ones_like(force), force**2, (steep * force) ** 2])

    def exponents(self, p: FloatArray) -> tuple[float, float]:
        """Return the exponents of loading and unloading: fitted, or 2.7 and 11."""
        return (float(p[-2]), float(p[-1])) if self.free else (LOADING, UNLOADING)


def fit_pack(
    path: str | Path,
    *,
    thickness: float,
    exponents: bool = False,
    robust: bool = True,
    columns: str | None = None,
) -> Fit:
    """Fit "pack.stiffness" to a table with the columns ``indentation``, ``force`` and optionally ``branch``.

    `thickness` is the thickness d of the pack, platen minus front, m. With `exponents`, the exponents of
    loading and unloading are fitted too, instead of assuming 2.7 and 11. For the other options, see
    `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        The table is invalid or too small, a branch is missing, or the force falls on the loading branch.
    """
    if not thickness > 0.0:
        raise InputError(
            f"the thickness of the pack is {thickness:g} m",
            key="thickness",
            value=thickness,
            expected="more than 0 m",
        )
    table = read_table(
        path, {"indentation": "m", "force": "N"}, text={"branch": ("loading", "unloading")}, columns=columns
    )
    cycles = cycles_of(table)
    check_loading(table, cycles)
    depth, force = table.values["indentation"], table.values["force"]
    law = PackLaw(depth / thickness, cycles, exponents, thickness)
    data = Data(
        (table.path,),
        "pack",
        depth,
        force,
        (("indentation", "m"), ("force", "N")),
        cycles.unloading * (1 + law.column),
        ("loading", *(f"unloading {turn + 1}" for turn in law.turns)),
        table.lines,
    )
    check_rows(
        data, law.parameters + _SPARE, "the stiffness of the pack, the turning points and their errors"
    )
    if exponents and not len(cycles.unloaded):
        raise InputError(
            f"{table.path}: no rows of unloading",
            file=table.path,
            key="rows",
            expected="unloading rows, to fit the exponent of unloading",
        )
    solution = solved(data, law, _start(law, table), robust=robust)
    _check_turns(law, table, solution)
    p_value, why = (float("nan"), "") if exponents else _judge(law, data, solution)
    free = [("exponent of loading", "1", False), ("exponent of unloading", "1", False)] if exponents else []
    turns = [("", "", False)] * len(law.turns)
    return assemble(
        data,
        law,
        solution,
        [("pack.stiffness", "N", True), *turns, *free],
        given={"pack.thickness": f"{thickness!r} m"},
        remedies={"pack.stiffness": "more rows at larger indentations"},
        rejected=why,
        p_value=p_value,
        notes=_notes(law, table, solution),
    )


def _start(law: PackLaw, table: Readings) -> FloatArray:
    """Estimate the initial guess from the loading rows; raise `InputError` for too few or negative forces."""
    force, cycles = table.values["force"], law.cycles
    rows = np.flatnonzero(law.inside & ~cycles.unloading)
    if len(rows) < _LOADING_ROWS:
        raise InputError(
            f"{table.path}: {len(rows)} rows of loading inside the pack",
            file=table.path,
            key="rows",
            expected=f"{_LOADING_ROWS} or more, to fit the stiffness",
        )
    deep = rows[np.argsort(law.log_r[rows], kind="stable")[len(rows) // 2 :]]
    stiffness = float(np.median(force[deep] * np.exp(-LOADING * law.log_r[deep])))
    if stiffness <= 0.0:
        raise InputError(
            f"{table.path}: the forces of loading are not positive",
            file=table.path,
            key="force",
            expected="positive magnitudes of the force",
        )
    turns = [law.log_r[law.inside & (cycles.cycle == turn)].max() for turn in law.turns]
    return np.array([stiffness, *turns, *([LOADING, UNLOADING] if law.free else [])])


def _check_turns(law: PackLaw, table: Readings, solution: Solution) -> None:
    """Raise `InputError` for a load cycle whose branches meet far from the measured turning point."""
    for turn, meeting in zip(law.turns, solution.p[1:], strict=False):
        rows = np.flatnonzero(law.inside & (law.cycles.cycle == turn))
        if abs(meeting - law.log_r[rows].max()) > _FAR:
            raise InputError(
                (
                    f"{table.path}: lines {table.lines[rows[0]]} to {table.lines[rows[-1]]} are a load"
                    " cycle whose branches do not meet"
                ),
                file=table.path,
                key="rows",
                expected="rows in the order of the measurement",
            )


def _judge(law: PackLaw, data: Data, solution: Solution) -> tuple[float, str]:
    """Test the exponents of equation (5); return the p-value and the reason for a rejection."""
    out = bool(len(law.turns))
    terms = dict(zip("pq", law.by_exponents(solution.p)[: 1 + out], strict=False))
    p_value, why = judge(solution, terms, data.abscissa, data.series)
    if why not in terms:
        return p_value, why
    flaw = "its force does not grow with the power 2.7 of the indentation"
    if out:
        r = data.abscissa / law.thickness
        free = PackLaw(r, law.cycles, True, law.thickness)
        start = np.array([*solution.p, LOADING, UNLOADING])
        try:
            low, high = free.exponents(solve(free, data.values, start).p)
        except NoSolutionError:
            return p_value, flaw
        flaw = f"exponents of {low:.3g} and {high:.3g} describe it better than {LOADING:g} and {UNLOADING:g}"
    return p_value, flaw


def _notes(law: PackLaw, table: Readings, solution: Solution) -> list[str]:
    """Return remarks on missing unloading rows and on misfits of the largest indentation of a cycle."""
    if not len(law.turns):
        return ["without rows of unloading the hysteresis of the pack is taken from equation (5), not tested"]
    sentences = []
    depth = table.values["indentation"]
    for k, turn in enumerate(law.turns):
        largest = float(depth[law.cycles.cycle == turn].max())
        meeting = float(np.exp(solution.p[1 + k])) * law.thickness
        error = solution.standard_errors[1 + k] * meeting
        if abs(meeting - largest) > max(_MEETS * largest, 5.0 * error):
            sentences.append(
                f"cycle {turn + 1}: loading and unloading meet at an indentation of {meeting:.4g} m, while"
                f" the largest measured is {largest:.4g} m"
            )
    return sentences
