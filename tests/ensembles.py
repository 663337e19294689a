"""Ensembles of many different members, and results of two ensembles compared.

Helpers only; assertions are in the tests that use them.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from tests import hammers

import printhammer as ph
from printhammer.kernel.lanes.layout import LANES
from printhammer.run.ensemble import Ensemble, EnsembleResult

SIZE = 3 * LANES + 100
TIMES = np.linspace(0.0, 7e-3, 600)


class Members:
    """Members of an ensemble, stored one by one, so that any subset can be run.

    The first `strange` members of ten are unsuitable for lanes: they start in the pack, on a
    surface, or fast. The range of the last hammer's magnet ends within reach.
    """

    def __init__(self, seed: int, size: int = SIZE, *, kinds: int = 6, strange: int = 1) -> None:
        rng = np.random.default_rng([37, seed])
        draw = hammers.Draw(rng)
        several = [hammers.crude(), *(draw() for _ in range(kinds - 1))]
        # Not so far above the highest that one pulse brings it to.
        several[-1] = several[0].replace({"magnet.range_max": 300e-6})
        self.hammers = [several[i] for i in rng.integers(kinds, size=size)]
        self.drives: list[Any] = []
        self.ends = rng.uniform(0.3e-3, 7e-3, size)
        self.states = np.empty((size, 2))
        self.strobes: list[npt.NDArray[np.float64]] = []
        for i, hammer in enumerate(self.hammers):
            period = rng.uniform(0.4e-3, 2e-3)
            self.drives.append(ph.PulseTrain(hammer.waveform, period=period, pulses=int(rng.integers(1, 7))))
            self.states[i] = rng.uniform(45e-6, 200e-6), rng.uniform(-1.0, 1.5)
            if i % 10 < strange:
                position, front = hammer.position, hammer.front
                assert position is not None
                assert front is not None
                self.states[i] = [(front + 30e-6, 0.5), (position, -0.2), (front, 0.1), (60e-6, 9.0)][
                    i // 10 % 4
                ]
            self.strobes.append(np.sort(rng.uniform(0.0, 7e-3, int(rng.integers(0, 12)))))

    def ensemble(self, which: Any = None, **options: Any) -> Ensemble:
        """Build the ensemble of all members, or of some members."""
        chosen = range(len(self.hammers)) if which is None else which
        return Ensemble(
            [self.hammers[i] for i in chosen],
            [self.drives[i] for i in chosen],
            self.ends[chosen],
            states=self.states[chosen],
            **options,
        )

    def run(self, which: Any = None, *, tolerance: float = 2e-11, **options: Any) -> EnsembleResult:
        """Return all results of the members `which` (default: all), unless `options` select results."""
        chosen = range(len(self.hammers)) if which is None else which
        given = {"dots": True, "strobes": [self.strobes[i] for i in chosen], "times": TIMES, **options}
        return self.ensemble(which, tolerance=tolerance).run(**given)


def rows(result: EnsembleResult, i: int) -> dict[str, npt.NDArray[Any]]:
    """Return all results of one member, without the padding to the longest member."""
    found = {name: np.atleast_1d(getattr(result, name)[i]) for name in ("status", "reached", "steps")}
    for name, table, mark in (("dots", result.dots, "fired_at"), ("strobes", result.strobes, "t")):
        if table is not None:
            kept = ~np.isnan(getattr(table, mark)[i])
            # Currents are there under a voltage only.
            columns = {key: column for key, column in vars(table).items() if column is not None}
            found.update({f"{name}.{key}": column[i][kept] for key, column in columns.items()})
    if result.x is not None:
        found["x"] = result.x[i]
    return found


def differing(
    one: EnsembleResult, other: EnsembleResult, which: Any = None, skip: tuple[str, ...] = ()
) -> list[Any]:
    """Return the members, with the names of the results, that are not bit-identical.

    Member i of `other` is member which[i] of `one`; results that one of the two lacks are ignored.
    """
    found = []
    for i in range(len(other.status)):
        mine, theirs = rows(one, i if which is None else which[i]), rows(other, i)
        found += [
            (i, name)
            for name in mine.keys() & theirs.keys()
            if name not in skip and mine[name].tobytes() != theirs[name].tobytes()
        ]
    return sorted(found)
