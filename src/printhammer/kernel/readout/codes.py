"""Frequency-time map, computed in pieces: rates and firing times of its runs, displacements as codes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

GAP = 65535
"""Code of a cell without a displacement; codes of known displacements are 0 to 65534."""
_STEEPEST = 1e38
"""Largest number of codes per metre; close to the largest float32, so that the product stays finite."""


def write_rates(low: float, high: float, rates: Any) -> None:
    """Write evenly spaced rates [Hz] from `low` to `high` to the array `rates`, like `numpy.linspace`."""
    last = rates.shape[0] - 1
    step = (high - low) / max(last, 1)
    for i in range(last + 1):
        rates[i] = i * step + low
    if last > 0:
        rates[last] = high


def write_trains(rates: Any, slots: Any, pattern: bool, starts: Any, firings: Any) -> None:
    """Write the firing times [s] of a pulse train at each rate, and the start index of each train.

    `slots`, int64, are the slot numbers of the firings. With `pattern`, the time of a firing is its slot
    number divided by the rate, otherwise its slot number multiplied by the rounded period.
    """
    count = slots.shape[0]
    starts[0] = 0
    for i in range(rates.shape[0]):
        starts[i + 1] = (i + 1) * count
        for k in range(count):
            firings[i * count + k] = slots[k] / rates[i] if pattern else slots[k] * (1.0 / rates[i])


def widen_range(x: Any, ends: Any) -> None:
    """Extend the range `ends` [m], shape (2,), to include all known displacements of `x`, float32."""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            if math.isfinite(x[i, j]):
                ends[0] = min(ends[0], x[i, j])
                ends[1] = max(ends[1], x[i, j])


def write_codes(x: Any, low: float, high: float, codes: Any) -> None:
    """Write displacements as codes from 0 (at `low` [m]) to 65534 (at `high` [m]); `GAP` if unknown.

    `x` is float32 with two axes. `codes` is int64 with one axis: the codes are unsigned integers of 16 bits,
    row after row, four in each element, the first in the lowest bits.
    """
    least, span = np.float32(low), np.float32(high - low)
    # Without motion, both ends are adjacent floats.
    steep = np.float32(min((GAP - 1) / (high - low), _STEEPEST))
    for at in range(codes.shape[0]):
        codes[at] = 0
    at = 0
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            code = GAP
            if not math.isnan(x[i, j]):
                scaled = min(x[i, j] - least, span) * steep
                code = int(min(max(scaled, np.float32(0.0)), np.float32(GAP - 1)))
            # The highest bit of an element is its sign.
            codes[at // 4] += (code - (GAP + 1) if at % 4 == 3 and code > GAP // 2 else code) << (
                16 * (at % 4)
            )
            at += 1


def write_struck(dots: Any, starts: Any, firings: int, struck: Any) -> None:
    """Write 1 to `struck` for each firing that made a dot, else 0.

    Each member of the ensemble has `firings` firings.
    `dots` and `starts` are `Kept.dots` and `Kept.dot_starts` of :mod:`printhammer.kernel.lanes.batch`.
    """
    for member in range(starts.shape[0] - 1):
        for k in range(firings):
            struck[member * firings + k] = 1 if dots[starts[member] + k, 0] > 0.0 else 0
