"""Candidates shared by tests: random points, and points near a good hammer."""

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
    """Return the values of the search variables for a hammer file."""
    return values_of({key: constant.si for key, constant in ph.load(hammer).constants.items()})


def random_points(count: int, seed: int) -> Points:
    rng = np.random.default_rng(seed)
    return [rng.random(len(VARIABLES)) for _ in range(count)]


def near_points(count: int, seed: int, apart: float = 0.05, hammer: str | Path = CRUDE) -> Points:
    """Return random points near a good hammer, as fractions of the ranges."""
    rng = np.random.default_rng(seed)
    middle = point_of(values_in(hammer))
    return [np.clip(middle + rng.uniform(-apart, apart, len(middle)), 0.0, 1.0) for _ in range(count)]


@cache
def some_candidates(
    count: int = 12, near: int = 6, seed: int = 11, apart: float = 0.05
) -> tuple[Candidate, ...]:
    """Return candidates at random points and at points near a good hammer."""
    found = candidates(random_points(count, seed) + near_points(near, seed, apart))
    return tuple(candidate for candidate in found if candidate is not None)


def constants_in(hammer: str | Path) -> dict[str, float]:
    """Return the constants of a hammer file that the search varies, SI."""
    known = ph.load(hammer).constants
    return {key: known[key].si for key in constants_at(values_in(hammer), 1.0, 1.0)}
