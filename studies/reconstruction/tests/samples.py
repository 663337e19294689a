"""Candidates that tests share: some at random, some about a hammer that does well."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from studies.reconstruction.search.candidates import Candidate, candidates
from studies.reconstruction.search.space import VARIABLES, constants_at, point_of, values_of
from tests.hammers import CRUDE

import printhammer as ph

Points = list[Any]


def values_in(hammer: str | Path) -> dict[str, float]:
    """A hammer file as values of the variables."""
    return values_of({key: constant.si for key, constant in ph.load(hammer).constants.items()})


def random_points(count: int, seed: int) -> Points:
    rng = np.random.default_rng(seed)
    return [rng.random(len(VARIABLES)) for _ in range(count)]


def near_points(count: int, seed: int, apart: float = 0.05, hammer: str | Path = CRUDE) -> Points:
    """Points about a hammer that does well, in shares of the ranges."""
    rng = np.random.default_rng(seed)
    middle = point_of(values_in(hammer))
    return [np.clip(middle + rng.uniform(-apart, apart, len(middle)), 0.0, 1.0) for _ in range(count)]


@cache
def some_candidates(
    count: int = 12, near: int = 6, seed: int = 11, apart: float = 0.05
) -> tuple[Candidate, ...]:
    """Candidates of random points and of points about the hammer that does well."""
    found = candidates(random_points(count, seed) + near_points(near, seed, apart))
    return tuple(candidate for candidate in found if candidate is not None)


def constants_in(hammer: str | Path) -> dict[str, float]:
    """The constants of a hammer file that the search sets, SI."""
    known = ph.load(hammer).constants
    return {key: known[key].si for key in constants_at(values_in(hammer), 1.0, 1.0)}
