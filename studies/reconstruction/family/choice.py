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

APART: Final = 0.1  # Distance from which on two values of a constant count as different

CONSTANTS_APART: Final = 3  # Number of constants in which two hammers are that far apart at least

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
"""Power of a common factor of mass and forces with which a constant of that SI unit scales; else 0."""

CURRENT_POWERS: Final[dict[str, float]] = {"A": 1.0, "N^0.5 m^0.25/A": -1.0}
"""Power of a factor of the current with which a constant of that SI unit scales; else 0."""


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
    """Return constants with the same motion at the common print force and current of the search.

    As `scaled`; `print_force` is the peak force of the single-pulse dot with these constants, N.
    """
    amplitude = constants["waveform.amplitude"]
    return scaled(constants, units, PRINT_FORCE / print_force, CURRENT / amplitude)


def distances(constants: FloatArray, others: FloatArray) -> FloatArray:
    """Return how far a hammer is from others, shape (n,): its third largest distance of a constant.

    Two hammers are clearly different where this is at least `APART`. The `constants` of the one have
    shape (k,), those of the others (n, k).
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
    """Choose hammers, `count` at most, any two of them clearly different; return their numbers.

    The `tables` (n, k) hold the constants of the candidates, the best candidates first, in each way in which
    they are compared. `accept` is asked of a candidate that would be chosen; where it says no, another one
    is. The next one is the farthest from all chosen so far, for a `wide` family, or else the nearest of those
    that are far enough, for a large one. The first candidate that is accepted comes first, and the choice is
    the same for the same tables.
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
