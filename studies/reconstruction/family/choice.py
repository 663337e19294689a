"""Selection of clearly different hammers.

Two hammers are clearly different if at least three of their constants have a relative difference, ``|a - b| /
min(|a|, |b|)``, of at least a tenth. Two scalings leave the motion unchanged and must not count as
differences: mass and all forces multiplied by one factor, and current and 1 / Bm multiplied by one factor.
Hammers are therefore compared twice, with their own constants and with constants scaled to a common print
force and current; they have to differ in both comparisons.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from studies.reconstruction.search.space import CURRENT, PRINT_FORCE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from printhammer.support.arrays import FloatArray

APART: Final = 0.1  # Relative difference from which two values of a constant count as different; arbitrary

CONSTANTS_APART: Final = 3  # Number of constants in which clearly different hammers differ; arbitrary

FORCE_POWERS: Final[dict[str, float]] = {
    "kg": 1.0,
    "N": 1.0,
    "N/m": 1.0,
    "N s/m": 1.0,
    "N/m^1.5": 1.0,
    "N s/m^2.5": 1.0,
    "N^0.5 m^0.25": 0.5,
    "N^0.5 m^0.25/A": 0.5,
}
"""Exponents, by SI unit, with which constants scale with mass and all forces; 0 for other units."""

CURRENT_POWERS: Final[dict[str, float]] = {"A": 1.0, "N^0.5 m^0.25/A": -1.0}
"""Exponents, by SI unit, with which constants scale with all currents; 0 for other units."""


def scaled(
    constants: Mapping[str, float], units: Mapping[str, str], force: float = 1.0, current: float = 1.0
) -> dict[str, float]:
    """Return constants with the same motion: mass and forces scaled by `force`, currents by `current`.

    `constants` are in SI, `units` their SI units, both by key of a hammer file.
    """
    return {
        key: value
        * force ** FORCE_POWERS.get(units[key], 0.0)
        * current ** CURRENT_POWERS.get(units[key], 0.0)
        for key, value in constants.items()
    }


def at_gauge(
    constants: Mapping[str, float], units: Mapping[str, str], print_force: float
) -> dict[str, float]:
    """Return constants with the same motion, scaled to the print force and current of the search.

    See `scaled`; `print_force` is the peak force [N] of the dot of a single pulse with these constants.
    """
    amplitude = constants["waveform.amplitude"]
    return scaled(constants, units, PRINT_FORCE / print_force, CURRENT / amplitude)


def distances(constants: FloatArray, others: FloatArray) -> FloatArray:
    """Return distances between hammers: the third largest relative difference of the constants.

    Two hammers are clearly different if this distance is at least `APART`. `constants` has shape (k,),
    `others` (n, k); the result has shape (n,).
    """
    least = np.minimum(np.abs(constants), np.abs(others))
    apart = np.abs(others - constants)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(apart == 0.0, 0.0, apart / least)
    return np.asarray(np.sort(relative, axis=1)[:, -CONSTANTS_APART], dtype=np.float64)


def choose(
    tables: Sequence[FloatArray],
    count: int,
    accept: Callable[[int], bool] = lambda _: True,
    *,
    wide: bool = True,
) -> list[int]:
    """Select at most `count` pairwise clearly different hammers; return their indices.

    Each of the `tables` (n, k) contains the constants of all candidates in one scaling, the best candidate
    first. The selection is greedy and deterministic: with `wide`, the next member is the candidate farthest
    from all selected hammers (farthest-point sampling), which spreads the family; otherwise the nearest
    candidate that is still clearly different, which makes the family large. `accept` is called with the index
    of each candidate; a candidate for which `accept` returns false is skipped.
    """
    total = len(tables[0]) if tables else 0
    nearest: FloatArray = np.full(total, np.inf)
    open_ = np.ones(total, dtype=np.bool_)
    chosen: list[int] = []
    while len(chosen) < count:
        possible = np.flatnonzero(open_ & (nearest >= APART))
        if not possible.size:
            break
        order = nearest[possible]
        pick = int(possible[np.argmax(order) if wide else np.argmin(order)])
        open_[pick] = False
        if not accept(pick):
            continue
        chosen.append(pick)
        for table in tables:
            nearest = np.minimum(nearest, distances(table[pick], table))
    return chosen
