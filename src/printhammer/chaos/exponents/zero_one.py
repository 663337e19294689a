"""The 0-1 test for chaos in a series of values, which needs no tangent flow.

The values phi(1), phi(2), ... drive a point in a plane, each in a direction that advances by an angle c,

    p_c(n) = sum of phi(j) cos(j c),   q_c(n) = sum of phi(j) sin(j c),   j = 1 ... n.

For a regular series the point stays bounded; for a chaotic series it performs a random walk, and its mean
square displacement M_c(n) grows in proportion to n. The growth is measured by the correlation K_c of M_c(n)
with n (G. A. Gottwald and I. Melbourne, Proc. R. Soc. Lond. A 460 (2004) 603; SIAM J. Appl. Dyn. Syst. 8
(2009) 129; the correlation method and its limits: the same authors, Springer Lect. Notes Phys. 915 (2016)
221). K is the median of K_c over many angles, since at the few angles that resonate with a regular series the
path of the point grows, too.
"""

from __future__ import annotations

import math
from typing import Any, Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.strobe.points import Strobe, points_of
from printhammer.chaos.strobe.verdict import AGREEMENT
from printhammer.drive.input import read_array, read_count
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Result, column, coordinate, part, scalar
from printhammer.run.regime import Firing, Regime
from printhammer.support.arrays import FloatArray

ANGLES: Final = 100
"""Default number of random angles c of the 0-1 test, as in Gottwald and Melbourne (2009)."""

RANGE: Final = (math.pi / 5.0, 4.0 * math.pi / 5.0)
"""Range of the angles c, rad; closer to 0 or pi, short cycles resonate."""

SEED: Final = 1983
"""Default seed of the random number generator of the angles: the year of the paper."""

REGULAR: Final = 0.2
"""Largest K of a regular series; arbitrary."""

CHAOTIC: Final = 0.8
"""Smallest K of a chaotic series; arbitrary.

K^2 is the fraction of the variance of M_c(n) that a straight line explains: at most a twentieth for a regular
series, about two thirds or more for a chaotic series.
"""

FEWEST: Final = 100  # Arbitrary
"""Smallest length of a series; its mean square displacement is computed up to a tenth of the length."""

SETTLING: Final = 0.5  # Arbitrary
"""Ratio of standard deviations, last to first quarter of a series, below which the series is a transient."""

LONGEST_CYCLE: Final = 64
"""Largest cycle length of a series that is tested; at most a quarter of its length. Arbitrary."""

CYCLES: Final = 5  # Arbitrary
"""Number of cycles over which a path has to grow to indicate chaos; within one cycle, any path may grow."""

FOLLOWS: Final = 0.7  # Arbitrary
"""Distance of the images of neighbours, relative to random pairs, below which a series is deterministic."""

_CUT: Final = 10  # Ratio of the series length to the largest lag, as in Gottwald and Melbourne (2009)
_PASSES: Final = 4  # Smallest number of cycles in a series for a cycle to be considered; arbitrary
_TOGETHER: Final = 1 << 20
"""Number of complex numbers processed in one batch; arbitrary."""


class ZeroOne(Result):
    """Result of the 0-1 test: the correlations K_c, their median K, and the classification."""

    k: float = scalar(
        "1",
        "median of the correlations",
        more="near 0 for a regular series, near 1 for a chaotic series, nan where the series has gaps",
    )
    verdict: str = scalar(
        "", 'classification by K: "regular" up to 0.2, "chaotic" from 0.8 on, else "undecided"'
    )
    reason: str = scalar("", 'reason for the classification "undecided"', more="else empty")
    length: int = scalar("1", "length of the series")
    cycle: int = scalar(
        "1",
        "cycle length q after which the series most nearly repeats",
        more="the mean of every q-th value was subtracted",
    )
    resolution: float = scalar(
        "1", "amplitude up to which changes of the series are ignored", more="in the unit of the series"
    )
    seed: int = scalar("1", "seed of the random generator of the angles")
    angles: FloatArray = coordinate("rad", "angle c", "angle", name="angle")
    correlations: FloatArray = column("1", "correlation K_c", "angle", name="correlation")
    shown: int = part("index of the angle with the median correlation", repr=False)
    displacement: FloatArray = column(
        "unit of the series squared",
        "mean square displacement, corrected",
        "step",
        more="after 1, 2, ... steps, at the angle of the median",
    )
    p: FloatArray = column(
        "unit of the series", "path, first coordinate", "number", more="at the angle of the median"
    )
    q: FloatArray = column(
        "unit of the series", "path, second coordinate", "number", more="at the angle of the median"
    )

    @property
    def title(self) -> str:
        """Title of the result: "0-1 test for chaos"."""
        return "0-1 test for chaos"

    @property
    def phrase(self) -> str:
        """Summary of K, the number of angles, and the length of the series, in one line."""
        # Avoids a negative zero.
        k = round(self.k, 3) + 0.0
        return f"K = {k:.3f}, median of {len(self.angles)} angles over {self.length} numbers"

    def notes(self) -> dict[str, Any]:
        """Return the angle whose path is stored, for the attributes of the Dataset."""
        return {"shown_angle": float(self.angles[self.shown])}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: correlation by `angle`, displacement by `step`, path by `number`."""
        places = {"step": ("number of steps", len(self.displacement)), "number": ("place", self.length)}
        return super().entries() | {
            name: (
                Column("1", meaning, (name,), "coordinate", name=name),
                np.arange(1, count + 1, dtype=np.int32),
            )
            for name, (meaning, count) in places.items()
        }


def zero_one(
    series: npt.ArrayLike | Strobe | Regime | Hammer,
    *,
    resolution: float | None = None,
    angles: SupportsIndex = ANGLES,
    seed: int = SEED,
    **firing: Unpack[Firing],
) -> ZeroOne:
    """Apply the 0-1 test to a series, or to the displacements of strobe points.

    Periodic components make M_c(n) oscillate, which hides slow growth. The test of 2009 subtracts the
    contribution of the mean, (mean)^2 (1 - cos n c)/(1 - cos c). Here the mean is subtracted from the series
    itself, which is equivalent in the limit and loses no digits. If a series nearly repeats every q values,
    the mean of every q-th value is subtracted, so that chaos within narrow bands is detected in short
    series, too.

    The remainder of a settled series is rounding noise, which performs a random walk as chaos does. Therefore
    an oscillation (resolution)^2 sin(n sqrt 2) is added to M_c(n), as proposed by J. H. P. Dawes and M. C.
    Freeland (2008, unpublished; see the review of 2016) to damp weak noise: only growth beyond this
    oscillation counts. A series whose changes die out is a transient, for which the test is undecided.

    Parameters
    ----------
    series : array, Strobe, Regime or Hammer
        At least 100 values; or strobe points, whose displacements are used; or a regime, or a hammer with
        the keywords `firing`, of which a thousand strobe points are computed after a thousand firings.
    resolution : float, optional
        Amplitude below which changes are ignored, in the unit of the series. By default 1e-12 of the largest
        absolute value; for strobe points, by default 1e-6 of the half-width of the strobe window, the
        distance within which two states agree in a classification.
    angles : int, optional
        Number of random angles.
    seed : int, optional
        Seed of the random generator of the angles.
    **firing
        Firing of the hammer, as for `printhammer.Regime.of`.

    Returns
    -------
    ZeroOne
        Test result with a classification; "undecided" if the run of a strobe ended early.

    Raises
    ------
    InputError
        The series is too short, is not one-dimensional or contains values that are not finite, or the
        resolution is negative.
    """
    many = read_count(angles, "angles")
    points = points_of(series, firing)
    stopped = ""
    if isinstance(points, Strobe):
        numbers = np.asarray(points.x, dtype=np.float64)
        least = AGREEMENT * float(points.window.half_widths[0])
        if not np.isfinite(numbers).all():
            stopped = f"the run ended early: {points.status}"
    else:
        numbers = _numbers(points)
        least = 1e-12 * float(np.abs(numbers).max(initial=0.0))
    if numbers.size < FEWEST:
        raise InputError(f"series: {numbers.size} numbers", key="series", expected=f"at least {FEWEST}")
    if resolution is not None:
        if not (math.isfinite(resolution) and resolution >= 0.0):
            raise InputError.of("resolution", resolution, "a number, not negative")
        least = float(resolution)
    if seed < 0:
        raise InputError.of("seed", seed, "a whole number, not negative")
    chosen = np.random.default_rng(seed).uniform(*RANGE, many)
    length = numbers.size
    k, cycle, shown, correlations = math.nan, 1, 0, np.full(many, np.nan)
    verdict, reason = "undecided", stopped
    path = np.full((1, length), complex(math.nan, math.nan))
    displacement = np.full(length // _CUT, np.nan)
    if not stopped:
        cycle, rest = without_cycle(numbers, least)
        pieces = np.array_split(chosen, min(many, 1 + many * length // _TOGETHER))
        correlations = np.concatenate(
            [_correlations(_displacements(_paths(rest, some), least)) for some in pieces]
        )
        # The lower median, unlike the mean of the two middle values, belongs to one of the angles.
        shown = int(np.argsort(correlations, kind="stable")[(many - 1) // 2])
        path = _paths(rest, chosen[shown : shown + 1])
        displacement = _displacements(path, least)[0]
        k = float(np.median(correlations))
        verdict, reason = _classify(k, cycle, rest, least)
    return ZeroOne(
        k=k,
        verdict=verdict,
        reason=reason,
        length=length,
        cycle=cycle,
        resolution=least,
        seed=seed,
        angles=chosen,
        correlations=correlations,
        shown=shown,
        displacement=displacement,
        p=path[0].real.copy(),
        q=path[0].imag.copy(),
    )


def _classify(k: float, cycle: int, rest: FloatArray, resolution: float) -> tuple[str, str]:
    """Classify a series by the median correlation `k`, and by whether changes in the series die out.

    `rest` is the series minus its means over the cycle of length `cycle`. Returns the class, and the reason
    for "undecided", else an empty string.
    """
    if k <= REGULAR:
        return "regular", ""
    quarter = rest.size // 4
    early, late = float(np.std(rest[:quarter])), float(np.std(rest[-quarter:]))
    if early > resolution and late < SETTLING * early:
        return "undecided", "the series has not settled: discard a longer transient"
    if k < CHAOTIC:
        return (
            "undecided",
            f"K = {k:.2f} is between {REGULAR:g} and {CHAOTIC:g}: a longer series may decide",
        )
    if rest.size // _CUT < CYCLES * cycle:
        return "undecided", (
            f"the series nearly repeats itself every {cycle} numbers; a test of the remainder requires at"
            f" least {_CUT * CYCLES * cycle} numbers"
        )
    return "chaotic", ""


def _paths(rest: FloatArray, angles: FloatArray) -> npt.NDArray[np.complex128]:
    turned = np.exp(1j * np.outer(angles, np.arange(1, rest.size + 1)))
    return np.asarray(np.cumsum(rest * turned, axis=1))


def _displacements(paths: npt.NDArray[np.complex128], resolution: float) -> FloatArray:
    """Compute the mean square displacements of paths, at lags up to a tenth of the path length.

    The oscillation of the amplitude (resolution)^2 is added, which damps weak noise; see `zero_one`.
    """
    moved = mean_square_displacements(paths, paths.shape[1] // _CUT)
    steps = np.arange(1, moved.shape[1] + 1)
    return np.asarray(moved + resolution**2 * np.sin(math.sqrt(2.0) * steps))


def without_cycle(numbers: FloatArray, resolution: float) -> tuple[int, FloatArray]:
    """Estimate the cycle length q of a series; return q, and the series minus the means of every q-th value.

    The cycle length minimises the criterion of G. Schwarz (Ann. Statist. 6 (1978) 461), n ln(residual
    variance) + q ln(n); with q = 1 only the mean of the series is subtracted. Changes up to the resolution
    are ignored. If the residual is not deterministic, the series is a cycle with noise. Noise alone would
    look like chaos; therefore the cycle is then kept, and q = 1 is returned.
    """
    worth = []
    for q in range(1, min(LONGEST_CYCLE, numbers.size // _PASSES) + 1):
        rest = _less_means(numbers, q)
        variance = max(float((rest**2).sum()) / numbers.size + resolution**2, np.finfo(np.float64).tiny)
        worth.append(numbers.size * math.log(variance) + q * math.log(numbers.size))
    cycle = int(np.argmin(worth)) + 1
    rest = _less_means(numbers, cycle)
    if cycle > 1 and float(rest.std()) > resolution and not _is_deterministic(rest, cycle):
        return 1, _less_means(numbers, 1)
    return cycle, rest


def _is_deterministic(rest: FloatArray, q: int) -> bool:
    """Whether a residual series is deterministic: nearest neighbours are followed by close values.

    Only values at the same phase of a cycle of q values are compared. Neighbours are determined in two ways:
    by the values alone, and by the values together with the preceding values. One of the two must succeed.
    """
    shares = []
    for before in (0, 1):
        points = np.stack([rest[before - k : rest.size - 1 - k] for k in range(before + 1)], axis=1)
        image = rest[before + 1 :]
        near, any_two = 0.0, 0.0
        for start in range(q):
            own, later = points[start::q], image[start::q]
            apart = np.abs(own[:, np.newaxis] - own).max(axis=2)
            np.fill_diagonal(apart, np.inf)
            between = np.abs(later[:, np.newaxis] - later)
            near += float(between[np.arange(len(own)), apart.argmin(axis=1)].sum())
            any_two += float(between.sum()) / max(len(own) - 1, 1)
        shares.append(near / any_two if any_two else 0.0)
    return min(shares) < FOLLOWS


def _less_means(numbers: FloatArray, q: int) -> FloatArray:
    rest = numbers.copy()
    for start in range(q):
        rest[start::q] -= rest[start::q].mean()
    return rest


def mean_square_displacements(paths: npt.NDArray[np.complex128], cut: int) -> FloatArray:
    """Compute the mean square displacement of each path at the lags from 1 to `cut`.

    A path is a row of complex positions z(1), ..., z(N). The displacement at lag n is the mean of
    |z(j + n) - z(j)|^2 over the first N - cut values of j, so that all means have the same number of terms.
    The result has one row per path and one column per lag.
    """
    many, count = paths.shape
    first = count - cut
    # |a - b|^2 = |a|^2 + |b|^2 - 2 Re a* b, and the sum of the last term is a correlation.
    size = 1 << (2 * count - 1).bit_length()
    head = np.fft.fft(paths[:, :first], size)
    crossed = np.fft.ifft(head.conj() * np.fft.fft(paths, size))[:, 1 : cut + 1].real
    squares = np.concatenate([np.zeros((many, 1)), np.cumsum(np.abs(paths) ** 2, axis=1)], axis=1)
    steps = np.arange(1, cut + 1)
    moved = squares[:, steps + first] - squares[:, steps]
    return np.asarray((moved + squares[:, [first]] - 2.0 * crossed) / first, dtype=np.float64)


def _correlations(displacements: FloatArray) -> FloatArray:
    """Compute the correlation K_c of each row with the numbers 1, 2, ...; 0 for a constant row."""
    count = displacements.shape[1]
    away = np.arange(count) - 0.5 * (count - 1)
    rows = displacements - displacements.mean(axis=1, keepdims=True)
    sizes = np.sqrt((away**2).sum() * (rows**2).sum(axis=1))
    return np.asarray(np.divide((rows * away).sum(axis=1), sizes, out=np.zeros(len(rows)), where=sizes > 0.0))


def _numbers(series: npt.ArrayLike) -> FloatArray:
    numbers = read_array(series, "series")
    if numbers.ndim != 1:
        raise InputError(
            f"series: an array of shape {numbers.shape}", key="series", expected="one number after the other"
        )
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if wrong.size:
        raise InputError(
            f"series: number {wrong[0] + 1} is {numbers[wrong[0]]}", key="series", expected="finite numbers"
        )
    return numbers
