"""Noise of residuals and records: scale, outliers, autocorrelation, variance components."""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.support.arrays import BoolArray, FloatArray

_MAD: Final = 1.482602218505602
"""Standard deviation of a normal distribution over its median absolute deviation."""
_SPIKE: Final = 10.0
_FAR: Final = 4.5
"""Residuals of more standard deviations are outliers: of 100 000 normal ones, less than one."""
_LONGEST_MEMORY: Final = 8

_CLIP: Final = 2.5
"""Residuals count as no larger than this, in standard deviations, while the outliers are not known."""


def robust_scale(values: FloatArray) -> float:
    """Return the standard deviation of normal noise about 0 from its median absolute value."""
    return _MAD * float(np.median(np.abs(values)))


def noise_of_record(values: FloatArray) -> float:
    """Return the standard deviation of the white noise in evenly spaced samples of something smoother.

    From third differences, which leave no parabola; their median does not see outliers or contacts.
    """
    if len(values) < 8:
        return 0.0
    return robust_scale(np.diff(values, 3)) / float(np.sqrt(20.0))


def running_median(values: FloatArray, width: int) -> FloatArray:
    """Return the running median over an odd number of samples; at the ends that of the outermost ones."""
    half = width // 2
    windows = np.lib.stride_tricks.sliding_window_view(values, width)
    first, last = np.median(values[:width]), np.median(values[-width:])
    return np.concatenate([np.full(half, first), np.median(windows, axis=1), np.full(half, last)])


def spikes_of(values: FloatArray, noise: float) -> BoolArray:
    """Return which samples of a record stand out of their neighbours, more than noise and slope explain."""
    middle = running_median(values, 5)
    padded = np.pad(middle, 2, mode="edge")
    return np.abs(values - middle) > _SPIKE * noise + np.abs(padded[4:] - padded[:-4])


def outliers_of(residuals: FloatArray, floor: float) -> BoolArray:
    """Return which residuals of mostly good data are larger than normal noise, or the floor, has them."""
    return np.abs(residuals) > _FAR * max(robust_scale(residuals), floor)


def memory_factor(residuals: FloatArray) -> float:
    """Return by how much the variance of a slow average exceeds that of independent residuals.

    An autoregressive process is fitted (Yule and Walker), its order by the Bayes criterion; the factor is its
    spectrum at frequency 0 over its variance. 1 for white noise.
    """
    count = len(residuals)
    centred = residuals - residuals.mean() if count else residuals
    longest = min(_LONGEST_MEMORY, count // 20)
    if longest < 1 or not centred.any():
        return 1.0
    r = np.array([float(centred[: count - k] @ centred[k:]) for k in range(longest + 1)]) / count
    best, factor = count * np.log(r[0]), 1.0
    error = r[0]
    a = np.zeros(0)
    for order in range(1, longest + 1):
        # Levinson's recursion.
        reflection = (r[order] - a @ r[order - 1 : 0 : -1]) / error if order > 1 else r[1] / error
        a = np.append(a - reflection * a[::-1], reflection)
        error *= 1.0 - reflection * reflection
        if error <= 0.0:
            break
        criterion = count * np.log(error) + order * np.log(count)
        if criterion < best:
            best, factor = criterion, error / (1.0 - a.sum()) ** 2 / r[0]
    return float(factor)


def variance_of(
    spread: FloatArray,
    residuals: FloatArray,
    used: BoolArray,
    parameters: int,
    *,
    clipped: bool = False,
) -> FloatArray:
    """Return the variance of each row, shape (m,), by maximum likelihood of its components.

    Each step multiplies every component by the root of the ratio of what the residuals ask for to what they
    have; a component that is not needed goes to zero. Each component has its `spread`, shape (m, q), in each
    row; only the rows used count, and the parameters of the law take up as many residuals. Where the outliers
    are not known yet, large residuals are clipped.
    """
    from scipy.stats import chi2

    g, r2 = spread[used], residuals[used] ** 2
    size = g.mean(axis=0)
    g = g[:, size > 0.0] / size[size > 0.0]
    kept = spread[:, size > 0.0] / size[size > 0.0]
    first = robust_scale(residuals[used]) ** 2 if clipped else float(r2.mean())
    theta = np.full(g.shape[1], (first or float(r2.mean())) / g.shape[1])
    limit = _CLIP * _CLIP
    # Mean of a squared normal number that is cut at the limit.
    mean = float(chi2.cdf(limit, 3) + limit * chi2.sf(limit, 1)) if clipped else 1.0
    share = len(r2) / (len(r2) - parameters) if len(r2) > parameters else 1.0
    for _ in range(500):
        v = g @ theta
        ratio = share * r2 / v
        if clipped:
            ratio = np.minimum(ratio, limit)
        factor = np.sqrt((g.T @ (ratio / (mean * v))) / (g.T @ (1.0 / v)))
        theta = theta * factor
        if np.abs(np.where(theta > 1e-9 * theta.max(), factor, 1.0) - 1.0).max() < 1e-6:
            break
    # Weights that rest on a handful of residuals would follow their noise: no row counts 1e4 times another.
    v = kept @ theta
    variance: FloatArray = np.maximum(v, 1e-4 * v.max())
    return variance
