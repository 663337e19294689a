"""Histories of dots: numbers, patterns, and gaps hidden by a rest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.control.table.drive import (
    REST,
    Settings,
    checked_size,
    entries_of,
    histories,
    histories_of,
    number_of,
    pattern_of,
    plain,
    pulses_of,
    shared_numbers,
)

SIZES = st.tuples(st.integers(1, 4), st.integers(1, 4))


def test_of_a_pattern() -> None:
    # Gaps 1, 1, 3 with a reach of 2: the last dot is printed from rest.
    assert histories_of((4, 5, 6, 9), 2, 2).tolist() == [0, 3, 4, 0, 0]


def test_a_rest_hides_what_lies_before() -> None:
    assert plain((1, REST, 2)) == (1, REST, REST)
    assert number_of((1, REST, 2), 2) == number_of((1, REST, REST), 2) == 9


def test_slots_must_ascend() -> None:
    with refused("slots"):
        histories_of((3, 3), 1, 1)


@pytest.mark.parametrize(
    ("gaps", "reach", "key"),
    [(0, 1, "history"), (5, 1, "history"), (1, 0, "reach"), (1, 9, "reach"), (True, 1, "history")],
)
def test_sizes_out_of_bounds(gaps: int, reach: int, key: str) -> None:
    with refused(key):
        checked_size(gaps, reach)


@given(SIZES)
def test_all_differ_and_all_numbers_are_shared_by_one(size: tuple[int, int]) -> None:
    gaps, reach = size
    every = histories(gaps, reach)
    numbers = [number_of(history, reach) for history in every]
    assert len(set(numbers)) == len(every) == sum(reach**known for known in range(gaps + 1))
    shared = shared_numbers(gaps, reach)
    assert len(shared) == entries_of(gaps, reach)
    assert set(shared.tolist()) == set(numbers)
    assert all(shared[number] == number for number in numbers)


@given(SIZES, st.data())
def test_the_last_dot_of_its_pattern_has_the_history(size: tuple[int, int], data: st.DataObject) -> None:
    gaps, reach = size
    history = data.draw(st.sampled_from(histories(gaps, reach)))
    before = (reach + 1,) if REST in history else (1, 1)
    for given_before in ((), before):
        slots = pattern_of(history, given_before)
        assert histories_of(slots, gaps, reach)[-2] == number_of(history, reach)


def test_a_pulse_that_is_due_before_the_beginning_fires_at_the_beginning() -> None:
    # A slow device, whose dots from rest are fired 3 ms ahead of their slots, and later dots 2 ms after them.
    settings = Settings(
        advance=np.array([3e-3, -2e-3]),
        width=np.array([4e-3, 3e-3]),
        brake_delay=np.array([0.0, 8e-3]),
        brake_width=np.array([0.0, 1e-3]),
    )
    pulses = pulses_of(settings, 1, 1, (0, 1, 4), 50.0)
    assert pulses.fired.tolist() == pytest.approx(
        [0.0, pulses.due[1] + 2e-3, pulses.due[2] - 3e-3], abs=1e-15
    )
    # The brake between the first two dots keeps its time.
    assert pulses.braked.tolist() == [1e-3, 0.0, 0.0]
    assert pulses.fired[0] + pulses.offset[0] == pytest.approx(pulses.due[0] + 8e-3, rel=1e-12)
