"""Noise of residuals and records: scale, outliers, autocorrelation, and variance components."""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.support.arrays import BoolArray, FloatArray

_MAD: Final = 1.482602218505602
"""Ratio of standard deviation to median absolute deviation, by definition of the normal distribution."""
_SPIKE: Final = 10.0  # Factor on the noise above which a reading is a spike; arbitrary
_FAR: Final = 4.5
"""Outlier threshold, in standard deviations, so that fewer than 1 in 100,000 normal values are outliers."""
_LONGEST_MEMORY: Final = 8  # Largest lag of the autocorrelation of the noise; arbitrary

_CLIP: Final = 2.5
"""Clipping level of residuals, in standard deviations, while the outliers are unknown; arbitrary."""


def robust_scale(values: FloatArray) -> float:
    """Estimate the standard deviation of zero-mean normal noise from the median absolute value."""
    return _MAD * float(np.median(np.abs(values)))


def noise_of_record(values: FloatArray) -> float:
    """Estimate the standard deviation of white noise in evenly spaced samples of a smooth signal.

    Third differences remove a parabola; their median is insensitive to outliers and contacts.
    """
    if len(values) < 8:
        return 0.0
    return robust_scale(np.diff(values, 3)) / float(np.sqrt(20.0))


def running_median(values: FloatArray, width: int) -> FloatArray:
    """Return the running median over an odd number of samples; the ends repeat the outermost medians."""
    half = width // 2
    windows = np.lib.stride_tricks.sliding_window_view(values, width)
    first, last = np.median(values[:width]), np.median(values[-width:])
    return np.concatenate([np.full(half, first), np.median(windows, axis=1), np.full(half, last)])


def spikes_of(values: FloatArray, noise: float) -> BoolArray:
    """Return the mask of samples that differ from their neighbours by more than noise and slope explain.

    `noise` is the standard deviation of the noise, in the unit of the values.
    """
    middle = running_median(values, 5)
    padded = np.pad(middle, 2, mode="edge")
    return np.abs(values - middle) > _SPIKE * noise + np.abs(padded[4:] - padded[:-4])


def outliers_of(residuals: FloatArray, floor: float) -> BoolArray:
    """Return the mask of the outliers: absolute residuals above `_FAR` times the robust scale.

    The scale is at least `floor`, in the unit of the residuals.
    """
    return np.abs(residuals) > _FAR * max(robust_scale(residuals), floor)


def memory_factor(residuals: FloatArray) -> float:
    """Return the ratio by which autocorrelation increases the variance of a long average of residuals.

    An autoregressive process is fitted (Yule-Walker equations), with its order by the Bayesian information
    criterion; the factor is its spectral density at frequency 0 over its variance, 1 for white noise.
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
        # Levinson-Durbin recursion.
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
    """Estimate the variance of each row, shape (m,), by maximum likelihood of variance components.

    The iteration multiplies each component by the square root of the ratio of its observed to its expected
    score; superfluous components tend to zero. `spread`, shape (m, q), contains the coefficients of the
    components. The estimate is from the rows in the mask `used`, with a correction for the number of fitted
    `parameters`. With `clipped`, large residuals are clipped, for use while the outliers are unknown.
    """
    from scipy.special import chdtr, chdtrc

    g, r2 = spread[used], residuals[used] ** 2
    size = g.mean(axis=0)
    g = g[:, size > 0.0] / size[size > 0.0]
    kept = spread[:, size > 0.0] / size[size > 0.0]
    first = robust_scale(residuals[used]) ** 2 if clipped else float(r2.mean())
    theta = np.full(g.shape[1], (first or float(r2.mean())) / g.shape[1])
    limit = _CLIP * _CLIP
    # Mean of a squared standard normal number that is clipped at the limit.
    mean = float(chdtr(3, limit) + limit * chdtrc(1, limit)) if clipped else 1.0
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
    # A variance from a handful of residuals is unreliable: weights are limited to a ratio of 1e4.
    v = kept @ theta
    variance: FloatArray = np.maximum(v, 1e-4 * v.max())
    return variance
