"""Curve through samples, as plain functions for laws and waveforms: cell, slope, value and integral.

The n abscissas of a curve, ascending, are c[first], c[first + 1], ...; the n ordinates follow them in `c`.
Between the samples the curve is a straight line or a shape-preserving cubic (PCHIP), which is once
continuously differentiable and does not overshoot: F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17
(1980) 238, with the slopes of F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300, as in
`scipy.interpolate.PchipInterpolator`.
"""

from __future__ import annotations

from typing import Any


def cell_of(c: Any, first: int, knots: int, at: float) -> int:
    """Return the index of the cell that contains `at`; the knots are c[first:first + knots]."""
    low = 0
    high = knots - 1
    while high - low > 1:
        middle = (low + high) // 2
        if c[first + middle] <= at:
            low = middle
        else:
            high = middle
    return low


def end_slope(h0: float, h1: float, m0: float, m1: float) -> float:
    """Return the slope of a shape-preserving cubic at the end of a curve.

    The outermost cell has the width `h0` and the secant slope `m0`, its neighbour `h1` and `m1`.
    """
    slope = ((2.0 * h0 + h1) * m0 - h0 * m1) / (h0 + h1)
    if slope * m0 <= 0.0:
        return 0.0
    if m0 * m1 <= 0.0 and abs(slope) > 3.0 * abs(m0):
        return 3.0 * m0
    return slope


def inner_slope(h0: float, h1: float, m0: float, m1: float) -> float:
    """Return the slope of a shape-preserving cubic at a sample inside a curve; 0 at an extremum.

    The cells to the left and right have the widths `h0` and `h1` and the secant slopes `m0` and `m1`.
    """
    if m0 == 0.0 or m1 == 0.0 or (m0 < 0.0) != (m1 < 0.0):
        return 0.0
    w0, w1 = 2.0 * h1 + h0, h1 + 2.0 * h0
    return 1.0 / ((w0 / m0 + w1 / m1) / (w0 + w1))


def width_at(c: Any, first: int, k: int) -> float:
    """Return the width of cell `k` of a curve, between its abscissas c[first + k] and c[first + k + 1]."""
    return float(c[first + k + 1] - c[first + k])


def secant_at(c: Any, first: int, n: int, k: int) -> float:
    """Return the slope of the straight line across cell `k` of a curve of `n` samples from c[first] on."""
    return float((c[first + n + k + 1] - c[first + n + k]) / width_at(c, first, k))


def slope_at(c: Any, first: int, n: int, k: int) -> float:
    """Return the slope of the shape-preserving cubic through `n` samples, from c[first] on, at sample `k`."""
    if n == 2:
        return secant_at(c, first, n, 0)
    inside = min(max(k, 1), n - 2)
    h0, m0 = width_at(c, first, inside - 1), secant_at(c, first, n, inside - 1)
    h1, m1 = width_at(c, first, inside), secant_at(c, first, n, inside)
    if k == 0:
        return end_slope(h0, h1, m0, m1)
    if k == n - 1:
        return end_slope(h1, h0, m1, m0)
    return inner_slope(h0, h1, m0, m1)


def curve_at(c: Any, first: int, n: int, straight: bool, x: float) -> float:
    """Return the ordinate at `x` of the curve through `n` samples from c[first] on.

    If `straight`, the curve consists of straight lines, otherwise of shape-preserving cubics. `x` lies within
    the range of the abscissas.
    """
    k = cell_of(c, first, n, x)
    h, m, past = width_at(c, first, k), secant_at(c, first, n, k), x - c[first + k]
    if straight:
        return float(c[first + n + k] + m * past)
    left, right = slope_at(c, first, n, k), slope_at(c, first, n, k + 1)
    turn = (left + right - 2.0 * m) / h
    return float(c[first + n + k] + past * (left + past * ((m - left) / h - turn + past * turn / h)))


def integral_to(c: Any, first: int, n: int, straight: bool, x: float) -> float:
    """Return the integral, from the first sample to `x`, of the curve through `n` samples from c[first] on.

    If `straight`, the curve consists of straight lines, otherwise of shape-preserving cubics. `x` lies within
    the range of the abscissas.
    """
    last = cell_of(c, first, n, x)
    total = 0.0
    for k in range(last + 1):
        h, m = width_at(c, first, k), secant_at(c, first, n, k)
        past = h if k < last else x - c[first + k]
        low, bend, cubic = m, 0.0, 0.0
        if not straight:
            right = slope_at(c, first, n, k + 1)
            low = slope_at(c, first, n, k)
            turn = (low + right - 2.0 * m) / h
            bend, cubic = (m - low) / h - turn, turn / h
        total += past * (c[first + n + k] + past * (low / 2.0 + past * (bend / 3.0 + past * cubic / 4.0)))
    return float(total)
