"""One slot of a burst: what currents through it do, for many currents at once.

A slot begins just after the armature has turned in the pack, with the state in which the slot before has left
it, and lasts one period; its own dot falls a fixed time before its end. The current runs in straight lines
between nodes at even times, from where it was at the end of the slot before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final, Self

import numpy as np

from printhammer.drive.base import Drive
from printhammer.drive.segments import POLYNOMIAL, table
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.run.ensemble import MODE_NAMES, Ensemble

if TYPE_CHECKING:
    import numpy.typing as npt

    from printhammer.control.least_work.coil_force import CoilForce
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_SAMPLES: Final = 301
_IN_PACK: Final = {
    "loading": 1,
    "unloading": 2,
    "reloading": 3,
    "held on the loading branch": 1,
    "held on the unloading branch": 2,
}
_MANY: Final = 64
_LEAST_SPEED: Final = 0.03
_CLEAR: Final = 2e-6


@dataclass(frozen=True)
class SlotState:
    """How a slot begins.

    Attributes
    ----------
    x, v : float
        Displacement, m, and velocity, m/s.
    branch : int
        Code of the mode, as in `Strobes`, or -1 for none.
    memory : float
        As in `Strobes`, m.
    current : float
        Coil current, A.
    """

    x: float
    v: float
    branch: int
    memory: float
    current: float

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
    """What some currents do in a slot: arrays of shape (M,).

    Attributes
    ----------
    positive, net : array
        Work of the coil, J, good to about 1e-4 of itself.
    squared_current : array
        Integral of the squared current, A^2 s.
    force : array
        Largest force of the first dot, N; 0 without one.
    arrival : array
        Time of its touch since the slot began, s; NaN without one.
    extra_contacts : int array
        Further contacts.
    reloading : array
        How far the armature lagged, m, in the contact with which the slot begins: by which way it left the
        pack slower than `_LEAST_SPEED`, once clear of where it turned, or went into it again.
    ok : bool array
        Whether the run went as asked.
    """

    positive: FloatArray
    net: FloatArray
    squared_current: FloatArray
    force: FloatArray
    arrival: FloatArray
    extra_contacts: npt.NDArray[np.int64]
    reloading: FloatArray
    ok: npt.NDArray[np.bool_]


def node_times(duration: float, nodes: int) -> FloatArray:
    """Return the times of the nodes after the start of a slot, s, the start itself first."""
    return np.linspace(0.0, duration, nodes + 1)


def outcomes(
    hammer: Hammer,
    coil: CoilForce,
    begin: SlotState,
    currents: FloatArray,
    duration: float,
    tolerance: float,
    largest: float,
) -> Outcomes:
    """Run a slot with many currents.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    coil : CoilForce
        Force of its coil.
    begin : SlotState
        How the slot begins.
    currents : array, shape (M, nodes)
        Currents at the nodes after the first one, A.
    duration : float
        Of the slot, s.
    tolerance : float
        As for `printhammer.simulate`.
    largest : float
        Largest current that may occur, A.
    """
    assert hammer.front is not None
    grid = np.linspace(0.0, duration, _SAMPLES)
    nodes = node_times(duration, currents.shape[1])
    paths = np.concatenate([np.full((len(currents), 1), begin.current), currents], axis=1)
    result = _ensemble(hammer, begin, paths, duration, tolerance, largest).run(
        dots=True, strobes=[grid] * len(paths), threads=1 if len(paths) < _MANY else None, engine="plain"
    )
    assert result.strobes is not None
    assert result.dots is not None
    current = np.array([np.interp(grid, nodes, path) for path in paths])
    x, v = result.strobes.x, result.strobes.v
    power = coil(x, current) * v
    dots = result.dots
    arrival = np.where(dots.struck[:, 0], dots.flight_time[:, 0], np.nan)
    below = x < np.maximum.accumulate(x, axis=1) - _CLEAR
    leaving = below & (x > hammer.front) & ~(grid >= arrival[:, np.newaxis])
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


def slot_end(
    hammer: Hammer,
    begin: SlotState,
    currents: FloatArray,
    duration: float,
    tolerance: float,
    largest: float,
) -> SlotState:
    """Return how the slot after one with given currents, A, at its nodes begins."""
    path = np.concatenate([[begin.current], currents])[np.newaxis]
    result = _ensemble(hammer, begin, path, duration, tolerance, largest).run(
        strobes=[[duration]], threads=1, engine="plain"
    )
    found = result.strobes
    assert found is not None
    return SlotState(
        float(found.x[0, 0]),
        float(found.v[0, 0]),
        int(found.branch[0, 0]),
        float(found.memory[0, 0]),
        float(currents[-1]),
    )


def _ensemble(
    hammer: Hammer,
    begin: SlotState,
    paths: FloatArray,
    duration: float,
    tolerance: float,
    largest: float,
) -> Ensemble:
    drives = [
        # Thousands are made in a search: checks of what was just computed would take most of its time.
        _NodeDrive(
            NodeCurrent.model_construct(
                quantity="current", duration=duration, values=tuple(path), largest=largest
            ),
            [0.0],
        )
        for path in paths.tolist()
    ]
    return Ensemble(hammer, drives, duration, states=begin.row, tolerance=tolerance)
