"""Ink on paper: round dots of given optical densities, drawn into an array.

Where dots overlap, their densities add. The rim of a dot is soft over a tenth of its diameter, or a pixel and
a half where that is more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from printhammer.support.arrays import FloatArray

PAPER: Final = (252, 250, 243)
INK: Final = (24, 24, 38)
"""Colours, red, green, blue, of paper and of ink that lets no light through."""

MOST_PIXELS: Final = 24_000_000
"""Size above which a sheet is drawn more coarsely."""

_SOFT: Final = 0.1
_PIXELS: Final = 1.5
_TOGETHER: Final = 1_000_000


@dataclass(frozen=True)
class Sheet:
    """A part of the paper."""

    left: float
    right: float
    top: float
    bottom: float
    """Its edges, m: across, and downward."""

    @property
    def width(self) -> float:
        """From left to right, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """From top to bottom, m."""
        return self.bottom - self.top

    def pixels(self, finest: float) -> tuple[float, int, int]:
        """Return size, m, of a pixel, not below the finest, and number of rows and columns of pixels."""
        size = max(finest, (self.width * self.height / MOST_PIXELS) ** 0.5)
        return size, max(1, round(self.height / size)), max(1, round(self.width / size))


def inked(
    sheet: Sheet, across: FloatArray, down: FloatArray, density: FloatArray, diameter: float, finest: float
) -> FloatArray:
    """Return the optical density on a sheet.

    Parameters
    ----------
    sheet : Sheet
        Where.
    across, down : array, shape (N,)
        Middles of the dots, m; those off the sheet are left out as far as they are off it.
    density : array, shape (N,)
        Their optical densities.
    diameter : float
        Of every dot, m.
    finest : float
        Size of a pixel, m.

    Returns
    -------
    array, shape (rows, columns)
        Optical densities from top left.
    """
    size, rows, columns = sheet.pixels(finest)
    radius = 0.5 * diameter / size
    soft = max(2.0 * radius * _SOFT, _PIXELS)
    reach = int(np.ceil(radius + soft)) + 1
    x, y = (across - sheet.left) / size - 0.5, (down - sheet.top) / size - 0.5
    on = (x > -reach) & (x < columns + reach) & (y > -reach) & (y < rows + reach)
    # A border as wide as a dot reaches twice saves telling which of its pixels lie on the sheet.
    border = 2 * reach + 1
    x, y, ink = x[on] + border, y[on] + border, density[on]
    wide = columns + 2 * border
    whole = np.zeros((rows + 2 * border) * wide)
    near = np.arange(-reach, reach + 1)
    together = max(1, _TOGETHER // near.size**2)
    for first in range(0, ink.size, together):
        part = slice(first, first + together)
        column, row = np.floor(x[part]).astype(np.int64), np.floor(y[part]).astype(np.int64)
        from_x = near + (column - x[part])[:, np.newaxis]
        from_y = near + (row - y[part])[:, np.newaxis]
        far = np.sqrt(from_x[:, np.newaxis, :] ** 2 + from_y[:, :, np.newaxis] ** 2)
        cover = np.clip((radius - far) / soft + 0.5, 0.0, 1.0) * ink[part, np.newaxis, np.newaxis]
        place = (row * wide + column)[:, np.newaxis, np.newaxis] + (near[:, np.newaxis] * wide + near)
        np.add.at(whole, place.reshape(-1), cover.reshape(-1))
    return whole.reshape(-1, wide)[border : border + rows, border : border + columns]


def coloured(density: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return the picture of paper with ink of some densities, shape (rows, columns, 3)."""
    back = np.exp(-math.log(10.0) * np.asarray(density, np.float32))[..., np.newaxis]
    ink, paper = np.array(INK, np.float32), np.array(PAPER, np.float32)
    return np.asarray(ink + back * (paper - ink) + np.float32(0.5), np.uint8)
