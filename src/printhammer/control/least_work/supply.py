"""How a burst of least work fares when the supply gives another current than it was planned for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

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
