"""How a burst of least work fares when the supply gives another current than it was planned for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from printhammer.errors import InputError
from printhammer.run.ensemble import Ensemble

if TYPE_CHECKING:
    import numpy.typing as npt

    from printhammer.drive.sequence import PulseSequence
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray


@dataclass(frozen=True)
class SupplyCheck:
    """One burst with every current larger or smaller: arrays of shape (n,).

    Attributes
    ----------
    changes : array
        Relative change of every current: 0.03 for 3 % more.
    adequate : int array
        Number of dots in their slots with the force asked for, and without extra contacts.
    weakest : array
        Force of the weakest dot, in parts of that of the single pulse; 0 where one is lost.
    spread : array
        Largest deviation of a touch from its slot, s; NaN where a dot is lost.
    status : str array
        How the runs ended.
    """

    changes: FloatArray
    adequate: npt.NDArray[np.int64]
    weakest: FloatArray
    spread: FloatArray
    status: npt.NDArray[np.str_]


def supply_check(
    hammer: Hammer,
    drive: PulseSequence,
    end: float,
    slots: FloatArray,
    *,
    rate: float,
    single: float,
    least: float,
    changes: npt.ArrayLike,
) -> SupplyCheck:
    """Run the drive of a burst with every current changed, in one ensemble.

    Parameters
    ----------
    hammer, drive, end
        What is run, and how long, s.
    slots : array, shape (dots,)
        Times at which the dots are to touch, s.
    rate : float
        Dots per second, Hz.
    single, least : float
        Force of the single pulse, N, and least force of a dot in parts of it.
    changes : array
        Relative changes of the current, each above -1.

    Raises
    ------
    InputError
        A change is not a finite number above -1.
    """
    factors = 1.0 + np.atleast_1d(np.asarray(changes, dtype=np.float64))
    if factors.ndim != 1 or not (np.isfinite(factors) & (factors > 0.0)).all():
        raise InputError(f"changes = {changes!r}, expected relative changes of the current above -1")
    drives = [drive.scaled(factor) for factor in factors.tolist()]
    result = Ensemble(hammer, drives, end).run(dots=True, engine="plain")
    dots = result.dots
    assert dots is not None
    touched = np.where(dots.struck, dots.fired_at + dots.flight_time, np.inf)
    away = np.abs(touched[:, :, np.newaxis] - slots)
    # The dot of a slot is the touch nearest to it, wherever its pulse was fired.
    which = away.argmin(axis=1)
    late = away.min(axis=1)
    rows = np.arange(len(drives))[:, np.newaxis]
    made = late < 0.5 / rate
    force = np.where(made, np.nan_to_num(dots.peak_force[rows, which]) / single, 0.0)
    good = made & (dots.extra_contacts[rows, which] == 0) & (force >= least)
    return SupplyCheck(
        changes=factors - 1.0,
        adequate=good.sum(axis=1),
        weakest=force.min(axis=1),
        spread=np.where(made.all(axis=1), late.max(axis=1), np.nan),
        status=np.array(result.status_names, "U16"),
    )
