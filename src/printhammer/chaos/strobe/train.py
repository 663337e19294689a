"""Trains from rest to their last strobe point, together on all cores, and verdicts on them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from printhammer.chaos.orbits.settled import Settled, settled
from printhammer.chaos.strobe.verdict import Verdict, period_of, repeats, verdict
from printhammer.results import Declared, part
from printhammer.run.ensemble import MODE_NAMES, Ensemble
from printhammer.run.window import window_of
from printhammer.support.threads import Progress, mapped, shifted

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.derivatives.states import Exponent
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray, IntArray

HELD_BRANCHES: Final = {
    MODE_NAMES.index(f"held on the {branch} branch"): MODE_NAMES.index(branch)
    for branch in ("loading", "unloading")
}
"""Branches of the pack on which the armature rests, and those that they are part of."""

_BEFORE: Final = 100
"""Firings before an exponent counts."""


class Train(Declared):
    """A regime fired from a state on, with nothing fired before."""

    regime: Regime = part("hammer and periodic drive")
    drive: Drive = part("so many pulses, or the endless force")
    state: tuple[float, float] | None = part(
        "displacement, m, and velocity, m/s, at time 0", more="None for the rest state", default=None
    )

    @classmethod
    def of(cls, regime: Regime, firings: int, state: tuple[float, float] | None = None) -> Self:
        """Make a train for states up to a firing.

        One more is fired: runs end there, so that no state depends on where that is.
        """
        return cls(regime, regime.pulses(firings + 1), state)

    @property
    def hammer(self) -> Hammer:
        """The hammer."""
        return self.regime.hammer

    @property
    def period(self) -> float:
        """Time between firings, s."""
        return self.regime.period

    def times(self, firings: IntArray) -> FloatArray:
        """Return the times of firings, s, the very first one being number 1."""
        if len(self.drive.times) > 1:
            return np.asarray(self.drive.times[firings - 1], dtype=np.float64)
        return np.asarray(self.drive.times[0] + self.period * (firings - 1.0), dtype=np.float64)


@dataclass(frozen=True)
class States:
    """States of one train; see `printhammer.chaos.strobe.points.Strobe`."""

    t: FloatArray
    x: FloatArray
    v: FloatArray
    branch: IntArray
    memory: FloatArray
    status: str

    def distances(self, train: Train) -> FloatArray:
        """Return how far the states are from repeating, see `printhammer.chaos.strobe.verdict.repeats`."""
        front = math.inf if train.hammer.front is None else train.hammer.front
        return repeats(self.points, pack_branches(self.x, self.branch, front), _scales(train))

    @property
    def points(self) -> FloatArray:
        """Displacement, velocity and memory, a row for each firing."""
        return np.column_stack([self.x, self.v, self.memory])

    def scaled(self, train: Train) -> FloatArray:
        """Return the points in half-widths of the window."""
        return np.asarray(self.points / _scales(train))

    def settled(self, train: Train, distances: FloatArray) -> Settled | None:
        """Return to what the train has settled, from successive states; None if they do not repeat."""
        period = period_of(distances)
        if period is None:
            return None
        return settled(train.regime.at_firings, self.points, period, _scales(train))


def _scales(train: Train) -> FloatArray:
    width, speed = window_of(train.hammer, train.drive).half_widths
    return np.array([width, speed, width])


def pack_branches(x: FloatArray, branch: npt.NDArray[np.integer[Any]], front: float | FloatArray) -> IntArray:
    """Return the branches of the pack on which states lie, 0 outside of it."""
    branches = np.where(x > front, branch, 0).astype(np.int64)
    for held, part_of in HELD_BRANCHES.items():
        branches[branches == held] = part_of
    return branches


def run_trains(
    trains: Sequence[Train],
    chosen: IntArray,
    tolerance: float,
    judged: tuple[int, int] | None,
    *,
    every_exponent: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> tuple[list[States], list[Verdict | None]]:
    """Return the states of trains at chosen firings, each at the phase of its regime, and verdicts on them.

    A verdict is about the firings from the first to the last that are `judged`; there is none where that is
    None. Exponents of periodic trains are computed only where `every_exponent` is true.
    """
    if not trains:
        return [], []
    total = len(trains)
    firings = np.arange(judged[0], judged[1] + 1) if judged is not None else np.zeros(0, np.int64)
    own = [train.times(chosen) + train.regime.phase * train.period for train in trains]
    theirs = [train.times(firings) for train in trains]
    every = [np.union1d(mine, other) for mine, other in zip(own, theirs, strict=True)]
    after = np.array([max(int(chosen.max(initial=1)), int(firings.max(initial=1))) + 1])
    ends = [float(train.times(after)[0]) for train in trains]
    begun = [train.state for train in trains]
    ensemble = Ensemble(
        [train.hammer for train in trains],
        [train.drive for train in trains],
        ends,
        states=None if None in begun else np.array(begun),
        tolerance=tolerance,
    )
    tell = shifted(progress, 0, total if judged is None else 2 * total)
    result = ensemble.run(strobes=every, threads=threads, progress=tell)
    table, names = result.strobes, result.status_names
    assert table is not None

    def at(i: int, times: FloatArray) -> States:
        rows = np.searchsorted(every[i], times)
        x, v, branch, memory = (
            part[i, rows].copy() for part in (table.x, table.v, table.branch, table.memory)
        )
        return States(times, x, v, branch, memory, names[i])

    states = [at(i, times) for i, times in enumerate(own)]
    if judged is None:
        return states, [None] * total
    stopped = [names[i] if result.reached[i] < theirs[i][-1] else "" for i in range(total)]
    watched = [at(i, times) for i, times in enumerate(theirs)]
    distances = [of_train.distances(train) for of_train, train in zip(watched, trains, strict=True)]
    ends_at = mapped(
        lambda i: None if stopped[i] else watched[i].settled(trains[i], distances[i]), range(total), threads
    )
    open_cases = [
        i for i in range(total) if not stopped[i] and (every_exponent or period_of(distances[i]) is None)
    ]
    tell = shifted(progress, 2 * total - len(open_cases), 2 * total)
    exponents = exponents_of(
        [trains[i] for i in open_cases], judged, tolerance, threads=threads, progress=tell
    )
    growth = dict(zip(open_cases, exponents, strict=True))
    return states, [
        verdict(distances[i], judged, tolerance, growth.get(i), stopped[i], ends_at[i]) for i in range(total)
    ]


def exponents_onward(
    begun: Sequence[tuple[Regime, tuple[float, float]]],
    points: int,
    tolerance: float,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[Exponent]:
    """Return the largest exponents of trains that go on from states at a firing.

    Over so many points, after a hundred firings.
    """
    window = _BEFORE + 1, _BEFORE + points
    # What is left of the pulses before is left out: it is the same for all neighbouring motions.
    trains = [Train(regime, regime.pulses(window[1] + 2), state) for regime, state in begun]
    return exponents_of(trains, window, tolerance, threads=threads, progress=progress)


def exponents_of(
    trains: Sequence[Train],
    firings: tuple[int, int],
    tolerance: float,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[Exponent]:
    """Return the largest exponents of trains, from the first to the last of some firings, on all cores."""
    from printhammer.derivatives.states import strobe_exponent

    return mapped(
        lambda train: strobe_exponent(
            train.hammer,
            train.drive,
            train.period,
            first=firings[0],
            last=firings[1],
            state=train.state,
            tolerance=tolerance,
        ),
        trains,
        threads,
        progress,
    )
