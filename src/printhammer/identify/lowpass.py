"""Exact first-order low-pass filter for motions and waveforms; models sensors of limited bandwidth.

The output y of a sensor of bandwidth f (-3 dB) obeys tau y' = u - y with tau = 1 / (2 pi f). If u is a
polynomial p, a particular solution is p - tau p' + tau^2 p'' - ..., and the transient decays as exp(-t /
tau). The solution is assembled from the polynomial pieces of u, without sampling.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from printhammer.drive.input import read_number
from printhammer.drive.segments import EXPONENTIAL, POLYNOMIAL
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.readings import Readings


def time_constant(bandwidth: float | None) -> float:
    """Return the time constant [s] of a first-order sensor with a bandwidth [Hz]; 0 for None (unlimited)."""
    return 0.0 if bandwidth is None else 1.0 / (2.0 * math.pi * bandwidth)


def bandwidth_of(table: Readings) -> float | None:
    """Return the bandwidth stated in a comment of a table, Hz; None if unlimited."""
    text = table.comments.get("bandwidth", "")
    if text in ("", "none", "unlimited"):
        return None
    where = f"{table.path}: the comment 'bandwidth'"
    try:
        value = read_number(text, "Hz", where)
    except InputError as error:
        raise InputError(str(error), file=table.path, key="bandwidth", value=text) from None
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(
            f"{where}: {text}", file=table.path, key="bandwidth", value=text, expected="a positive number"
        )
    return value


def lowpass_motion(times: FloatArray, x: FloatArray, v: FloatArray, tau: float) -> FloatArray:
    """Low-pass filter the displacements of motions that are at rest before the first time.

    `x` and `v` contain the displacements [m] and velocities [m/s] of several motions, or their derivatives,
    at ascending times [s]; shape (times, motions), like the result. Between the times the displacement is the
    cubic Hermite interpolant. `tau` is the time constant of the filter, s.
    """
    if tau == 0.0 or len(times) < 2:
        return x.copy()
    h = np.diff(times)[:, np.newaxis]
    rise = np.diff(x, axis=0) / h
    second = (6.0 * rise - 4.0 * v[:-1] - 2.0 * v[1:]) / h
    third = 6.0 * (v[:-1] + v[1:] - 2.0 * rise) / (h * h)
    at_start = x[:-1] - tau * (v[:-1] - tau * (second - tau * third))
    at_end = x[1:] - tau * (v[1:] - tau * (second + third * h - tau * third))
    kept = np.exp(-h[:, 0] / tau).tolist()
    result = np.empty_like(x)
    for column, (start, end) in enumerate(zip(at_start.T.tolist(), at_end.T.tolist(), strict=True)):
        result[:, column] = _joined(float(x[0, column]), start, end, kept)
    return result


def lowpass_lines(times: FloatArray, values: FloatArray, tau: float) -> FloatArray:
    """Low-pass filter a piecewise linear signal, given by values at ascending times [s], shape (n,).

    At the first time the output equals the input. `tau` is the time constant of the filter, s.
    """
    if tau == 0.0 or len(times) < 2:
        return values.copy()
    h = np.diff(times)
    lag = tau * np.diff(values) / h
    at_start, at_end = (values[:-1] - lag).tolist(), (values[1:] - lag).tolist()
    return np.array(_joined(float(values[0]), at_start, at_end, np.exp(-h / tau).tolist()))


def _joined(first: float, at_start: list[float], at_end: list[float], kept: list[float]) -> list[float]:
    """Return the output of the filter at the start of the first piece, `first`, and at the end of each piece.

    `at_start` and `at_end` are the particular solutions at the start and at the end of each piece; `kept` is
    the fraction of the transient that is left at the end of the piece. The loop over floats is several times
    faster than array operations on short rows.
    """
    result = [first]
    value = first
    for start, end, fraction in zip(at_start, at_end, kept, strict=True):
        value = end + (value - start) * fraction
        result.append(value)
    return result


def lowpass_waveform(segments: FloatArray, t: npt.ArrayLike, tau: float) -> FloatArray:
    """Low-pass filter a waveform [A or N], fired at time 0; return the output at ascending times [s].

    The waveform is a segment table (`printhammer.drive.segments`) with finite support; the time constant
    `tau` [s] is positive.
    """
    times = np.asarray(t, dtype=np.float64)
    result = np.zeros(len(times))
    left = 0.0
    rows = segments.tolist()
    for number, row in enumerate(rows):
        last = number + 1 == len(rows)
        end = math.inf if last else rows[number + 1][0]
        inside = (times >= row[0]) & (times < end)
        here = _particular_solution(row, np.zeros(1), tau)[0]
        s = times[inside] - row[0]
        result[inside] = _particular_solution(row, s, tau) + (left - here) * np.exp(-s / tau)
        if not last:
            span = np.array([end - row[0]])
            left = float(_particular_solution(row, span, tau)[0] + (left - here) * math.exp(-span[0] / tau))
    return result


def _particular_solution(row: list[float], s: FloatArray, tau: float) -> FloatArray:
    """Return the particular solution of the low-pass filter for one segment, without the transient."""
    _start, kind, p0, p1, p2, p3 = row
    if kind == POLYNOMIAL:
        value = p0 + s * (p1 + s * (p2 + s * p3))
        return value - tau * (p1 + s * (2 * p2 + s * 3 * p3) - tau * (2 * p2 + 6 * p3 * s - tau * 6 * p3))
    if kind == EXPONENTIAL:
        left = 1.0 - p2 * tau
        # At equal decay rates the solution is s exp(-s / tau), the limit of the expression.
        left = left if abs(left) > 1e-6 else math.copysign(1e-6, left)
        return p0 + p1 / left * np.exp(-p2 * s)
    turn = p2 * tau
    return p0 + p1 * (np.sin(p2 * s + p3) - turn * np.cos(p2 * s + p3)) / (1.0 + turn * turn)
