"""The 0-1 test: is a series of numbers chaotic or regular? A second opinion that needs no tangent flow.

The numbers phi(1), phi(2), ... push a point about in a plane, each in a direction that turns on by an angle
c,

    p_c(n) = sum of phi(j) cos(j c),   q_c(n) = sum of phi(j) sin(j c),   j = 1 ... n.

Where the series is regular the point stays within bounds; where it is chaotic it wanders off like a random
walk, and its mean square displacement M_c(n) grows in proportion to n. The growth is measured by the
correlation K_c of M_c(n) with n (G. A. Gottwald and I. Melbourne, Proc. R. Soc. Lond. A 460 (2004) 603; SIAM
J. Appl. Dyn. Syst. 8 (2009) 129; the correlation method and its limits: same authors, Springer Lect. Notes
Phys. 915 (2016) 221). K is the median over many angles, since at the few that resonate with the series a
regular one walks away too.
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
"""Number of angles c unless told otherwise."""

RANGE: Final = (math.pi / 5.0, 4.0 * math.pi / 5.0)
"""Angles lie between these: nearer to 0 and pi short cycles resonate."""

SEED: Final = 1983
"""Seed of the angles unless told otherwise."""

REGULAR: Final = 0.2
CHAOTIC: Final = 0.8
"""K up to which a series is regular, and from which on it is chaotic.

K^2 is the part of the ups and downs of M_c(n) that a straight line accounts for: less than a twentieth, or
about two thirds and more.
"""

FEWEST: Final = 100
"""Least length of a series; the mean square displacement is taken up to a tenth of it."""

SETTLING: Final = 0.5
"""Changes die out that are smaller by this factor in the last quarter of a series than in the first."""

LONGEST_CYCLE: Final = 64
"""Largest number q after which a series may repeat itself; at most a quarter of its length."""

CYCLES: Final = 5
"""Growth counts as chaos where it is seen over so many cycles q; within one, any path may go away."""

FOLLOWS: Final = 0.7
"""Numbers follow from those before where images of neighbours are closer than this share of any two."""

_CUT: Final = 10
_PASSES: Final = 4
_TOGETHER: Final = 1 << 20
"""Complex numbers that are worked on together."""


class ZeroOne(Result):
    """What the 0-1 test says of a series."""

    k: float = scalar(
        "1",
        "median of the correlations",
        more="near 0 for a regular series, near 1 for a chaotic one, nan where the series has gaps",
    )
    verdict: str = scalar("", '"regular" up to 0.2, "chaotic" from 0.8 on, else "undecided"')
    reason: str = scalar("", 'why the verdict is "undecided"', more="else empty")
    length: int = scalar("1", "length of the series")
    cycle: int = scalar(
        "1",
        "number q after which the series most nearly repeats itself",
        more="the mean of each q-th number was taken out",
    )
    resolution: float = scalar(
        "1", "amplitude up to which changes of the series count as none", more="in its own unit"
    )
    seed: int = scalar("1", "seed of the angles")
    angles: FloatArray = coordinate("rad", "angle c", "angle", name="angle")
    correlations: FloatArray = column("1", "correlation K_c", "angle", name="correlation")
    shown: int = part("place of the angle whose correlation is the median", repr=False)
    displacement: FloatArray = column(
        "unit of the series squared",
        "mean square displacement, corrected",
        "step",
        more="after 1, 2, ... steps at the angle that is shown",
    )
    p: FloatArray = column("unit of the series", "path, first coordinate", "number", more="likewise")
    q: FloatArray = column("unit of the series", "path, second coordinate", "number", more="likewise")

    @property
    def title(self) -> str:
        """One line that says what this is."""
        return "0-1 test for chaos"

    @property
    def phrase(self) -> str:
        """The outcome in one line."""
        # Without the sign of a zero.
        k = round(self.k, 3) + 0.0
        return f"K = {k:.3f}, median of {len(self.angles)} angles over {self.length} numbers"

    def notes(self) -> dict[str, Any]:
        """Return the angle that is shown, for the attributes of the Dataset."""
        return {"shown_angle": float(self.angles[self.shown])}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return correlations over `angle`, displacements over `step` and the path over `number`."""
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
    """Return what the 0-1 test says of a series, or of the displacements at the points of a strobe.

    What repeats itself only makes M_c(n) oscillate, and hides slow growth. The test of 2009 takes out what
    the mean adds, (mean)^2 (1 - cos n c)/(1 - cos c). Here the mean is taken out of the series itself, which
    is the same in the limit and loses no digits; and of a series that nearly repeats itself every q numbers
    the mean of each q-th one is, so that chaos within narrow bands is seen in short series too.

    What is left of a series that has settled is the noise of the arithmetic, which wanders like chaos. So an
    oscillation of the size of `resolution` is added, (resolution)^2 sin(n sqrt 2), as J. H. P. Dawes and M.
    C. Freeland (2008, unpublished; see the review of 2016) do to damp weak noise: growth counts where it
    exceeds that. A series whose changes die out is a transient, of which the test can say nothing.

    Parameters
    ----------
    series : array, Strobe, Regime or Hammer
        At least 100 numbers; or strobe points, whose displacements are taken; or a regime, or a hammer and
        how it is fired, of which a thousand points are, after a thousand firings.
    resolution : float, optional
        Amplitude up to which changes count as none, in the unit of the series. By default 1e-12 of the
        largest absolute value; for strobe points what also counts as agreement there, 1e-6 of the half-width
        of the window.
    angles : int, optional
        Number of random angles.
    seed : int, optional
        Of the angles.
    **firing
        How a hammer is fired, as for `printhammer.Regime.of`.

    Returns
    -------
    ZeroOne
        With a verdict; "undecided" for a strobe whose run ended early.

    Raises
    ------
    InputError
        The series is too short, has no shape (n,) or holds numbers that are not finite; the resolution is
        negative.
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
        # The lower of the two in the middle, so that there is an angle which has it.
        shown = int(np.argsort(correlations, kind="stable")[(many - 1) // 2])
        path = _paths(rest, chosen[shown : shown + 1])
        displacement = _displacements(path, least)[0]
        k = float(np.median(correlations))
        verdict, reason = _judged(k, cycle, rest, least)
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


def _judged(k: float, cycle: int, rest: FloatArray, resolution: float) -> tuple[str, str]:
    """Return verdict and, where it is "undecided", the reason."""
    if k <= REGULAR:
        return "regular", ""
    quarter = rest.size // 4
    early, late = float(np.std(rest[:quarter])), float(np.std(rest[-quarter:]))
    if early > resolution and late < SETTLING * early:
        return "undecided", "the series has not settled: a longer transient may have to be left out"
    if k < CHAOTIC:
        return "undecided", f"K = {k:.2f} lies between {REGULAR:g} and {CHAOTIC:g}: a longer series may tell"
    if rest.size // _CUT < CYCLES * cycle:
        return "undecided", (
            f"the series nearly repeats itself every {cycle} numbers; whether the rest is chaotic takes"
            f" at least {_CUT * CYCLES * cycle} to tell"
        )
    return "chaotic", ""


def _paths(rest: FloatArray, angles: FloatArray) -> npt.NDArray[np.complex128]:
    turned = np.exp(1j * np.outer(angles, np.arange(1, rest.size + 1)))
    return np.asarray(np.cumsum(rest * turned, axis=1))


def _displacements(paths: npt.NDArray[np.complex128], resolution: float) -> FloatArray:
    """Return mean square displacements up to a tenth of the length, weak noise damped."""
    moved = mean_square_displacements(paths, paths.shape[1] // _CUT)
    steps = np.arange(1, moved.shape[1] + 1)
    return np.asarray(moved + resolution**2 * np.sin(math.sqrt(2.0) * steps))


def without_cycle(numbers: FloatArray, resolution: float) -> tuple[int, FloatArray]:
    """Return after how many numbers a series most nearly repeats itself, and what is left without that part.

    That is the number q, 1 for the mean alone, whose q means are worth their number by the criterion of G.
    Schwarz (Ann. Statist. 6 (1978) 461): n ln(variance left) + q ln(n) is least. Left is the series without
    the means of every q-th number. Changes up to the resolution count as none. Where what would be left does
    not follow from itself, it is noise on a cycle: by itself that wanders like chaos, so it stays on it.
    """
    worth = []
    for q in range(1, min(LONGEST_CYCLE, numbers.size // _PASSES) + 1):
        rest = _less_means(numbers, q)
        variance = max(float((rest**2).sum()) / numbers.size + resolution**2, np.finfo(np.float64).tiny)
        worth.append(numbers.size * math.log(variance) + q * math.log(numbers.size))
    cycle = int(np.argmin(worth)) + 1
    rest = _less_means(numbers, cycle)
    if cycle > 1 and float(rest.std()) > resolution and not _follows_from_itself(rest, cycle):
        return 1, _less_means(numbers, 1)
    return cycle, rest


def _follows_from_itself(rest: FloatArray, q: int) -> bool:
    """Tell whether neighbours at the same place of a cycle of q numbers are neighbours one number later, too.

    Neighbours are told by their numbers alone, or by the ones before as well.
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
    """Return mean |z(j + n) - z(j)|^2 over j, for n from 1 to `cut`, of each of m rows z, shape (m, cut).

    j runs over the first N - cut of N places, so that all means are of equally many.
    """
    many, count = paths.shape
    first = count - cut
    # |a - b|^2 = |a|^2 + |b|^2 - 2 Re a* b, and the sum of the last is a correlation.
    size = 1 << (2 * count - 1).bit_length()
    head = np.fft.fft(paths[:, :first], size)
    crossed = np.fft.ifft(head.conj() * np.fft.fft(paths, size))[:, 1 : cut + 1].real
    squares = np.concatenate([np.zeros((many, 1)), np.cumsum(np.abs(paths) ** 2, axis=1)], axis=1)
    steps = np.arange(1, cut + 1)
    moved = squares[:, steps + first] - squares[:, steps]
    return np.asarray((moved + squares[:, [first]] - 2.0 * crossed) / first, dtype=np.float64)


def _correlations(displacements: FloatArray) -> FloatArray:
    """Return the correlation of each row with 1, 2, ...; 0 for a row that does not change at all."""
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
