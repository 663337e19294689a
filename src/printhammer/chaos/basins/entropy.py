"""Basin entropy: how uncertain it is to which attractor a state leads that is known up to a box.

A. Daza, A. Wagemakers, B. Georgeot, D. Guéry-Odelin and M. A. F. Sanjuán, Basin entropy: a new tool to
analyze uncertainty in dynamical systems, Scientific Reports 6 (2016) 31416.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, SupportsIndex

import numpy as np

from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.results import Declared, part

if TYPE_CHECKING:
    import numpy.typing as npt

BOX: Final = 4
"""Cells along the side of a box unless told otherwise."""


class BasinEntropy(Declared):
    """Basin entropy, natural logarithms."""

    box: int = part("cells along the side of a box")
    boxes: int = part("number N of whole boxes with at least one decided cell")
    boundary_boxes: int = part("number Nb of those in which cells lead to more than one attractor")
    entropy: float = part(
        "S / N, with S the sum over the boxes of -sum p ln p, p being the shares of the attractors in the"
        " decided cells of the box",
        more="NaN without boxes",
    )
    boundary_entropy: float = part(
        "S / Nb; NaN where no box has more than one attractor",
        more="more than ln 2 shows that the boundary is fractal; less shows nothing",
    )
    left_out: int = part("cells that are in no whole box, or not decided")

    @property
    def fractal(self) -> bool:
        """Whether the boundary entropy exceeds ln 2, which a boundary that is no fractal cannot."""
        return self.boundary_entropy > math.log(2.0)


def basin_entropy(labels: npt.ArrayLike, *, box: SupportsIndex = BOX) -> BasinEntropy:
    """Compute the basin entropy of a plane of labels.

    Parameters
    ----------
    labels : int array, shape (n, m)
        Number of the attractor to which each cell leads, from 1 on; 0 and less where it is not known, which
        leaves the cell out.
    box : int, optional
        Cells along the side of a box; cells beyond the last whole box are left out.

    Raises
    ------
    InputError
        No plane of whole numbers, or a box that is not from 1 to the shorter side.
    """
    plane = np.asarray(labels)
    if plane.ndim != 2 or not plane.size or plane.dtype.kind not in "iu":
        raise InputError(f"labels: shape {plane.shape}, expected a plane of whole numbers")
    side = read_count(box, "box")
    if side > min(plane.shape):
        raise InputError(f"box = {box!r}, expected at most {min(plane.shape)} cells")
    rows, columns = (count // side for count in plane.shape)
    cut = plane[: rows * side, : columns * side].reshape(rows, side, columns, side)
    boxes = cut.transpose(0, 2, 1, 3).reshape(rows * columns, side * side)
    kinds = np.unique(boxes[boxes > 0])
    counts = np.stack([(boxes == kind).sum(axis=1) for kind in kinds], axis=1) if kinds.size else None
    if counts is None:
        return BasinEntropy(side, 0, 0, math.nan, math.nan, int(plane.size))
    decided = counts.sum(axis=1)
    counts = counts[decided > 0]
    shares = counts / counts.sum(axis=1, keepdims=True)
    each = -(shares * np.log(np.where(shares > 0.0, shares, 1.0))).sum(axis=1)
    mixed = int(((counts > 0).sum(axis=1) > 1).sum())
    total = float(each.sum())
    return BasinEntropy(
        box=side,
        boxes=len(counts),
        boundary_boxes=mixed,
        entropy=total / len(counts),
        boundary_entropy=total / mixed if mixed else math.nan,
        left_out=int(plane.size - decided.sum()),
    )
