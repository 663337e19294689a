"""Correlation dimension of an attractor by the Grassberger-Procaccia algorithm, with an error interval.

The correlation sum C(r) is the fraction of pairs of states closer than r; on an attractor of dimension D2 it
scales as r^D2 if r is neither so large that the shape of the attractor matters nor so small that few pairs
remain (P. Grassberger and I. Procaccia, Physica D 9 (1983) 189). Pairs close in time are excluded (J.
Theiler, Phys. Rev. A 34 (1986) 2427). The dimension is the slope of ln C against ln r on a *plateau*: the
widest range over which the local slope stays within a tolerance.

Limitations: N states do not resolve distances below about N^(-2/D2) of the size of the attractor, and a set
with gaps has fluctuating slopes for any number of states. The error interval therefore covers every slope on
the plateau, and the scatter between parts of the series; without a plateau no dimension is returned.
"""

from __future__ import annotations

import math
from typing import Final, SupportsIndex

import numpy as np
import numpy.typing as npt

from printhammer.chaos.exponents.recurrence import rows_of
from printhammer.chaos.strobe.points import Strobe, points_of
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.results import Result, column, coordinate, scalar
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

MOST: Final = 50_000
"""Largest number of states for the correlation dimension; arbitrary."""
FEWEST: Final = 200
"""Smallest number of states for the correlation dimension; arbitrary."""
THEILER: Final = 10  # Default of the Theiler window, in steps; arbitrary
FLAT: Final = 0.1
"""Default for the largest range of local slopes on a plateau; arbitrary."""

_PER_OCTAVE: Final = 2  # Number of radii per factor of 2; arbitrary
_PIECE: Final = 4
"""Width of the fit of a local slope, in steps of the radius; arbitrary."""
_SHORTEST: Final = 3 * _PER_OCTAVE
"""Smallest length of a plateau, in steps of the radius; corresponds to a factor of 8."""
_FEW_PAIRS: Final = 200  # Number of pairs below which a correlation sum is discarded; arbitrary
_LARGEST: Final = 0.25  # Arbitrary
"""Correlation sum above which radii are not used: the finite size of the attractor biases the slope."""
_PARTS: Final = 5  # Number of sections of the series whose scatter gives the error; arbitrary


class CorrelationDimension(Result, rows="radius"):
    """Correlation sums of a series of states, local slopes, and the dimension if there is a plateau."""

    radius: FloatArray = coordinate("1", "distance of states", "radius", more="in units of the scales")
    sums: FloatArray = column("1", "fraction of pairs that are closer", "radius", name="correlation_sum")
    slopes: FloatArray = column(
        "1",
        "local slope of the logarithm of the correlation sum over that of the distance",
        "radius",
        more="nan at the ends",
    )
    states: int = scalar("1", "number of states")
    theiler: int = scalar("1", "Theiler window: pairs of states less than this many steps apart are excluded")
    flat: float = scalar("1", "largest range of local slopes on a plateau")
    plateau: tuple[float, float] = scalar("1", "range of distances of the plateau, or nan")
    dimension: float = scalar("1", "correlation dimension", more="nan without a plateau")
    low: float = scalar("1", "lower end of the interval of the dimension")
    high: float = scalar("1", "upper end of the interval of the dimension")

    @property
    def title(self) -> str:
        """Title of the correlation dimension, with the number of states."""
        return f"correlation dimension of {self.states} states"

    @property
    def message(self) -> str:
        """Dimension with error interval and plateau, or the reason why there is no dimension, in one line."""
        if math.isnan(self.dimension):
            return f"no plateau over a factor of 8 with slopes within {self.flat:.2g}: no dimension"
        near, far = self.plateau
        return (
            f"dimension {self.dimension:.3f}, between {self.low:.3f} and {self.high:.3f}, on a plateau from"
            f" {near:.2g} to {far:.2g}"
        )


def correlation_dimension(
    states: npt.ArrayLike | Strobe | Regime,
    *,
    scales: npt.ArrayLike | None = None,
    theiler: SupportsIndex = THEILER,
    flat: float = FLAT,
) -> CorrelationDimension:
    """Estimate the correlation dimension of a series of states, or of strobe points.

    Parameters
    ----------
    states : array, Strobe or Regime
        One row, or one number, per state; 200 to 50,000 states. Displacement, velocity and pack memory of
        strobe points are used. For a regime, a thousand points are computed after a thousand firings; a few
        thousand points are more accurate. The distance between two states is the largest difference of a
        component.
    scales : array, optional
        Scales of the components; by default the half-widths of the window of a strobe, and 1 for other
        states.
    theiler : int, optional
        Theiler window: pairs of states less than this many steps apart are excluded.
    flat : float, optional
        Tolerance of the plateau: the largest difference between two local slopes on a plateau.

    Returns
    -------
    CorrelationDimension
        Dimension with a symmetric error interval. Its half-width is the largest deviation of a local slope on
        the plateau from the dimension, plus twice the standard error from five parts of the series.

    Raises
    ------
    InputError
        There are too many or too few states, a state is not finite, all states are equal, or the scales do
        not match the components.
    """
    rows, units = rows_of(points_of(states, {}), scales, MOST)
    apart, tolerance = read_count(theiler, "theiler"), read_positive(flat, "1", "flat")
    if len(rows) < FEWEST:
        raise InputError(f"states: {len(rows)} states", key="states", expected=f"{FEWEST} to {MOST}")
    if apart > len(rows) // 4:
        raise InputError.of(
            "theiler", apart, f"at most a quarter of the number of states, {len(rows)}", written=str(apart)
        )
    scaled = rows / units
    width = float(np.ptp(scaled, axis=0).max())
    if width == 0.0:
        raise InputError(
            "states: all are equal", key="states", expected="an attractor of more than one state"
        )
    count = math.ceil(_PER_OCTAVE * math.log2(2.0 * len(rows)) * 2.0)
    radius = width * 2.0 ** (-np.arange(count)[::-1] / _PER_OCTAVE)
    sums, pairs = correlation_sums(scaled, radius, apart)
    slopes = local_slopes(radius, np.where(sums * pairs >= _FEW_PAIRS, sums, np.nan))
    slopes[sums > _LARGEST] = np.nan
    flattest = _plateau(slopes, tolerance)
    if flattest is None:
        nothing = (math.nan, math.nan)
        return CorrelationDimension(
            radius=radius, sums=sums, slopes=slopes, states=len(rows), theiler=apart, flat=tolerance,
            plateau=nothing, dimension=math.nan, low=math.nan, high=math.nan,
        )  # fmt: skip
    first, last = flattest
    dimension = _slope(radius[first : last + 1], sums[first : last + 1])
    parts = []
    for part in np.array_split(scaled, _PARTS):
        own, few = correlation_sums(part, radius[first : last + 1], min(apart, len(part) // 4))
        seen = own * few >= 2.0
        parts.append(_slope(radius[first : last + 1][seen], own[seen]) if seen.sum() > 1 else math.nan)
    error = 2.0 * float(np.nanstd(parts)) / math.sqrt(_PARTS - 1)
    room = float(np.abs(slopes[first : last + 1] - dimension).max()) + error
    return CorrelationDimension(
        radius=radius,
        sums=sums,
        slopes=slopes,
        states=len(rows),
        theiler=apart,
        flat=tolerance,
        plateau=(float(radius[first]), float(radius[last])),
        dimension=dimension,
        low=dimension - room,
        high=dimension + room,
    )


def correlation_sums(states: FloatArray, radius: FloatArray, theiler: int) -> tuple[FloatArray, int]:
    """Compute the fraction of pairs of states that are closer than each of the distances in `radius`.

    Pairs less than `theiler` steps apart in time are excluded. The number of remaining pairs is returned,
    too.
    """
    from scipy.spatial import cKDTree

    count = len(states)
    tree = cKDTree(states)
    within = (tree.count_neighbors(tree, radius, p=math.inf) - count).astype(np.float64) / 2.0
    for lag in range(1, theiler):
        distances = np.sort(np.abs(states[lag:] - states[:-lag]).max(axis=1))
        within -= np.searchsorted(distances, radius, side="right")
    pairs = (count - theiler) * (count - theiler + 1) // 2
    return np.asarray(within / pairs), pairs


def local_slopes(radius: FloatArray, sums: FloatArray) -> FloatArray:
    """Fit the local slope of ln C (`sums`) against ln r (`radius`) at each distance r.

    The slope is that of a straight line fitted to the distance and its neighbours.
    """
    slopes = np.full(len(radius), np.nan)
    half = _PIECE // 2
    for k in range(half, len(radius) - half):
        piece = slice(k - half, k + half + 1)
        if np.isfinite(sums[piece]).all() and (sums[piece] > 0.0).all():
            slopes[k] = _slope(radius[piece], sums[piece])
    return slopes


def _slope(radius: FloatArray, sums: FloatArray) -> float:
    x, y = np.log(radius), np.log(sums)
    away = x - x.mean()
    return float(away @ y / (away @ away))


def _plateau(slopes: FloatArray, tolerance: float) -> tuple[int, int] | None:
    """Return the first and last index of the longest run of slopes whose range is at most the tolerance.

    Of runs of equal length, the run with the smallest range is returned; None if all runs are too short.
    """
    best: tuple[int, float, int] | None = None
    for first in range(len(slopes)):
        least, most = math.inf, -math.inf
        for last in range(first, len(slopes)):
            if not math.isfinite(slopes[last]):
                break
            least, most = min(least, float(slopes[last])), max(most, float(slopes[last]))
            if most - least > tolerance:
                break
            if last - first >= _SHORTEST and (best is None or (last - first, least - most) > best[:2]):
                best = (last - first, least - most, first)
    return None if best is None else (best[2], best[2] + best[0])
