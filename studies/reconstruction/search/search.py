"""The search: a Sobol sample, then CMA-ES from its best points and differential steps in the feasible region.

CMA-ES: Hansen, "The CMA evolution strategy: a tutorial" (2016), run as independent islands that restart when
they no longer improve; the differential steps are those of `explorer`. The seed determines everything. Each
candidate is a line of the log, so that a search that was stopped can be resumed without computing logged
candidates again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError, missing_extra
from printhammer.hammer.hammer import load
from printhammer.results import Declared, part
from studies.reconstruction.search.evaluation import AIMS, WEIGHTS, Aim, losses_digest, scored
from studies.reconstruction.search.explorer import Explorer
from studies.reconstruction.search.log import Log, read_search
from studies.reconstruction.search.space import SHAPES, VARIABLES, Shape, point_of, values_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Executor
    from pathlib import Path

    from printhammer.support.arrays import FloatArray

FORMAT: Final = 1
SAMPLE: Final = 16384
"""Number of points of the initial Sobol sample; arbitrary."""

ISLANDS: Final = 4
EXPLORED: Final = 64
"""Number of points that the explorer proposes per generation, in addition to the islands; arbitrary."""

POPULATION: Final = 16
SIGMA: Final = 0.08
"""Largest initial step length of an island, as a fraction of the ranges; arbitrary."""

PATIENCE: Final = 30  # Generations without improvement after which an island restarts; arbitrary

_SEEDS: Final = 200  # Number of best points from which the start of an island is drawn

_FAVOUR: Final = 2.0
_TOGETHER: Final = 128
_GAIN: Final = 1e-3
_APART: Final = 0.03
STARTS: Final = 64
"""Default number of starting points from another search."""


class Plan(Declared):
    """Settings that determine a search."""

    aim: Aim = part("claims that guide the search, one of `AIMS`")
    seed: int = part("seed of the random number generators")
    sample: int = part("number of points of the initial Sobol sample", default=SAMPLE)
    starts: tuple[tuple[float, ...], ...] = part(
        "additional starting points of islands, such as the best points of another search", default=()
    )
    shape: Shape = part("waveform shape of the hammers", default="rectangle")

    def heading(self) -> dict[str, Any]:
        """Return the first line of the log as a mapping."""
        return {
            "format": FORMAT,
            "aim": self.aim,
            "shape": self.shape,
            "seed": self.seed,
            "sample": self.sample,
            "starts": [list(point) for point in self.starts],
            "islands": ISLANDS,
            "explored": EXPLORED,
            "population": POPULATION,
            "weights": WEIGHTS[self.aim],
            "losses": losses_digest(),
            "variables": [[v.name, v.low, v.high, v.logarithmic] for v in VARIABLES],
        }


def starts_of(path: Path, aim: Aim, count: int = STARTS) -> tuple[tuple[float, ...], ...]:
    """Return the best points of another search that are not close to each other, as starts for an aim.

    Raises
    ------
    InputError
        The file is not the log of a search; or the aim is "stated" and the other search used additional
        claims, which would then influence this search.
    """
    from studies.reconstruction.judging.shortlist import shortlist

    heading, rows = read_search(path)
    if aim == "stated" and heading["aim"] != "stated":
        raise InputError(f"{path}: aim = {heading['aim']!r}, expected the log of a search on stated claims")
    return tuple(tuple(row["point"]) for row in shortlist(rows, count, _APART))


def known_starts(aim: Aim) -> tuple[tuple[float, ...], ...]:
    """Return the points of the shipped hammer and of its family as starts.

    Raises
    ------
    InputError
        The aim is "stated": these hammers were found with additional claims, which would then influence the
        search.
    """
    from printhammer.report.reconstruction.results import shipped_results

    if aim == "stated":
        raise InputError("aim = 'stated', expected no start at hammers that other claims have led to")
    family = shipped_results().family
    shipped = {key: constant.si for key, constant in load("hendriks-1983").constants.items()}
    constants = [shipped, *(member.constants for member in (family.hammers if family else ()))]
    return tuple(tuple(np.clip(point_of(values_of(each)), 0.0, 1.0).tolist()) for each in constants)


def search(
    plan: Plan,
    path: Path,
    *,
    pool: Executor | None = None,
    tell: Callable[[int, float, dict[str, Any]], None] | None = None,
) -> Iterator[dict[str, Any]]:
    """Search without end; yield each candidate, as a row of the log, after writing the row.

    A search already in the log is resumed. `tell` is called after each batch with the number of candidates,
    the smallest total loss, and the row with this loss.

    Raises
    ------
    InputError
        The log belongs to another search, or the package `cmaes` is not installed.
    """
    from scipy.stats import qmc

    _strategies()
    log = Log(path, plan.heading())
    place, best = 0, None

    def batch(points: list[FloatArray]) -> list[dict[str, Any]]:
        nonlocal place, best
        there = log.known(place, points)
        fresh = scored(points[len(there) :], plan.aim, pool, plan.shape) if len(there) < len(points) else []
        log.append(fresh)
        rows = [*there, *fresh]
        place += len(rows)
        for row in rows:
            if best is None or row["total"] < best["total"]:
                best = row
        if tell is not None and best is not None:
            tell(place, best["total"], best)
        return rows

    rng = np.random.default_rng([plan.seed, AIMS.index(plan.aim), SHAPES.index(plan.shape)])
    start: list[dict[str, Any]] = []
    points = [
        *(np.array(point) for point in plan.starts),
        *qmc.Sobol(len(VARIABLES), seed=rng).random(plan.sample),
    ]
    for first in range(0, len(points), _TOGETHER):
        for row in batch(points[first : first + _TOGETHER]):
            start.append(row)
            yield row
    start.sort(key=lambda row: row["total"])
    explorer = Explorer(WEIGHTS[plan.aim], rng)
    explorer.note(start)
    islands = [_Island(start, rng) for _ in range(ISLANDS)]
    while True:
        asked = [point for island in islands for point in island.ask()]
        rows = batch(asked + explorer.ask(EXPLORED))
        yield from rows
        explorer.note(rows)
        for number, island in enumerate(islands):
            own = rows[number * POPULATION : (number + 1) * POPULATION]
            island.tell(own)
            if island.done:
                # Its best point may be the start of another island.
                start.append(island.best)
                start.sort(key=lambda row: row["total"])
                islands[number] = _Island(start, rng)


def _strategies() -> Any:
    """Return the class CMA (an evolution strategy) of the optional package `cmaes`."""
    try:
        from cmaes import CMA
    except ImportError:
        raise missing_extra("the search needs cmaes", "studies") from None
    return CMA


class _Island:
    """One run of CMA-ES, started at one of the best known points."""

    def __init__(self, start: list[dict[str, Any]], rng: np.random.Generator) -> None:
        # Better points are drawn more often.
        pick = int(min(_SEEDS, len(start)) * rng.random() ** _FAVOUR)
        self._strategy = _strategies()(
            mean=np.clip(np.array(start[pick]["point"]), 0.02, 0.98),
            sigma=SIGMA * 2.0 ** -rng.integers(4),
            bounds=np.array([[0.0, 1.0]] * len(VARIABLES)),
            seed=int(rng.integers(2**31)),
            population_size=POPULATION,
        )
        self.best = start[pick]
        self._least, self._since = np.inf, 0

    def ask(self) -> list[FloatArray]:
        return [self._strategy.ask() for _ in range(POPULATION)]

    def tell(self, rows: list[dict[str, Any]]) -> None:
        self._strategy.tell([(np.array(row["point"]), row["total"]) for row in rows])
        best = min(rows, key=lambda row: float(row["total"]))
        self._since = 0 if best["total"] < self._least - _GAIN else self._since + 1
        if best["total"] < self._least:
            self._least, self.best = best["total"], best

    @property
    def done(self) -> bool:
        """Whether the run has stopped improving."""
        return self._since > PATIENCE or self._strategy.should_stop()
