"""Designs: the members of a grid or of a Latin hypercube, and how they are divided into blocks of work."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from printhammer.support.arrays import FloatArray


def latin_hypercube(members: int, seed: int, axes: int) -> FloatArray:
    """Draw a Latin hypercube, shape (members, axes), of numbers from 0 to below 1.

    Each axis is divided into as many equal strata as there are members; each stratum holds one of them, at
    random within it (McKay, Beckman and Conover, Technometrics 21 (1979) 239).
    """
    random = np.random.Generator(np.random.PCG64(seed))
    drawn = np.empty((members, axes))
    for column in range(axes):
        drawn[:, column] = (random.permutation(members) + random.random(members)) / members
    return drawn


def between(share: FloatArray, low: float, high: float, geometric: bool) -> FloatArray:
    """Return the values at given shares, 0 to 1, of a range."""
    values: FloatArray
    if geometric:
        values = np.exp(np.log(low) + share * (np.log(high) - np.log(low)))
    else:
        values = low + share * (high - low)
    return np.clip(values, min(low, high), max(low, high))


class Blocks(Declared):
    """Members of a grid in blocks that are whole chunks of it and consecutive in its order."""

    shape: tuple[int, ...] = part("members along each dimension; the last one runs fastest")
    chunks: tuple[int, ...] = part("those of a block")

    @classmethod
    def of(cls, shape: Sequence[int], most: int) -> Blocks:
        """Divide a grid into blocks of at most so many members."""
        chunks = [1] * len(shape)
        inner = 1
        for dim in reversed(range(len(shape))):
            chunks[dim] = max(1, min(shape[dim], most // inner))
            if chunks[dim] < shape[dim]:
                break
            inner *= shape[dim]
        return cls(tuple(shape), tuple(chunks))

    @property
    def counts(self) -> tuple[int, ...]:
        """Blocks along each dimension."""
        return tuple(-(-length // chunk) for length, chunk in zip(self.shape, self.chunks, strict=True))

    @property
    def number(self) -> int:
        """Number of blocks."""
        return math.prod(self.counts)

    def indices(self) -> Iterator[tuple[int, ...]]:
        """Run through the places of the blocks in the chunk grid, in the order of the members."""
        return iter(np.ndindex(*self.counts))

    def size(self, index: Sequence[int]) -> tuple[int, ...]:
        """Return the members of a block along each dimension."""
        return tuple(
            min(chunk, length - i * chunk)
            for i, length, chunk in zip(index, self.shape, self.chunks, strict=True)
        )

    def members(self, index: Sequence[int]) -> range:
        """Return the numbers of the members of a block."""
        first = 0
        for i, length, chunk in zip(index, self.shape, self.chunks, strict=True):
            first = first * length + i * chunk
        return range(first, first + math.prod(self.size(index)))
