"""The magnet from forces against displacement and current: F0, Am and Bm of equation (3).

    F(x, I) = F0 - (Am - Bm I)^2 / sqrt(x) + Bs - (Bs / As)(x - b)

Data: the columns ``displacement``, ``current``, ``force``, the static force of magnet and spring together,
positive toward the paper; and, to tell both apart, a table of the spring alone.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.static.assemble import Data, assemble, enough, solved
from printhammer.identify.static.checks import judge
from printhammer.identify.static.magnet_law import TotalLaw, start_of
from printhammer.identify.static.spring import start_of as spring_start
from printhammer.identify.tables import Readings, read_table

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.identify.result import Fit
    from printhammer.support.arrays import FloatArray, IntArray

_SPARE: Final = 4
"""Rows more than parameters, for the errors and the test of the law."""

_LEVELS: Final = 12
"""Currents that are shown one by one; of more, all are one series."""

_COMBINED: Final = "magnet.F0 + spring.Bs (1 + b / spring.As)"
_SLOPE: Final = "spring.Bs / spring.As"
_ZERO: Final = "zero of the displacement"


def fit_magnet(
    path: str | Path,
    *,
    position: float | None = None,
    spring: str | Path | None = None,
    zero: float | None = 0.0,
    robust: bool = True,
) -> Fit:
    """Fit the magnet, and with it the spring.

    The table has the columns ``displacement``, ``current`` and ``force``, of magnet and spring together;
    `spring` is one of the spring alone, without currents, which needs the position b of the backstop, m.
    `zero` is what the displacement sensor shows at x = 0, m; None to fit it. Found are "magnet.F0",
    "magnet.Am", "magnet.Bm", "spring.Bs" and "spring.As"; without a table of the spring only "magnet.Am",
    "magnet.Bm" and the two combinations that the forces determine. See `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        A table cannot be used or is too small, its force never releases the armature, or a constant is not
        told from zero.
    """
    table = read_table(path, {"displacement": "m", "current": "A", "force": "N"})
    alone = None if spring is None else read_table(spring, {"displacement": "m", "force": "N"})
    if alone is not None and position is None:
        raise InputError(f"{alone.path}: the position of the backstop is missing, expected it with a spring")
    data = _data(table, alone)
    x = data.abscissa
    # NaN where there is no magnet.
    current = np.concatenate([table.values["current"], np.full(0 if alone is None else len(alone), math.nan)])
    law = TotalLaw(x, current, position if alone is not None else None, zero)
    enough(data, law.parameters + _SPARE, "the constants of the magnet and their errors")
    levels = _check(table, alone, zero or 0.0, position)
    start = start_of(table, levels, zero or 0.0)
    if alone is not None and position is not None:
        travel = alone.values["displacement"] - (zero or 0.0) - position
        pair = spring_start(alone.path, travel, alone.values["force"])
        start[0] -= pair[0] * (1.0 + position / pair[1])
        start = np.array([*start[:3], *pair])
    if zero is None:
        start = np.append(start, 0.0)
    solution = solved(data, law, start, robust=robust)
    _releases(table, law, solution.p, zero, position)
    p_value, why = judge(solution, law.richer(solution.p, by_current=levels != 2), x, data.series)
    wide, strong = "more rows over a wider span of displacement", "more currents over a wider span"
    remedies = {"magnet.Am": wide, "magnet.Bm": strong, "magnet.F0": wide, "spring.Bs": wide}
    return assemble(
        data,
        law,
        solution,
        _names(alone is not None, zero is None),
        given=_given(position, zero, alone is not None),
        remedies={**remedies, "spring.As": wide},
        indistinct=_indistinct(alone is not None, levels),
        rejected=why,
        p_value=p_value,
    )


def _data(table: Readings, alone: Readings | None) -> Data:
    x, current, force = (table.values[name] for name in ("displacement", "current", "force"))
    series = np.zeros(len(x), dtype=np.int64)
    names: tuple[str, ...] = ("magnet and spring",)
    groups = clusters(current)
    if 1 < groups <= _LEVELS:
        series = group_of(current)
        digits = 2 - math.floor(math.log10(float(np.ptp(current))))
        means = [round(float(np.mean(current[series == group])), digits) for group in range(groups)]
        names = tuple(f"{mean + 0.0:g} A" for mean in means)
    files: tuple[Path, ...] = (table.path,)
    lines = table.lines
    if alone is not None:
        more = len(alone)
        x = np.concatenate([x, alone.values["displacement"]])
        force = np.concatenate([force, alone.values["force"]])
        series = np.concatenate([series, np.full(more, len(names))])
        lines = np.concatenate([lines, alone.lines])
        names, files = (*names, "spring alone"), (table.path, alone.path)
    axes = (("displacement", "m"), ("force", "N"))
    return Data(files, "magnet", x, force, axes, series, names, lines)


def _check(table: Readings, alone: Readings | None, zero: float, position: float | None) -> int:
    """Refuse a table that allows no fit; return the number of different currents, 0 for very many."""
    x, current, force = (table.values[name] for name in ("displacement", "current", "force"))
    low = int(np.argmin(x))
    if x[low] <= zero:
        where = f"{table.path}: line {table.lines[low]}: displacement {x[low]:.6g} m"
        raise InputError(f"{where}, expected more than {zero:g} m, where equation (3) ends")
    levels = clusters(current)
    if levels == 1:
        raise InputError(
            f"{table.path}: all forces are at {current[0]:.4g} A, expected 2 or more currents, or magnet.Bm"
            " cannot be found"
        )
    places, needed = clusters(x), 3 if alone is not None else 4
    if 0 < places < needed:
        raise InputError(
            f"{table.path}: {places} different displacements, expected {needed} or more, or the pull cannot"
            " be told from the spring"
        )
    near = x <= max(x.min(), position or 0.0) + 0.02 * np.ptp(x)
    if force[near].max() <= 0.0:
        raise InputError(_never(table, float(x[near].max()), float(force[near].max())))
    return levels


def _never(table: Readings, place: float, force: float) -> str:
    largest = table.values["current"].max()
    return (
        f"{table.path}: the force never releases the armature, at {place:.4g} m it is {force:.3g} N at best,"
        f" expected a positive one at a current measured (up to {largest:.4g} A)"
    )


def _releases(
    table: Readings, law: TotalLaw, p: FloatArray, zero: float | None, position: float | None
) -> None:
    """Refuse constants with which the force never becomes positive where the armature rests."""
    offset = float(p[-1]) if zero is None else zero
    place = float(table.values["displacement"].min()) - offset if position is None else position
    currents = np.unique(table.values["current"])
    best = float(law.at(p, np.full(len(currents), place), currents).max())
    if best <= 0.0:
        raise InputError(_never(table, place, best))


def _names(with_spring: bool, with_zero: bool) -> list[tuple[str, str, bool]]:
    pull = [("magnet.Am", "N^0.5 m^0.25", True), ("magnet.Bm", "N^0.5 m^0.25/A", True)]
    if with_spring:
        names = [("magnet.F0", "N", True), *pull, ("spring.Bs", "N", True), ("spring.As", "m", True)]
    else:
        names = [(_COMBINED, "N", False), *pull, (_SLOPE, "N/m", False)]
    return [*names, (_ZERO, "m", False)] if with_zero else names


def _given(position: float | None, zero: float | None, with_spring: bool) -> dict[str, str]:
    given = {"backstop.position": f"{position!r} m"} if with_spring else {}
    return given if zero is None or zero == 0.0 else {**given, _ZERO: f"{zero!r} m"}


def _indistinct(with_spring: bool, levels: int) -> list[str]:
    sentences = []
    if not with_spring:
        sentences.append(
            "F0, Bs and As cannot be told apart by forces of magnet and spring together: only"
            f" {_COMBINED} and {_SLOPE} are found; a table of the spring alone would tell them apart"
        )
    if levels == 2:
        sentences.append(
            "two currents do not tell a current that weakens the pull from one beyond Am / Bm, where the pull"
            " grows again; it is taken as weakening"
        )
    return sentences


def clusters(values: FloatArray) -> int:
    """Count the groups into which values fall, with gaps of a twentieth of their span; 0 for a continuum."""
    if float(np.ptp(values)) <= 1e-3 * float(np.abs(values).max()):
        return 1
    groups = 1 + int(group_of(values).max())
    return groups if groups > 1 else 0


def group_of(values: FloatArray) -> IntArray:
    """Return to which of these groups each value belongs, from 0 for the least."""
    order = np.argsort(values, kind="stable")
    apart = np.diff(values[order]) > 0.05 * float(np.ptp(values))
    group = np.empty(len(values), dtype=np.int64)
    group[order] = np.concatenate([[0], np.cumsum(apart)])
    return group
