"""The pack from its force against indentation: the stiffness AiEp of equation (5), the exponents if asked.

    loading    F = S r^p                    r = indentation / d,  p = 2.7,  q = 11
    unloading  F = S rho^(p - q) r^q        rho = r at the turning point

Data: the columns ``indentation`` from the front of the pack, ``force`` as a magnitude, and ``branch``,
"loading" or "unloading"; rows in the order measured. Without ``branch`` it follows from the sense of the
indentation. The turning point of each cycle is fitted with the constants, not read off: the unloading force
depends on its 8.3th power, and the largest indentation measured is too large by the noise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import NoSolutionError, Solution, solve
from printhammer.identify.static.assemble import Data, assemble, enough, solved
from printhammer.identify.static.checks import judge
from printhammer.identify.static.pack_cycles import Cycles, check_loading, cycles_of
from printhammer.identify.tables import Readings, read_table

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.identify.result import Fit
    from printhammer.support.arrays import FloatArray

LOADING, UNLOADING = 2.7, 11.0
"""Exponents of equation (5)."""

_SPARE: Final = 4
_LOADING_ROWS: Final = 4
_MEETS: Final = 0.02
"""Part of the largest indentation by which the branches may meet elsewhere without a word."""

_FAR: Final = 1.0
"""Logarithm of how far from the largest indentation they may meet at all."""


class PackLaw:
    """Equation (5) at measured indentations over the thickness of the pack, r, shape (m,).

    p = [S, ln rho of each cycle with unloading rows], and the two exponents at its end if they are fitted. An
    error of the indentation has its slope over the thickness, m.
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
        """Return the force, N."""
        low, high = self.exponents(p)
        power = low * self.log_r
        if len(self.turns):
            depth = p[1 + self.column]
            power = np.where(self.cycles.unloading, low * depth + high * (self.log_r - depth), power)
        return np.where(self.inside, p[0] * np.exp(power), 0.0)

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return its derivatives by the parameters."""
        force, (low, high) = self.value(p), self.exponents(p)
        columns = [force / p[0]]
        for k in range(len(self.turns)):
            mine = self.cycles.unloading & (self.column == k)
            columns.append(np.where(mine, (low - high) * force, 0.0))
        if self.free:
            columns += self.by_exponents(p)
        return np.column_stack(columns)

    def by_exponents(self, p: FloatArray) -> list[FloatArray]:
        """Return the derivatives of the force by the two exponents."""
        force, out = self.value(p), self.cycles.unloading
        depth = p[1 + self.column] if len(self.turns) else np.zeros_like(force)
        return [np.where(out, depth, self.log_r) * force, np.where(out, (self.log_r - depth) * force, 0.0)]

    def spread(self, p: FloatArray) -> FloatArray:
        """Return the components of the variance: force, force in proportion, indentation."""
        force, (low, high) = self.value(p), self.exponents(p)
        steep = np.where(self.cycles.unloading, high, low) / (np.exp(self.log_r) * self.thickness)
        return np.column_stack([np.ones_like(force), force**2, (steep * force) ** 2])

    def exponents(self, p: FloatArray) -> tuple[float, float]:
        """Return the exponents of loading and unloading."""
        return (float(p[-2]), float(p[-1])) if self.free else (LOADING, UNLOADING)


def fit_pack(path: str | Path, *, thickness: float, exponents: bool = False, robust: bool = True) -> Fit:
    """Fit "pack.stiffness" to a table with the columns ``indentation``, ``force`` and perhaps ``branch``.

    The thickness d of the pack, platen less front, is in m. With `exponents` those of loading and unloading
    are fitted too, instead of 2.7 and 11. See `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        The table cannot be used or is too small, a branch is missing, or the force falls on the loading
        branch.
    """
    if not thickness > 0.0:
        raise InputError(f"the thickness of the pack is {thickness:g} m, expected more than 0 m")
    table = read_table(path, {"indentation": "m", "force": "N"}, text={"branch": ("loading", "unloading")})
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
    enough(data, law.parameters + _SPARE, "the stiffness of the pack, the turning points and their errors")
    if exponents and not len(cycles.unloaded):
        raise InputError(
            f"{table.path}: no rows of unloading, expected some, or their exponent cannot be found"
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
    """Return the parameters to begin with; refuse too few or negative forces of loading in the pack."""
    force, cycles = table.values["force"], law.cycles
    rows = np.flatnonzero(law.inside & ~cycles.unloading)
    if len(rows) < _LOADING_ROWS:
        raise InputError(
            f"{table.path}: {len(rows)} rows of loading inside the pack, expected {_LOADING_ROWS} or more, or"
            " the stiffness cannot be found"
        )
    deep = rows[np.argsort(law.log_r[rows], kind="stable")[len(rows) // 2 :]]
    stiffness = float(np.median(force[deep] * np.exp(-LOADING * law.log_r[deep])))
    if stiffness <= 0.0:
        raise InputError(
            f"{table.path}: the forces of loading are not positive, expected magnitudes, whatever their"
            " direction"
        )
    turns = [law.log_r[law.inside & (cycles.cycle == turn)].max() for turn in law.turns]
    return np.array([stiffness, *turns, *([LOADING, UNLOADING] if law.free else [])])


def _check_turns(law: PackLaw, table: Readings, solution: Solution) -> None:
    """Refuse a load cycle whose branches meet nowhere near what was measured."""
    for turn, meeting in zip(law.turns, solution.p[1:], strict=False):
        rows = np.flatnonzero(law.inside & (law.cycles.cycle == turn))
        if abs(meeting - law.log_r[rows].max()) > _FAR:
            raise InputError(
                f"{table.path}: lines {table.lines[rows[0]]} to {table.lines[rows[-1]]} are a load cycle"
                " whose loading and unloading do not meet, expected rows in the order of the measurement"
            )


def _judge(law: PackLaw, data: Data, solution: Solution) -> tuple[float, str]:
    """Test the exponents of equation (5); return the probability, and why they are rejected."""
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
    """Say what is missing, and where the branches meet elsewhere than at the largest indentation."""
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
