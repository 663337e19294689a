"""Slot of a burst: simulation of many trial currents at once, and the cost of each trial.

A slot begins just after the armature has turned in the pack, with the final state of the preceding slot, and
lasts one period; its own dot is due a fixed time before its end. The current is piecewise linear between
equidistant nodes and continues from the end of the preceding slot. The coil force is evaluated by a spline,
for many displacements and currents at once.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Self

import numpy as np
from scipy.interpolate import RectBivariateSpline

from printhammer.drive.base import Drive
from printhammer.drive.segments import POLYNOMIAL, table
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.run.ensemble import MODE_NAMES, Ensemble
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

_SAMPLES: Final = 301  # Samples of power and motion per slot; arbitrary
_IN_PACK: Final = {
    "loading": 1,
    "unloading": 2,
    "reloading": 3,
    "held on the loading branch": 1,
    "held on the unloading branch": 2,
}
"""Pack branch code for `Ensemble`, by the name of the mode."""

_MANY: Final = 64  # Smallest number of simulations that is distributed over threads; arbitrary
_LEAST_SPEED: Final = 0.03  # Least speed at which the armature should leave the pack, m/s; arbitrary
_CLEAR: Final = 2e-6
"""Distance from the turning point beyond which the armature is leaving the pack, m; arbitrary."""
# Weight of the squared current relative to the positive work, a regularisation; arbitrary
_SMOOTHING: Final = 1e-3
RELOADING: Final = 1e-6  # Lag in the pack that costs as much as the loading work, m; arbitrary


@dataclass(frozen=True)
class SlotState:
    """State of the hammer at the beginning of a slot."""

    # Displacement, m, and velocity, m/s
    x: float
    v: float
    branch: int  # Mode code, as in `Strobes`, or -1 for none
    memory: float  # Memory of the pack, m, as in `Strobes`
    current: float  # Coil current, A

    @property
    def row(self) -> list[float]:
        """Initial state for `Ensemble`; outside the pack, displacement and velocity only."""
        branch = _IN_PACK.get(MODE_NAMES[self.branch] if self.branch >= 0 else "", 0)
        return [self.x, self.v, float(branch), self.memory] if branch else [self.x, self.v]


class NodeCurrent(Waveform):
    """A piecewise linear current between equidistant nodes, cheap to construct in large numbers."""

    shape: ClassVar[str] = "nodes"
    duration: float
    values: tuple[float, ...]
    largest: float

    def segments(self) -> FloatArray:
        """Return the segment table: one straight line per node interval."""
        values = np.array(self.values)
        starts = node_times(self.duration, values.size - 1)
        slopes = np.diff(values) / np.diff(starts)
        rows = zip(starts[:-1].tolist(), values[:-1].tolist(), slopes.tolist(), strict=True)
        return table([(start, POLYNOMIAL, a, b, 0.0, 0.0) for start, a, b in rows], self.duration)

    def scaled(self, factor: float) -> Self:
        """Return a copy with every value multiplied by `factor`."""
        changed = {"values": tuple(factor * value for value in self.values)}
        return self.model_copy(update={**changed, "largest": abs(factor) * self.largest})


class _NodeDrive(Drive):
    """Drive that fires one `NodeCurrent` at the start of a slot."""

    bounded = True

    @property
    def largest_pulse(self) -> float:
        """Current limit, A, common to all currents of a search, so that all simulations are scaled alike."""
        assert isinstance(self.waveform, NodeCurrent)
        return self.waveform.largest


@dataclass(frozen=True)
class Outcomes:
    """Outcomes of many trial currents in a slot: arrays with one element per current."""

    # Coil work, J, accurate to about 1e-4 relative
    positive: FloatArray
    net: FloatArray
    squared_current: FloatArray  # Integral of the squared current, A^2 s
    force: FloatArray  # Peak force of the first dot, N; 0 without a dot
    arrival: FloatArray  # Touch of the first dot since the slot began, s; NaN without a dot
    extra_contacts: IntArray  # Number of extra contacts
    # Lag of the armature, m, in the contact that opens the slot: the distance lost, beyond `_CLEAR` of the
    # turning point, by leaving the pack slower than `_LEAST_SPEED` or by going back into it
    reloading: FloatArray
    ok: BoolArray  # Whether the simulation reached its end


def node_times(duration: float, nodes: int) -> FloatArray:
    """Return the times of the nodes of a slot's current, s after the start of the slot; the first is 0."""
    return np.linspace(0.0, duration, nodes + 1)


@dataclass(frozen=True)
class Task:
    """Settings common to all slots of a burst: hammer, limits, required force, objective."""

    hammer: Hammer  # Driven hammer
    coil: CoilForce  # Force of the hammer's coil
    largest: float  # Largest absolute value of the current, A
    slew: float  # Largest absolute slope of the current, A/s
    force: float  # Least force of a dot, N
    loading: float  # Loading work of a dot with that force, J; the unit of the cost
    heat: bool  # Whether to minimise the squared current instead of the positive work
    tolerance: float  # Error tolerance per integration step

    def run(self, begin: SlotState, currents: FloatArray, duration: float, tolerance: float) -> Outcomes:
        """Simulate a slot of `duration` [s] from the state `begin` with each of M trial currents.

        `currents` are the currents [A] at the nodes, shape (M, nodes), without the node at the start.
        """
        front = self.hammer.front
        assert front is not None
        grid = np.linspace(0.0, duration, _SAMPLES)
        nodes = node_times(duration, currents.shape[1])
        paths = np.concatenate([np.full((len(currents), 1), begin.current), currents], axis=1)
        result = self._ensemble(begin, paths, duration, tolerance).run(
            dots=True, strobes=[grid] * len(paths), threads=1 if len(paths) < _MANY else None, engine="plain"
        )
        strobes, dots = result.strobes, result.dots
        assert strobes is not None
        assert dots is not None
        current = np.array([np.interp(grid, nodes, path) for path in paths])
        x, v = strobes.x, strobes.v
        power = self.coil(x, current) * v
        arrival = np.where(dots.struck[:, 0], dots.flight_time[:, 0], np.nan)
        below = x < np.maximum.accumulate(x, axis=1) - _CLEAR
        leaving = below & (x > front) & ~(grid >= arrival[:, np.newaxis])
        return Outcomes(
            positive=np.trapezoid(np.maximum(power, 0.0), grid, axis=1),
            net=np.asarray(np.trapezoid(power, grid, axis=1)),
            squared_current=np.trapezoid(current**2, grid, axis=1),
            force=np.nan_to_num(dots.peak_force[:, 0]),
            arrival=arrival,
            extra_contacts=dots.extra_contacts[:, 0],
            reloading=np.trapezoid(np.where(leaving, np.maximum(v + _LEAST_SPEED, 0.0), 0.0), grid, axis=1),
            ok=result.ok,
        )

    def end(self, begin: SlotState, currents: FloatArray, duration: float) -> SlotState:
        """Return the state at the end of a slot; `currents` are nodal currents [A], as a row in `run`."""
        path = np.concatenate([[begin.current], currents])[np.newaxis]
        ensemble = self._ensemble(begin, path, duration, self.tolerance)
        return end_of(ensemble, duration, float(currents[-1]))

    def cost(self, outcomes: Outcomes, duration: float) -> FloatArray:
        """Compute the objective of trial currents from their outcomes, in units of the loading work of a dot.

        The net work is included since it grows with the backstop loss. A slow or interrupted departure from
        the pack is penalised: if the armature re-enters the pack during unloading, the pack law of the paper
        jumps to the loading branch, and the pack returns more energy than after an uninterrupted unloading.
        """
        heat = outcomes.squared_current / (self.largest**2 * duration)
        spent = heat if self.heat else outcomes.positive / self.loading + _SMOOTHING * heat
        return np.asarray(spent + outcomes.net / self.loading + outcomes.reloading / RELOADING)

    def _ensemble(self, begin: SlotState, paths: FloatArray, duration: float, tolerance: float) -> Ensemble:
        # A search creates thousands of drives; validating their values would dominate its time.
        constants: dict[str, Any] = {"quantity": "current", "duration": duration, "largest": self.largest}
        drives = [
            _NodeDrive(NodeCurrent.model_construct(**constants, values=tuple(path)), [0.0])
            for path in paths.tolist()
        ]
        return Ensemble(self.hammer, drives, duration, states=begin.row, tolerance=tolerance)


def end_of(ensemble: Ensemble, end: float, current: float) -> SlotState:
    """Return the final state of a simulation that ends at `end` [s], with a known final current [A]."""
    strobes = ensemble.run(strobes=[[end]], threads=1, engine="plain").strobes
    assert strobes is not None
    x, v, memory = (float(column[0, 0]) for column in (strobes.x, strobes.v, strobes.memory))
    return SlotState(x, v, int(strobes.branch[0, 0]), memory, current)


_PLACES, _CURRENTS = 161, 33  # Numbers of spline nodes over displacement and current; arbitrary
_BEHIND: Final = 0.2  # Range of the spline behind the backstop, as a fraction of the stroke; arbitrary


class CoilForce:
    """Coil force Fm(x, I) - Fm(x, 0) as a spline, for fast evaluation in searches.

    The error of the spline is about 1e-8 of the largest force. The results of a search are recomputed with
    the law of the magnet itself, see `printhammer.run.energy`. The hammer needs magnet, pack and backstop;
    the spline covers currents up to `largest` [A] of either sign.
    """

    def __init__(self, hammer: Hammer, largest: float) -> None:
        static = StaticForce(hammer)
        low = hammer.origin - _BEHIND * (static.front - hammer.origin)
        # A fifth of the stroke behind the backstop, or less if the law is singular there.
        low = max(low, hammer.origin - _BEHIND * (hammer.origin - static.low))
        places = np.linspace(low, static.end, _PLACES)
        currents = np.linspace(-largest, largest, _CURRENTS)
        force = [
            static.magnet(x, current) - static.magnet(x)
            for x, current in itertools.product(places.tolist(), currents.tolist())
        ]
        table = np.array(force).reshape(places.size, currents.size)
        self._spline = RectBivariateSpline(places, currents, table, kx=5, ky=3)
        self._ends = float(places[0]), float(places[-1])

    def __call__(self, x: FloatArray, current: FloatArray) -> FloatArray:
        """Evaluate the force [N] at displacements [m] and currents [A]; NaN where x is NaN."""
        inside = np.clip(np.nan_to_num(x, nan=self._ends[0]), *self._ends)
        force = self._spline.ev(inside, current)
        return np.where(np.isnan(x), np.nan, force)
