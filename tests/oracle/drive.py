"""Current or force of a drive as Taylor series, from the formulas of its waveform; part of the oracle.

No segment tables of the compiled kernel are used, except the knots of a sampled waveform: between
two of them a cubic is fitted to the values of the waveform.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from tests.oracle.series import ORDER, Array

_DEGREES = np.arange(ORDER + 1)

TAIL = 27.6310211159
"""Decay constants after which a tail is defined as zero (1e-12 of its start is left)."""


@dataclass(frozen=True)
class Piece:
    """poly(s) + exp_size exp(-exp_rate s) + sin_size sin(sin_rate s + sin_phase), s the time since ``start``.

    ``start`` and ``end`` are counted from the firing, s.
    """

    start: float
    end: float
    poly: tuple[float, ...] = ()
    exp_size: float = 0.0
    exp_rate: float = 0.0
    sin_size: float = 0.0
    sin_rate: float = 0.0
    sin_phase: float = 0.0

    def series(self, s: float, h: float) -> Array:
        """Coefficients in (time - now)/h at ``s`` after the start."""
        out = np.zeros(ORDER + 1)
        if self.poly:
            out[: len(self.poly)] = self._shifted(s, h)
        if self.exp_size:
            out += self.exp_size * math.exp(-self.exp_rate * s) * _exponential(-self.exp_rate * h)
        if self.sin_size:
            angle = self.sin_rate * s + self.sin_phase
            cycle = np.array([math.sin(angle), math.cos(angle), -math.sin(angle), -math.cos(angle)])
            out += self.sin_size * _exponential(self.sin_rate * h) * cycle[_DEGREES % 4]
        return out

    def _shifted(self, s: float, h: float) -> list[float]:
        """Return the coefficients of poly(s + h x) in x, by Horner's rule."""
        shifted = [0.0] * len(self.poly)
        for coefficient in reversed(self.poly):
            for k in range(len(shifted) - 1, 0, -1):
                shifted[k] = shifted[k] * s + shifted[k - 1] * h
            shifted[0] = shifted[0] * s + coefficient
        return shifted


def _exponential(rate: float) -> Array:
    """Return the coefficients of exp(rate x)."""
    factors = np.ones(ORDER + 1)
    factors[1:] = rate / _DEGREES[1:]
    return np.asarray(np.cumprod(factors))


def waveform_pieces(waveform: Any) -> list[Piece]:
    """Write one pulse of a waveform, fired at zero, as analytic pieces."""
    shape = waveform.shape
    if shape == "chain":
        # What a part has left when the next one begins is cut off.
        ends = [offset for offset, _part in waveform.parts[1:]] + [math.inf]
        return [
            replace(piece, start=piece.start + offset, end=min(piece.end + offset, end))
            for (offset, part), end in zip(waveform.parts, ends, strict=True)
            for piece in waveform_pieces(part)
            if piece.start + offset < end
        ]
    if shape == "sampled":
        return _sampled_pieces(waveform)
    a = float(waveform.amplitude)
    if shape == "sine":
        rate = 2.0 * math.pi * float(waveform.frequency)
        return [Piece(0.0, math.inf, sin_size=a, sin_rate=rate, sin_phase=float(waveform.phase))]
    width = float(waveform.width)
    if shape == "half-sine":
        return [Piece(0.0, width, sin_size=a, sin_rate=math.pi / width)]
    rise = float(waveform.rise)
    if shape == "rectangle":
        decay = float(waveform.decay)
        if rise > 0.0:
            pieces = [Piece(0.0, width, poly=(a,), exp_size=-a, exp_rate=1.0 / rise)]
            last = -a * math.expm1(-width / rise)
        else:
            pieces = [Piece(0.0, width, poly=(a,))]
            last = a
        if decay > 0.0:
            pieces.append(Piece(width, width + TAIL * decay, exp_size=last, exp_rate=1.0 / decay))
        return pieces
    if shape == "trapezoid":
        fall = float(waveform.fall)
        pieces = []
        if rise > 0.0:
            pieces.append(Piece(0.0, rise, poly=(0.0, a / rise)))
        if width > 0.0:
            pieces.append(Piece(rise, rise + width, poly=(a,)))
        if fall > 0.0:
            pieces.append(Piece(rise + width, rise + width + fall, poly=(a, -a / fall)))
        return pieces
    raise ValueError(f"the reference knows no waveform shape {shape!r}")


def _sampled_pieces(waveform: Any) -> list[Piece]:
    knots = np.asarray(waveform.segments())[:, 0]
    pieces = []
    for start, end in itertools.pairwise(knots):
        span = end - start
        nodes = np.array([0.05, 0.35, 0.65, 0.95])
        values = np.asarray(waveform.value(start + span * nodes))
        scaled = np.linalg.solve(nodes[:, None] ** np.arange(4), values)
        check = float(np.asarray(waveform.value(np.array([start + 0.5 * span])))[0])
        if abs(np.polyval(scaled[::-1], 0.5) - check) > 1e-9 * max(np.abs(values).max(), 1e-300):
            raise ValueError("the sampled waveform is no cubic between its knots")
        pieces.append(Piece(float(start), float(end), poly=tuple(scaled / span ** np.arange(4))))
    return pieces


class ReferenceDrive:
    """Current (or force) of a drive at any time, as a series, and the times at which it is not analytic."""

    def __init__(self, drive: Any) -> None:
        if drive.quantity == "voltage":
            raise ValueError("the drive is a voltage, the reference integrates currents and forces")
        self.is_current = drive.quantity == "current"
        self.add = drive.overlap == "add"
        self.times = [float(time) for time in np.atleast_1d(drive.times)]
        waveforms = getattr(drive, "waveforms", None) or (drive.waveform,) * len(self.times)
        once = {id(waveform): waveform_pieces(waveform) for waveform in waveforms}
        self.pieces = [once[id(waveform)] for waveform in waveforms]
        self.support = max((piece.end for pieces in once.values() for piece in pieces), default=0.0)
        edges = {
            time + edge
            for time, pieces in zip(self.times, self.pieces, strict=True)
            for piece in pieces
            for edge in (piece.start, piece.end)
        }
        self.edges = sorted(edge for edge in edges.union(self.times) if math.isfinite(edge))

    def next_edge(self, t: float) -> float:
        """Return the first time after ``t`` where a pulse, or a piece of one, begins or ends, or infinity."""
        place = bisect_right(self.edges, t)
        return self.edges[place] if place < len(self.edges) else math.inf

    def series(self, t: float, h: float) -> Array:
        """Coefficients in (time - t)/h, valid up to the next edge."""
        out = np.zeros(ORDER + 1)
        latest = bisect_right(self.times, t) - 1
        for i in range(latest, -1, -1):
            fired = self.times[i]
            for piece in self.pieces[i]:
                # Edges are compared as the sums they are, so that none is missed by a rounding.
                if fired + piece.start <= t < fired + piece.end:
                    out += piece.series(t - (fired + piece.start), h)
            if not self.add or t - fired > self.support:
                break
        return out
