"""The window in which strobe points are drawn, and in whose half-widths their distances are measured."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.results import Declared, scalar
from printhammer.run.problem import scales_of

if TYPE_CHECKING:
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import BoolArray, FloatArray

PAPER_X: Final = (38.1e-6, 88.9e-6)
"""Displacements of the window of Fig. 11 of Hendriks (1983), m: 0.0015 to 0.0035 in."""

PAPER_V: Final = (-0.635, 0.635)
"""Velocities of the same, m/s: -25 to +25 in/s."""

PAPER_BACKSTOP: Final = 50.8e-6
PAPER_FRONT: Final = 203.2e-6

_SAME: Final = 1e-3
_PART: Final = 1.0 / 6.0


class Window(Declared):
    """A rectangle in the plane of displacement and velocity."""

    x: tuple[float, float] = scalar("m", "least and largest displacement")
    v: tuple[float, float] = scalar("m/s", "least and largest velocity")

    @property
    def half_widths(self) -> FloatArray:
        """Half-widths, m and m/s, shape (2,)."""
        return 0.5 * np.array([self.x[1] - self.x[0], self.v[1] - self.v[0]])

    def inside(self, x: FloatArray, v: FloatArray) -> BoolArray:
        """Whether states lie inside, shape (n,)."""
        return (self.x[0] <= x) & (x <= self.x[1]) & (self.v[0] <= v) & (v <= self.v[1])


PAPER_WINDOW: Final = Window(PAPER_X, PAPER_V)
"""The window of Fig. 11."""


def window_of(hammer: Hammer, drive: Drive) -> Window:
    """Return the window of a hammer under a drive.

    That of Fig. 11 for a hammer whose backstop and pack are where the paper has them. For others its
    half-widths are a sixth of the way from backstop to pack, as in Fig. 11, and a sixth of the speed that
    the largest force gives the armature over that way; where a hammer lacks one of them and nothing bounds
    the motion, the whole of its scales (`printhammer.run.problem.scales_of`). As in Fig. 11 the backstop, or
    the origin, lies a quarter of its width from the left.
    """
    place, front = hammer.position, hammer.front
    if (
        place is not None
        and front is not None
        and math.isclose(place, PAPER_BACKSTOP, rel_tol=_SAME)
        and math.isclose(front, PAPER_FRONT, rel_tol=_SAME)
    ):
        return PAPER_WINDOW
    part = _PART if place is not None and front is not None else 1.0
    way, speed = (part * scale for scale in scales_of(hammer, drive, (hammer.origin, 0.0)))
    return Window((hammer.origin - 0.5 * way, hammer.origin + 1.5 * way), (-speed, speed))
