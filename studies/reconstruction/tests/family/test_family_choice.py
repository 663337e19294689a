import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from studies.reconstruction.family.choice import choose, distances
from studies.reconstruction.family.family import compared

WIDTH = 5
FEW = np.array([1.0, 1.05, 1.09, 1.11, 1.3, -1.0, 0.0])


def clearly_different(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two hammers are at least 10 % apart in at least three constants."""
    apart = 0
    for one, other in zip(a, b, strict=True):
        if one != other and abs(one - other) >= 0.1 * min(abs(one), abs(other)):
            apart += 1
    return apart >= 3


def table(rows: int) -> st.SearchStrategy[np.ndarray]:
    row = st.lists(st.sampled_from(FEW.tolist()), min_size=WIDTH, max_size=WIDTH)
    return st.lists(row, min_size=1, max_size=rows).map(np.array)


@given(table(12), st.booleans())
def test_any_two_of_the_chosen_are_clearly_different(rows: np.ndarray, wide: bool) -> None:
    chosen = choose([rows], len(rows), wide=wide)
    assert chosen[0] == 0
    assert len(set(chosen)) == len(chosen)
    for i, j in itertools.combinations(chosen, 2):
        assert clearly_different(rows[i], rows[j])
    # No rejected candidate is clearly different from all members.
    for left in set(range(len(rows))) - set(chosen):
        assert any(not clearly_different(rows[left], rows[i]) for i in chosen)


@given(table(8))
def test_both_ways_of_comparing_count(rows: np.ndarray) -> None:
    chosen = choose([rows, rows[:, ::-1] * 2.0], len(rows))
    for i, j in itertools.combinations(chosen, 2):
        assert clearly_different(rows[i], rows[j])
    assert choose([rows, np.ones_like(rows)], len(rows)) == [0]


def test_the_distance_is_that_of_the_third_constant() -> None:
    one = np.array([1.0, 2.0, 3.0, 4.0])
    others = np.array([[2.0, 2.2, 3.3, 4.0], [1.0, 2.0, 3.0, 4.0], [-1.0, -2.0, -3.0, 4.0]])
    assert distances(one, others) == pytest.approx([0.1, 0.0, 2.0])


def test_who_is_refused_is_replaced_and_asked_once() -> None:
    rows = np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [2.1, 2.1, 2.1], [4.0, 4.0, 4.0]])
    asked: list[int] = []

    def accept(number: int) -> bool:
        asked.append(number)
        return number not in (0, 3)

    assert choose([rows], 3, accept) == [1]
    assert asked == [0, 1, 3]
    assert choose([rows], 3) == [0, 3, 1]
    assert choose([rows], 3, wide=False) == [0, 1, 3]
    assert choose([rows], 2) == [0, 3]
    assert choose([], 3) == []


CONSTANTS = {
    "mass": 4e-4,
    "magnet.F0": 2.5,
    "magnet.Am": 0.44,
    "magnet.Bm": 0.09,
    "spring.Bs": 14.0,
    "pack.stiffness": 260.0,
    "backstop.stiffness": 1.2e9,
    "backstop.damping": 4e8,
    "waveform.amplitude": 0.9,
    "waveform.width": 3.5e-4,
}


@pytest.mark.parametrize(("force", "current"), [(2.0, 1.0), (1.0, 1.5), (3.0, 0.5)])
def test_a_common_scale_makes_no_other_hammer(force: float, current: float) -> None:
    # Independent of the program: square roots of forces scale with the square root of the factor.
    powers = {"magnet.Am": (0.5, 0.0), "magnet.Bm": (0.5, -1.0), "waveform.amplitude": (0.0, 1.0)}
    powers |= {"waveform.width": (0.0, 0.0)}
    same = {}
    for key, value in CONSTANTS.items():
        of_force, of_current = powers.get(key, (1.0, 0.0))
        same[key] = value * force**of_force * current**of_current
    tables = compared([CONSTANTS, same], [20.0, 20.0 * force])
    assert tables[1][0] == pytest.approx(tables[1][1], rel=1e-12)
    assert choose(tables, 2) == [0]
    if force != 1.0:
        assert choose(tables[:1], 2) == [0, 1]
