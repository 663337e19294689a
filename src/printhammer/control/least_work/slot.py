"""One slot of a burst: what currents through it do, for many currents at once.

A slot begins just after the armature has turned in the pack, with the state in which the slot before has left
it, and lasts one period; its own dot falls a fixed time before its end. The current runs in straight lines
between nodes at even times, from where it was at the end of the slot before.

The force that the coil adds to that of the magnet, for many places and currents at once.
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

_SAMPLES: Final = 301  # Instants of a slot at which power and motion are looked at
_IN_PACK: Final = {
    "loading": 1,
    "unloading": 2,
    "reloading": 3,
    "held on the loading branch": 1,
    "held on the unloading branch": 2,
}
"""Branch as `Ensemble` takes it, by the mode."""

_MANY: Final = 64  # Number of runs from which on threads are worth their while
_LEAST_SPEED: Final = 0.03  # Speed with which the armature is to leave the pack, m/s
_CLEAR: Final = 2e-6  # Distance from where it turned from which on it leaves, m
# Weight of the squared current beside the positive work, so that no current is spent for nothing
_SMOOTHING: Final = 1e-3
RELOADING: Final = 1e-6  # Lag in the pack that costs as much as the loading work, m


@dataclass(frozen=True)
class SlotState:
    """How a slot begins."""

    # Displacement, m, and velocity, m/s
    x: float
    v: float
    branch: int  # Code of the mode, as in `Strobes`, or -1 for none
    memory: float  # As in `Strobes`, m
    current: float  # Coil current, A

    @property
    def row(self) -> list[float]:
        """The state as `Ensemble` takes it: outside the pack place and speed are all."""
        branch = _IN_PACK.get(MODE_NAMES[self.branch] if self.branch >= 0 else "", 0)
        return [self.x, self.v, float(branch), self.memory] if branch else [self.x, self.v]


class NodeCurrent(Waveform):
    """A current in straight lines between nodes at even times, as many a search makes them."""

    shape: ClassVar[str] = "nodes"
    duration: float
    values: tuple[float, ...]
    largest: float

    def segments(self) -> FloatArray:
        """Return the segment table: a straight line from node to node."""
        values = np.array(self.values)
        starts = node_times(self.duration, values.size - 1)
        slopes = np.diff(values) / np.diff(starts)
        rows = zip(starts[:-1].tolist(), values[:-1].tolist(), slopes.tolist(), strict=True)
        return table([(start, POLYNOMIAL, a, b, 0.0, 0.0) for start, a, b in rows], self.duration)

    def scaled(self, factor: float) -> Self:
        """Return the same with every value multiplied by a factor."""
        changed = {"values": tuple(factor * value for value in self.values)}
        return self.model_copy(update={**changed, "largest": abs(factor) * self.largest})


class _NodeDrive(Drive):
    """One such current, fired once."""

    bounded = True

    @property
    def largest_pulse(self) -> float:
        """Largest value allowed; one for all currents of a search, so that all runs have the same scales."""
        assert isinstance(self.waveform, NodeCurrent)
        return self.waveform.largest


@dataclass(frozen=True)
class Outcomes:
    """What some currents do in a slot: arrays of shape (M,)."""

    # Work of the coil, J, good to about 1e-4 of itself
    positive: FloatArray
    net: FloatArray
    squared_current: FloatArray  # Integral of the squared current, A^2 s
    force: FloatArray  # Largest force of the first dot, N; 0 without one
    arrival: FloatArray  # Time of its touch since the slot began, s; NaN without one
    extra_contacts: IntArray  # Further contacts
    # How far the armature lagged, m, in the contact with which the slot begins: by which way it left
    # the pack slower than `_LEAST_SPEED`, once clear of where it turned, or went into it again
    reloading: FloatArray
    ok: BoolArray  # Whether the run went as asked


def node_times(duration: float, nodes: int) -> FloatArray:
    """Return the times of the nodes after the start of a slot, s, the start itself first."""
    return np.linspace(0.0, duration, nodes + 1)


@dataclass(frozen=True)
class Task:
    """What the slots of a burst have in common."""

    hammer: Hammer  # The hammer
    coil: CoilForce  # Force of its coil
    largest: float  # Largest current of either sign, A
    slew: float  # Largest slope of the current of either sign, A/s
    force: float  # Least force of a dot, N
    loading: float  # Loading work of such a dot, J, by which work is measured
    heat: bool  # Whether the squared current is to be least instead of the positive work
    tolerance: float  # As for `printhammer.simulate`

    def run(self, begin: SlotState, currents: FloatArray, duration: float, tolerance: float) -> Outcomes:
        """Run a slot of some duration, s, with many currents (M, nodes), A, at the nodes after the first."""
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
        """Return how the slot after one with some currents (nodes,), A, begins."""
        path = np.concatenate([[begin.current], currents])[np.newaxis]
        ensemble = self._ensemble(begin, path, duration, self.tolerance)
        return end_of(ensemble, duration, float(currents[-1]))

    def cost(self, outcomes: Outcomes, duration: float) -> FloatArray:
        """Return what is to be least, in parts of the loading work.

        The net work counts as well, since it grows with what the backstop takes. Lagging in the pack is dear:
        where the armature went into it again, the law as printed would jump to the loading branch, and the
        pack give back more than it does once unloaded.
        """
        heat = outcomes.squared_current / (self.largest**2 * duration)
        spent = heat if self.heat else outcomes.positive / self.loading + _SMOOTHING * heat
        return np.asarray(spent + outcomes.net / self.loading + outcomes.reloading / RELOADING)

    def _ensemble(self, begin: SlotState, paths: FloatArray, duration: float, tolerance: float) -> Ensemble:
        # Thousands are made in a search: checks of what was just computed would take most of its time.
        constants: dict[str, Any] = {"quantity": "current", "duration": duration, "largest": self.largest}
        drives = [
            _NodeDrive(NodeCurrent.model_construct(**constants, values=tuple(path)), [0.0])
            for path in paths.tolist()
        ]
        return Ensemble(self.hammer, drives, duration, states=begin.row, tolerance=tolerance)


def end_of(ensemble: Ensemble, end: float, current: float) -> SlotState:
    """Return the state at the end of a run, s, where the current is known, A."""
    strobes = ensemble.run(strobes=[[end]], threads=1, engine="plain").strobes
    assert strobes is not None
    x, v, memory = (float(column[0, 0]) for column in (strobes.x, strobes.v, strobes.memory))
    return SlotState(x, v, int(strobes.branch[0, 0]), memory, current)


_PLACES, _CURRENTS = 161, 33  # Numbers of nodes of the surface
_BEHIND: Final = 0.2  # How far it reaches behind the backstop, in parts of the stroke


class CoilForce:
    """Fm(x, I) - Fm(x, 0) as a smooth surface through values of the law, for searches.

    Its error is about 1e-8 of the largest force. What a search has found is computed anew with the law
    itself, see `printhammer.run.energy`. The hammer has magnet, pack and backstop; the surface
    reaches to currents of `largest`, A, of either sign.
    """

    def __init__(self, hammer: Hammer, largest: float) -> None:
        static = StaticForce(hammer)
        low = hammer.origin - _BEHIND * (static.front - hammer.origin)
        # About a fifth of the stroke behind the backstop; a law that is singular there ends before it.
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
        """Return the force, N, at displacements, m, and currents, A; NaN where x is NaN."""
        inside = np.clip(np.nan_to_num(x, nan=self._ends[0]), *self._ends)
        force = self._spline.ev(inside, current)
        return np.where(np.isnan(x), np.nan, force)
