"""The search: a wide sample, then evolution strategies from its best points, and steps over what is feasible.

Everything follows from the seed. Each candidate is a line of the log, so that a search that was stopped goes
on where it was: what the log holds is not computed again.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.reconstruction.evaluation import WEIGHTS, scored
from printhammer.reconstruction.explorer import Explorer
from printhammer.reconstruction.space import VARIABLES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Executor
    from pathlib import Path

    from printhammer.reconstruction.evaluation import Aim
    from printhammer.segments import FloatArray

FORMAT: Final = 1
SAMPLE: Final = 16384
"""Points of the wide sample."""

ISLANDS: Final = 4
EXPLORED: Final = 64
"""Points of each round that explore, beside those of the islands."""

POPULATION: Final = 16
SIGMA: Final = 0.08
"""Largest first step length of an island, in shares of the ranges."""

PATIENCE: Final = 30
"""Generations without gain after which an island begins anew."""

_SEEDS: Final = 200
"""Best points known from which islands begin."""

_FAVOUR: Final = 2.0
_TOGETHER: Final = 128
_GAIN: Final = 1e-3
_APART: Final = 0.03
STARTS: Final = 64
"""Points taken over from another search."""


@dataclass(frozen=True)
class Plan:
    """What decides on a search.

    Attributes
    ----------
    aim : str
        Which claims lead: "stated" or "all".
    seed : int
        Of everything random.
    sample : int
        Points of the wide sample.
    starts : tuple of tuple of float
        Further points from which islands may begin, such as the best of another search.
    """

    aim: Aim
    seed: int
    sample: int = SAMPLE
    starts: tuple[tuple[float, ...], ...] = ()

    def heading(self) -> dict[str, Any]:
        """Return the first line of the log."""
        return {
            "format": FORMAT,
            "aim": self.aim,
            "seed": self.seed,
            "sample": self.sample,
            "starts": [list(point) for point in self.starts],
            "islands": ISLANDS,
            "explored": EXPLORED,
            "population": POPULATION,
            "weights": WEIGHTS[self.aim],
            "variables": [[v.name, v.low, v.high, v.logarithmic] for v in VARIABLES],
        }


def starts_of(path: Path, count: int = STARTS) -> tuple[tuple[float, ...], ...]:
    """Return the best points of another search that are not next to each other.

    Raises
    ------
    InputError
        The file is not the log of a search.
    """
    from printhammer.reconstruction.shortlist import read_search, shortlist

    _heading, rows = read_search(path)
    return tuple(tuple(row["point"]) for row in shortlist(rows, count, _APART))


class Log:
    """The log of a search: a heading, then a line for each candidate, in the order they were tried.

    Parameters
    ----------
    path : Path
        JSON lines; made where it is missing.
    plan : Plan
        Of the search.

    Raises
    ------
    InputError
        The file holds something else, or the log of another search.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path = path
        self.known: list[dict[str, Any]] = []
        if path.exists() and path.stat().st_size:
            self._read(plan)
        else:
            self._append([plan.heading()])

    def _read(self, plan: Plan) -> None:
        text = self.path.read_text(encoding="utf-8")
        lines = text.split("\n")
        whole = lines[:-1]
        if not text.endswith("\n"):
            # A search that was stopped while it wrote.
            self.path.write_text("".join(f"{line}\n" for line in whole), encoding="utf-8")
        try:
            rows = [json.loads(line) for line in whole]
        except json.JSONDecodeError as error:
            raise InputError(f"{self.path}: expected JSON lines of a search ({error})") from None
        if not rows or rows[0] != plan.heading():
            raise InputError(f"{self.path}: the log of another search, expected {json.dumps(plan.heading())}")
        self.known = rows[1:]

    def _append(self, rows: list[dict[str, Any]]) -> None:
        with self.path.open("a", encoding="utf-8") as file:
            file.write("".join(json.dumps(row) + "\n" for row in rows))

    def take(
        self, points: list[FloatArray], aim: Aim, pool: Executor | None, place: int
    ) -> list[dict[str, Any]]:
        """Return the rows of points from `place` on, computing and noting those that are not there yet."""
        there = self.known[place : place + len(points)]
        for row, point in zip(there, points, strict=False):
            if not np.array_equal(row["point"], point):
                raise InputError(f"{self.path}: candidate {place + 1} is not the one of this search")
        fresh = scored(points[len(there) :], aim, pool) if len(there) < len(points) else []
        if fresh:
            self._append(fresh)
        self.known[place : place + len(points)] = []  # replayed rows are not needed again
        self.known[place:place] = [*there, *fresh]
        return [*there, *fresh]


def search(
    plan: Plan,
    path: Path,
    *,
    pool: Executor | None = None,
    tell: Callable[[int, float, dict[str, Any]], None] | None = None,
) -> Iterator[dict[str, Any]]:
    """Search without end; every candidate is yielded after it was noted.

    Parameters
    ----------
    plan : Plan
        What to search for.
    path : Path
        Log; a search begun there goes on.
    pool : Executor, optional
        Processes to compute in; by default this one.
    tell : callable, optional
        Called after each batch with the number of candidates, the least total loss, and its row.

    Yields
    ------
    dict
        A row of the log.

    Raises
    ------
    InputError
        The log is that of another search, or the package that searches is not installed.
    """
    log = Log(path, plan)
    place, best = 0, None

    def batch(points: list[FloatArray]) -> list[dict[str, Any]]:
        nonlocal place, best
        found = log.take(points, plan.aim, pool, place)
        place += len(found)
        for row in found:
            if best is None or row["total"] < best["total"]:
                best = row
        if tell is not None and best is not None:
            tell(place, best["total"], best)
        return found

    rng = np.random.default_rng([plan.seed, len(plan.aim)])
    start: list[dict[str, Any]] = []
    points = [*(np.array(point) for point in plan.starts), *_wide(plan, rng)]
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
        found = batch(asked + explorer.ask(EXPLORED))
        yield from found
        explorer.note(found)
        for number, island in enumerate(islands):
            own = found[number * POPULATION : (number + 1) * POPULATION]
            island.tell(own)
            if island.done:
                # What it found may be where another begins.
                start.append(island.best)
                start.sort(key=lambda row: row["total"])
                islands[number] = _Island(start, rng)


def _wide(plan: Plan, rng: np.random.Generator) -> list[FloatArray]:
    from scipy.stats import qmc

    sampler = qmc.Sobol(len(VARIABLES), seed=rng)
    return list(sampler.random(plan.sample))


class _Island:
    """One evolution strategy, from one of the best points known."""

    def __init__(self, start: list[dict[str, Any]], rng: np.random.Generator) -> None:
        try:
            from cmaes import CMA
        except ImportError:
            raise InputError(
                "the search needs cmaes, which is not installed: pip install 'printhammer[identify]'"
            ) from None
        # Good ones are taken more often.
        pick = int(min(_SEEDS, len(start)) * rng.random() ** _FAVOUR)
        self._strategy = CMA(
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

    def tell(self, found: list[dict[str, Any]]) -> None:
        self._strategy.tell([(np.array(row["point"]), row["total"]) for row in found])
        best = min(found, key=lambda row: float(row["total"]))
        self._since = 0 if best["total"] < self._least - _GAIN else self._since + 1
        if best["total"] < self._least:
            self._least, self.best = best["total"], best

    @property
    def done(self) -> bool:
        """Whether it gains no more."""
        return self._since > PATIENCE or self._strategy.should_stop()
