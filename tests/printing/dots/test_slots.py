import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.printing.dots.judging import Limits, limits_named
from printhammer.printing.dots.strategy import (
    LEAD_IN,
    cycle_with_lead_in,
    de_bruijn,
    eight_slot_patterns,
    slot_times,
    slots_of,
)


def words(slots: np.ndarray, order: int) -> list[str]:
    """Every run of `order` slots, as text."""
    text = "".join("1" if dot else "0" for dot in slots)
    return [text[begin : begin + order] for begin in range(len(text) - order + 1)]


@pytest.mark.parametrize("order", range(1, 11))
def test_the_cycle_holds_every_word_once(order: int) -> None:
    cycle = de_bruijn(order)
    assert len(cycle) == 2**order
    around = words(np.concatenate([cycle, cycle[: order - 1]]), order)
    assert len(set(around)) == len(around) == 2**order


def test_the_cycle_of_order_three_is_the_known_one() -> None:
    assert words(de_bruijn(3), 8) == ["00010111"]


def test_after_the_lead_in_every_word_ends_once() -> None:
    slots = cycle_with_lead_in()
    assert len(slots) == LEAD_IN + 256
    assert len(set(words(slots[LEAD_IN - 7 :], 8))) == 256
    np.testing.assert_array_equal(slots[:LEAD_IN], slots[-LEAD_IN:])


@given(st.integers(1, 6), st.integers(0, 200))
def test_a_lead_in_of_any_length_is_what_comes_before(order: int, lead_in: int) -> None:
    slots = cycle_with_lead_in(order, lead_in)
    np.testing.assert_array_equal(slots[: -(2**order)], slots[2**order :])


def test_patterns_are_all_but_the_empty_one() -> None:
    rows = {"".join("1" if dot else "0" for dot in row) for row in eight_slot_patterns()}
    assert len(rows) == 255
    assert "00000000" not in rows
    assert slots_of(eight_slot_patterns()[0]) == (7,)
    assert slots_of(eight_slot_patterns()[-1]) == tuple(range(8))


def test_slots_are_a_period_apart() -> None:
    np.testing.assert_allclose(np.diff(slot_times((0, 1, 4), 800.0)), [1.25e-3, 3.75e-3], rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: de_bruijn(0), "order"),
        (lambda: de_bruijn(17), "order"),
        (lambda: Limits(force=-0.1), "limits.force"),
        (lambda: Limits(arrival=float("nan")), "limits.arrival"),
        (lambda: limits_named("letter"), "limits"),
    ],
)
def test_what_makes_no_sense_is_refused(make: object, key: str) -> None:
    with refused(key):
        make()


def test_the_spreads_of_the_paper_are_halved_to_either_side() -> None:
    assert 2.0 * limits_named("dot-matrix").arrival == pytest.approx(200e-6)
    assert 2.0 * limits_named("engraved").arrival == pytest.approx(30e-6)
