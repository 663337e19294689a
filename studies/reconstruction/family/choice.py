"""The choice of clearly different hammers.

Two hammers are clearly different if at least three of their constants are at least a tenth apart, a distance
being ``|a - b| / min(|a|, |b|)``. Two changes of the constants leave the motion as it is, and must not count:
mass and all forces scale together, and so do the current and 1 / Bm. Hammers are therefore compared twice, as
they are and brought to a common print force and a common current; they have to differ both times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from studies.reconstruction.search.space import CURRENT, PRINT_FORCE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from printhammer.support.arrays import FloatArray

APART: Final = 0.1  # Relative difference from which two values of a constant count as different; arbitrary

CONSTANTS_APART: Final = 3  # Least number of constants in which two hammers differ by that much; arbitrary

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
"""Exponent with which a constant of that SI unit scales when mass and all forces are multiplied; else 0."""

CURRENT_POWERS: Final[dict[str, float]] = {"A": 1.0, "N^0.5 m^0.25/A": -1.0}
"""Exponent with which a constant of that SI unit scales when all currents are multiplied; else 0."""


def scaled(
    constants: Mapping[str, float], units: Mapping[str, str], force: float = 1.0, current: float = 1.0
) -> dict[str, float]:
    """Return constants with the same motion: all forces and the mass times `force`, currents times `current`.

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
    """Return constants with the same motion, normalized to the print force and current of the search.

    See `scaled`; `print_force` is the peak force, N, of the dot of a single pulse with these constants.
    """
    amplitude = constants["waveform.amplitude"]
    return scaled(constants, units, PRINT_FORCE / print_force, CURRENT / amplitude)


def distances(constants: FloatArray, others: FloatArray) -> FloatArray:
    """Return the distances of one hammer from others: the third largest relative difference of a constant.

    Two hammers are clearly different where this is at least `APART`. `constants` has shape (k,), `others`
    (n, k); the result has shape (n,).
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
    """Choose at most `count` pairwise clearly different hammers; return their indices.

    Each of the `tables` (n, k) holds the constants of all candidates in one normalization, the best candidate
    first. The choice is greedy and deterministic: with `wide`, the candidate farthest from all chosen so far
    is taken next (farthest-point sampling), which spreads the family; otherwise the nearest one that is still
    clearly different, which makes the family large. `accept` is called with each index before it is chosen; a
    candidate for which it returns false is skipped.
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
