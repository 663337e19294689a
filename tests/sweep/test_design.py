import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.sweep.plan import Blocks, between, latin_hypercube

shapes = st.lists(st.integers(1, 7), min_size=1, max_size=4)


@given(shapes, st.integers(1, 60))
def test_blocks_hold_every_member_once_and_in_order(shape: list[int], most: int) -> None:
    blocks = Blocks.of(shape, most)
    found = [member for index in blocks.indices() for member in blocks.members(index)]
    assert found == list(range(math.prod(shape)))
    assert blocks.number == len(list(blocks.indices()))


@given(shapes, st.integers(1, 60))
def test_a_block_is_a_chunk_of_the_grid(shape: list[int], most: int) -> None:
    blocks = Blocks.of(shape, most)
    assert math.prod(blocks.chunks) <= most
    numbers = np.arange(math.prod(shape)).reshape(shape)
    for index in blocks.indices():
        where = tuple(slice(i * n, (i + 1) * n) for i, n in zip(index, blocks.chunks, strict=True))
        assert numbers[where].ravel().tolist() == list(blocks.members(index))
        assert numbers[where].shape == blocks.size(index)


@given(st.integers(1, 40), st.integers(0, 2**32), st.integers(1, 5))
def test_a_latin_hypercube_has_one_member_in_each_stratum(members: int, seed: int, axes: int) -> None:
    drawn = latin_hypercube(members, seed, axes)
    assert drawn.shape == (members, axes)
    strata = np.sort(np.floor(drawn * members).astype(int), axis=0)
    assert (strata == np.arange(members)[:, np.newaxis]).all()


def test_another_seed_draws_others() -> None:
    assert (latin_hypercube(5, 1, 2) == latin_hypercube(5, 1, 2)).all()
    assert not (latin_hypercube(5, 1, 2) == latin_hypercube(5, 2, 2)).any()


@pytest.mark.parametrize("geometric", [False, True])
@given(
    share=st.floats(0.0, 1.0, exclude_max=True), ends=st.tuples(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
)
def test_drawn_values_lie_in_the_range(geometric: bool, share: float, ends: tuple[float, float]) -> None:
    value = between(np.array([share]), *ends, geometric)[0]
    assert min(ends) <= value <= max(ends)


def test_a_geometric_range_is_divided_by_ratio() -> None:
    assert between(np.array([0.5]), 1.0, 100.0, True)[0] == pytest.approx(10.0, rel=1e-14)
