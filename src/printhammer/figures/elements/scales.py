"""Axes in both unit systems, as in the paper: SI left and below, inches and pounds right and above."""

from __future__ import annotations

from functools import lru_cache
from typing import Final, Literal

import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axes._secondary_axes import SecondaryAxis

from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray
from printhammer.units import from_si

Name = Literal["displacement", "velocity", "force", "time", "current"]


class Scale(Declared):
    """Scale of an axis: name, SI unit, display unit, and display unit of the secondary axis."""

    label: str = part("name on the axis")
    si: str = part("SI unit of the data")
    unit: str = part("display unit of the numbers on the axis")
    other: str = part("display unit of the secondary axis; empty without such an axis", default="")

    @property
    def factor(self) -> float:
        """Factor from the SI unit to the display unit."""
        return _factor(self.si, self.unit)

    @property
    def ratio(self) -> float:
        """Factor from the display unit to the unit of the secondary axis."""
        return _factor(self.si, self.other) / self.factor

    @property
    def sign(self) -> str:
        """Symbol of the display unit, such as "µm"."""
        return _SIGNS.get(self.unit, self.unit)

    def shown(self, values: npt.ArrayLike) -> FloatArray:
        """Convert values in the SI unit to the display unit."""
        import numpy as np

        return np.asarray(values, dtype=np.float64) * self.factor


_SIGNS: Final = {"um": "µm", "mil": "10⁻³ in"}
_SCALES: Final[dict[str, tuple[tuple[float, Scale], ...]]] = {
    "displacement": (
        (5e-3, Scale("Displacement", "m", "um", "mil")),
        (5.0, Scale("Displacement", "m", "mm", "in")),
        (float("inf"), Scale("Displacement", "m", "m", "in")),
    ),
    "velocity": ((float("inf"), Scale("Velocity", "m/s", "m/s", "in/s")),),
    "force": ((float("inf"), Scale("Force", "N", "N", "lbf")),),
    "time": ((0.5, Scale("Time", "s", "ms")), (float("inf"), Scale("Time", "s", "s"))),
    "current": ((float("inf"), Scale("Current", "A", "A")),),
}


def scale(name: Name, largest: float = 0.0) -> Scale:
    """Choose the scale of a quantity, with display units suited to magnitudes up to `largest`, SI."""
    return next(shown for limit, shown in _SCALES[name] if largest <= limit)


def label(ax: Axes, side: Literal["x", "y"], shown: Scale, name: str = "") -> SecondaryAxis | None:
    """Label an axis with its unit; return the secondary axis in the other unit system, or None.

    The data of the axes are in `shown.unit`; `name` overrides the name of the scale.
    """
    name = name or shown.label
    text = f"{name}  [{shown.sign}]".replace("\n  ", "\n") if shown.unit != "1" else name
    if side == "x":
        ax.set_xlabel(text)
    else:
        ax.set_ylabel(text)
    if not shown.other:
        ax.tick_params(axis=side, top=side == "x", right=side == "y")
        return None
    ratio = shown.ratio
    functions = (lambda values: values * ratio, lambda values: values / ratio)
    other = f"[{_SIGNS.get(shown.other, shown.other)}]"
    if side == "x":
        opposite = ax.secondary_xaxis("top", functions=functions)
        opposite.set_xlabel(other)
    else:
        opposite = ax.secondary_yaxis("right", functions=functions)
        opposite.set_ylabel(other)
    return opposite


@lru_cache(maxsize=64)
def _factor(si: str, unit: str) -> float:
    return from_si(1.0, si, unit)
