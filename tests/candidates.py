"""Candidates that tests share: some at random, some about the shipped hammer, which does well."""

from functools import cache
from typing import Any

import numpy as np

import printhammer as ph
from printhammer.reconstruction.candidates import Candidate, candidates
from printhammer.reconstruction.space import VARIABLES, constants_at, point_of, values_of

Points = list[Any]


def shipped_values() -> dict[str, float]:
    """The shipped hammer as values of the variables."""
    return values_of({key: constant.si for key, constant in ph.load("hendriks-1983").constants.items()})


def random_points(count: int, seed: int) -> Points:
    rng = np.random.default_rng(seed)
    return [rng.random(len(VARIABLES)) for _ in range(count)]


def near_points(count: int, seed: int, apart: float = 0.05) -> Points:
    """Points about the shipped hammer, in shares of the ranges."""
    rng = np.random.default_rng(seed)
    middle = point_of(shipped_values())
    return [np.clip(middle + rng.uniform(-apart, apart, len(middle)), 0.0, 1.0) for _ in range(count)]


@cache
def some_candidates(
    count: int = 12, near: int = 6, seed: int = 11, apart: float = 0.05
) -> tuple[Candidate, ...]:
    """Candidates of random points and of points about the shipped hammer."""
    found = candidates(random_points(count, seed) + near_points(near, seed, apart))
    return tuple(candidate for candidate in found if candidate is not None)


def shipped_constants() -> dict[str, float]:
    """The constants of the shipped hammer that the search sets, SI."""
    known = ph.load("hendriks-1983").constants
    return {key: known[key].si for key in constants_at(shipped_values(), 1.0, 1.0)}
